"""What every page shares: names for the templates, the images of the study,
friendly error pages.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

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
)
from flask_wtf.csrf import CSRFError
from werkzeug.exceptions import HTTPException

from app.database import Database
from app.study import Study

#: A year: an image's address is the hash of its bytes, so what it names never changes.
IMMUTABLE = "public, max-age=31536000, immutable"

blueprint = Blueprint("web", __name__)


def study() -> Study:
    """The study of the running application."""
    return current_app.extensions["study"]


def database() -> Database:
    """The database of the running application."""
    return current_app.extensions["database"]


def simulated() -> bool:
    """Whether the running application holds simulated answers."""
    return current_app.config["STUDY_KIND"] == "simulated"


def wants_json() -> bool:
    """Whether the page's script asks, and not a form or an address bar."""
    return (
        request.accept_mimetypes.best_match(["text/html", "application/json"]) == "application/json"
    )


def init(app: Flask) -> None:
    app.register_blueprint(blueprint)
    app.register_error_handler(HTTPException, _error_page)
    app.context_processor(lambda: {"study": study().definition, "simulated": simulated()})


@blueprint.get("/images/<sha256>")
def image(sha256: str) -> Response:
    """An image of the study by the hash of its bytes; other bytes are never sent under that
    address.
    """
    found = study().images_by_sha256.get(sha256)
    if found is None:
        abort(404, "This study has no such image.")
    path = found.path.resolve()
    if not path.is_file() or _digest(path, path.stat().st_mtime_ns, path.stat().st_size) != sha256:
        current_app.logger.error("%s was changed or removed after the study was opened", path)
        abort(404, "The file of this image was changed after the study was opened.")
    response = send_file(path, mimetype=found.media_type, etag=sha256)
    response.headers["Cache-Control"] = IMMUTABLE
    return response


@lru_cache(maxsize=1024)
def _digest(path: Path, _mtime_ns: int, _size: int) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@blueprint.get("/study.css")
def style() -> Response:
    """What is shown of each cell's images: the aspect ratio of their region of interest and where
    it lies (the content policy allows no inline styles).
    """
    opened = study()
    rules = []
    for place, cell in enumerate(opened.cells):
        image = opened.image(cell, opened.techniques[0])
        left, top, right, bottom = image.region
        width, height = right - left, bottom - top
        values = {
            "ratio": f"{image.width * width / (image.height * height):.6f}",
            "width": f"{100 / width:.4f}%",
            "left": f"{-100 * left / width:z.4f}%",
            "top": f"{-100 * top / height:z.4f}%",
        }
        listed = " ".join(f"--{name}: {value};" for name, value in values.items())
        rules.append(f'[data-cell="{place}"] {{ {listed} }}\n')
    response = Response("".join(rules), mimetype="text/css")
    response.headers["Cache-Control"] = "no-cache"
    return response


def _error_page(error: HTTPException):
    message = error.description
    if isinstance(error, CSRFError):
        message = (
            "The page was too old, or your browser keeps no cookies. Allow cookies for "
            "this site, reload and try again."
        )
    if wants_json():
        return jsonify(error=message), error.code
    response = error.get_response()
    response.data = render_template("error.html", code=error.code, name=error.name, message=message)
    response.content_type = "text/html; charset=utf-8"
    return response
