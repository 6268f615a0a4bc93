"""From a study to its images and their manifest.

The folder holds images/, the manifest, and build.json: for every finished image the key of what it
was rendered from and its entry in the manifest. An image is rendered when its key is new or its
file is not the one that was written, so that a second build renders only what changed and an
interrupted one goes on. Files are written under another name and then renamed: there is never half
a file. The manifest is written last, and is not there while images are missing.
"""

import dataclasses
import hashlib
import json
import subprocess
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from analysis.files import replacing
from analysis.manifest import WHOLE
from stimuli import manifest, sources
from stimuli.errors import InputError, Stopped
from stimuli.parts import PEOPLE
from stimuli.scenes import MAP_ENDING
from stimuli.study import FRAMING, Cell, Study

STATE = "build.json"
STATE_FORMAT = "subdermal-build/2"
#: The first edition's: its images are all rendered anew, and those that are left over removed.
OLD_STATE_FORMAT = "subdermal-build/1"
_ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Stimulus:
    """An image to make.

    `parameters` is the validated dataclass of its technique, `scene` the checked scene of its cell,
    `key` a sha256 of all that it is made from.
    """

    cell: Cell
    condition: str
    parameters: Any
    scene: Any
    file: str
    key: str


@dataclass(frozen=True)
class Built:
    """How many images a build rendered, how many it found up to date, and what there is to say."""

    rendered: int
    kept: int
    notes: tuple[str, ...] = ()


def build(
    study: Study, out: str | Path, force: bool = False, progress: bool = False, rounds: int = 0
) -> Built:
    """Render what is missing or out of date of the study's images, and write the manifest.

    `force` renders every image anew; `progress` shows a bar on stderr. `rounds` also times every
    technique so often and puts the median milliseconds of scattering alone into the manifest: they
    differ from run to run. Images of one study come from one OpenGL driver: when it differs from
    that of the finished images, these are rendered anew as well.

    A scene is put up once for all its cameras, and freed before the next.
    """
    out = Path(out)
    parameters = resolve(study)
    state = _read_state(out)
    plan = _plan(study, parameters)
    (out / "images").mkdir(parents=True, exist_ok=True)
    kept = set() if force else {s.file for s in plan if _is_finished(out, s, state)}
    work = _Work(study, out, state, plan, kept, rounds)
    if len(kept) < len(plan) or rounds:
        work.run(progress)
    _remove_strays(out, state, {s.file for s in plan})
    done = [state[s.file] for s in plan]
    licences = _distinct(entry for one in done for entry in one["licences"])
    notes = _distinct(note for one in done for note in one["notes"])
    record = {
        "format": manifest.FORMAT,
        "study": study.record(),
        "images": [state[s.file]["image"] for s in plan],
        "licences": licences,
    }
    _write_json(out / manifest.NAME, record)
    return Built(len(work.rendered), len(plan) - len(work.rendered), tuple(notes))


