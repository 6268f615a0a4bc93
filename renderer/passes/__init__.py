"""What all techniques share: one module and its shaders a pass."""
