"""What the verbs over a study's database share: where the study is, where its answers are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from app.database import Database
    from app.study import Study

directory_argument = click.argument(
    "directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path)
)
database_option = click.option(
    "--database",
    metavar="URL",
    help="Database of the answers, as an SQLAlchemy URL. Without it DIR/study.sqlite3.",
)


def opened(directory: Path, database: str | None) -> tuple[Study, Database]:
    """The study in a folder and its answers, which may be served meanwhile."""
    from app.database import Database
    from app.study import Study

    study = Study.open(directory)
    url = database or study.database_url(False)
    return study, Database.open(url, study, simulated=False)
