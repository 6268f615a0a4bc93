"""Which list of questions a participant gets: the first that nobody has who counts or is at it.
Lists are drawn from the study's seed, written down, then obeyed.
"""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING

from sqlalchemy import select
from sqlalchemy.orm import Session

from app import recruiting
from app.models import Participant, StudyRecord, Trial

if TYPE_CHECKING:
    from app.study import Study


def assign(session: Session, study: Study, record: StudyRecord, participant: Participant) -> None:
    """Give a new participant a list and its questions. `record` must be locked, so that no list is
    given twice.

    A list whose holder withdrew, was excluded or has gone away unfinished is given anew, so that
    the lists that are answered are the first ones of the design, which is balanced as far as it
    goes. Who tries the study out has lists apart from the others.
    """
    from stimuli.design import trials

    holders = select(Participant.list_number).where(
        Participant.pilot.is_(participant.pilot),
        Participant.list_number.is_not(None),
        Participant.withdrawn_at.is_(None),
        Participant.excluded_at.is_(None),
        recruiting.finished_or_at_it(record),
    )
    held = set(session.scalars(holders))
    number = next(number for number in count(1) if number not in held)
    participant.list_number = number
    definition = study.definition
    session.add_all(
        Trial(
            participant_id=participant.id,
            order=trial.order,
            cell=trial.cell,
            left=trial.left,
            right=trial.right,
            kind=trial.kind,
            seed=f"{study.seed}/list {number}",
        )
        for trial in trials(
            study.cells,
            study.techniques,
            study.seed,
            number,
            definition.quality,
            definition.assignment.pairs,
        )
    )
