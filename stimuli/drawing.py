"""The drawing of a build's images: in this process, or task by task in any number of others.

A task is a few images of one scene, small values and paths, never pixels: what it makes are the
files of the images and their records. So a task can be given to another process or machine that
sees the folder, and given again when that one is lost: what was finished is not drawn again.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import os
import socket
import threading
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from analysis.files import replacing
from analysis.manifest import WHOLE
from stimuli import manifest, records, sources
from stimuli.errors import InputError
from stimuli.parts import PEOPLE, person_table
from stimuli.scenes import MAP_ENDING
from stimuli.study import FRAMING, Cell, Render


@dataclass(frozen=True)
class Stimulus:
    """An image to make.

    `technique` is what its condition names, `parameters` the validated dataclass of that technique,
    `scene` the checked scene of its cell, `key` a sha256 of all that it is made from.
    """

    cell: Cell
    condition: str
    technique: str
    parameters: Any
    scene: Any
    file: str
    key: str


@dataclass(frozen=True)
class Task:
    """Images of one scene to draw into the folder `out`.

    driver: what OpenGL has to say of itself (`renderer.driver`), so that all images of a study come
    from one; commit: as in `build.commit`; rounds: how often each technique is timed.
    """

    out: str
    render: Render
    stimuli: tuple[Stimulus, ...]
    driver: dict
    commit: str | None
    rounds: int = 0


class Studio:
    """The scene that this process has put up: one at a time, kept while tasks want the same."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._wanted: tuple | None = None
        self._staged = self._drawing = None

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def close(self) -> None:
        """Take down the scene, and give its memory back before another is made."""
        self._wanted = None
        if self._staged is None:
            return
        from renderer.memory import give_back

        self._stack.close()
        self._staged = self._drawing = None
        give_back()

    def draw(self, task: Task, drawn: Callable[[Stimulus], None] = lambda _: None) -> None:
        """Draw those of the task's images that are not there yet; `drawn` is called after each."""
        out = Path(task.out)
        left = {
            s.file
            for s in task.stimuli
            if not records.is_finished(out, s.file, s.key, records.read_one(out, s.file))
        }
        if not left and not task.rounds:
            return
        drawing = self._put_up(task)
        for cell in _by_cell(task.stimuli):
            missing = [s for s in cell if s.file in left]
            if not missing and not task.rounds:
                continue
            with drawing.frame(cell[0].scene.camera, cell[0].scene.picture) as frame:
                for k, stimulus in enumerate(missing):
                    self._image(task, stimulus, frame, drawing, masked=k > 0)
                    drawn(stimulus)
                if task.rounds:
                    _time(out, cell, frame, task.rounds)

    def _put_up(self, task: Task) -> Any:
        """The renderer of the task's scene."""
        from renderer import Renderer
        from stimuli.scenes import stage

        wanted = (place(task.stimuli[0].scene), task.render)
        if wanted != self._wanted:
            self.close()
            render = task.render
            self._staged = stage(task.stimuli[0].scene, render.seed)
            self._drawing = self._stack.enter_context(
                Renderer(
                    self._staged.graph,
                    size=render.size,
                    supersample=render.supersample,
                    seed=render.seed,
                    keep=("shadows",),  # a view is drawn once, a scene by every worker
                )
            )
            self._wanted = wanted
        if self._drawing.info() != task.driver:
            raise InputError(
                f"{socket.gethostname()} draws with {_told(self._drawing.info())}; expected "
                f"{_told(task.driver)}: images of a study come from one OpenGL driver"
            )
        return self._drawing

    def _image(
        self, task: Task, stimulus: Stimulus, frame: Any, drawing: Any, masked: bool
    ) -> None:
        """Render one image and record it: it is there whatever comes after. masked: whether the
        mask of its cell is written already.
        """
        render, out = task.render, Path(task.out)
        result = frame.render(stimulus.parameters)
        digest = write_png(out / stimulus.file, result.image, render.size)
        if not masked:
            _write_mask(out / manifest.MASKS / f"{stimulus.cell.name}.png", result.samples, render)
        image = entry(
            stimulus,
            render,
            digest,
            samples_per_pixel(result.samples),
            drawing.info(),
            task.commit,
            self._staged.provenance,
        )
        done = {
            "key": stimulus.key,
            "image": image,
            "licences": self._staged.licences,
            "notes": list(self._staged.notes),
        }
        records.write(out, stimulus.file, done)


def entry(
    stimulus: Stimulus,
    render: Render,
    digest: str,
    samples: float,
    driver: dict,
    commit: str | None,
    head: dict,
) -> dict:
    """What the manifest says of an image: digest, the sha256 of its file; samples: the mean a pixel
    that scatters; head: where its objects came from.
    """
    further = {k: v for k, v in stimulus.cell.levels.items() if k != FRAMING}
    region = tuple(stimulus.scene.camera.region)
    return {
        "framing": stimulus.cell.framing,
        **({"levels": further} if further else {}),
        "technique": stimulus.condition,
        "file": stimulus.file,
        "width": render.size[0],
        "height": render.size[1],
        **({"region": list(region)} if region != WHOLE else {}),
        "sha256": digest,
        "parameters": {
            "technique": stimulus.technique,
            "supersample": render.supersample,
            **_jsonable(stimulus.parameters),
        },
        "scene": described(stimulus.scene),
        "seed": render.seed,
        "measures": {"samples_per_pixel": samples},
        "renderer": {**driver, "commit": commit},
        "head": head,
    }


_studio = Studio()
_thread: int | None = None


