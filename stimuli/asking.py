"""What people are asked beside the pairs, and how they take part."""

from dataclasses import dataclass

from stimuli.table import Table


@dataclass(frozen=True)
class Participants:
    """shared_device: several people answer one after the other in one browser, as in a laboratory:
    the last page lets another person begin. Otherwise one browser is for one person.
    """

    shared_device: bool = False


def read_participants(table: Table) -> Participants:
    """The table `[participants]` of a study, checked."""
    participants = Participants(
        shared_device=table.take("shared_device", bool, "true or false", default=False)
    )
    table.end()
    return participants
