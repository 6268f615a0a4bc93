"""Several studies on one server: where each stands, one sign-in for all.

The first study stands at the server's root, where one alone stands, so that addresses that people
were sent go on working when others are added; every other one stands at /s/NAME/. Each is an
application of its own, with a database, a key and cookies of its own. Accounts are those of the
first study's database.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from werkzeug.middleware.dispatcher import DispatcherMiddleware
from werkzeug.wrappers import Response

from app import create_app
from app.errors import InputError
from app.study import Study

if TYPE_CHECKING:
    from flask import Flask

#: Of a study in its address; that of a study in its manifest is one.
NAME = re.compile(r"[a-z0-9]([a-z0-9_-]*[a-z0-9])?")


@dataclass(frozen=True)
class Hosted:
    """A study of a server: its name there, what its addresses begin with, its application, and
    that of its simulated participants where there are any.
    """

    name: str
    root: str
    app: Flask
    twin: Flask | None


def named(text: str) -> tuple[str | None, str]:
    """NAME=REST taken apart; no name where the text does not begin with one."""
    name, equals, rest = text.partition("=")
    return (name, rest) if equals and NAME.fullmatch(name) else (None, text)


def assemble(
    places: Sequence[tuple[str | None, Path]],
    databases: Mapping[str | None, str],
    *,
    enrolments: int,
    **settings,
) -> tuple[Callable, tuple[Hosted, ...]]:
    """The WSGI application of the studies in folders, each with the name that it is given there or
    its own, and what is hosted.

    databases: URLs by these names, the one of None for a study alone; the others' are in their
    folders.
    """
    studies = [Study.open(place) for _, place in places]
    names = [name or study.name for (name, _), study in zip(places, studies)]
    for k, name in enumerate(names):
        if name in names[:k]:
            both = f"{places[names.index(name)][1]} and {places[k][1]}"
            raise InputError(
                f"two studies are called {name}, {both}; give one another name, such as "
                f"{name}-2={places[k][1]}"
            )
    urls = dict(databases)
    if len(studies) == 1 and None in urls:
        urls = {names[0]: urls[None]}
    if unknown := urls.keys() - set(names):
        raise InputError(
            f"--database {urls[min(unknown, key=str)].split('://')[0]}://...: expected NAME=URL, "
            f"with one of {', '.join(names)}"
        )
    hosted: list[Hosted] = []
    for k, (name, study) in enumerate(zip(names, studies)):
        root = f"/s/{name}" if k else ""
        common = settings | {"doorkeeper": hosted[0].app.extensions["doorkeeper"] if k else None}
        app = create_app(study, urls.get(name), enrolments=enrolments, root=root, **common)
        twin = None
        if (study.directory / "simulated.sqlite3").is_file():
            common["doorkeeper"] = app.extensions["doorkeeper"]  # one sign-in is for both
            twin = create_app(study, simulated=True, root=root, **common)
        hosted.append(Hosted(name, root, app, twin))
    mounts: dict[str, Callable] = {}
    for one in hosted:
        for app in filter(None, (one.app, one.twin)):
            app.extensions["hosted"] = tuple(hosted)
        if one.root:
            mounts[one.root] = one.app
        if one.twin:
            mounts[f"{one.root}/simulated"] = one.twin
    if len(hosted) > 1:
        mounts[f"/s/{names[0]}"] = _at_the_root
    return DispatcherMiddleware(hosted[0].app, mounts) if mounts else hosted[0].app, tuple(hosted)


def _at_the_root(environ: dict, start_response: Callable):
    """Lead from /s/NAME/ of the first study to where it stands; never to another server."""
    place = "/" + quote(environ["PATH_INFO"].encode("latin-1")).lstrip("/")
    if environ["QUERY_STRING"]:
        place += "?" + quote(environ["QUERY_STRING"].encode("latin-1"), safe="%&=+-._~:/?@!$'()*,;")
    return Response(status=308, headers={"Location": place})(environ, start_response)
