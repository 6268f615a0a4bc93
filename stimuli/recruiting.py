"""Where participants come from, and where they go back to: `[recruiting]` of a study."""

import re
from dataclasses import dataclass
from urllib.parse import quote, urlsplit

from stimuli.table import Table

#: What the links of the usual panels carry, who the person is first.
PANELS = {
    "prolific": ("PROLIFIC_PID", "STUDY_ID", "SESSION_ID"),
    "mturk": ("workerId", "assignmentId", "hitId"),
    "sona": ("id",),
    "none": (),
}
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,39}")


@dataclass(frozen=True)
class Recruiting:
    """What is taken from a recruiter's link; without `[recruiting]` nothing is.

    panel       one of `PANELS`, whose parameters are taken
    parameters  those that the link carries and that are stored; the first says who the person is,
                who takes part once
    required    whether who comes without them is sent away
    completed, turned_away
                where to go back to from the last page, and from a study that takes nobody now: an
                address, in which {NAME} stands for a parameter and {code} for the completion code;
                '' for nowhere
    """

    panel: str = "none"
    parameters: tuple[str, ...] = ()
    required: bool = False
    completed: str = ""
    turned_away: str = ""

    def record(self) -> dict:
        return {**vars(self), "parameters": list(self.parameters)}

    def back(self, address: str, values: dict[str, str]) -> str:
        """An address with the values filled in; '' where one is not known."""
        for name in re.findall(r"{([^{}]*)}", address):
            if name not in values:
                return ""
            address = address.replace(f"{{{name}}}", quote(values[name], safe=""))
        return address


def read_recruiting(table: Table) -> Recruiting:
    """Recruiting as a study declares it, checked."""
    panel = table.one_of("panel", PANELS, default="none")

    def names(value: list) -> bool:
        return all(isinstance(one, str) and _NAME.fullmatch(one) for one in value)

    listed = table.take(
        "parameters",
        list,
        "a list of names such as PROLIFIC_PID",
        lambda value: names(value) and len({*value}) == len(value) <= 10,
        default=list(PANELS[panel]),
    )
    known = {*listed, "code"}

    def address(value: str) -> bool:
        where = urlsplit(value)
        named = set(re.findall(r"{([^{}]*)}", value))
        return not value or (where.scheme == "https" and bool(where.netloc) and named <= known)

    expected = f"an https address, with no other than {', '.join(sorted(known))} in braces"
    recruiting = Recruiting(
        panel=panel,
        parameters=tuple(listed),
        required=table.take("required", bool, "true or false", default=False),
        completed=table.take("completed", str, expected, address, default=""),
        turned_away=table.take("turned_away", str, expected, address, default=""),
    )
    if "{code}" in recruiting.turned_away:
        raise table.fault("turned_away", recruiting.turned_away, "no {code}: there is none yet")
    if recruiting.required and not listed:
        raise table.fault("required", True, "parameters that can be required")
    table.end()
    return recruiting
