"""The judge: light walked at random through the same medium, mesh and light; no OpenGL in here."""
