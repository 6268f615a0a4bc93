"""Renders one head under one light with every technique; see renderer.renderer.Renderer.

Importing this package does not touch OpenGL: names resolve on first use.
"""

from __future__ import annotations

import importlib
import os
import sys

if sys.platform == "linux":
    # pyrender imports pyglet for its viewer, which would look for an X server's libraries.
    os.environ.setdefault("PYGLET_HEADLESS", "true")

VERSION = "0.2.0"
#: Of zlib, for images: half the time of 6, its own choice, for files 6 % larger.
PNG_LEVEL = 4
_WHERE = {
    "Renderer": "renderer.renderer",
    "driver": "renderer.renderer",
    "TECHNIQUES": "renderer.techniques",
    "make": "renderer.techniques",
    "FRAMINGS": "renderer.scene.camera",
    "ANGLES": "renderer.scene.camera",
}


def __getattr__(name: str):
    if name not in _WHERE:
        raise AttributeError(f"module 'renderer' has no attribute {name!r}")
    return getattr(importlib.import_module(_WHERE[name]), name)
