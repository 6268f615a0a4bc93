"""Reading a table: what is kept, what is reported,
what is refused. Nothing is dropped in silence.
"""

import json

import numpy as np
import pytest

from analysis import InputError, read_manifest, read_responses, responses_from_records

HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
GOOD = "P1,3,close-up,golubev,none,-2,1,1500,2024-05-01T09:00:00Z"


def one_line(error):
    text = str(error.value)
    assert "\n" not in text
    return text


def test_answers_are_oriented_to_the_pair_and_not_to_the_side(write):
    responses = read_responses(
        write(
            [
                "P1,3,close-up,a,b,-2,1,1500,2024-05-01T09:00:00Z",
                "P2,5,close-up,b,a,-2,1,1500.5,2024-05-01T10:00:00+01:00",
                "P3,1,close-up,b,a,0,1,0,2024-05-01",
            ]
        )
    )
    frame = responses.frame
    assert list(frame.a) == ["a"] * 3 and list(frame.b) == ["b"] * 3
    assert list(frame.preference) == [-2, 2, 0]
    assert list(frame.strength) == [2, 2, 0]
    assert list(frame.winner[:2]) == ["a", "b"] and frame.winner.isna()[2]
    assert list(frame.a_left) == [True, False, False]
    assert list(frame.answer) == [-2, -2, 0]
    assert list(frame.line) == [2, 3, 4]
    assert frame.started_at[0] == frame.started_at[1]
    assert responses.rows == 3 and not responses.findings and not responses.simulated


def test_the_order_of_techniques_orients_the_pairs(write):
    path = write(["P1,3,close-up,a,b,-2,1,1500,2024-05-01T09:00:00Z"])
    turned = read_responses(path, order=["b", "a"]).frame
    assert (turned.a[0], turned.b[0], turned.preference[0], turned.winner[0]) == ("b", "a", 2, "a")


@pytest.mark.parametrize("mark", ["", "\ufeff"])
@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_byte_order_mark_line_ends_and_blank_lines_do_not_matter(tmp_path, mark, newline):
    path = tmp_path / "responses.csv"
    path.write_bytes((mark + HEADER + newline + newline + GOOD + newline + newline).encode())
    responses = read_responses(path)
    assert len(responses.frame) == 1 and responses.frame.line[0] == 3 and not responses.findings


def test_columns_may_stand_in_any_order_with_more_between(write):
    columns = ["reason", *reversed(HEADER.split(","))]
    cells = ['"because, well"', *reversed(GOOD.split(","))]
    frame = read_responses(write([",".join(cells)], header=",".join(columns))).frame
    assert frame.answer[0] == -2 and frame.participant[0] == "P1"


MALFORMED = {
    "answer": ["", "3", "-3", "0.5", "A", "inf", "1e0"],
    "participant": ["", "  "],
    "framing": [""],
    "left": [""],
    "right": ["", "golubev"],
}
UNREADABLE = {
    "familiarity": ["", "11", "-1", "2.5", "high", "nan"],
    "order": ["", "0", "-1", "first"],
    "rt_ms": ["", "-5", "fast", "nan", "inf", "1e999"],
    "started_at": ["", "yesterday", "2024-13-01T00:00:00Z", "25:00", "31.02.2024"],
}


def each(table):
    return [(column, value) for column, values in table.items() for value in values]


@pytest.mark.parametrize(("column", "value"), each(MALFORMED))
def test_a_malformed_value_is_reported_with_its_line_and_its_column(write, column, value):
    cells = GOOD.split(",")
    cells[HEADER.split(",").index(column)] = value
    bad = ",".join(cells)
    responses = read_responses(write([GOOD, bad]))
    (finding,) = responses.findings
    assert (finding.line, finding.kind, finding.row) == (3, "malformed", bad)
    assert column in finding.reason and "expected" in finding.reason
    assert len(responses.frame) == 1 and responses.rows == 2


@pytest.mark.parametrize(("column", "value"), each(UNREADABLE))
def test_an_answer_counts_whatever_stands_beside_it(write, column, value):
    cells = GOOD.replace("P1", "P2").split(",")
    cells[HEADER.split(",").index(column)] = value
    responses = read_responses(write([GOOD, ",".join(cells)]))
    assert len(responses.frame) == 2 and not responses.findings
    (missing,) = responses.missing
    assert (missing.line, missing.column, missing.value) == (3, column, value)
    assert responses.frame[column].isna().tolist() == [False, True]
    (note,) = [one for one in responses.notes if "is missing in 1 answer of 2" in one]
    assert note.startswith(column) and "counted all the same" in note


