"""The gallery of illumination models: local ones on a ball, global ones in a box, side by side.

Every panel is a PNG of its own with its settings in it (scene, size, samples, seed); what is there
already with the same settings is kept, so that an interrupted gallery goes on where it stopped.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from PIL.PngImagePlugin import PngInfo

import renderer
from renderer.illumination import paths, radiosity
from renderer.illumination.rays import World, camera_rays, picture
from renderer.illumination.whitted import Node, trace
from renderer.scene import Scene
from renderer.scene.view import View, resolve
from stimuli.errors import InputError
from stimuli.scenes import complete, load_table, merge, read_scene, stage

BAND_PX, GAP_PX, TITLE_PX = 24, 6, 30
_BACK, _INK = (24, 24, 26), (236, 236, 236)
WHITE_SHEETS = {
    "subject": "far",
    "objects": {
        "ball": False,
        "near": {
            "shape": "sheet",
            "size_mm": [50.0, 50.0],
            "position_mm": [-14.0, 0.0, 350.0],
            "material": "paper",
        },
        "far": {
            "shape": "sheet",
            "size_mm": [80.0, 80.0],
            "position_mm": [14.0, 0.0, 0.0],
            "material": "paper",
        },
    },
    "materials": {"paper": {"kind": "shading", "model": "lambert", "albedo": [0.8] * 3}},
    "lights": {"lamp": {"position_mm": [0.0, 0.0, 1100.0], "irradiance": [2.9] * 3}},
    "environment": {"ambient": [0.0, 0.0, 0.0]},
    "camera": {"target_mm": [-14.0, 0.0, 175.0], "height_mm": 112.0, "fov_y_deg": 6.0},
}
GLOWING = {
    "objects": {
        "panel": {
            "shape": "slab",
            "size_mm": [160.0, 4.0, 160.0],
            "position_mm": [0.0, 170.0, -40.0],
        }
    },
    "materials": {
        "panel": {
            "kind": "shading",
            "model": "lambert",
            "albedo": [0.0, 0.0, 0.0],
            "emission": [5.0, 4.8, 4.4],
        }
    },
    "lights": {"lamp": False},
    "environment": {"ambient": [0.02, 0.02, 0.02]},
}


@dataclass(frozen=True)
class Options:
    """What a gallery is drawn with.

    size_px: of a panel's side; samples: paths a pixel; patch_mm, rays: of radiosity; depth: of the
    recursion; pixel: whose tree of rays is drawn, in [0, 1] from the left and the top.
    """

    scene: str = "box"
    size_px: int = 200
    samples: int = 64
    patch_mm: float = 62.5
    rays: int = 512
    depth: int = 6
    pixel: tuple[float, float] = (0.3625, 0.7375)
    seed: int = 0


class Room:
    """A scene for rays, its view, and what has been computed of it."""

    def __init__(self, table: dict[str, Any], options: Options):
        self.options = options
        self.scene: Scene = read_scene(table)
        self.graph = stage(self.scene, options.seed).graph
        self.size = (options.size_px, options.size_px)
        self.view: View = resolve(self.scene.camera, self.graph.subject, *self.size)

    @cached_property
    def world(self) -> World:
        return World(self.graph, self.options.seed)

    @cached_property
    def solution(self) -> radiosity.Solution:
        o = self.options
        return radiosity.solve(self.world, o.patch_mm, o.rays, o.seed)

    def traced(self, depth: int, even: Callable | None = None) -> np.ndarray:
        """Radiance (H, W, 3) by Whitted's recursion; depth 0: ray casting."""
        return picture(lambda o, d: trace(self.world, o, d, depth, even), self.view, self.size, 2)

    def patched(self, sweep: int = -1, smooth: bool = True) -> np.ndarray:
        """Radiance (H, W, 3) of radiosity after a sweep."""
        shade = radiosity.shade_smooth if smooth else radiosity.shade_flat
        B = self.solution.sweeps[sweep]
        return picture(
            lambda o, d: shade(self.world, self.solution, B, o, d), self.view, self.size, 2
        )

    def two_pass(self) -> np.ndarray:
        """Radiance (H, W, 3) by ray tracing with radiosity's light for ambient light."""
        incident = self.solution.smooth(self.solution.incident)
        return self.traced(self.options.depth, lambda hits: incident(hits) / np.pi)

    def by_paths(self, progress: Callable | None = None) -> np.ndarray:
        """Radiance (H, W, 3) by Monte Carlo."""
        o = self.options
        return paths.picture(self.world, self.view, self.size, o.samples, o.seed, progress)[0]


