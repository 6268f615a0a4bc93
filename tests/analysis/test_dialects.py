"""Tables as spreadsheets save them: what is detected, what is said, what stays missing."""

import pytest

from analysis import read_responses
from analysis.report import report_responses

HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
ROWS = [
    'J\N{LATIN SMALL LETTER E WITH ACUTE},3,close-up,a,b,-2,1,"1500,5",04.03.2024 09:15',
    "P2,2,close-up,b,a,1,2,900,05.03.2024",
    "P3,5,close-up,a,b,0,3,1200,2024-03-06T10:00:00Z",
]


def german(text):
    """As Excel saves it in German: semicolons, and no quotation marks that it does not need."""
    return text.replace('"1500,5"', "1500#5").replace(",", ";").replace("1500#5", "1500,5")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("hint", ["", "sep=;\r\n"])
def test_a_spreadsheets_table_is_read_and_said(tmp_path, encoding, separator, hint):
    text = "\r\n".join([HEADER, *ROWS]) + "\r\n"
    if separator != ",":
        text = german(text).replace(";", separator)
    path = tmp_path / "responses.csv"
    path.write_bytes(((hint if separator == ";" else "") + text).encode(encoding))
    responses = read_responses(path)
    frame = responses.frame
    assert frame.participant[0] == "J\N{LATIN SMALL LETTER E WITH ACUTE}"
    assert list(frame.answer) == [-2, 1, 0] and list(frame.rt_ms) == [1500.5, 900, 1200]
    assert [f"{time:%d %H:%M}" for time in frame.started_at] == ["04 09:15", "05 00:00", "06 10:00"]
    assert not responses.findings and not responses.missing
    notes = " ".join(responses.notes)
    assert "decimal commas" in notes and "day first" in notes
    assert ("semicolons" in notes) == (separator == ";")
    assert ("Windows-1252" in notes) == (encoding == "cp1252")


def test_what_has_two_readings_is_missing(write):
    """1,500 may be a thousand and a half or one and a half: nobody guesses."""
    rows = ['P1,3,close-up,a,b,-2,1,"1,500",2024', 'P2,3,close-up,a,b,-2,1,"2,250",2024']
    responses = read_responses(write(rows))
    assert responses.frame.rt_ms.isna().all() and len(responses.missing) == 2
    sure = read_responses(write([*rows, 'P3,3,close-up,a,b,-2,1,"1500,25",2024']))
    assert list(sure.frame.rt_ms) == [1.5, 2.25, 1500.25]


def test_a_report_says_what_was_missing_and_why(write, undrawn):
    rows = [
        f"P{k},{k},close-up,a,b,{k % 5 - 2},1,{'1,5' if k == 3 else 1500},2024-05-01".replace(
            "1,5,", '"1,500",'
        )
        for k in range(12)
    ] + ["P0,1,close-up,a,b,9,2,1,2024-05-01", "P0,1,close-up,a,b,1,2,1,2024-05-01"]
    files = report_responses(read_responses(write(rows)))
    methods = files["methods.md"].decode()
    assert "2 rows of the table could not be used (1: answer is not an integer" in methods
    assert "1: the person had answered that question already)" in methods
    assert "familiarity in 1 answer (not a whole number from 0 to 10)" in methods
    tex = files["report.tex"].decode()
    assert "Rows that are not counted: 2 of 14" in tex and "Values that are missing" in tex
    assert files["tables/missing_values.csv"].decode().splitlines()[1].startswith("5,rt_ms,")
    assert "see below" not in files["report.html"].decode()
