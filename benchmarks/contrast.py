"""Table 4.1 of the thesis, redrawn: samples that contrast saves, and what they cost in error.

Golubev and Golubev Plus in both readings of how its two sets relate, at three framings: as the
study sees the head, and the mean over the three angles of fig. 4.7. Counts are of the pixels that
scatter; the error is the RMSE of scattered light against golubev with 192 samples, over the mean.
"""

from __future__ import annotations

import numpy as np

import renderer
from renderer.scene.camera import ANGLES
from stimuli import scenes

CONDITIONS = (
    ("golubev", {}),
    ("golubev", {"samples": 12}),
    ("golubev_plus", {"sets": "separate"}),
    ("golubev_plus", {"sets": "nested"}),
    ("golubev_plus", {"levels": "continuous"}),
    ("golubev_plus", {"levels": "continuous", "sets": "nested"}),
    ("golubev_plus", {"contrast_exponent": 2.0}),
)
THESIS = CONDITIONS[:1] + CONDITIONS[2:4]  # those of table 4.1, whose angles are counted too
REFERENCE = {"samples": 192}
MOST = 22


def scattered(frame, technique) -> tuple[np.ndarray, np.ndarray]:
    """Scattered light (N, 3) and samples (N,) of the pixels that scatter."""
    with frame.scatter(technique) as target:
        light, count = (texture.read() for texture in target.textures)
    seen = count[..., 0] > 0
    return light[seen][:, :3].astype(np.float64), count[seen][:, 0].astype(np.float64)


def main() -> None:
    staged = scenes.stage(scenes.read_scene(scenes.load_table("thesis")))
    with renderer.Renderer(staged.graph) as drawing:
        print(f"{drawing.info()['gl_renderer']}, 1920x1080, 2x2 supersampling")
        for framing, camera in renderer.FRAMINGS.items():
            views = {"study's view": camera, **{angle: camera.at(angle) for angle in ANGLES}}
            taken: dict[str, list[float]] = {}
            for view, seen_from in views.items():
                with drawing.frame(seen_from) as frame:
                    if view == "study's view":
                        truth = scattered(frame, renderer.make("golubev", REFERENCE))[0]
                    for name, parameters in CONDITIONS if view == "study's view" else THESIS:
                        light, count = scattered(frame, renderer.make(name, parameters))
                        words = " ".join(f"{key}={value}" for key, value in parameters.items())
                        key = f"{name} {words}"
                        if view == "study's view":
                            error = np.sqrt(np.mean((light - truth) ** 2)) / truth.mean()
                            print(
                                f"{framing:<12}{key:<46}{count.mean():>7.2f} samples,"
                                f"{100 * (1 - count.mean() / MOST):>6.1f} % saved, error"
                                f"{100 * error:>6.2f} %",
                                flush=True,
                            )
                        else:
                            taken.setdefault(key, []).append(count.sum())
            for key, counts in taken.items():
                saved = 1 - sum(counts) / sum(taken["golubev "])
                print(
                    f"{framing:<12}{key:<46}{np.mean(counts):>14,.0f} samples over "
                    f"{', '.join(ANGLES)}: {100 * saved:.1f} % saved",
                    flush=True,
                )


if __name__ == "__main__":
    main()