class _Work:
    """One build: which images are left, and what was found on the way."""

    def __init__(
        self,
        study: Study,
        out: Path,
        state: dict,
        plan: list[Stimulus],
        kept: set[str],
        rounds: int,
    ):
        self.study, self.out, self.state, self.plan = study, out, state, plan
        self.kept, self.rounds = kept, rounds
        self.rendered: set[str] = set()

    def run(self, progress: bool) -> None:
        """Draw what is left, scene by scene."""
        from tqdm import tqdm

        import renderer

        driver = renderer.driver()
        by = {file: self.state[file]["image"]["renderer"] for file in self.kept}
        self.kept = {file for file in self.kept if _same_driver(by[file], driver)}
        todo = [s.file for s in self.plan if s.file not in self.kept]
        if todo:
            (self.out / manifest.NAME).unlink(missing_ok=True)
        scenes: dict[str, list[Stimulus]] = {}
        for stimulus in self.plan:
            if self.rounds or stimulus.file not in self.kept:
                scenes.setdefault(_place(stimulus.scene), []).append(stimulus)
        try:
            with tqdm(total=len(todo), desc="rendering", unit="image", disable=not progress) as bar:
                for stimuli in scenes.values():
                    self._scene(stimuli, bar)
        except KeyboardInterrupt as error:
            raise Stopped(
                f"stopped with {len(self.rendered)} of {len(todo)} images rendered; `subdermal "
                "build` without --force goes on from there"
            ) from error

    def _scene(self, stimuli: list[Stimulus], bar: Any) -> None:
        """Put up one scene and draw what is left of its images."""
        from renderer import Renderer
        from stimuli.scenes import stage

        render = self.study.render
        staged = stage(stimuli[0].scene, render.seed)
        with Renderer(
            staged.graph, size=render.size, supersample=render.supersample, seed=render.seed
        ) as drawing:
            entry = {"renderer": {**drawing.info(), "commit": commit()}, "head": staged.provenance}
            for cell in _by_cell(stimuli):
                scene = cell[0].scene
                with drawing.frame(scene.camera, scene.picture) as frame:
                    for stimulus in cell:
                        if stimulus.file in self.kept:
                            continue
                        bar.set_postfix_str(f"{stimulus.cell.name}, {stimulus.condition}")
                        self._image(stimulus, frame, entry, staged)
                        bar.update()
                    if self.rounds:
                        self._time(cell, frame)

    def _image(self, stimulus: Stimulus, frame: Any, entry: dict, staged: Any) -> None:
        """Render one image and record it: it is there whatever comes after."""
        render = self.study.render
        result = frame.render(stimulus.parameters)
        digest = _write_png(self.out / stimulus.file, result.image, render.size)
        technique = {c.name: c.technique for c in self.study.techniques}[stimulus.condition]
        further = {k: v for k, v in stimulus.cell.levels.items() if k != FRAMING}
        region = tuple(stimulus.scene.camera.region)
        image = {
            "framing": stimulus.cell.framing,
            **({"levels": further} if further else {}),
            "technique": stimulus.condition,
            "file": stimulus.file,
            "width": render.size[0],
            "height": render.size[1],
            **({"region": list(region)} if region != WHOLE else {}),
            "sha256": digest,
            "parameters": {
                "technique": technique,
                "supersample": render.supersample,
                **_jsonable(stimulus.parameters),
            },
            "scene": _described(stimulus.scene),
            "seed": render.seed,
            "measures": {"samples_per_pixel": samples_per_pixel(result.samples)},
            **entry,
        }
        done = {
            "key": stimulus.key,
            "image": image,
            "licences": staged.licences,
            "notes": list(staged.notes),
        }
        self.state[stimulus.file] = done
        self.rendered.add(stimulus.file)
        _write_json(self.out / STATE, {"format": STATE_FORMAT, "images": self.state})

    def _time(self, stimuli: list[Stimulus], frame: Any) -> None:
        """Put each image's median milliseconds of scattering into its measures."""
        shown = {s.file: s.parameters for s in stimuli}
        for file, spent in frame.time(shown, self.rounds).items():
            measures = self.state[file]["image"]["measures"]
            measures["milliseconds"] = round(1000 * float(np.median(spent[:, 0])), 1)
        _write_json(self.out / STATE, {"format": STATE_FORMAT, "images": self.state})


def resolve(study: Study) -> dict[str, Any]:
    """The validated parameters of each condition; InputError names the key at fault."""
    import renderer
    import renderer.errors

    resolved = {}
    for i, condition in enumerate(study.techniques):
        try:
            resolved[condition.name] = renderer.make(
                condition.technique, _frozen(condition.parameters)
            )
        except renderer.errors.InputError as error:
            raise InputError(f"study {study.name}: techniques[{i}]: {error}") from error
    return resolved


def scenes_of(study: Study) -> dict[str, Any]:
    """The checked scene of each cell, by the cell's name; InputError names the key at fault."""
    from renderer.errors import InputError as SceneError
    from stimuli.scenes import read_scene

    scenes = {}
    for cell in study.cells:
        try:
            scenes[cell.name] = read_scene(study.scene_of(cell), f"{cell.name}: scene")
        except (SceneError, InputError) as error:
            raise InputError(f"study {study.name}: {error}") from error
    return scenes


def samples_per_pixel(samples: np.ndarray) -> float:
    """The mean of an image's counts of samples where any was taken; 0 where nothing was sampled."""
    taken = samples[samples > 0]
    return round(float(taken.mean()), 4) if taken.size else 0.0


def commit() -> str | None:
    """The git commit of the checkout that this package runs from, with "-dirty" where tracked
    source that shapes the images differs from it; None where there is no checkout or no git.
    """

    def git(*args: str) -> subprocess.CompletedProcess:
        return subprocess.run(["git", "-C", str(_ROOT), *args], capture_output=True, text=True)

    try:
        run = git("rev-parse", "--show-toplevel", "--verify", "HEAD")
    except FileNotFoundError:
        return None
    if run.returncode:
        return None
    top, head = run.stdout.splitlines()
    if Path(top).resolve() != _ROOT:
        return None
    return head + (
        "-dirty" if git("diff", "--quiet", "HEAD", "--", "renderer", "stimuli").returncode else ""
    )


def _plan(study: Study, parameters: dict[str, Any]) -> list[Stimulus]:
    """Every image of the study, cell by cell."""
    scenes = scenes_of(study)
    files = {name: _own_files(scene) for name, scene in scenes.items()}
    plan = []
    for cell in study.cells:
        for condition in study.techniques:
            chosen = parameters[condition.name]
            made_from = {
                "render": dataclasses.asdict(study.render),
                "scene": _described(scenes[cell.name]),
                "files": files[cell.name],
                "source": _source(type(chosen).__module__),
                "technique": condition.technique,
                "parameters": _jsonable(chosen),
            }
            key = hashlib.sha256(json.dumps(made_from, sort_keys=True).encode()).hexdigest()
            file = f"images/{cell.name}_{condition.name}.png"
            plan.append(Stimulus(cell, condition.name, chosen, scenes[cell.name], file, key))
    return plan


