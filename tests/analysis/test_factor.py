"""Answers grouped by another column than framing: what is a question, what is a repeated measure,
what is refused.
"""

import click
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from scipy import stats

from analysis import InputError, Options, everything, read_responses, responses_from_records
from analysis.panel import panels
from analysis.report import report_responses
from app.answers import varied_option
from app.commands.analyse import command

HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
OPTIONS = Options(resamples=100, margin=0.5, seed=7)
#: Tables of which a level's rows are those of the same answers analysed alone; Holm's p depends on
#: the other rows.
ALONE = (
    "tallies",
    "ahp_intervals",
    "ahp_consistency",
    "worths",
    "worth_models",
    "pairs",
    "agreement",
)


@pytest.fixture
def lit(random_study):
    """Rows of 8 people who saw every pair at three framings and two lightings, on one of two
    displays each; answers differ.
    """
    rows = []
    for lighting, seed in (("evening", 1), ("day", 2)):
        for row in random_study(8, seed=seed, techniques=("none", "golubev", "golubev_plus")):
            person = int(row[0][1:])
            rows.append(
                [
                    row[0],
                    1 + person % 5,
                    *row[2:6],
                    row[6] + 100 * seed,
                    *row[7:],
                    lighting,
                    "OLED" if person % 4 == 3 else "LCD",
                ]
            )
    return rows


def same(left: pd.DataFrame, right: pd.DataFrame) -> None:
    pd.testing.assert_frame_equal(
        left.reset_index(drop=True), right.reset_index(drop=True), check_exact=True
    )


def test_a_level_is_what_its_answers_alone_are_over_all_framings(write, lit):
    header, order = HEADER + ",lighting,display", ("none", "golubev", "golubev_plus")
    results = everything(
        read_responses(write(lit, header), order=order, factor="lighting"), OPTIONS
    )
    for level in ("evening", "day"):
        responses = read_responses(
            write([row for row in lit if row[-2] == level], header), order=order
        )
        alone = everything(responses, OPTIONS)
        for name in ALONE:
            here, there = results.tables[name], alone.tables[name]
            here, there = here[here.framing == level], there[there.framing == "overall"]
            if name == "agreement":  # 'overall' pools no majority
                here = here[~here.statistic.str.startswith("pooled")]
            drop = [
                column
                for column in (
                    *("framing", "holm_p", "tost_holm_p", "equivalent"),
                    *("simultaneous_low", "simultaneous_high"),
                    *("jod_simultaneous_low", "jod_simultaneous_high"),
                )
                if column in here
            ]
            same(here.drop(columns=drop), there.drop(columns=drop))
        medians = results.tables["pair_medians"]
        by_hand = responses.frame.groupby(["a", "b"], observed=True).preference.median()
        assert list(medians.median_preference[medians.framing == level]) == list(by_hand)


def test_a_factor_of_people_resamples_the_people_of_a_level_and_leaves_overall_alone(write, lit):
    header, rows = HEADER + ",lighting,display", [row for row in lit if row[-2] == "day"]
    grouped = everything(read_responses(write(rows, header), factor="display"), OPTIONS)
    plain = everything(read_responses(write(rows, header)), OPTIONS)
    lcd = everything(
        read_responses(write([row for row in rows if row[-1] == "LCD"], header)), OPTIONS
    )
    for name in ("tallies", "worths", "ahp_intervals", "agreement", "pairs"):
        here = grouped.tables[name].drop(
            columns=[one for one in ("holm_p", "tost_holm_p") if one in grouped.tables[name]]
        )
        for results, level in ((plain, "overall"), (lcd, "LCD")):
            there = results.tables[name]
            there = there[there.framing == "overall"][here.columns].assign(framing=level)
            mine = here[here.framing == level]
            if name == "agreement":
                mine = mine[~mine.statistic.str.startswith("pooled")]
            same(mine, there)
    same(grouped.tables["participants"], plain.tables["participants"])
    assert (grouped.tables["pairs"].set_index("framing").n["OLED"] == 2).all()  # of 8 people


