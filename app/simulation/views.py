"""The door for simulated participants.

It is built into applications over a simulated database only.
"""

from __future__ import annotations

from flask import Blueprint, abort, jsonify, redirect, render_template, request, session, url_for
from sqlalchemy import func, select

from app import export
from app.models import Participant, Response, StudyRecord
from app.web import database, study

blueprint = Blueprint("simulation", __name__, url_prefix="/simulation")


@blueprint.get("/")
def door():
    """A form that lets in the participant of a given number, new or half-way."""
    return render_template("simulation.html")


@blueprint.get("/status.json")
def status():
    """Which study this is, the seed of its simulation, and how many answers there are."""
    with database().read() as db:
        answers = dict(
            db.execute(
                select(Response.participant_id, func.count()).group_by(Response.participant_id)
            ).all()
        )
        people = db.scalars(select(Participant).order_by(Participant.id))
        return jsonify(
            kind="simulated",
            study=study().name,
            version=study().version,
            answers=export.count(db),
            seed=db.get_one(StudyRecord, 1).simulation_seed,
            participants=[
                {
                    "number": p.id,
                    "answers": answers.get(p.id, 0),
                    "completed": p.completed_at is not None,
                }
                for p in people
            ],
        )


@blueprint.post("/")
def let_in():
    """Take up participant `number` of the simulation with `seed`;
    all of a database have one seed.
    """
    number, seed = request.form.get("number", type=int), request.form.get("seed", type=int)
    if number is None or seed is None:
        abort(400, "Expected the whole numbers number and seed.")
    with database().write() as db:
        record = db.get_one(StudyRecord, 1)
        record.simulation_seed = seed if record.simulation_seed is None else record.simulation_seed
        if record.simulation_seed != seed:
            abort(
                409,
                f"This database was simulated with the seed {record.simulation_seed}, not {seed}.",
            )
        newest = db.scalar(select(func.max(Participant.id))) or 0
        if not 1 <= number <= newest + 1:
            abort(409, f"The next new participant is number {newest + 1}, not {number}.")
    session["visit"] = f"simulated-{number}"
    session.permanent = True
    return redirect(url_for("questionnaire.welcome"), 303)
