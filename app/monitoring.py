"""What whoever runs the server looks at: whether it answers, and numbers for Prometheus."""

from __future__ import annotations

import hmac

from flask import Blueprint, Response, abort, current_app, jsonify, request
from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError

from app import export, recruiting
from app.models import Participant, StudyRecord
from app.web import database

blueprint = Blueprint("monitoring", __name__)


@blueprint.get("/health")
def health():
    """200 where the database answers, 503 where it does not; nothing about the study."""
    try:
        with database().read() as db:
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
        record = recruiting.record_of(db)
        values = {
            "participants_total": ("People who gave consent", _people(db)),
            "participants_completed": (
                "Of them, those who finished",
                _people(db, Participant.completed_at.is_not(None)),
            ),
            "participants_withdrawn": (
                "Of them, those who withdrew",
                _people(db, Participant.withdrawn_at.is_not(None)),
            ),
            "answers": ("Answers that count", export.count(db)),
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


def _people(db, *which) -> int:
    return db.scalar(select(func.count()).select_from(Participant).where(*which))