def test_answers_of_one_person_at_several_framings_are_one_value(write, answer):
    """By hand: six people lean to b by day, with means 0.5, 0.5, 1, 1.5, 1.5 and 2 over two
    framings; by night nobody sees anything.
    """
    day = {"P1": (0, 1), "P2": (1, 0), "P3": (1, 1), "P4": (1, 2), "P5": (2, 1), "P6": (2, 2)}
    rows = [
        answer(person, framing, "a", "b", value) + f",{light}"
        for person, values in day.items()
        for framing, value in zip(("close-up", "half-length"), values, strict=True)
        for light, value in (("day", value), ("night", 0))
    ]
    responses = read_responses(write(rows, HEADER + ",light"), factor="light")
    assert not responses.findings and responses.items == {"day": ("a", "b"), "night": ("a", "b")}
    table = everything(responses, OPTIONS).tables["pairs"].set_index("framing")
    means = np.array([0.5, 0.5, 1, 1.5, 1.5, 2])
    assert table.n["day"] == 6  # people, not the twelve answers that are counted
    assert list(table.loc["day", ["strong_a", "slight_a", "none", "slight_b", "strong_b"]]) == [
        0,
        0,
        2,
        6,
        4,
    ]
    assert table.mean_preference["day"] == pytest.approx(7 / 6)
    assert (
        table.sign_p["day"] == pytest.approx(2 / 2**6) == table.wilcoxon_p["day"]
    )  # all of six one way
    assert table.dz["day"] == pytest.approx(means.mean() / means.std(ddof=1))
    margin = stats.ttest_1samp(means, 0.5, alternative="less").pvalue
    assert table.tost_p["day"] == pytest.approx(margin)
    assert table.wilcoxon_p["night"] == 1 and table.mean_preference["night"] == 0
    assert table.mean_preference["overall"] == pytest.approx(7 / 12)
    tallies = (
        everything(responses, OPTIONS).tables["tallies"].set_index(["framing", "technique"]).score
    )
    assert tallies["day", "b"] == 14 and tallies["night", "b"] == 0 == tallies["day", "a"]


def test_without_the_factor_the_second_answer_would_be_a_duplicate(write, lit):
    path = write(lit, HEADER + ",lighting,display")
    assert {one.kind for one in read_responses(path).findings} == {"duplicate"}
    assert len(read_responses(path).findings) == len(lit) // 2
    assert read_responses(path, factor="lighting").findings == ()
    first = read_responses(path, factor="display").findings[0]
    assert "answered LCD, " in first.reason and first.line == 2 + len(lit) // 2


def test_framing_itself_is_what_is_grouped_by_without_a_factor(write, random_study):
    path = write(random_study(6, seed=2))
    one, other = (
        everything(read_responses(path, **given), OPTIONS) for given in ({}, {"factor": "framing"})
    )
    for name, table in one.tables.items():
        same(table, other.tables[name])
    copied = write(
        [[*row, row[2]] for row in random_study(6, seed=2)], HEADER + ",shot", "copied.csv"
    )
    shot = everything(read_responses(copied, factor="shot"), OPTIONS)
    order = ["close-up", "half-length", "head-shot"]
    for name in (
        "tallies",
        "worths",
        "agreement",
    ):  # the same numbers; the order of levels is that of first appearance
        columns = [
            column
            for column in ("framing", "technique", "model", "statistic")
            if column in one.tables[name]
        ]
        tables = (results.tables[name].sort_values(columns) for results in (one, shot))
        same(*(table[table.framing.isin(order)] for table in tables))


def test_levels_are_ordered_and_named(write, answer):
    rows = [
        answer(f"P{k}", "close-up", "a", "b", 1) + f",{level}"
        for k, level in enumerate(("10", "9", "1.5", "9"))
    ]
    responses = read_responses(write(rows, HEADER + ",distance_m"), factor="distance_m")
    assert responses.codebook.framings == ("1.5", "9", "10")
    assert responses.codebook.framing_rule == "from the lowest number to the highest"
    assert responses.codebook.framing_label("9") == "9 (distance m)"
    named = read_responses(
        write(
            [row + ",b" for row in rows[:1]] + [row + ",a" for row in rows[1:]], HEADER + ",d,where"
        ),
        factor="where",
    )
    assert named.codebook.framings == ("b", "a")


