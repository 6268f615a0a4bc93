"""How a pair is looked at: `[viewer]` of a study."""

from dataclasses import dataclass

from stimuli.table import Table

#: Image pixels as screen pixels, or resampled once to the room of the window.
ONE_TO_ONE, FIT = "1:1", "fit"
#: Side by side (or one above the other, whichever shows more); in one place, swapped while a key or
#: a finger is held; in one place with a divider that is moved.
MODES = ("beside", "flicker", "wipe")
OPTIONAL, REQUIRED = "optional", "required"


@dataclass(frozen=True)
class Viewer:
    """What a study allows of the pair viewer.

    display     "1:1": one image pixel is one screen pixel (a window smaller than the region of
                interest shows a part of it, which can be moved); "fit": the region is resampled to
                the window
    modes       those of `MODES` that are allowed, in the order of their buttons; each question
                begins with the first
    surround    sRGB grey around the images, 0 to 255; ITU-R BT.500 asks for about 15 % of the
                white's luminance, which is 108
    zoom        largest number of screen pixels an image pixel is magnified to, 1 to 16; 1: none
    scripts     "optional": without JavaScript the pair stands side by side, scaled by the browser,
                and the answer is marked; "required": such a browser is told so and asked nothing
    """

    display: str = ONE_TO_ONE
    modes: tuple[str, ...] = MODES
    surround: int = 108
    zoom: int = 8
    scripts: str = OPTIONAL

    @property
    def ink(self) -> str:
        """The colour of text on the surround: black or white, at least 4.5:1 (WCAG 1.4.3)."""
        return "#fff" if self.surround < 118 else "#000"

    def record(self) -> dict:
        return {**vars(self), "modes": list(self.modes)}


def read_viewer(table: Table, display: str = ONE_TO_ONE) -> Viewer:
    """The viewer of a study's table, checked; `display` where it says nothing of it."""

    def allowed(value: list) -> bool:
        return bool(value) and all(mode in MODES for mode in value) and len({*value}) == len(value)

    viewer = Viewer(
        display=table.one_of("display", (ONE_TO_ONE, FIT), default=display),
        modes=tuple(
            table.take(
                "modes", list, f"a list of some of {', '.join(MODES)}", allowed, default=list(MODES)
            )
        ),
        surround=table.number("surround", 0, 255, default=108),
        zoom=table.number("zoom", 1, 16, default=8),
        scripts=table.one_of("scripts", (OPTIONAL, REQUIRED), default=OPTIONAL),
    )
    table.end()
    return viewer
