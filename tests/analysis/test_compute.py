"""All statistics of one table: columns, determinism, and every kind of bad table ends in numbers, a
note or a refusal in one line.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from analysis import InputError, read_responses, responses_from_records
from analysis.compute import everything
from analysis.inference import PAIRS
from analysis.options import Options
from analysis.panel import panels
from app.cli import main

FAST = Options(resamples=100, margin=0.5, margin_jod=0.5)
COLUMNS = {
    "tallies": "framing,technique,score,low,high",
    "pair_medians": "framing,a,b,n,median_preference,low,high",
    "ahp_intervals": "framing,aggregation,method,technique,priority,low,high",
    "ahp_consistency": (
        "framing,aggregation,ci,ci_low,ci_high,cr,cr_low,cr_high,a,b,judgement,consistent,"
        "chance_cr,chance_share"
    ),
    "worths": "framing,model,technique,estimate,low,high,fit",
    "worth_models": "framing,model,parameter,estimate,low,high",
    "goodness": "framing,model,parameters,log_likelihood,deviance,df,p",
    "pairs": ",".join(PAIRS),
    "contrasts": "framing,a,b,estimate,low,high,p,holm_p",
    "omnibus": "framing,question,people,size,p",
    "by_images": "a,b,images,mean_preference,low,high,p,holm_p,least,most",
    "trend": "statistic,value,low,high,p",
    "order_effects": "statistic,people,value,low,high,p",
    "agreement": "framing,statistic,value,low,high,p",
    "side_balance": "framing,technique,left,right,left_share,p,holm_p",
    "participants": "participant,familiarity,answers,left,none,right,side_p,same_answer_share,"
    "median_rt_ms,circular_triads,zeta,"
    "repeats,repeat_share,traps,trap_share,agreement_with_others,excluded",
    "sensitivity": "framing,conclusion,a,b,everyone,without_excluded,changed",
    "familiarity_interaction": "framing,technique,n,slope,low,high,spearman,p,holm_p,detectable",
    "notes": "table,note",
}


def csv(results):
    return {name: table.to_csv(index=False) for name, table in results.tables.items()}


def sound(results):
    """What holds for every table: known columns, no infinite number, intervals in order, p within 0
    and 1, notes of one line.
    """
    assert list(results.tables) == list(COLUMNS)
    for name, table in results.tables.items():
        assert ",".join(table.columns) == COLUMNS[name]
        numbers = table.select_dtypes("number")
        assert not np.isinf(numbers.to_numpy(float)).any(), name
        for column in [column for column in table if column.endswith("_p") or column == "p"]:
            assert table[column].dropna().between(0, 1).all(), (name, column)
        if {"low", "high"} <= set(table):
            known = table.dropna(subset=["low", "high"])
            assert (known.low <= known.high).all()
    assert all("\n" not in line for lines in results.notes.values() for line in lines)
    return results


@pytest.fixture(scope="module")
def whole(random_study, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "responses.csv"
    header = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
    path.write_text(
        "\n".join([header, *(",".join(map(str, row)) for row in random_study(14, seed=2))])
    )
    return path


def test_all_tables_have_their_columns_and_the_same_seed_the_same_bytes(whole):
    one, two = (sound(everything(read_responses(whole), FAST)) for _ in range(2))
    assert csv(one) == csv(two) and one.notes == two.notes and one.options == FAST
    other = everything(read_responses(whole), replace(FAST, seed=1))
    assert csv(other)["worths"] != csv(one)["worths"]
    estimates = [result.tables["worths"].estimate for result in (one, other)]
    assert np.array_equal(*estimates, equal_nan=True)


def test_the_order_of_rows_changes_nothing(whole):
    frame = pd.read_csv(whole, dtype=str)
    one, other = (
        everything(
            responses_from_records(rows.to_dict("records"), order=sorted(set(frame.left))), FAST
        )
        for rows in (frame, frame.sample(frac=1, random_state=1))
    )
    assert csv(one) == csv(other)


BAD = {
    "one participant": ["a>b b>c a<c"],
    "one pair": ["a>b", "a<b", "a=b", "a>b", "a>>b", "a<<b"],
    "all ties": ["a=b b=c a=c"] * 7,
    "no ties": ["a>b b>c a<c", "a<b b<c a>c"] * 4,
    "unbeaten": ["a>b b>c a>c", "a>b b<c a>c"] * 4,
    "disconnected": ["a>b c<d", "a<b c>d"] * 4,
    "two participants": ["a>b b>c a<c", "a<b b<c a>c"],
    "four participants": ["a>b b>c a<c", "a<b b<c a>c"] * 2,
    "everyone alike": ["a>>b b>>c a>>c"] * 9,
    "one answer each": ["a>b", "b>c", "a<c", "b>a", "c>b", "a>c", "a=b"],
    "two strengths": ["a>b b>>c a<<c", "a<b b<<c a>>c"] * 4,
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", BAD)
def test_bad_tables_give_numbers_or_a_note(lines, kind):
    results = sound(everything(lines(*BAD[kind]), FAST))
    worths = results.tables["worths"]
    for model, rows in worths.groupby("model"):
        named = any(
            f"close-up, {model}: no finite worths" in note for note in results.notes["worths"]
        )
        assert rows.estimate.isna().all() if named else rows.estimate.notna().all()
    if len(BAD[kind]) < 5:
        intervals = [
            results.tables[name][["low", "high"]]
            for name in ("worths", "pairs", "tallies", "agreement")
        ]
        assert pd.concat(intervals).isna().all(axis=None) and any(
            "need 5" in note for note in results.notes["worths"]
        )


@pytest.mark.filterwarnings("error")
def test_eleven_conditions_and_one_framing(crowd, table):
    results = sound(everything(table(crowd(9, np.linspace(-1, 1, 11), seed=1, taste=0.3)), FAST))
    assert len(results.tables["pairs"]) == 55 and results.tables["worths"].estimate.notna().all()
    assert results.tables["ahp_consistency"].cr.isna().all() and set(
        results.tables["tallies"].framing
    ) == {"close-up"}


def test_one_condition_is_refused(write, answer):
    with pytest.raises(
        InputError, match="none of its 2 rows can be used; .*left and right are both 'a'"
    ):
        read_responses(
            write([answer("P1", "close-up", "a", "a", 0), answer("P2", "close-up", "a", "a", 0)])
        )


def test_a_framing_that_is_called_overall_is_refused(write, answer):
    responses = read_responses(write([answer("P1", "overall", "a", "b", 1)]))
    with pytest.raises(InputError, match="a framing is called 'overall'"):
        everything(responses, FAST)


def test_framings_with_other_techniques_meet_in_overall(write, answer):
    rows = [
        answer(f"P{k}", framing, *pair, (-1) ** k)
        for k in range(8)
        for framing, pair in (("close-up", "ab"), ("head-shot", "bc"))
    ]
    responses = read_responses(write(rows), order="abc")
    result = panels(responses)["overall"]
    assert result.items == ("a", "b", "c") and list(
        zip(result.first, result.second, strict=True)
    ) == [
        (0, 1),
        (1, 2),
    ]
    sound(everything(responses, FAST))


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        (lambda text: text.encode("utf-16")[:-1], "begins as UTF-16"),
        (lambda text: text.replace("answer,", "", 1).encode(), "no column answer"),
        (
            lambda text: "\n".join(
                [text.splitlines()[0], *(["P1,9,x,a,b,7,0,-1,never"] * 3)]
            ).encode(),
            "none of its 3 rows can be used",
        ),
        (lambda text: b"", "is empty"),
    ],
)
def test_what_is_no_table_is_refused_by_the_command_in_one_line(
    whole, tmp_path, capsys, change, expected
):
    path = tmp_path / "responses.csv"
    path.write_bytes(change(whole.read_text()))
    code = main(["analyse", str(path), "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert (
        code == 2 and expected in said and said.count("\n") == 1 and not (tmp_path / "out").exists()
    )


def test_excels_utf_8_is_read_as_it_is(whole, tmp_path):
    path = tmp_path / "responses.csv"
    path.write_bytes(("\ufeff" + whole.read_text().replace("\n", "\r\n")).encode())
    one, other = (everything(read_responses(each), FAST) for each in (whole, path))
    assert csv(one) == csv(other)
