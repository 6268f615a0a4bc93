"""How a pair is looked at: `[viewer]` of a study."""

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
    """

    display: str = ONE_TO_ONE
    modes: tuple[str, ...] = MODES
    surround: int = 108
    zoom: int = 8
    scripts: str = OPTIONAL
    gap: int = 8
    reference: str = ""
    boost: Boost | None = None

    @property
    def triplet(self) -> bool:
        """Whether a reference stands between the two images."""
        return self.modes[0] in (TRIPLET, BOOSTED)

    @property
    def ink(self) -> str:
        """The colour of text on the surround: black or white, at least 4.5:1 (WCAG 1.4.3)."""
        return "#fff" if self.surround < 118 else "#000"

    def record(self) -> dict:
        record = {**vars(self), "modes": list(self.modes), "boost": self.boost and vars(self.boost)}
        return {key: value for key, value in record.items() if key not in _OF_TRIPLETS or value}


_OF_TRIPLETS = ("reference", "boost")


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
    )
    table.end()
    return viewer


def _boost(table: Table) -> Boost:
    def number(key: str, low: float, high: float, default: float) -> float:
        return float(
            table.take(
                key,
                (int, float),
                f"a number from {low} to {high}",
                lambda value: type(value) is not bool and low <= value <= high,
                default=default,
            )
        )

    boost = Boost(
        zoom=table.number("zoom", 1, 16, default=Boost.zoom),
        amplify=number("amplify", 1, 16, Boost.amplify),
        flicker_hz=number("flicker_hz", 0, 30, Boost.flicker_hz),
    )
    table.end()
    return boost
