"""Which questions a participant gets. Dealt: the first list that nobody has who counts or is at it.
Adaptive: the pairs that tell most, given all answers so far. Either is drawn from the study's seed,
written down, then obeyed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from itertools import combinations, count
from typing import TYPE_CHECKING

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from app import recruiting
from app.models import Participant, Response, StudyRecord, Trial
from stimuli.asking import ADAPTIVE

if TYPE_CHECKING:
    from app.study import Study
    from stimuli.design import Trial as Planned


def assign(session: Session, study: Study, record: StudyRecord, participant: Participant) -> None:
    """Give a new participant their questions. `record` must be locked, so that no list is given
    twice.
    """
    from stimuli.design import adaptive_trials, dealt_beside, trials

    definition = study.definition
    design = definition.assignment
    if design.design == ADAPTIVE and not dealt_beside(study.seed, participant.id, design.beside):
        from analysis.adaptive import written

        state = asked_so_far(session, study, record, participant)
        participant.design_state = written(state)
        digest = hashlib.sha256(participant.design_state.encode()).hexdigest()[:12]
        planned = adaptive_trials(
            study.cells,
            study.techniques,
            study.seed,
            participant.id,
            definition.quality,
            design,
            state,
        )
        _write(session, participant, planned, f"{study.seed}/adaptive {participant.id} {digest}")
        return
    number = _next_list(session, record, participant)
    participant.list_number = number
    planned = trials(
        study.cells, study.techniques, study.seed, number, definition.quality, design.pairs
    )
    _write(session, participant, planned, f"{study.seed}/list {number}")


def _next_list(session: Session, record: StudyRecord, participant: Participant) -> int:
    """A list whose holder withdrew, was excluded or has gone away unfinished is given anew, so that
    the lists that are answered are the first ones of the design, which is balanced as far as it
    goes. Who tries the study out has lists apart from the others.
    """
    holders = select(Participant.list_number).where(
        Participant.pilot.is_(participant.pilot),
        Participant.list_number.is_not(None),
        Participant.withdrawn_at.is_(None),
        Participant.excluded_at.is_(None),
        recruiting.finished_or_at_it(record),
    )
    held = set(session.scalars(holders))
    return next(number for number in count(1) if number not in held)


def asked_so_far(
    session: Session, study: Study, record: StudyRecord, participant: Participant
) -> dict[str, list[list[int]]]:
    """`analysis.adaptive.State` of the others who count: what was answered, and what those who are
    at it will still be asked. Who tries the study out has a state apart.
    """
    from analysis.adaptive import nothing

    state = nothing(study.cells, study.techniques)
    place = {pair: k for k, pair in enumerate(combinations(study.techniques, 2))}
    query = (
        select(Trial.cell, Trial.left, Trial.right, Response.answer, func.count())
        .join(Participant, Trial.participant_id == Participant.id)
        .outerjoin(Response, Response.trial_id == Trial.id)
        .where(
            Trial.kind == "main",
            Participant.id != participant.id,
            Participant.pilot.is_(participant.pilot),
            Participant.withdrawn_at.is_(None),
            Participant.excluded_at.is_(None),
            or_(Response.id.is_not(None), recruiting.finished_or_at_it(record)),
        )
        .group_by(Trial.cell, Trial.left, Trial.right, Response.answer)
    )
    for cell, left, right, answer, times in session.execute(query):
        first_left = (left, right) in place
        row = state[cell][place[(left, right) if first_left else (right, left)]]
        row[0 if first_left else 1] += times
        if answer is not None:
            preferred_first = (answer < 0) == first_left
            row[4 if not answer else 2 if preferred_first else 3] += times
    return state


def _write(
    session: Session, participant: Participant, planned: Iterable[Planned], seed: str
) -> None:
    session.add_all(
        Trial(
            participant_id=participant.id,
            order=trial.order,
            cell=trial.cell,
            left=trial.left,
            right=trial.right,
            kind=trial.kind,
            seed=seed,
        )
        for trial in planned
    )
