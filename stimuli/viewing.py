"""How a pair is looked at: `[viewer]` of a study."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from stimuli.table import Table

#: Image pixels as screen pixels, or resampled once to the room of the window.
ONE_TO_ONE, FIT = "1:1", "fit"
#: Side by side (or one above the other, whichever shows more); in one place, swapped while a key or
#: a finger is held; in one place with a divider that is moved.
MODES = ("beside", "flicker", "wipe")
#: With a reference between the two, as in ISO/IEC 29170-3 (JPEG AIC-3); each a study's only mode.
TRIPLET, BOOSTED = "triplet", "boosted"
VIEWS = (*MODES, TRIPLET, BOOSTED)
#: What `reference` says where each cell has a file of its own for it.
FILES = "files"
OPTIONAL, REQUIRED = "optional", "required"


@dataclass(frozen=True)
class Boost:
    """How differences from the reference are made easier to see (Men et al. 2021, Subjective image
    quality assessment with boosted triplet comparisons, doi:10.1109/ACCESS.2021.3118295).

    zoom        screen pixels an image pixel, 1 to 16
    amplify     what the difference from the reference is multiplied by, in sRGB values, 1 to 16
    flicker_hz  how often a second each of both takes turns with the reference; 0: not at all
    """

    zoom: int = 2
    amplify: float = 2.0
    flicker_hz: float = 4.0


@dataclass(frozen=True)
class Screen:
    """The screen that people are thought to look at, for predictions of what they can tell apart:
    ColorVideoVDP's standard_fhd unless a study says otherwise. Nothing is sent to the page.

    width, height  pixels of it; a device pixel is one of them
    page_px        of its height, what the browser's bars, the page's header, one caption and the
                   answers take
    diagonal_in    inches; distance_mm: of the eyes
    luminance      cd/m2 of white; contrast: to black; ambient_lux: light that falls on it
    """

    width: int = 1920
    height: int = 1080
    page_px: int = 270
    diagonal_in: float = 24.0
    distance_mm: float = 600.0
    luminance: float = 200.0
    contrast: float = 1000.0
    ambient_lux: float = 250.0

    @property
    def pixels_per_degree(self) -> float:
        """In the middle of the screen."""
        pitch_mm = 25.4 * self.diagonal_in / math.hypot(self.width, self.height)
        return 2 * self.distance_mm * math.tan(math.radians(0.5)) / pitch_mm


@dataclass(frozen=True)
class Viewer:
    """What a study allows of the pair viewer.

    display     "1:1": one image pixel is one screen pixel (a window smaller than the region of
                interest shows a part of it, which can be moved); "fit": the region is resampled to
                the window
    modes       those of `MODES` that are allowed, in the order of their buttons; each question
                begins with the first; or "triplet" or "boosted" alone: both images with the
                reference between them, as they are or boosted
    surround    sRGB grey around the images, 0 to 255; ITU-R BT.500 asks for about 15 % of the
                white's luminance, which is 108
    zoom        largest number of screen pixels an image pixel is magnified to, 1 to 16; 1: none
    scripts     "optional": without JavaScript the pair stands side by side, scaled by the browser,
                and the answer is marked; "required": such a browser is told so and asked nothing;
                boosted triplets require them
    gap         between images that stand beside each other, CSS pixels
    reference   of triplets: the name of a condition, or "files": `references` of the manifest
    boost       of boosted triplets
    screen      what people are thought to look at; None: as `Screen` has it
    """

    display: str = ONE_TO_ONE
    modes: tuple[str, ...] = MODES
    surround: int = 108
    zoom: int = 8
    scripts: str = OPTIONAL
    gap: int = 8
    reference: str = ""
    boost: Boost | None = None
    screen: Screen | None = None

    @property
    def triplet(self) -> bool:
        """Whether a reference stands between the two images."""
        return self.modes[0] in (TRIPLET, BOOSTED)

    @property
    def ink(self) -> str:
        """The colour of text on the surround: black or white, at least 4.5:1 (WCAG 1.4.3)."""
        return "#fff" if self.surround < 118 else "#000"

    def record(self) -> dict:
        tables = {key: (one := getattr(self, key)) and vars(one) for key in ("boost", "screen")}
        record = {**vars(self), "modes": list(self.modes), **tables}
        return {key: value for key, value in record.items() if key not in _SELDOM or value}


_SELDOM = ("reference", "boost", "screen")


def read_viewer(
    table: Table, display: str = ONE_TO_ONE, conditions: Sequence[str] = (), rendered: bool = False
) -> Viewer:
    """The viewer of a study's table, checked; `display` where it says nothing of it. conditions:
    the names that a reference can have; rendered: images come from the renderer, files do not.
    """

    def allowed(value: list) -> bool:
        known = all(mode in MODES for mode in value) and len({*value}) == len(value)
        return value in ([TRIPLET], [BOOSTED]) or (bool(value) and known)

    modes = tuple(
        table.take(
            "modes",
            list,
            f"a list of some of {', '.join(MODES)}, or {TRIPLET} or {BOOSTED} alone",
            allowed,
            default=list(MODES),
        )
    )
    boosted = modes == (BOOSTED,)
    reference, boost = "", None
    if modes[0] in (TRIPLET, BOOSTED):
        reference = table.one_of("reference", [*conditions, *([] if rendered else [FILES])])
    if boosted:
        boost = _boost(table.table("boost", default={}))
    scripts = (REQUIRED,) if boosted else (OPTIONAL, REQUIRED)
    viewer = Viewer(
        display=table.one_of(
            "display",
            (ONE_TO_ONE,) if boosted else (ONE_TO_ONE, FIT),
            default=ONE_TO_ONE if boosted else display,
        ),
        modes=modes,
        surround=table.number("surround", 0, 255, default=108),
        zoom=table.number("zoom", 1, 1 if boosted else 16, default=1 if boosted else 8),
        scripts=table.one_of("scripts", scripts, default=scripts[0]),
        gap=table.number("gap", 0, 400, default=Viewer.gap),
        reference=reference,
        boost=boost,
        screen=_screen(table.table("screen")) if "screen" in table.value else None,
    )
    table.end()
    return viewer


def shown_size(viewer: Viewer, screen: Screen, box: tuple[int, int], zoom: int = 0) -> Shown:
    """How the page shows a box (width, height) of an image when a question begins, as
    app/static/geometry.js places it in the room of a screen; zoom: screen pixels an image pixel
    instead, 0: as the study has it.
    """
    down, gap = screen.height - screen.page_px, viewer.gap
    abreast = {"beside": 2, TRIPLET: 3, BOOSTED: 3}.get(viewer.modes[0], 1)
    rooms = [((screen.width - (abreast - 1) * gap) // abreast, down)]
    if abreast > 1:
        rooms.append((screen.width, (down + CAPTION_PX) // abreast - CAPTION_PX))
    scale = zoom or (viewer.boost.zoom if viewer.boost else 1)
    if viewer.display == FIT and not zoom and not viewer.boost:
        sizes = [_fitted(box, *room) for room in rooms]
        width, height = max(sizes, key=lambda size: size[0] * size[1])
        return Shown(width, height, width / box[0], True)
    sizes = [tuple(map(min, (scale * side for side in box), room)) for room in rooms]
    width, height = max(sizes, key=lambda size: size[0] * size[1])
    return Shown(width, height, float(scale), False)


@dataclass(frozen=True)
class Shown:
    """width, height: of the frame, screen pixels; scale: of those, an image pixel; fitted: the
    whole box is resampled to it, else the box's middle is cut to it.
    """

    width: int
    height: int
    scale: float
    fitted: bool


CAPTION_PX = 26  # above each image, app/static/style.css: 1.6 rem
STEP_PX = 16  # widths to which the server resamples, app/renditions.py


def _fitted(box: tuple[int, int], across: int, down: int) -> tuple[int, int]:
    width = STEP_PX * int(min(across, down * box[0] / box[1], 4 * box[0]) // STEP_PX)
    while width > STEP_PX and _height(box, width) > down:
        width -= STEP_PX
    width = max(STEP_PX, width)
    return width, _height(box, width)


def _height(box: tuple[int, int], width: int) -> int:
    return max(1, (2 * width * box[1] + box[0]) // (2 * box[0]))


def _screen(table: Table) -> Screen:
    """[viewer.screen], checked."""
    limits = {
        "width": (64, 16384),
        "height": (64, 16384),
        "page_px": (0, 4096),
        "diagonal_in": (1.0, 200.0),
        "distance_mm": (50.0, 20000.0),
        "luminance": (1.0, 10000.0),
        "contrast": (2.0, 1e7),
        "ambient_lux": (0.0, 1e5),
    }
    values = {
        key: table.number(key, low, high, default=getattr(Screen, key))
        if isinstance(low, int)
        else _real(table, key, low, high, getattr(Screen, key))
        for key, (low, high) in limits.items()
    }
    screen = Screen(**values)
    if screen.page_px >= screen.height - STEP_PX:
        raise table.fault("page_px", screen.page_px, f"less than the height, {screen.height}")
    table.end()
    return screen


def _real(table: Table, key: str, low: float, high: float, default: float) -> float:
    return float(
        table.take(
            key,
            (int, float),
            f"a number from {low:g} to {high:g}",
            lambda value: type(value) is not bool and low <= value <= high,
            default=default,
        )
    )


def _boost(table: Table) -> Boost:
    boost = Boost(
        zoom=table.number("zoom", 1, 16, default=Boost.zoom),
        amplify=_real(table, "amplify", 1, 16, Boost.amplify),
        flicker_hz=_real(table, "flicker_hz", 0, 30, Boost.flicker_hz),
    )
    table.end()
    return boost
