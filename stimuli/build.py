"""From a study to its images and their manifest.

The folder holds images/, the manifest, and records/ (`stimuli.records`): for every finished image
the key of what it was rendered from and its entry in the manifest. An image is rendered when its
key is new or its file is not the one that was written, so that a second build renders only what
changed and an interrupted one goes on. Files are written under another name and then renamed: there
is never half a file. The manifest is written last, and is not there while images are missing.

Images are drawn in this process, or by the workers of an executor that is passed in: the bytes are
the same on one kind of machine.
"""

import subprocess
from collections.abc import Iterable
from concurrent.futures import FIRST_EXCEPTION, Executor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.files import PARTS
from stimuli import drawing, manifest, records
from stimuli.drawing import Stimulus, Studio, Task
from stimuli.errors import InputError, Stopped
from stimuli.study import Study

#: From so many scenes for each worker on, one scene is drawn by one worker.
SCENES_A_WORKER = 3
LOOK_EVERY_S = 0.5  # at what other processes have finished
_ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Built:
    """How many images a build rendered, how many it found up to date, and what there is to say."""

    rendered: int
    kept: int
    notes: tuple[str, ...] = ()


def build(
    study: Study,
    out: str | Path,
    force: bool = False,
    progress: bool = False,
    rounds: int = 0,
    executor: Executor | None = None,
    workers: int = 1,
) -> Built:
    """Render what is missing or out of date of the study's images, and write the manifest.

    `force` renders every image anew; `progress` shows a bar on stderr. `rounds` also times every
    technique so often and puts the median milliseconds of scattering alone into the manifest: they
    differ from run to run. Images of one study come from one OpenGL driver: when it differs from
    that of the finished images, these are rendered anew as well.

    executor: draws the images, in spawned processes that see the folder, without one this process
    does; workers: how many it has. A scene is put up once in each process for all its cameras, and
    freed before the next.
    """
    if rounds and executor is not None:
        raise InputError(
            f"times are asked for, {rounds} rounds, with workers; expected none, since other work "
            "would slow them: build first and time afterwards, which renders nothing anew"
        )
    out = Path(out).absolute()
    parameters = resolve(study)
    done = records.read(out)
    plan = _plan(study, parameters)
    (out / "images").mkdir(parents=True, exist_ok=True)
    records.upgrade(out, done)
    kept = {s.file for s in plan if records.is_finished(out, s.file, s.key, done.get(s.file))}
    work = _Work(study, out, plan, set() if force else kept, done)
    if len(work.kept) < len(plan) or rounds:
        work.run(progress, rounds, executor, workers)
    _remove_strays(out, done, {s.file for s in plan})
    done = records.read(out)
    if missing := [s.file for s in plan if s.file not in done]:
        raise InputError(
            f"{out}: workers drew {len(missing)} images that are not here, as {missing[0]}; "
            "expected a folder that this machine and all workers share"
        )
    made = [done[s.file] for s in plan]
    record = {
        "format": manifest.FORMAT,
        "study": study.record(),
        "images": [one["image"] for one in made],
        "licences": _distinct(entry for one in made for entry in one["licences"]),
    }
    records.write_json(out / manifest.NAME, record)
    notes = _distinct(note for one in made for note in one["notes"])
    return Built(len(plan) - len(work.kept), len(work.kept), tuple(notes))