def draw(task: Task) -> None:
    """Draw a task in a worker process, which keeps its scene up for the next one.

    Raises InputError where the worker cannot give the bytes that the build asks for: it does not
    see the folder, or has other source or files than the build.
    """
    global _thread
    here = f"worker {socket.gethostname()}:{os.getpid()}"
    _thread = _thread or threading.get_ident()
    if threading.get_ident() != _thread:
        raise InputError(f"{here} has several threads; expected one, since OpenGL draws in one")
    if not (Path(task.out) / records.FOLDER).is_dir():
        raise InputError(
            f"{here} does not see {task.out}; expected a folder on a file system of all workers"
        )
    files = own_files(task.stimuli[0].scene)
    for s in task.stimuli:
        if key(task.render, s.scene, files, s.technique, s.parameters) != s.key:
            raise InputError(
                f"{here} would make {s.file} from other source or files than the build; expected "
                "one version of subdermal, and files that all workers see"
            )
    _studio.draw(task)


def driver() -> dict:
    """What OpenGL says of itself in this process, see `renderer.driver`."""
    import renderer

    return renderer.driver()


def key(render: Render, scene: Any, files: list, technique: str, parameters: Any) -> str:
    """A sha256 of all that an image is made from; files: see `own_files`."""
    made_from = {
        "render": dataclasses.asdict(render),
        "scene": described(scene),
        "files": files,
        "source": _source(type(parameters).__module__),
        "technique": technique,
        "parameters": _jsonable(parameters),
    }
    return hashlib.sha256(json.dumps(made_from, sort_keys=True).encode()).hexdigest()


@cache
def _source(module: str) -> str:
    return sources.digest(module)


def own_files(scene: Any) -> list[list[str]]:
    """The user's files and the people in a scene, each with its sha256; of a person that a seed
    draws, that of their table.
    """
    drawn = []
    files = [getattr(thing, "file", "") for thing in scene.objects.values()]
    files += [
        file for material in scene.materials.values() for file in _maps(material.plain()).values()
    ]
    files.append(scene.environment.map)
    for thing in scene.objects.values():
        person = getattr(thing, "person", "")
        if person.isdigit():
            table = json.dumps(person_table(person), sort_keys=True)
            drawn.append([f"person {person}", hashlib.sha256(table.encode()).hexdigest()])
        elif person:
            known = PEOPLE / f"{person}.toml"
            files.append(str(known) if known.is_file() else person)
    paths = [Path(file) for file in files if file]
    return drawn + [[path.name, manifest.sha256(path)] for path in paths if path.is_file()]


def _maps(material: dict) -> dict[str, str]:
    """The files that a material's table names, by their keys."""
    return {key: file for key, file in material.items() if key.endswith(MAP_ENDING)}


def described(scene: Any) -> dict:
    """The scene's table; files by their names, since folders are nobody's business."""
    table = scene.plain()
    holders = [(entry, ("file",)) for entry in table["objects"].values()]
    holders += [(entry, tuple(_maps(entry))) for entry in table["materials"].values()]
    for holder, keys in (*holders, (table["environment"], ("map",))):
        for key in keys:
            if holder.get(key):
                holder[key] = Path(holder[key]).name
    return table


def place(scene: Any) -> str:
    """What two scenes have in common that differ in camera and picture alone."""
    table = scene.plain()
    del table["camera"], table["picture"]
    return json.dumps(table, sort_keys=True)


def samples_per_pixel(samples: np.ndarray) -> float:
    """The mean of an image's counts of samples where any was taken; 0 where nothing was sampled."""
    taken = samples[samples > 0]
    return round(float(taken.mean()), 4) if taken.size else 0.0


def write_png(path: Path, pixels: np.ndarray, size: tuple[int, int]) -> str:
    """Write (height, width, 3) bytes as a PNG and return the sha256 of the file."""
    import PIL.Image

    from renderer import PNG_LEVEL

    if pixels.shape != (size[1], size[0], 3) or pixels.dtype != np.uint8:
        raise RuntimeError(
            f"{path}: rendered {pixels.shape} {pixels.dtype}, expected "
            f"{(size[1], size[0], 3)} uint8"
        )
    with replacing(path) as temporary:
        PIL.Image.fromarray(pixels).save(temporary, format="PNG", compress_level=PNG_LEVEL)
        return manifest.sha256(temporary)


def _write_mask(path: Path, samples: np.ndarray, render: Render) -> None:
    """Where light scatters, white, the same for all conditions of a cell: for `subdermal inspect`,
    and to compute over the skin alone.
    """
    import PIL.Image

    (width, height), s = render.size, render.supersample
    path.parent.mkdir(exist_ok=True)
    share = (samples > 0).reshape(height, s, width, s).mean(axis=(1, 3))
    with replacing(path) as temporary:
        mask = PIL.Image.fromarray(np.where(share >= 0.5, 255, 0).astype(np.uint8))
        mask.save(temporary, format="PNG")


def _time(out: Path, stimuli: list[Stimulus], frame: Any, rounds: int) -> None:
    """Put each image's median milliseconds of scattering into its record's measures."""
    shown = {s.file: s.parameters for s in stimuli}
    for file, spent in frame.time(shown, rounds).items():
        done = records.read_one(out, file)
        milliseconds = round(1000 * float(np.median(spent[:, 0])), 1)
        done["image"]["measures"]["milliseconds"] = milliseconds
        records.write(out, file, done)


def _by_cell(group: Iterable[Stimulus]) -> list[list[Stimulus]]:
    cells: dict[str, list[Stimulus]] = {}
    for stimulus in group:
        cells.setdefault(stimulus.cell.name, []).append(stimulus)
    return list(cells.values())


def _told(driver: dict) -> str:
    return ", ".join(str(value) for value in driver.values())


def _jsonable(parameters: Any) -> dict:
    """A dataclass of parameters as JSON would give it back."""
    return json.loads(
        json.dumps(dataclasses.asdict(parameters), default=lambda array: array.tolist())
    )