@cache
def _source(module: str) -> str:
    return sources.digest(module)


def _own_files(scene: Any) -> list[list[str]]:
    """The user's files and the people in a scene, each with its sha256."""
    files = [getattr(thing, "file", "") for thing in scene.objects.values()]
    files += [
        file for material in scene.materials.values() for file in _maps(material.plain()).values()
    ]
    files.append(scene.environment.map)
    for thing in scene.objects.values():
        if person := getattr(thing, "person", ""):
            known = PEOPLE / f"{person}.toml"
            files.append(str(known) if known.is_file() else person)
    paths = [Path(file) for file in files if file]
    return [[path.name, manifest.sha256(path)] for path in paths if path.is_file()]


def _maps(material: dict) -> dict[str, str]:
    """The files that a material's table names, by their keys."""
    return {key: file for key, file in material.items() if key.endswith(MAP_ENDING)}


def _described(scene: Any) -> dict:
    """The scene's table; files by their names, since folders are nobody's business."""
    table = scene.plain()
    holders = [(entry, ("file",)) for entry in table["objects"].values()]
    holders += [(entry, tuple(_maps(entry))) for entry in table["materials"].values()]
    for holder, keys in (*holders, (table["environment"], ("map",))):
        for key in keys:
            if holder.get(key):
                holder[key] = Path(holder[key]).name
    return table


def _place(scene: Any) -> str:
    """What two scenes have in common that differ in camera and picture alone."""
    table = scene.plain()
    del table["camera"], table["picture"]
    return json.dumps(table, sort_keys=True)


def _distinct(entries: Iterable) -> list:
    """The entries without repetition, in order (they need not be hashable)."""
    distinct = []
    for entry in entries:
        if entry not in distinct:
            distinct.append(entry)
    return distinct


def _by_cell(group: list[Stimulus]) -> list[list[Stimulus]]:
    cells: dict[str, list[Stimulus]] = {}
    for stimulus in group:
        cells.setdefault(stimulus.cell.name, []).append(stimulus)
    return list(cells.values())


def _is_finished(out: Path, stimulus: Stimulus, state: dict) -> bool:
    done = state.get(stimulus.file)
    if done is None or done["key"] != stimulus.key or not (out / stimulus.file).is_file():
        return False
    return manifest.sha256(out / stimulus.file) == done["image"]["sha256"]


def _same_driver(recorded: dict, driver: dict) -> bool:
    return {**recorded, "commit": None} == {**driver, "commit": None}


def _remove_strays(out: Path, state: dict, wanted: Iterable[str]) -> None:
    """Remove images of an earlier version of the study: those that a build wrote and nobody
    changed.
    """
    strays = [file for file in state if file not in wanted]
    for file in strays:
        done, path = state.pop(file), out / file
        if path.is_file() and manifest.sha256(path) == done["image"]["sha256"]:
            path.unlink()
    if strays:
        _write_json(out / STATE, {"format": STATE_FORMAT, "images": state})


def _read_state(out: Path) -> dict:
    """The finished images by file: {"key", "image", "licences", "notes"}; with a key that no image
    has where the first edition made them. Refuses a folder whose manifest is not a build's.
    """
    path = out / STATE
    if not path.exists():
        if (out / manifest.NAME).exists():
            raise InputError(
                f"{out / manifest.NAME}: not written by a build, and not overwritten: choose "
                "another folder"
            )
        return {}
    try:
        record = json.loads(path.read_bytes())
        if record["format"] == STATE_FORMAT:
            return record["images"]
        if record["format"] == OLD_STATE_FORMAT:
            return {file: {**done, "key": ""} for file, done in record["images"].items()}
    except (ValueError, KeyError, TypeError):
        pass
    raise InputError(
        f"{path}: not the record of a build of this version: choose another folder, or delete "
        f"it and {manifest.NAME} to render everything anew"
    )


def _write_png(path: Path, pixels: np.ndarray, size: tuple[int, int]) -> str:
    """Write (height, width, 3) bytes as a PNG and return the sha256 of the file."""
    import PIL.Image

    if pixels.shape != (size[1], size[0], 3) or pixels.dtype != np.uint8:
        raise RuntimeError(
            f"{path}: rendered {pixels.shape} {pixels.dtype}, expected "
            f"{(size[1], size[0], 3)} uint8"
        )
    with replacing(path) as temporary:
        PIL.Image.fromarray(pixels).save(temporary, format="PNG")
        return manifest.sha256(temporary)


def _write_json(path: Path, record: dict) -> None:
    with replacing(path) as temporary:
        temporary.write_text(
            json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8"
        )


def _jsonable(parameters: Any) -> dict:
    """A dataclass of parameters as JSON would give it back."""
    return json.loads(
        json.dumps(dataclasses.asdict(parameters), default=lambda array: array.tolist())
    )


def _frozen(value: Any) -> Any:
    """Lists as tuples, all the way down: what a frozen dataclass holds."""
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value
