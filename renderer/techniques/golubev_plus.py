"""Golubev's filter with samples spent by local contrast.

Vuletic, master's thesis (the study's own technique), ch. 4; see renderer/techniques/contrast.py.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from renderer.techniques.contrast import ByContrast
from renderer.techniques.golubev import Golubev


@dataclass(frozen=True)
class GolubevPlus(ByContrast, Golubev):
    """12 base samples, 10 more where contrast is high."""

    name: ClassVar[str] = "golubev_plus"
    title: ClassVar[str] = "Golubev Plus"
    paper: ClassVar[str] = "Vuletic, master's thesis, ch. 4"