def rastered(table: dict[str, Any], size_px: int) -> np.ndarray:
    """The image (H, W, 3) uint8 of a scene by the rasteriser, technique "none"."""
    graph = stage(read_scene(table)).graph
    with (
        renderer.Renderer(graph, (size_px, size_px), 2, rays=1, shadow_map=64) as drawing,
        drawing.frame() as frame,
    ):
        return frame.render(renderer.make("none")).image


@dataclass(frozen=True)
class Panel:
    """One picture: where it stands, what it says, and how it is made.

    draw: takes a progress function to the image (H, W, 3) uint8. settings: all that it depends on.
    """

    row: str
    name: str
    label: str
    draw: Callable[[Callable], np.ndarray]
    settings: dict[str, Any]


def local_panels(options: Options) -> Iterator[Panel]:
    """Models, coefficients and attenuation, on the rasteriser."""
    ball = load_table("ball")

    def panel(row: str, name: str, label: str, patch: dict[str, Any]) -> Panel:
        table = merge(ball, patch)
        settings = {"scene": read_scene(table).plain(), "size_px": options.size_px}
        return Panel(row, name, label, lambda _: rastered(table, options.size_px), settings)

    def material(**fields) -> dict[str, Any]:
        return {"materials": {"ball": fields}}

    dark = {"lights": {"lamp": {"irradiance": [0.0] * 3}}}
    row = "Local models: one lamp, no shadows, no neighbours"
    yield panel(row, "ambient", "ambient", {**dark, **material()})
    yield panel(row, "lambert", "ambient + Lambert", material(model="lambert"))
    yield panel(row, "phong", "Phong, n 20", material(model="phong"))
    yield panel(row, "blinn_phong", "Blinn-Phong, n 20", material(model="blinn_phong"))
    rough = {"model": "cook_torrance", "roughness": 0.25, "f0": 0.2, "k_s": [1.0] * 3}
    yield panel(row, "cook_torrance", "Cook-Torrance, m .25", material(**rough))
    glow = {"model": "lambert", "emission": [0.02, 0.12, 0.2]}
    yield panel(row, "emission", "Lambert + emission", material(**glow))
    row = "Ambient I_a and diffuse k_d"
    for ambient in (0.0, 0.1, 0.3):
        for diffuse in (0.3, 0.6, 0.9):
            patch = material(model="lambert", albedo=[diffuse] * 3, k_a=[0.7] * 3)
            patch["environment"] = {"ambient": [ambient] * 3}
            name = f"ambient_{ambient:g}_diffuse_{diffuse:g}"
            yield panel(row, name, f"I_a {ambient:g}, k_d {diffuse:g}", patch)
    row = "Specular exponent n and k_s (Blinn-Phong)"
    for exponent in (1.0, 20.0, 200.0):
        for strength in (0.1, 0.25, 0.5):
            patch = material(albedo=[0.4] * 3, k_s=[strength] * 3, exponent=exponent)
            name = f"exponent_{exponent:g}_specular_{strength:g}"
            yield panel(row, name, f"n {exponent:g}, k_s {strength:g}", patch)
    row = "Attenuation 1 / (c1 + c2 d + c3 d^2), cut off at 1: two sheets of one material, d in m"
    for constants in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.5, 0.5, 0.5)):
        lamp = {"attenuation": list(constants), "attenuation_limit": 1.0}
        patch = merge(WHITE_SHEETS, {"lights": {"lamp": lamp}})
        words = ", ".join(f"{c:g}" for c in constants)
        name = "attenuation_" + "_".join(f"{c:g}" for c in constants)
        yield panel(row, name, f"c = {words}", patch)


