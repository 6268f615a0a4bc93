"""What is drawn: the model (skin, eyes, hair), the lights, the camera framings.

Lengths are millimetres, y is up, the head looks along +z, the crown is at y = 0.
Light is radiometric: a lamp gives irradiance E on a surface that faces it; diffuse radiance is
albedo * E / pi.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pyrender


@dataclass(frozen=True)
class Framing:
    """A camera: looks at `target` (relative to the eyes' midpoint, mm) so that `height_mm` fill the
    image's height.

    yaw_deg turns the camera about the head towards the person's left, pitch_deg lifts it.
    """

    target: tuple[float, float, float]
    height_mm: float
    yaw_deg: float
    pitch_deg: float
    fov_y_deg: float = 16.0


FRAMINGS: dict[str, Framing] = {
    "close-up": Framing((9.0, -20.0, -18.0), 136.0, 33.0, 2.0),
    "head-shot": Framing((4.0, -32.0, -60.0), 330.0, 28.0, 2.0),
    "half-length": Framing((2.0, -92.0, -90.0), 452.0, 20.0, 1.0),
}


@dataclass(frozen=True)
class Lamp:
    """A distant lamp: direction (3,) from the head towards it, irradiance (3,) on a facing surface,
    angular radius in degrees (its softness)."""

    name: str
    direction: tuple[float, float, float]
    irradiance: tuple[float, float, float]
    radius_deg: float

    @property
    def towards(self) -> np.ndarray:
        d = np.array(self.direction, dtype=float)
        return d / np.linalg.norm(d)


@dataclass(frozen=True)
class Lobe:
    """A spherical Gaussian of radiance, amplitude * exp(sharpness * (direction .

    w - 1)): a soft studio panel.
    """

    direction: tuple[float, float, float]
    sharpness: float
    amplitude: tuple[float, float, float]


@dataclass(frozen=True)
class Studio:
    """The light of every condition: two shadowed lamps and an environment of soft panels over a
    constant.
    """

    lamps: tuple[Lamp, ...] = (
        Lamp("key", (-0.62, 0.55, 0.72), (4.5, 4.15, 3.7), 1.1),
        Lamp("rim", (0.66, 0.40, -0.80), (3.6, 3.6, 3.7), 1.6),
    )
    lobes: tuple[Lobe, ...] = (
        Lobe((0.85, 0.15, 0.55), 5.0, (0.115, 0.14, 0.175)),  # cool fill from the shadow side
        Lobe((-0.45, 0.35, 0.85), 7.0, (0.28, 0.265, 0.24)),  # the key's own panel around it
        Lobe((0.0, 1.0, 0.1), 3.0, (0.20, 0.21, 0.225)),  # overhead
        Lobe((0.0, -1.0, 0.3), 2.0, (0.075, 0.062, 0.05)),  # floor bounce
        Lobe((-0.24, 0.20, 0.95), 60.0, (4.6, 4.5, 4.35)),  # a small bright panel: the catchlight
        Lobe((-0.9, 0.1, -0.5), 6.0, (0.18, 0.19, 0.22)),  # back edge
    )
    ambient: tuple[float, float, float] = (0.030, 0.032, 0.036)

    def radiance(self, directions: np.ndarray) -> np.ndarray:
        """Environment radiance (N, 3) from unit directions (N, 3)."""
        total = np.tile(np.array(self.ambient, dtype=float), (len(directions), 1))
        for lobe in self.lobes:
            axis = np.array(lobe.direction) / np.linalg.norm(lobe.direction)
            total += np.exp(lobe.sharpness * (directions @ axis - 1))[:, None] * np.array(
                lobe.amplitude
            )
        return total

    def uniforms(self) -> dict:
        axes = np.array(
            [np.array(lobe.direction) / np.linalg.norm(lobe.direction) for lobe in self.lobes]
        )
        return {
            "lobe_axis": np.column_stack([axes, [lobe.sharpness for lobe in self.lobes]]),
            "lobe_colour": np.array([lobe.amplitude for lobe in self.lobes]),
            "ambient": self.ambient,
            "lamp_direction": np.array([lamp.towards for lamp in self.lamps]),
            "lamp_irradiance": np.array([lamp.irradiance for lamp in self.lamps]),
            "lamp_tangent": np.tan(np.radians([lamp.radius_deg for lamp in self.lamps])),
        }


STUDIO = Studio()


@dataclass(frozen=True)
class View:
    """A framing resolved for one model and image size: matrices (4, 4), eye (3,), pixels per mm at
    1 mm distance.
    """

    view: np.ndarray
    projection: np.ndarray
    eye: np.ndarray
    pixels_per_mm: float
    scene: pyrender.Scene = field(repr=False)


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Camera pose (4, 4): camera to world, looking down its own -z, y up."""
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(back, right), back, eye
    return pose


def resolve(
    framing: Framing,
    landmarks: dict[str, np.ndarray],
    width: int,
    height: int,
    studio: Studio = STUDIO,
) -> View:
    """Place the camera and the lamps in a pyrender scene and take its matrices."""
    fov = np.radians(framing.fov_y_deg)
    distance = framing.height_mm / (2 * np.tan(fov / 2))
    yaw, pitch = np.radians(framing.yaw_deg), np.radians(framing.pitch_deg)
    target = np.asarray(landmarks["eyes"], dtype=float) + framing.target
    eye = target + distance * np.array(
        [np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)]
    )
    pose = look_at(eye, target)
    camera = pyrender.PerspectiveCamera(yfov=fov, znear=0.25 * distance, zfar=distance + 1500.0)
    scene = pyrender.Scene(bg_color=np.zeros(4), ambient_light=np.zeros(3))
    scene.add(camera, pose=pose)
    for lamp in studio.lamps:
        scene.add(
            pyrender.DirectionalLight(
                color=np.array(lamp.irradiance) / max(lamp.irradiance),
                intensity=max(lamp.irradiance),
            ),
            pose=look_at(lamp.towards, np.zeros(3)),
        )
    return View(
        np.linalg.inv(scene.get_pose(scene.main_camera_node)),
        camera.get_projection_matrix(width, height),
        eye,
        height / (2 * np.tan(fov / 2)),
        scene,
    )


def lamp_matrix(lamp: Lamp, positions: np.ndarray) -> np.ndarray:
    """World to the lamp's box (4, 4): x, y in [-1, 1] over the model's extent; z = distance along
    the light, mm, from its nearest point.
    """
    pose = look_at(lamp.towards, np.zeros(3))[:3, :3]
    local = positions @ pose
    low, high = local.min(axis=0) - 2.0, local.max(axis=0) + 2.0
    half = 0.5 * (high - low)[:2].max()
    centre = 0.5 * (low + high)
    matrix = np.eye(4)
    matrix[0, :3], matrix[1, :3] = pose[:, 0] / half, pose[:, 1] / half
    matrix[:2, 3] = -centre[:2] / half
    matrix[2, :3], matrix[2, 3] = -pose[:, 2], high[2]
    return matrix