def test_familiarity_groups_people_by_their_first_rating(write, answer):
    rows = [
        answer("P1", "close-up", "a", "b", 1, familiarity=2),
        answer("P1", "close-up", "a", "c", 1, familiarity="4.0"),
    ]
    rows += [answer("P2", "close-up", "a", "b", -1, familiarity=4)]
    responses = read_responses(write(rows), factor="familiarity")
    assert list(responses.frame.framing) == ["2", "2", "4"]
    assert any(
        "rated their familiarity in more than one way; the first" in note
        for note in responses.notes
    )


def test_a_factor_that_a_few_people_vary_excludes_nobody_for_levels_they_never_met(
    write, random_study
):
    """One of eight people changed display; the seven others did not answer 'half of the
    questions'.
    """
    rows = [[*row, "OLED" if row[0] == "P0007" else "LCD"] for row in random_study(8)]
    rows += [
        [*row[:6], row[6] + 30, *row[7:], "LCD"] for row in random_study(8) if row[0] == "P0007"
    ]
    rows += [
        [*row[:6], row[6] + 60, *row[7:], "beamer"] for row in random_study(8) if row[0] == "P0007"
    ]
    responses = read_responses(write(rows, HEADER + ",display"), factor="display")
    table = everything(responses, OPTIONS).tables["participants"]
    assert set(table.excluded) == {""} and table.answers.max() == 90


def test_what_levels_hold_is_said(write, lit):
    responses = read_responses(write(lit, HEADER + ",lighting,display"), factor="lighting")
    assert responses.notes[0] == (
        "Answers are grouped by lighting (evening: 8 participants, 72 answers; day: 8 "
        "participants, 72 answers); "
        "the column framing of every table holds its levels."
    )
    assert (
        "Every level of lighting pools framings (close-up, head-shot, half-length)"
        in responses.notes[1]
    )
    notes = everything(responses, OPTIONS).tables["notes"]
    assert list(notes.note[notes.table == "all"]) == list(responses.notes[:2])
    one = read_responses(write(lit[:72], HEADER + ",lighting,display"), factor="lighting")
    assert "There is one level of lighting: nothing is compared over it." in one.notes
    few = read_responses(write(lit[:72], HEADER + ",lighting,display"), factor="display")
    assert (
        "OLED: fewer than 5 participants, which resampled intervals and tests on participants need."
        in few.notes
    )
    assert any(
        note.startswith("Nobody judged the same images at several levels of display")
        for note in few.notes
    )


def test_the_report_names_the_factor(write, lit, undrawn):
    responses = read_responses(write(lit, HEADER + ",lighting,display"), factor="lighting")
    files = report_responses(responses, options=OPTIONS)
    page, methods = files["report.html"].decode(), files["methods.md"].decode()
    assert (
        "**Grouping.** Answers are grouped by lighting" in methods
        and "at 2 levels of lighting" in methods
    )
    assert "Page's L" not in methods and "from near to far" not in page.lower()
    assert "All together" in page and "Strength of preference at each level of lighting" in page
    assert "Lighting & Technique" in files["report.tex"].decode()
    assert (
        "at each framing" not in page
        and "All framings" not in page
        and "within a framing" not in page
    )
    assert files["tables/worths.csv"].startswith(
        b"framing,model,technique,estimate,low,high,fit\nevening,"
    )
    assert files["tables/trend.csv"] == b"statistic,value,low,high,p\n"


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        ("answer", ["x"], "the factor is 'answer', which no answers can be grouped by"),
        (
            "nowhere",
            ["x"],
            (
                "has no column 'nowhere' to group answers by; expected one of familiarity, "
                "framing, light"
            ),
        ),
        (
            "light",
            [f"l{k}" for k in range(31)],
            "the factor 'light' has 31 levels, expected at most 30",
        ),
        (
            "light",
            [f"{k / 7:.3f}" for k in range(11)],
            "the factor 'light' has 11 numbers from 0 to 1.429, expected at most 10",
        ),
        ("light", [""], "none of its 1 rows can be used; line 2: light is '', expected a level"),
    ],
)
def test_what_is_no_factor_is_refused_in_one_line(write, answer, column, values, message):
    path = write(
        [answer(f"P{k}", "close-up", "a", "b", 1) + f",{value}" for k, value in enumerate(values)],
        HEADER + ",light",
    )
    with pytest.raises(InputError) as caught:
        read_responses(path, factor=column)
    assert message in str(caught.value) and "\n" not in str(caught.value)


