"""The stimuli: heads, studies, and the building of their images."""