def test_ratings_from_0_are_ratings(write):
    rows = [GOOD.replace("P1,3", f"P{level},{level}") for level in range(5)]
    responses = read_responses(write(rows))
    assert sorted(responses.ratings) == [0, 1, 2, 3, 4] and not responses.missing
    assert responses.codebook.ratings == (0, 1, 2, 3, 4, 5)


def test_a_study_declares_the_levels_of_its_rating(tmp_path, write):
    rating = {"labels": ["never", "now and then", "daily"], "levels": [0, 1, 2]}
    names = {"framings": [{"name": "close-up"}], "techniques": [{"name": "golubev"}]}
    names["techniques"].append({"name": "none"})
    codebook = read_manifest(manifest(tmp_path, **names, familiarity=rating))
    rows = [GOOD.replace("P1,3", f"P{level},{level}") for level in range(4)]
    responses = read_responses(write(rows), codebook)
    assert responses.ratings.tolist()[:3] == [0, 1, 2] and np.isnan(responses.ratings["P3"])
    (missing,) = responses.missing
    assert missing.expected == "a level of the study's self-rating, 0 to 2"


def test_columns_beside_the_answer_may_be_absent(write):
    header = "participant,framing,left,right,answer"
    responses = read_responses(write(["P1,close-up,a,b,2", "P2,close-up,b,a,1"], header=header))
    assert len(responses.frame) == 2 and not responses.missing
    assert responses.frame.rt_ms.isna().all()
    assert "has no column rt_ms" in " ".join(responses.notes)


def test_a_question_without_its_place_in_the_order_is_no_repeat(write):
    rows = [GOOD, GOOD.replace(",1,1500", ",,1500"), GOOD.replace(",1,1500", ",7,1500")]
    responses = read_responses(write(rows))
    assert len(responses.repeats) == 1 and len(responses.findings) == 2


@pytest.mark.parametrize(
    "row", ["P1,3,close-up", GOOD + ",more", 'P1,"3"x,close-up,a,b,0,1,1,2024-05-01T09:00:00Z']
)
def test_a_row_that_has_not_the_headers_fields_is_reported(write, row):
    responses = read_responses(write([GOOD, row, GOOD.replace("P1", "P2")]))
    assert [(one.line, one.row) for one in responses.findings] == [(3, row)]
    assert list(responses.frame.participant) == ["P1", "P2"]


def test_a_row_over_several_lines_names_them_and_later_rows_keep_their_numbers(write):
    header = HEADER + ",comment"
    rows = [
        GOOD + ',"first\nsecond"',
        GOOD.replace(",-2,", ",9,") + ',"one\ntwo\nthree"',
        GOOD.replace("P1", "P2") + ",",
    ]
    responses = read_responses(write(rows, header=header))
    (finding,) = responses.findings
    assert (finding.line, finding.last_line) == (4, 6) and str(finding).startswith(
        "lines 4 to 6: answer is '9'"
    )
    assert finding.row == rows[1]
    assert list(responses.frame.line) == [2, 7]


def test_all_that_is_wrong_with_a_row_is_in_its_finding(write):
    responses = read_responses(
        write([GOOD, "P1,9,close-up,golubev,,7,1,1500,2024-05-01T09:00:00Z"])
    )
    assert (
        "right is ''" in responses.findings[0].reason
        and "answer is '7'" in responses.findings[0].reason
    )


def test_of_duplicates_the_first_counts_whatever_the_side(write, answer):
    rows = [
        answer("P1", "close-up", "a", "b", -1),
        answer("P1", "head-shot", "a", "b", -1),
        answer("P2", "close-up", "a", "b", -1),
        answer("P1", "close-up", "b", "a", 2),
        answer("P1", "close-up", "a", "b", -1),
    ]
    responses = read_responses(write(rows))
    assert [(one.line, one.kind) for one in responses.findings] == [
        (5, "duplicate"),
        (6, "duplicate"),
    ]
    assert all("line 2" in one.reason for one in responses.findings)
    assert list(responses.frame.line) == [2, 3, 4]


