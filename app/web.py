"""What every page shares: names for the templates, the images of the study,
friendly error pages.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from typing import TYPE_CHECKING, NoReturn, TypeVar

from flask import (
    Blueprint,
    Flask,
    Response,
    abort,
    current_app,
    jsonify,
    render_template,
    request,
    send_file,
    url_for,
)
from flask_babel import gettext, lazy_gettext
from flask_wtf.csrf import CSRFError
from werkzeug.exceptions import HTTPException

from app import renditions
from app.database import Database
from app.study import Study, box_name
from stimuli.manifest import Image

if TYPE_CHECKING:
    from app.hosting import Hosted

T = TypeVar("T")
#: What the pages' scripts accept, and nothing else; compared before anything is parsed.
JSON = "application/json"

#: A year: an image's address is the hash of its bytes, so what it names never changes.
IMMUTABLE = "public, max-age=31536000, immutable"

#: What a page says of an error that says nothing of its own.
STANDARD = {
    404: lazy_gettext("There is nothing at this address. Please check it."),
    405: lazy_gettext("This address takes no such request."),
    413: lazy_gettext("What was sent is too large."),
}
OTHERWISE = lazy_gettext("The request could not be answered.")

blueprint = Blueprint("web", __name__)


def study() -> Study:
    """The study of the running application."""
    return current_app.extensions["study"]


def database() -> Database:
    """The database of the running application."""
    return current_app.extensions["database"]


def hosted() -> tuple[Hosted, ...]:
    """The studies of the running server, this one among them."""
    return current_app.extensions["hosted"]


def simulated() -> bool:
    """Whether the running application holds simulated answers."""
    return current_app.config["STUDY_KIND"] == "simulated"


def download(body: str | Iterable[str] | Iterable[bytes], name: str) -> Response:
    """A table to be saved under a name."""
    response = Response(body, mimetype="text/csv")
    response.headers["Content-Disposition"] = f'attachment; filename="{name}"'
    return response


def wants_json() -> bool:
    """Whether the page's script asks, and not a form or an address bar."""
    return request.headers.get("Accept") == JSON or (
        request.accept_mimetypes.best_match(["text/html", JSON]) == JSON
    )


def init(app: Flask) -> None:
    app.register_blueprint(blueprint)
    app.register_error_handler(HTTPException, _error_page)
    app.add_template_filter(picture)
    app.add_template_filter(side)
    app.context_processor(lambda: {"simulated": simulated()})


def kept(make: Callable[[], T], *parts: Hashable) -> T:
    """What `make` gives, made once for everybody who asks at this address of the server.
    parts: what it is, and what else it depends on.
    """
    key, made = (request.script_root, *parts), study().made
    if key not in made:
        made[key] = make()
    return made[key]


def picture(image: Image) -> dict[str, str | int]:
    """What a page's script needs to fetch and place an image: the address of its region without
    the width at which it is wanted, and the region's size in image pixels.
    """
    return kept(
        lambda: _picture(image, "web.shown", sha256=image.sha256),
        "picture",
        image.cell,
        image.technique,
    )


def side(image: Image) -> dict[str, str | int]:
    """The same of an image as it stands at one side of a question."""
    boost = study().definition.viewer.boost
    if boost is None:
        return picture(image)
    reference = study().manifest.reference(image.cell)
    place = {"reference": reference.sha256, "amplify": f"{boost.amplify:g}"}
    return kept(
        lambda: _picture(image, "web.boosted", sha256=image.sha256, **place),
        "side",
        image.cell,
        image.technique,
    )


def _picture(image: Image, endpoint: str, **address: str) -> dict[str, str | int]:
    left, top, right, bottom = image.box
    place = url_for(endpoint, **address, box=box_name(image), width=0)
    return {
        "address": place.removesuffix("0"),
        "width": right - left,
        "height": bottom - top,
    }


@blueprint.get("/images/<sha256>")
def image(sha256: str) -> Response:
    """An image of the study by the hash of its bytes; other bytes are never sent under that
    address.
    """
    image_file = study().images_by_sha256.get(sha256)
    if image_file is None:
        abort(404, gettext("This study has no such image."))
    path = image_file.path.resolve()
    try:
        renditions.check(path, sha256)
    except renditions.Changed as error:
        _gone(error)
    response = send_file(path, mimetype=image_file.media_type, etag=sha256)
    response.headers["Cache-Control"] = IMMUTABLE
    return response


@blueprint.get("/images/<sha256>/<box>/<int:width>")
def shown(sha256: str, box: str, width: int) -> Response:
    """The region of interest of an image, `width` pixels wide: what a question shows. Its address
    names the bytes of the image, the region and the size, so that it never changes either.
    """
    image = study().shown.get((sha256, box))
    return _rendition(image and renditions.Rendition(image, width))


@blueprint.get("/images/<sha256>/<reference>/<amplify>/<box>/<int:width>")
def boosted(sha256: str, reference: str, amplify: str, box: str, width: int) -> Response:
    """The same with the difference from a reference amplified, where the study shows that."""
    boost, images = study().definition.viewer.boost, study().boosted.get((sha256, reference, box))
    if boost is None or amplify != f"{boost.amplify:g}":
        images = None
    return _rendition(images and renditions.Rendition(images[0], width, images[1], boost.amplify))


def _rendition(wanted: renditions.Rendition | None) -> Response:
    if wanted is None or not wanted.offered:
        abort(404, gettext("This study has no such image."))
    # named, not by */*: every browser says the latter
    webp = any(kind == renditions.WEBP and q > 0 for kind, q in request.accept_mimetypes)
    try:
        data, kind = renditions.rendition(wanted, study().directory / renditions.FOLDER, webp=webp)
    except renditions.Changed as error:
        _gone(error)
    response = Response(data, mimetype=kind)
    response.headers["Cache-Control"] = IMMUTABLE
    response.headers["Vary"] = "Accept"
    return response


def _gone(error: renditions.Changed) -> NoReturn:
    current_app.logger.error("%s", error)
    abort(404, gettext("The file of this image was changed after the study was opened."))


@blueprint.get("/study.css")
def style() -> Response:
    """What differs from study to study: the grey around the images, and the aspect ratio of each
    cell's region of interest (the content policy allows no inline styles).
    """
    opened, viewer = study(), study().definition.viewer
    rules = [f":root {{ --surround: rgb({viewer.surround} {viewer.surround} {viewer.surround}); "]
    rules.append(f"--on-surround: {viewer.ink}; }}\n.pair {{ --gap: {viewer.gap}px; }}\n")
    for place, cell in enumerate(opened.cells):
        left, top, right, bottom = opened.image(cell, opened.techniques[0]).box
        ratio = (right - left) / (bottom - top)
        rules.append(f'[data-cell="{place}"] {{ --ratio: {ratio:.6f}; }}\n')
    response = Response("".join(rules), mimetype="text/css")
    response.headers["Cache-Control"] = "no-cache"
    return response


def _error_page(error: HTTPException):
    # what werkzeug says by itself is in English
    standard = error.description == type(error).description
    message = str(STANDARD.get(error.code, OTHERWISE)) if standard else error.description
    if isinstance(error, CSRFError):
        message = gettext(
            "The page was too old, or your browser keeps no cookies. Allow cookies for this site, "
            "reload and try again."
        )
    if wants_json():
        return jsonify(error=message, lost=isinstance(error, CSRFError)), error.code
    response = error.get_response()
    response.data = render_template("error.html", code=error.code, name=error.name, message=message)
    response.content_type = "text/html; charset=utf-8"
    return response
