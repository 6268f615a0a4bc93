"""Which participant sees what, in which order and on which side: drawn from the seed, written down,
then obeyed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.models import Participant, Trial

if TYPE_CHECKING:
    from app.study import Study


def assign(study: Study, participant: Participant) -> list[Trial]:
    """The questions of a participant whose number is known; the same number and seed give the same
    list.
    """
    from stimuli.design import trials

    return [
        Trial(
            participant_id=participant.id,
            order=trial.order,
            cell=trial.cell,
            left=trial.left,
            right=trial.right,
            kind=trial.kind,
            seed=f"{study.seed}/{participant.id}",
        )
        for trial in trials(
            study.cells,
            study.techniques,
            study.seed,
            participant.id,
            study.definition.quality,
        )
    ]
