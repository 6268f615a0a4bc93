"""The application: the questionnaire and the dashboard over one study folder.

`create_app` and nothing else: everything it puts together has a module of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flask import Flask

    from app.researchers import Doorkeeper
    from app.study import Study

__all__ = ["create_app"]


def create_app(
    study_dir: str | Path | Study,
    database_url: str | None = None,
    *,
    simulated: bool = False,
    enrolments: int = 100,
    trusted_hosts: Sequence[str] = (),
    metrics_token: str | None = None,
    doorkeeper: Doorkeeper | None = None,
    root: str = "",
) -> Flask:
    """Make the WSGI application of the study in `study_dir` (a folder with a manifest.json, or what
    `app.study.Study` made of it).

    database_url: an SQLAlchemy URL; by default study.sqlite3 (or simulated.sqlite3) in the folder.
    simulated: whether the database holds simulated answers. It is recorded in the database at its
        creation, and a database of the other kind is refused.
    enrolments: how many people may begin from one address within ten minutes, in each worker, and
        ten times that from all together; 0 for no limit. Programs have none.
    trusted_hosts: names under which the server is asked; others are refused. Any where empty.
    metrics_token: who shows it may read /metrics; nobody without one.
    doorkeeper: of the accounts of the server; by default those in the study's own database.
    root: what the study's addresses begin with where it is not alone (`app.hosting`).
    """
    from flask import Flask

    from app import dashboard, language, monitoring, questionnaire, researchers, security, web
    from app.dashboard import live
    from app.database import Database
    from app.hosting import Hosted
    from app.simulation import views as simulation
    from app.study import Study

    study = study_dir if isinstance(study_dir, Study) else Study.open(study_dir)
    database = Database.open(
        database_url or study.database_url(simulated), study, simulated=simulated
    )

    app = Flask(
        "app",
        static_folder=str(Path(__file__).parent / "static"),
        template_folder=str(Path(__file__).parent / "templates"),
    )
    app.extensions["study"] = study
    app.extensions["database"] = database
    app.extensions["everybody"] = live.Everybody()
    app.extensions["newcomers"] = (
        security.Limiter(enrolments, 600) if enrolments and not simulated else None
    )
    # guesses, counted for this study in this process
    app.extensions["code_attempts"] = security.Limiter(attempts=10, window_s=300)
    app.extensions["doorkeeper"] = doorkeeper or researchers.Doorkeeper(database)
    app.extensions["hosted"] = (Hosted(study.name, root, app, None),)  # alone, so far
    app.config.update(HOSTS=tuple(trusted_hosts), METRICS_TOKEN=metrics_token)
    security.init(app, root)
    web.init(app)
    language.init(app)
    app.register_blueprint(monitoring.blueprint)
    app.register_blueprint(questionnaire.blueprint)
    app.register_blueprint(researchers.blueprint)
    app.register_blueprint(dashboard.blueprint)
    if simulated:
        app.register_blueprint(simulation.blueprint)
    return app