class _Work:
    """One build: which images are left to draw, and who draws them."""

    def __init__(
        self, study: Study, out: Path, plan: list[Stimulus], kept: set[str], done: dict[str, dict]
    ):
        self.study, self.out, self.plan, self.kept, self.done = study, out, plan, kept, done

    def run(self, progress: bool, rounds: int, executor: Executor | None, workers: int) -> None:
        """Draw what is left, scene by scene."""
        from tqdm import tqdm

        driver = executor.submit(drawing.driver).result() if executor else drawing.driver()
        by = {file: self.done[file]["image"]["renderer"] for file in self.kept}
        self.kept = {file for file in self.kept if _same_driver(by[file], driver)}
        todo = [s for s in self.plan if s.file not in self.kept]
        if todo:
            (self.out / manifest.NAME).unlink(missing_ok=True)
        for stimulus in todo:
            if stimulus.file in self.done:
                anew = {**self.done[stimulus.file], "key": records.NO_KEY}
                records.write(self.out, stimulus.file, anew)
        wanted = self.plan if rounds else todo
        rest = (driver, commit(), rounds)
        tasks = [
            Task(str(self.out), self.study.render, tuple(part), *rest)
            for part in _parts(wanted, workers)
        ]
        with tqdm(total=len(todo), desc="rendering", unit="image", disable=not progress) as bar:
            left = {s.file: s.key for s in todo}
            try:
                if executor is None:
                    self._draw_here(tasks, left, bar)
                else:
                    self._draw_by(executor, tasks, left, bar)
            except KeyboardInterrupt as error:
                raise Stopped(
                    f"stopped with {len(todo) - len(left)} of {len(todo)} images rendered; "
                    "`subdermal build` without --force goes on from there"
                ) from error

    def _draw_here(self, tasks: list[Task], left: dict[str, str], bar: Any) -> None:
        def drawn(stimulus: Stimulus) -> None:
            bar.set_postfix_str(f"{stimulus.cell.name}, {stimulus.condition}")
            bar.update()
            left.pop(stimulus.file)

        with Studio() as studio:
            for task in tasks:
                studio.draw(task, drawn)

    def _draw_by(
        self, executor: Executor, tasks: list[Task], left: dict[str, str], bar: Any
    ) -> None:
        """Have an executor draw, and take from `left`, keys by file, what is recorded."""

        def look() -> None:
            for file in records.named(self.out) & left.keys():
                if records.read_one(self.out, file)["key"] == left[file]:
                    left.pop(file)
                    bar.update()

        waiting = {executor.submit(drawing.draw, task) for task in tasks}
        try:
            while waiting:
                finished, waiting = wait(waiting, LOOK_EVERY_S, FIRST_EXCEPTION)
                for future in finished:
                    future.result()
                look()
        finally:
            for future in waiting:
                future.cancel()
            look()


def _parts(stimuli: Iterable[Stimulus], workers: int) -> list[list[Stimulus]]:
    """What is drawn together: a scene where each worker has several of its own, else a scene's
    images by one camera, whose shared passes are drawn once.
    """
    scenes: dict[str, dict[str, list[Stimulus]]] = {}
    for stimulus in stimuli:
        cells = scenes.setdefault(drawing.place(stimulus.scene), {})
        cells.setdefault(stimulus.cell.name, []).append(stimulus)
    if len(scenes) >= SCENES_A_WORKER * workers:
        return [[s for cell in cells.values() for s in cell] for cells in scenes.values()]
    return [cell for cells in scenes.values() for cell in cells.values()]


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
    plan = []
    for cell, scene in zip(study.cells, scenes_of(study).values(), strict=True):
        files = drawing.own_files(scene)
        for condition in study.techniques:
            chosen = parameters[condition.name]
            key = drawing.key(study.render, scene, files, condition.technique, chosen)
            file = f"images/{cell.name}_{condition.name}.png"
            plan.append(
                Stimulus(cell, condition.name, condition.technique, chosen, scene, file, key)
            )
    return plan


def _distinct(entries: Iterable) -> list:
    """The entries without repetition, in order (they need not be hashable)."""
    distinct = []
    for entry in entries:
        if entry not in distinct:
            distinct.append(entry)
    return distinct


def _same_driver(recorded: dict, driver: dict) -> bool:
    return {**recorded, "commit": None} == {**driver, "commit": None}


def _remove_strays(out: Path, done: dict[str, dict], wanted: set[str]) -> None:
    """Remove images of an earlier version of the study: those that a build wrote and nobody
    changed. What a process that was killed left half written goes too.
    """
    for file in done.keys() - wanted:
        path = out / file
        if path.is_file() and manifest.sha256(path) == done[file]["image"]["sha256"]:
            path.unlink()
        records.remove(out, file)
    cells = {Path(file).name for file in wanted}
    for path in (out / manifest.MASKS).glob("*.png"):
        if not any(name.startswith(f"{path.stem}_") for name in cells):
            path.unlink()
    for folder in ("images", manifest.MASKS, records.FOLDER):
        for part in (out / folder).glob(PARTS):
            part.unlink(missing_ok=True)


def _frozen(value: Any) -> Any:
    """Lists as tuples, all the way down: what a frozen dataclass holds."""
    if isinstance(value, dict):
        return {key: _frozen(entry) for key, entry in value.items()}
    return tuple(map(_frozen, value)) if isinstance(value, list) else value
