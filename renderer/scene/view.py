"""A camera resolved for one image: matrices, and the size of a millimetre."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pyrender

from renderer.errors import InputError
from renderer.scene.camera import Camera
from renderer.scene.graph import look_at


@dataclass(frozen=True)
class View:
    """view, projection (4, 4); eye (3,) mm; pixels per mm at 1 mm distance."""

    view: np.ndarray
    projection: np.ndarray
    eye: np.ndarray
    pixels_per_mm: float

    def rays(self) -> np.ndarray:
        """(3, 3): takes (x, y, 1) in normalised device coordinates to a direction in the world."""
        turn = self.view[:3, :3].T
        return np.column_stack(
            [turn[:, 0] / self.projection[0, 0], turn[:, 1] / self.projection[1, 1], -turn[:, 2]]
        )


def resolve(camera: Camera, subject: np.ndarray, width: int, height: int) -> View:
    """The view of a camera at a subject (3,), for an image of width x height pixels."""
    eye, target = camera.eye_mm(subject), camera.target(subject)
    distance = camera.distance_mm
    lens = pyrender.PerspectiveCamera(
        yfov=np.radians(camera.fov_y_deg), znear=0.25 * distance, zfar=distance + 1500.0
    )
    return _view(lens, look_at(eye, target), width, height)


def main_camera(graph: pyrender.Scene, width: int, height: int) -> View:
    """The view of a graph's own camera; it has to be perspective."""
    node = graph.main_camera_node
    if node is None:
        raise InputError("the scene has no camera; expected one, or a framing")
    if not isinstance(node.camera, pyrender.PerspectiveCamera):
        kind = type(node.camera).__name__
        raise InputError(f"the scene's camera is a {kind}; expected a PerspectiveCamera")
    return _view(node.camera, graph.get_pose(node), width, height)


def _view(lens: pyrender.PerspectiveCamera, pose: np.ndarray, width: int, height: int) -> View:
    pixels = height / (2 * np.tan(lens.yfov / 2))
    projection = lens.get_projection_matrix(width, height)
    return View(np.linalg.inv(pose), projection, pose[:3, 3].copy(), pixels)