def test_every_row_is_either_counted_or_reported(write, random_study):
    """Fuzz: cells replaced at random; kept and reported lines are all lines, each once."""
    rng = np.random.default_rng(5)
    rows = random_study(6, seed=5)
    junk = ["", "x", "-7", "none", "close-up", "2024", '"', "1,1"]
    for row in rows:
        if rng.random() < 0.3:
            row[rng.integers(len(row))] = junk[rng.integers(len(junk))]
    responses = read_responses(write(rows))
    kept, reported = list(responses.frame.line), [one.line for one in responses.findings]
    assert reported and sorted(kept + reported) == list(range(2, len(rows) + 2))
    assert responses.rows == len(rows)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"", "is empty"),
        (b"\xef\xbb\xbf \n", "is empty"),
        (HEADER.encode(), "no rows"),
        (HEADER.encode() + b"\n\n\n", "no rows"),
        (
            b"participant,answer\nP1,2\n",
            "has no column framing, left, right",
        ),
        (b"participant;answer;left\nP1;2;a\n", "has no column framing, right"),
        (HEADER.encode() + b",answer\n", "column answer twice"),
        (
            HEADER.encode() + b"\nP1,3,close-up,a,b,9,1,1,2024\n",
            "none of its 1 rows can be used; line 2: answer is '9'",
        ),
        (
            HEADER.encode() + b'\nP1,"3,close-up,a,b,0,1,1,2024\nP2\n',
            "line 2: a quotation mark is opened and never closed",
        ),
        (b"\xff\xfe" + HEADER.encode("utf-16-le") + b"\n", "begins as UTF-16"),
    ],
)
def test_a_fault_of_the_whole_file_is_refused_in_one_line(tmp_path, content, expected):
    path = tmp_path / "responses.csv"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        read_responses(path)
    assert expected in one_line(error) and str(path) in str(error.value)


def test_no_file_and_a_folder_are_refused(tmp_path):
    for path in (tmp_path / "nothing.csv", tmp_path):
        with pytest.raises(InputError, match="cannot be read"):
            read_responses(path)


def test_simulated_and_real_answers_never_mix(write):
    header = HEADER + ",simulated"
    assert read_responses(write([GOOD + ",1"], header=header)).simulated
    assert not read_responses(write([GOOD + ",0"], header=header)).simulated
    with pytest.raises(InputError, match="first on line 3.*first on line 2"):
        read_responses(write([GOOD + ",1", GOOD.replace("P1", "P2") + ",0"], header=header))
    responses = read_responses(write([GOOD + ",1", GOOD.replace("P1", "P2") + ","], header=header))
    assert "simulated is ''" in responses.findings[0].reason


def test_a_rejected_row_still_shows_that_kinds_are_mixed(write):
    rows = [GOOD + ",0", GOOD.replace("P1", "P2").replace("-2", "9") + ",1"]
    with pytest.raises(InputError, match="mixes"):
        read_responses(write(rows, header=HEADER + ",simulated"))


def test_framings_without_a_study_go_from_near_to_far_then_as_they_appear(write, answer):
    seen = ["zoom", "half-length", "close-up", "aerial"]
    codebook = read_responses(
        write([answer("P1", framing, "b", "a", 0) for framing in seen])
    ).codebook
    assert codebook.framings == ("close-up", "half-length", "zoom", "aerial")
    assert (
        codebook.techniques == ("b", "a") and codebook.order_rule == "first appearance in the table"
    )


@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ("golubev", "lacks 'none'"),
        ("golubev,none,none", "twice 'none'"),
        ("golubev,none,x", "unknown 'x'"),
        ("", "lacks"),
    ],
)
def test_an_order_names_every_technique_once(write, order, expected):
    with pytest.raises(InputError, match=expected) as error:
        read_responses(write([GOOD]), order=order.split(","))
    one_line(error)


def manifest(tmp_path, **study):
    table = {
        "framings": [{"name": "near", "label": "Near by"}, {"name": "far"}],
        "techniques": [
            {"name": "b", "label": "Bee"},
            {"name": "a", "label": "Ay"},
            {"name": "c", "label": "Sea"},
        ],
        "title": "A study",
    } | study
    path = tmp_path / "manifest.json"
    path.write_text(json.dumps({"format": "subdermal-manifest/1", "study": table}))
    return path


