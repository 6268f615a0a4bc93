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
import os
import subprocess
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stimuli import manifest
from stimuli.errors import InputError, Stopped
from stimuli.study import Study

STATE = "build.json"
STATE_FORMAT = "subdermal-build/1"
_ROOT = Path(__file__).resolve().parents[1]
_SOURCES = (_ROOT / "renderer", _ROOT / "stimuli" / "heads")


@dataclass(frozen=True)
class Stimulus:
    """An image to make: `parameters` is the validated dataclass of its technique,
    `key` a sha256.
    """

    framing: str
    condition: str
    parameters: Any
    file: str
    key: str


@dataclass(frozen=True)
class Built:
    """How many images a build rendered, how many it found up to date, and what there is to say of
    the head.
    """

    rendered: int
    kept: int
    notes: tuple[str, ...] = ()


def build(
    study: Study, out: str | Path, force: bool = False, progress: bool = False, rounds: int = 0
) -> Built:
    """Render what is missing or out of date of the study's images into `out`, and write the
    manifest.

    `force` renders every image anew; `progress` shows a bar on stderr. `rounds` also times every
    technique so often and puts the median milliseconds of scattering alone into the manifest: they
    differ from run to run. Images of one study come from one OpenGL driver: when it differs from
    that of the finished images, these are rendered anew as well.
    """
    out = Path(out)
    parameters = resolve(study)
    state = _read_state(out)

    from renderer import Renderer
    from stimuli.heads import load_head

    head = load_head(study.head.name, study.head.unit, study.render.seed, study.head.up)
    plan = _plan(study, parameters, head.provenance)
    (out / "images").mkdir(parents=True, exist_ok=True)
    kept = set() if force else {s.file for s in plan if _is_finished(out, s, state)}
    if len(kept) < len(plan) or rounds:
        render = study.render
        with Renderer(
            head.model, size=render.size, supersample=render.supersample, seed=render.seed
        ) as drawing:
            driver = drawing.info()
            kept = {file for file in kept if _same_driver(state[file]["image"]["renderer"], driver)}
            todo = [s for s in plan if s.file not in kept]
            (out / manifest.NAME).unlink(missing_ok=True)
            entry = {"renderer": {**driver, "commit": commit()}, "head": head.provenance}
            _render(study, todo, drawing, out, state, entry, progress)
            if rounds:
                _time(plan, drawing, out, state, rounds)
    _remove_strays(out, state, {s.file for s in plan})
    record = {
        "format": manifest.FORMAT,
        "study": study.record(),
        "images": [state[s.file]["image"] for s in plan],
        "licences": head.licences,
    }
    _write_json(out / manifest.NAME, record)
    return Built(rendered=len(plan) - len(kept), kept=len(kept), notes=head.notes)


def resolve(study: Study) -> dict[str, Any]:
    """The validated parameters of each condition; InputError names the key at fault."""
    import renderer
    import renderer.errors

    for i, framing in enumerate(study.framings):
        if framing.name not in renderer.FRAMINGS:
            raise InputError(
                f"study {study.name}: framings[{i}].name: got {framing.name!r}, expected one "
                f"of {', '.join(renderer.FRAMINGS)}"
            )
    resolved = {}
    for i, condition in enumerate(study.techniques):
        try:
            resolved[condition.name] = renderer.make(
                condition.technique, _frozen(condition.parameters)
            )
        except renderer.errors.InputError as error:
            raise InputError(f"study {study.name}: techniques[{i}]: {error}") from error
    return resolved


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
        found = git("rev-parse", "--show-toplevel", "--verify", "HEAD")
    except FileNotFoundError:
        return None
    if found.returncode:
        return None
    top, head = found.stdout.splitlines()
    if Path(top).resolve() != _ROOT:
        return None
    return head + (
        "-dirty" if git("diff", "--quiet", "HEAD", "--", "renderer", "stimuli").returncode else ""
    )


def _plan(study: Study, parameters: dict[str, Any], provenance: dict) -> list[Stimulus]:
    """Every image of the study, framing by framing."""
    common = {
        "render": dataclasses.asdict(study.render),
        "head": provenance,
        "source": _source_digest(),
    }
    plan = []
    for framing in study.framings:
        for condition in study.techniques:
            chosen = parameters[condition.name]
            made_from = {
                **common,
                "framing": framing.name,
                "technique": condition.technique,
                "parameters": _jsonable(chosen),
            }
            key = hashlib.sha256(json.dumps(made_from, sort_keys=True).encode()).hexdigest()
            file = f"images/{framing.name}_{condition.name}.png"
            plan.append(Stimulus(framing.name, condition.name, chosen, file, key))
    return plan