def global_panels(options: Options) -> Iterator[Panel]:
    """Ray casting to Monte Carlo in one box, radiosity's sweeps, and light from an emitter."""
    box = Room(load_table(options.scene), options)

    def panel(room: Room, row: str, name: str, label: str, radiance: Callable, **settings) -> Panel:
        def draw(progress: Callable) -> np.ndarray:
            return room.scene.picture.encode(radiance(progress))

        common = {"scene": room.scene.plain(), "size_px": options.size_px, "seed": options.seed}
        return Panel(row, name, label, draw, {**common, **settings})

    depth = {"depth": options.depth}
    mesh = {"patch_mm": options.patch_mm, "rays": options.rays}
    drawn = {"samples": options.samples}
    row = "One box, one lamp"
    yield panel(box, row, "ray_casting", "ray casting with Phong", lambda _: box.traced(0))
    yield panel(
        box, row, "whitted", "ray tracing (Whitted)", lambda _: box.traced(options.depth), **depth
    )
    yield panel(box, row, "radiosity", "radiosity", lambda _: box.patched(), **mesh)
    yield panel(
        box,
        row,
        "radiosity_ray_tracing",
        "radiosity + ray tracing",
        lambda _: box.two_pass(),
        **depth,
        **mesh,
    )
    yield panel(box, row, "monte_carlo", "Monte Carlo", box.by_paths, **drawn)
    row = "Radiosity: patches, and after successive sweeps of Gauss-Seidel"
    yield panel(box, row, "patches", "patches, solved", lambda _: box.patched(smooth=False), **mesh)
    for sweep in (0, 1, 2, 4):
        yield panel(
            box,
            row,
            f"sweep_{sweep}",
            "E alone" if sweep == 0 else f"after {sweep}",
            lambda _, k=sweep: box.patched(min(k, len(box.solution.sweeps) - 1)),
            **mesh,
        )
    if options.scene != "box":
        return
    glowing = Room(merge(load_table("box"), GLOWING), options)
    row = "An emitting panel and no lamp: a source only to the global methods"
    yield panel(glowing, row, "glow_ray_casting", "ray casting", lambda _: glowing.traced(0))
    yield panel(glowing, row, "glow_radiosity", "radiosity", lambda _: glowing.patched(), **mesh)
    yield panel(
        glowing,
        row,
        "glow_radiosity_ray_tracing",
        "radiosity + ray tracing",
        lambda _: glowing.two_pass(),
        **depth,
        **mesh,
    )
    yield panel(glowing, row, "glow_monte_carlo", "Monte Carlo", glowing.by_paths, **drawn)


def tree(options: Options, path: Path) -> list[Node]:
    """Draw Whitted's tree of one pixel: its rays seen from above, and what each brings."""
    from matplotlib.figure import Figure
    from scipy.spatial import ConvexHull

    room = Room(load_table(options.scene), options)
    at = np.array(options.pixel) * options.size_px
    if not ((at >= 0) & (at < options.size_px)).all():
        raise InputError(f"pixel is {options.pixel}; expected two shares from 0 to below 1")
    column, line = at.astype(int)
    k = line * options.size_px + column
    origins, towards = camera_rays(room.view, *room.size)
    nodes: list[Node] = []
    trace(room.world, origins[k : k + 1], towards[k : k + 1], options.depth, tree=nodes)
    names = [*room.scene.objects]
    colours = {"eye": "#444444", "reflected": "#c0392b", "refracted": "#2471a3"}
    figure = Figure(figsize=(12, 5), layout="constrained")
    above, branches = figure.subplots(1, 2, width_ratios=[2, 3])
    world = room.world
    for b in range(world.body.max() + 1):
        flat = world.positions[world.faces[world.body == b]].reshape(-1, 3)[:, [0, 2]]
        ring = flat[ConvexHull(flat, qhull_options="QJ").vertices]
        above.fill(*ring.T, facecolor="#00000010", edgecolor="#888888")
    reach = np.ptp(world.positions, axis=0).max()
    for number, node in enumerate(nodes):
        end = node.start + 0.2 * reach * node.towards if node.end is None else node.end
        ends = np.array([node.start, end])[:, [0, 2]]
        above.plot(*ends.T, color=colours[node.kind], lw=1)
        above.annotate(str(number), ends.mean(axis=0), fontsize=7)
    above.set(xlabel="x / mm", ylabel="z / mm, towards the eye", title="rays from above")
    above.set_aspect("equal")
    place = _tree_places(nodes)
    for number, node in enumerate(nodes):
        if node.parent >= 0:
            ends = np.array([place[node.parent], place[number]])
            branches.plot(*ends.T, color=colours[node.kind], lw=1 + 3 * node.share.max(), zorder=1)
        met = "leaves" if node.body < 0 else [*names, *["eye"] * world.body.max()][node.body]
        words = f"{number} {met}\n"
        words += f"share {node.share.mean():.3f}\nadds {node.brings.mean():.3f}"
        box = {"boxstyle": "round", "fc": "white", "ec": colours[node.kind]}
        branches.text(*place[number], words, fontsize=7, ha="center", va="center", bbox=box)
    for kind, colour in colours.items():
        branches.plot([], [], color=colour, label=f"{kind} ray")
    branches.legend(loc="upper left", fontsize=8, frameon=False)
    whole = sum(node.brings.mean() for node in nodes)
    branches.set(
        title=f"what each ray adds to the pixel's radiance, {whole:.3f} (mean of channels)"
    )
    branches.margins(0.12)
    branches.axis("off")
    figure.savefig(path, dpi=130, metadata={"Software": None})
    return nodes


