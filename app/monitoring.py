"""What whoever runs the server looks at: whether it answers, and numbers for Prometheus."""

from __future__ import annotations

import hmac

from flask import Blueprint, Response, abort, current_app, jsonify, request
from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session

from app import export, recruiting
from app.models import Participant, StudyRecord
from app.web import database, hosted

blueprint = Blueprint("monitoring", __name__)


@blueprint.get("/health")
def health():
    """200 where the databases of all studies answer, 503 where one does not; nothing more."""
    try:
        for one in hosted():
            with one.app.extensions["database"].read() as db:
                db.execute(select(StudyRecord.id)).one()
    except SQLAlchemyError as error:
        current_app.logger.error("the database does not answer: %s", error)
        return jsonify(status="no database"), 503
    return jsonify(status="ok")


@blueprint.get("/metrics")
def metrics():
    """Counts in Prometheus' text format, for who has the token; there are none without one."""
    token, given = current_app.config["METRICS_TOKEN"], request.headers.get("Authorization", "")
    if not token:
        abort(404)
    if not hmac.compare_digest(given.encode(), f"Bearer {token}".encode()):
        abort(401, "Expected the header Authorization: Bearer TOKEN.")
    with database().read() as db:
        record, count = recruiting.record_of(db), counts(db)
        values = {
            "participants_total": ("People who gave consent", count["begun"]),
            "participants_completed": ("Of them, those who finished", count["completed"]),
            "participants_withdrawn": ("Of them, those who withdrew", count["withdrawn"]),
            "answers": ("Answers that count", count["answers"]),
            "places_taken": ("Places of the quota that are taken", recruiting.places(db, record)),
            "quota": ("Complete participants wanted, 0 for any number", record.quota or 0),
            "open": ("Whether everybody can begin", int(record.state == "open")),
        }
    lines = []
    for name, (what, value) in values.items():
        lines += [
            f"# HELP subdermal_{name} {what}.",
            f"# TYPE subdermal_{name} gauge",
            f"subdermal_{name} {value}",
        ]
    return Response("\n".join(lines) + "\n", mimetype="text/plain; version=0.0.4")


def counts(db: Session) -> dict[str, int]:
    """How many people gave consent, and of them how many finished and withdrew; answers that
    count.
    """
    begun = select(
        func.count(),
        func.count(Participant.completed_at),
        func.count(Participant.withdrawn_at),
    ).select_from(Participant)
    names = ("begun", "completed", "withdrawn")
    return dict(zip(names, db.execute(begun).one())) | {"answers": export.count(db)}