def _source_digest() -> str:
    """The sha256 of all source that shapes an image, and of the renderer's version."""
    import renderer

    digest = hashlib.sha256(renderer.VERSION.encode())
    for folder in _SOURCES:
        for path in sorted(folder.rglob("*")):
            if path.is_file() and "__pycache__" not in path.parts:
                digest.update(
                    path.relative_to(_ROOT).as_posix().encode() + b"\0" + path.read_bytes()
                )
    return digest.hexdigest()


def _is_finished(out: Path, stimulus: Stimulus, state: dict) -> bool:
    done = state.get(stimulus.file)
    if done is None or done["key"] != stimulus.key or not (out / stimulus.file).is_file():
        return False
    return manifest.sha256(out / stimulus.file) == done["image"]["sha256"]


def _same_driver(recorded: dict, driver: dict) -> bool:
    return {**recorded, "commit": None} == {**driver, "commit": None}


def _render(
    study: Study,
    todo: list[Stimulus],
    drawing: Any,
    out: Path,
    state: dict,
    entry: dict,
    progress: bool,
) -> None:
    """Render framing by framing, so that the shared passes are drawn once; record each finished
    image.
    """
    from tqdm import tqdm

    techniques = {condition.name: condition.technique for condition in study.techniques}
    finished = 0
    try:
        with tqdm(total=len(todo), desc="rendering", unit="image", disable=not progress) as bar:
            for framing in dict.fromkeys(s.framing for s in todo):
                frame = drawing.frame(framing)
                for stimulus in (s for s in todo if s.framing == framing):
                    bar.set_postfix_str(f"{framing}, {stimulus.condition}")
                    result = frame.render(stimulus.parameters)
                    digest = _write_png(out / stimulus.file, result.image, study.render.size)
                    image = {
                        "framing": framing,
                        "technique": stimulus.condition,
                        "file": stimulus.file,
                        "width": study.render.size[0],
                        "height": study.render.size[1],
                        "sha256": digest,
                        "parameters": {
                            "technique": techniques[stimulus.condition],
                            "supersample": study.render.supersample,
                            **_jsonable(stimulus.parameters),
                        },
                        "seed": study.render.seed,
                        "measures": {"samples_per_pixel": samples_per_pixel(result.samples)},
                        **entry,
                    }
                    state[stimulus.file] = {"key": stimulus.key, "image": image}
                    _write_json(out / STATE, {"format": STATE_FORMAT, "images": state})
                    finished += 1
                    bar.update()
    except KeyboardInterrupt as error:
        raise Stopped(
            f"stopped with {finished} of {len(todo)} images rendered; `subdermal build` "
            "without --force goes on from there"
        ) from error


def _time(plan: list[Stimulus], drawing: Any, out: Path, state: dict, rounds: int) -> None:
    """Put each image's median milliseconds of scattering into its measures."""
    for framing in dict.fromkeys(s.framing for s in plan):
        shown = {s.file: s.parameters for s in plan if s.framing == framing}
        for file, spent in drawing.frame(framing).time(shown, rounds).items():
            state[file]["image"]["measures"]["milliseconds"] = round(
                1000 * float(np.median(spent[:, 0])), 1
            )
    _write_json(out / STATE, {"format": STATE_FORMAT, "images": state})


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
    """The finished images by file: {"key", "image"}. Refuses a folder whose manifest is not a
    build's.
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
    except (ValueError, KeyError, TypeError):
        pass
    raise InputError(
        f"{path}: not the record of a build of this version: delete it to render everything anew"
    )


def _write_png(path: Path, pixels: np.ndarray, size: tuple[int, int]) -> str:
    """Write (height, width, 3) bytes as a PNG and return the sha256 of the file."""
    import PIL.Image

    if pixels.shape != (size[1], size[0], 3) or pixels.dtype != np.uint8:
        raise RuntimeError(
            f"{path}: rendered {pixels.shape} {pixels.dtype}, expected "
            f"{(size[1], size[0], 3)} uint8"
        )
    with _replacing(path) as temporary:
        PIL.Image.fromarray(pixels).save(temporary, format="PNG")
        return manifest.sha256(temporary)


def _write_json(path: Path, record: dict) -> None:
    with _replacing(path) as temporary:
        temporary.write_text(
            json.dumps(record, indent=2, ensure_ascii=False) + "\n", encoding="utf-8"
        )


@contextmanager
def _replacing(path: Path) -> Iterator[Path]:
    """A file to write beside `path`, which takes its place when the block ends well."""
    temporary = path.with_name(f".{path.name}.part")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


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