def _tree_places(nodes: list[Node]) -> np.ndarray:
    """Where to draw the nodes (N, 2): leaves side by side, parents above their children."""
    children: list[list[int]] = [[] for _ in nodes]
    for number, node in enumerate(nodes):
        if node.parent >= 0:
            children[node.parent].append(number)
    places = np.zeros((len(nodes), 2))
    free = 0.0
    stack = [(0, False)]
    while stack:
        number, done = stack.pop()
        if children[number] and not done:
            stack.append((number, True))
            stack += [(child, False) for child in reversed(children[number])]
            continue
        if children[number]:
            places[number, 0] = places[children[number], 0].mean()
        else:
            places[number, 0] = free
            free += 1
        places[number, 1] = -nodes[number].level
    return places


#: Form factors of a cube's walls: opposite, and next to each other (Howell, A Catalog of Radiation
#: Heat Transfer Configuration Factors, C-11 and C-14).
CUBE = (0.199825, 0.200044)
MATT = {"model": "lambert", "k_r": [0.0] * 3, "k_t": [0.0] * 3}


def matt(table: dict[str, Any]) -> dict[str, Any]:
    """The scene with nothing but Lambert's law; mirrors and glass become grey."""
    table = complete(table)
    scene = read_scene(table)
    patch: dict[str, Any] = {}
    for name, material in scene.materials.items():
        clear = any(getattr(material, "k_r", ())) or any(getattr(material, "k_t", ()))
        grey = {"albedo": [0.5] * 3} if clear else {"albedo": list(material.albedo)}
        emission = {"emission": list(getattr(material, "emission", (0.0,) * 3))}
        patch[name] = {"kind": "shading", **MATT, **grey, **emission}
        table = merge(table, {"materials": {name: False}})
    return merge(table, {"materials": patch})