def test_an_empty_cell_is_a_finding_and_overall_no_level(write, answer):
    rows = [answer("P1", "close-up", "a", "b", 1) + end for end in (",day", ", ", ",day")]
    responses = read_responses(write(rows, HEADER + ",light"), factor="light")
    assert [(one.line, one.kind) for one in responses.findings] == [
        (3, "malformed"),
        (4, "duplicate"),
    ]
    with pytest.raises(InputError, match="a level of light is called 'overall'"):
        panels(
            read_responses(
                write([rows[0].replace("day", "overall")], HEADER + ",light"), factor="light"
            )
        )


def test_records_have_factors_too(write, lit):
    path = write(lit, HEADER + ",lighting,display")
    records = pd.read_csv(path).to_dict("records")
    from_records, from_file = (
        responses_from_records(records, factor="lighting"),
        read_responses(path, factor="lighting"),
    )
    columns = ["framing", "image_framing", "a", "b", "preference"]
    assert from_records.frame[columns].equals(from_file.frame[columns])
    records[3]["lighting"] = None
    (finding,) = responses_from_records(records, factor="lighting").findings
    assert finding.line == 4 and "lighting is ''" in finding.reason
    with pytest.raises(InputError, match="has no column 'lamp'"):
        responses_from_records(records, factor="lamp")


def test_a_column_of_any_name_is_a_factor(write, answer):
    for name in ("level", "line", "last_line", "a", "strength"):
        rows = [answer(f"P{k}", "close-up", "x", "y", 1) + f",{'uv'[k % 2]}" for k in range(4)]
        responses = read_responses(write(rows, f"{HEADER},{name}"), factor=name)
        assert responses.codebook.framings == ("u", "v") and list(responses.frame.line) == [
            2,
            3,
            4,
            5,
        ]


def test_the_command_takes_a_factor(write, lit, tmp_path, undrawn):
    path = write(lit, HEADER + ",lighting,display")
    done = CliRunner().invoke(
        command,
        [str(path), "--factor", "lighting", "--resamples", "100", "--out", str(tmp_path / "out")],
    )
    assert done.exit_code == 0, done.output
    pairs = pd.read_csv(tmp_path / "out/tables/pairs.csv")
    assert list(pairs.framing.unique()) == ["evening", "day", "overall"]
    assert "--factor lighting" in (tmp_path / "out/report.html").read_text()
    done = CliRunner().invoke(
        command, ["--matrices", "x.toml", "--factor", "lighting", "--out", str(tmp_path / "out")]
    )
    assert done.exit_code == 2 and "--factor cannot go with --matrices" in done.output


def test_columns_that_tell_images_apart_keep_every_answer(write, answer):
    """A crossed table without a manifest: half of it looked like duplicates."""
    rows = [
        answer(f"P{k}", "close-up", "a", "b", (-1) ** k) + f",{person},{light}"
        for k in range(8)
        for person in ("man", "woman")
        for light in ("sun", "studio")
    ]
    path = write(rows, HEADER + ",person,light")
    lost = read_responses(path)
    assert len(lost.frame) == 8 and any("--varied" in note for note in lost.notes)
    whole = read_responses(path, varied=("person", "light"))
    assert len(whole.frame) == 32 and not whole.findings
    by_person = read_responses(path, factor="person", varied=("person", "light"))
    assert len(by_person.frame) == 32 and by_person.codebook.framings == ("man", "woman")
    with pytest.raises(InputError, match="has no column 'skin'"):
        read_responses(path, varied=("skin",))


@pytest.mark.parametrize("given", [["person,light"], ["person", "light"], []])
def test_columns_that_tell_images_apart_are_named_at_once_or_one_by_one(given):
    @click.command()
    @varied_option
    def shown(varied):
        click.echo(varied)

    arguments = [word for value in given for word in ("--varied", value)]
    output = CliRunner().invoke(shown, arguments).output
    assert output == ("('person', 'light')\n" if given else "\n")
