"""A participant without a body: reads the pages of the questionnaire and sends their forms, as a
browser would.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from html.parser import HTMLParser
from typing import Any
from urllib.parse import urljoin

import httpx

from app.errors import InputError
from app.plates import plates
from app.simulation.people import Crowd
from app.study import Study

TIMEOUT_S = 60
#: What a browser on a 1920 x 1080 screen would report.
WINDOW = {
    "viewport_width": 1920,
    "viewport_height": 963,
    "device_pixel_ratio": 1,
    "shown_width": 955.5,
    "shown_height": 537.47,
    "view": "beside",
}
#: Of a 24-inch screen at 1920 x 1080, with the greys of sRGB; `anyway`: whatever is asked for.
SCREEN = {
    "window_width": 1920,
    "window_height": 963,
    "device_pixel_ratio": 1,
    "zoom": 1,
    "screen_width": 1920,
    "screen_height": 1080,
    "card_width": 309.5,
    "grey": 186,
    "dark_steps": 4,
    "bright_steps": 4,
    "anyway": "yes",
}


@dataclass
class Form:
    """A form of a page: where it goes and its named fields with their values."""

    action: str
    fields: dict[str, str] = field(default_factory=dict)


class _Parser(HTMLParser):
    """Collects the forms of a page, as a browser would send them before anything is chosen."""

    def __init__(self):
        super().__init__()
        self.forms: list[Form] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        if tag == "form":
            self.forms.append(Form(attributes.get("action") or ""))
        elif tag == "input" and self.forms and attributes.get("name"):
            chosen = attributes.get("type") not in ("radio", "checkbox") or "checked" in attributes
            self.forms[-1].fields.setdefault(
                attributes["name"], (attributes.get("value") or "") if chosen else ""
            )


def forms(html: str) -> list[Form]:
    """Every form of a page."""
    parser = _Parser()
    parser.feed(html)
    return parser.forms


class Visitor:
    """Simulated participants at one address, one after the other."""

    def __init__(self, url: str, study: Study, crowd: Crowd, seed: int):
        self._base = url.rstrip("/") + "/"
        self._study, self._crowd, self._seed = study, crowd, seed

    def status(self) -> dict[str, Any]:
        """What the server says of its simulation; refused unless it is one, of this study and
        seed.
        """
        address = urljoin(self._base, "simulation/status.json")
        try:
            answer = httpx.get(address, timeout=TIMEOUT_S)
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            raise InputError(
                f"--url {self._base}: no answer ({error or type(error).__name__})"
            ) from None
        try:
            status = answer.json() if answer.status_code == 200 else {}
        except ValueError:
            status = {}
        if status.get("kind") != "simulated":
            raise InputError(
                f"--url {self._base}: expected a simulated study, and real databases take no "
                "simulated participants"
            )
        if (status["study"], status["version"]) != (self._study.name, self._study.version):
            raise InputError(
                f"--url {self._base}: serves {status['study']} version {status['version']}, "
                f"expected {self._study.name} version {self._study.version}"
            )
        if status["seed"] not in (None, self._seed):
            raise InputError(
                f"--seed {self._seed}: these participants were begun with the seed "
                f"{status['seed']}; go on with it"
            )
        return status

    def take_part(self, number: int) -> Iterator[int]:
        """Answer every question that participant `number` has not answered yet; yields each one's
        order.
        """
        with httpx.Client(follow_redirects=True, timeout=TIMEOUT_S) as http:
            page = self._get(http, "simulation/")
            page = self._send(http, page, "seed", number=number, seed=self._seed)
            if form := _find(page, "consent"):
                page = self._send(http, page, "consent", consent="yes")
            elif not str(page.url).endswith("/thanks"):
                page = self._get(http, "question")  # half-way: the page that is due
            if form := _find(page, "familiarity"):
                page = self._send(
                    http, page, "familiarity", familiarity=self._crowd.familiarity(number)
                )
            page = self._between(http, page, number)
            order = self._answered(number)
            while form := _find(page, "trial"):
                order += 1
                cell, left, right = self._seen(form)
                answer, rt_ms = self._crowd.answer(number, order, cell, left, right)
                # of a scale without it, 'no difference' goes to either side
                answer = min(
                    self._study.definition.scale,
                    key=lambda p: (abs(p.counts - answer), (p.value < 0) == (rt_ms % 2 == 0)),
                ).value
                page = self._send(http, page, "trial", answer=answer, rt_ms=rt_ms, **WINDOW)
                page = self._between(http, page, number)
                yield order
            if 'id="completion-code"' not in page.text:
                raise RuntimeError(f"participant {number} got no completion code at {page.url}")

    def _plates(self) -> dict[str, str]:
        """What is on the study's colour plates: programs see all colours."""
        shown = plates(self._study.seed, self._study.definition.screen.plates)
        return {f"plate_{k}": plate.digit for k, plate in enumerate(shown, 1)}

    def _between(self, http: httpx.Client, page: httpx.Response, number: int) -> httpx.Response:
        """Answer the study's own questions and go on from instructions and rests."""
        asks = {
            ask.name: ask for ask in (*self._study.definition.before, *self._study.definition.after)
        }
        while True:
            if form := _find(page, "rested"):
                page = self._get(http, f"question?rested={form.fields['rested']}")
            elif form := _find(page, "window_width"):
                page = self._send(http, page, "window_width", **SCREEN, **self._plates())
            elif form := _find(page, "stated"):
                filled = {
                    name: self._crowd.statement(number, asks[name])
                    for name in form.fields
                    if name in asks
                } | {
                    name: self._crowd.statement(number, ask)
                    for name, ask in asks.items()
                    if ask.kind == "text" and f'name="{name}"' in page.text
                }
                page = self._send(http, page, "stated", **filled)
            else:
                return page

    def _answered(self, number: int) -> int:
        return next(
            (p["answers"] for p in self.status()["participants"] if p["number"] == number), 0
        )

    def _seen(self, form: Form) -> tuple[str, str, str]:
        """Cell, left and right technique.

        The page names neither (people must not know): the hashes tell.
        """
        left, right = (
            {
                image.cell: image.technique
                for image in self._study.manifest.images
                if image.sha256 == form.fields[name]
            }
            for name in ("image_left", "image_right")
        )
        cell = next(cell for cell in left if cell in right)  # one image may serve several cells
        return cell, left[cell], right[cell]

    def _get(self, http: httpx.Client, path: str) -> httpx.Response:
        return _checked(http.get(urljoin(self._base, path)))

    def _send(
        self, http: httpx.Client, page: httpx.Response, name: str, **filled: Any
    ) -> httpx.Response:
        """Fill in the form that has a field of that name, and send it."""
        form = _find(page, name)
        if form is None:
            raise RuntimeError(f"{page.url} has no form with the field {name}")
        data = form.fields | {key: str(value) for key, value in filled.items()}
        return _checked(http.post(urljoin(str(page.url), form.action), data=data))


def _find(page: httpx.Response, name: str) -> Form | None:
    return next((form for form in forms(page.text) if name in form.fields), None)


def _checked(page: httpx.Response) -> httpx.Response:
    if page.status_code != 200:
        raise RuntimeError(f"{page.url} answered {page.status_code}")
    return page