def test_a_study_gives_order_and_labels_and_finds_strangers(tmp_path, write, answer):
    codebook = read_manifest(manifest(tmp_path))
    rows = [
        answer("P1", "far", "a", "b", 1),
        answer("P1", "afar", "a", "b", 1),
        answer("P1", "near", "a", "d", 1),
    ]
    responses = read_responses(write(rows), codebook)
    assert responses.frame.a[0] == "b" and responses.frame.preference[0] == -1
    assert [one.line for one in responses.findings] == [3, 4]
    assert (
        "framing is 'afar', expected one of the study's: near, far" in responses.findings[0].reason
    )
    assert "right is 'd'" in responses.findings[1].reason
    assert codebook.label("b") == "Bee" and codebook.framing_label("far") == "far"
    assert (
        "No answers at near." in responses.notes and "No answers at all for c." in responses.notes
    )


def test_the_methods_say_what_the_images_were_made_from(tmp_path, write, answer):
    from analysis import methods
    from analysis.options import Options

    path = manifest(tmp_path)
    table = json.loads(path.read_text())
    table["licences"] = [
        {"what": "a bust", "licence": "CC-BY-4.0", "source": "there", "credit": "A. Maker"},
        {"what": "lamps", "licence": "CC0-1.0", "source": "here"},
    ]
    path.write_text(json.dumps(table))
    responses = read_responses(write([answer("P1", "far", "a", "b", 1)]), read_manifest(path))
    text = dict(methods.paragraphs(responses, Options(), "here"))
    assert text["Images"] == (
        "The images were made from a bust (A. Maker, CC-BY-4.0); lamps (CC0-1.0)."
    )
    table["licences"] = "mine"
    path.write_text(json.dumps(table))
    with pytest.raises(InputError, match="licences is 'mine', expected a list of tables"):
        read_manifest(path)


@pytest.mark.parametrize(
    ("content", "expected"),
    [
        (b"{", "not JSON"),
        (b"[]", "format is 'list'"),
        (b"{}", "format is None"),
        (b'{"format": "subdermal-manifest/9"}', "format is 'subdermal-manifest/9'"),
        (b'{"format": "subdermal-manifest/1"}', "study is None"),
        (b'{"format": "subdermal-manifest/1", "study": {"framings": []}}', "study.framings is"),
        (
            b'{"format": "subdermal-manifest/1", "study": {"framings": [{"name": 3}]}}',
            r"study.framings\[0\].name is 3",
        ),
    ],
)
def test_a_broken_manifest_is_refused_in_one_line(tmp_path, content, expected):
    path = tmp_path / "manifest.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=expected) as error:
        read_manifest(tmp_path)
    one_line(error)


@pytest.mark.parametrize(
    ("rating", "expected"),
    [
        ({"labels": ["one"]}, "expected texts, two or more"),
        ({"labels": ["a", "b"], "levels": [1, 1]}, "levels is .1, 1., expected whole numbers"),
        ({"labels": ["a", "b"], "levels": [1, 2, 3]}, "one for each label"),
    ],
)
def test_a_rating_has_two_levels_or_more_that_ascend(tmp_path, rating, expected):
    with pytest.raises(InputError, match=expected):
        read_manifest(manifest(tmp_path, familiarity=rating))


def test_what_a_reader_should_know_of_counted_rows_is_noted(write, answer):
    rows = [
        answer("P1", "close-up", "a", "b", 1, familiarity=2),
        answer("P1", "close-up", "a", "c", 1, familiarity=4),
        answer("P2", "close-up", "a", "b", 1),
        answer("P2", "head-shot", "a", "b", 1),
    ]
    notes = " ".join(read_responses(write(rows)).notes)
    assert "P1 rated their familiarity in more than one way" in notes
    assert "P1, P2 answered fewer than the 3 questions" in notes
    assert "No answers at head-shot for c." in notes


def test_records_give_what_the_file_gives(write, random_study):
    rows = random_study(3, seed=9)
    from_file = read_responses(write(rows))
    from_records = responses_from_records(
        [dict(zip(HEADER.split(","), row, strict=True)) for row in rows]
    )
    columns = ["participant", "framing", "a", "b", "preference", "rt_ms", "started_at"]
    assert from_file.frame[columns].equals(from_records.frame[columns])
    with pytest.raises(InputError, match="lack left"):
        responses_from_records([{name: 1 for name in HEADER.split(",") if name != "left"}])