def cube(rays: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Form factors (6, 6) of the walls of a closed cube, a patch a wall, found by rays alone; and
    the cosines (6, 6) between the walls' normals: -1 for opposite ones, 0 side by side.
    """
    table = {
        "objects": {"room": {"shape": "box", "closed": True, "size_mm": [100.0] * 3}},
        "materials": {"room": {"kind": "shading", "model": "lambert"}},
        "environment": {"ambient": [1.0] * 3},
    }
    world = World(stage(read_scene(table)).graph, seed)
    walls = radiosity.patches(world, 150.0)
    return radiosity.exchange(world, walls, rays, seed).counted, walls.normals @ walls.normals.T


def numbers(options: Options, progress: Callable | None = None) -> dict[str, float]:
    """What can be checked of radiosity and of Monte Carlo, in the scene with matt materials."""
    half = replace(options, size_px=max(options.size_px // 2, 16))
    room = Room(matt(load_table(options.scene)), half)
    solution, made = room.solution, room.solution.exchange
    seen = made.area > 0
    rows = (made.F.sum(axis=1) + made.open)[seen]

    def lopsided(F: np.ndarray) -> float:
        sent = made.area[:, None] * F
        return float(np.abs(sent - sent.T).sum() / sent.sum())

    walls, cosines = cube(128 * options.rays, options.seed)
    comes, goes = solution.balance()
    even = np.full((len(made.area), 3), 1.0)
    closed = made.F / np.maximum(made.F.sum(axis=1, keepdims=True), 1e-30)
    *_, B = radiosity.gauss_seidel(closed, 0.5 * even, even)
    radiance, error = paths.picture(
        room.world, room.view, room.size, options.samples, options.seed, progress
    )
    noise = (error**2).mean()

    def away(image: np.ndarray) -> float:
        """Root mean square difference to Monte Carlo, without its noise, as a share of the mean."""
        square = ((image - radiance) ** 2).mean() - noise
        return float(np.sign(square) * np.sqrt(abs(square)) / radiance.mean())

    return {
        "patches": len(made.area),
        "sweeps": len(solution.sweeps) - 1,
        "row sum, least": float(rows.min()),
        "row sum, most": float(rows.max()),
        "A_i F_ij unlike A_j F_ji, by rays": lopsided(made.counted),
        "A_i F_ij unlike A_j F_ji, balanced": lopsided(made.F),
        "cube, opposite walls": float(walls[cosines < -0.5].mean()),
        "cube, opposite walls, exact": CUBE[0],
        "cube, walls side by side": float(walls[np.abs(cosines) < 0.5].mean()),
        "cube, walls side by side, exact": CUBE[1],
        "closed room, E 1, rho .5: B / 2 - 1, most": float(np.abs(B[seen] / 2 - 1).max()),
        "light that goes / that comes - 1": float((goes.sum() / comes.sum()) - 1),
        "mean radiance, Monte Carlo": float(radiance.mean()),
        "its noise, rms": float(np.sqrt(noise) / radiance.mean()),
        "radiosity, rms from Monte Carlo": away(room.patched()),
        "radiosity + ray tracing, rms from Monte Carlo": away(room.two_pass()),
        "ray casting, rms from Monte Carlo": away(room.traced(0)),
    }


def sheet(rows: dict[str, list[tuple[str, Image.Image]]], width: int) -> Image.Image:
    """Rows of labelled pictures under their titles, each row as wide as the sheet or smaller."""
    small, large = ImageFont.load_default(13), ImageFont.load_default(17)
    placed, top = [], GAP_PX
    for title, entries in rows.items():
        side = (width - GAP_PX) // len(entries) - GAP_PX
        pictures = []
        for label, image in entries:
            scale = min(1.0, side / image.width)
            size = (round(image.width * scale), round(image.height * scale))
            pictures.append((label, image.resize(size, Image.Resampling.LANCZOS)))
        placed.append((top, title, pictures))
        top += TITLE_PX + pictures[0][1].height + BAND_PX + GAP_PX
    board = Image.new("RGB", (width, top), _BACK)
    draw = ImageDraw.Draw(board)
    for y, title, pictures in placed:
        draw.text((GAP_PX, y + TITLE_PX / 2), title, font=large, fill=_INK, anchor="lm")
        x = GAP_PX
        for label, image in pictures:
            board.paste(image, (x, y + TITLE_PX))
            middle = (x + image.width / 2, y + TITLE_PX + image.height + BAND_PX / 2)
            draw.text(middle, label, font=small, fill=_INK, anchor="mm")
            x += image.width + GAP_PX
    return board


def gallery(
    folder: Path, options: Options, progress: bool = False
) -> tuple[Path, dict[str, float]]:
    """Draw all panels, the tree and the sheet into `folder`; the sheet's path and the numbers."""
    from tqdm import tqdm

    folder.mkdir(parents=True, exist_ok=True)
    panels = [*local_panels(options), *global_panels(options)]
    rows: dict[str, list[tuple[str, Image.Image]]] = {}
    with tqdm(total=len(panels) + 2, unit="picture", disable=not progress) as bar:
        say = lambda done: bar.set_postfix_str(f"{done} of {options.samples} paths a pixel")
        for panel in panels:
            bar.set_description(panel.name)
            image = _kept(folder / f"{panel.name}.png", panel.settings, lambda p=panel: p.draw(say))
            rows.setdefault(panel.row, []).append((panel.label, image))
            bar.set_postfix_str("")
            bar.update()
        bar.set_description("tree")
        tree(options, folder / "tree.png")
        bar.update()
        bar.set_description("numbers")
        measured = numbers(options, say)
        bar.update()
    settings = {"version": renderer.VERSION, **options.__dict__}
    text = json.dumps({"settings": settings, "numbers": measured}, indent=1)
    (folder / "numbers.json").write_text(text + "\n")
    width = 6 * (options.size_px + GAP_PX) + GAP_PX
    with Image.open(folder / "tree.png") as drawing:
        rows["Whitted's tree of one pixel"] = [("", drawing.convert("RGB"))]
    board = sheet(rows, width)
    board.save(folder / "gallery.png")
    return folder / "gallery.png", measured


def _kept(path: Path, settings: dict[str, Any], draw: Callable[[], np.ndarray]) -> Image.Image:
    """The picture at path if it was drawn with these settings by this version, else a new one."""
    text = json.dumps({"version": renderer.VERSION, **settings}, sort_keys=True)
    try:
        with Image.open(path) as old:
            if old.info.get("settings") == text:
                return old.convert("RGB")
    except (FileNotFoundError, OSError):
        pass
    image, info = Image.fromarray(draw()), PngInfo()
    info.add_text("settings", text)
    part = path.with_suffix(".part")
    image.save(part, format="PNG", pnginfo=info)
    part.replace(path)
    return image
