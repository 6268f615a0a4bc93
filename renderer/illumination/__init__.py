"""Illumination models, local and global, of a scene: what teaching texts compare.

models: the local formulas; rays: the scene as rays meet it; whitted: ray casting and recursive ray
tracing; radiosity: patches, form factors and their solution; paths: Monte Carlo.
"""
