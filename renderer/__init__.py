"""The renderer: scene, passes and scattering techniques."""
