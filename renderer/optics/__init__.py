"""Diffusion profiles: numpy only, millimetres, no OpenGL."""
