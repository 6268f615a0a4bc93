"""The figures, the page and the command: whole, marked when simulated, the same on every run, safe
with any name.
"""

import base64
import csv
import io
import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from analysis import InputError, read_matrices, read_responses
from analysis.figures import SIMULATED, VERMILLION, _lattice
from analysis.report import file_names, report_matrices, report_responses, write_files
from app.cli import main

HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at"
ROOT = Path(__file__).resolve().parents[2]
MATRICES = Path(__file__).parent / "thesis_matrices.toml"
PICTURES = (
    {"scores", "familiarity", "total_by_distance", "pair", "priorities"}
    | {*("worths", "jod_ladder", "pairs", "scores_intervals", "agreement", "participants")}
    | {f"preferences_{name}" for name in ("close-up", "head-shot", "half-length")}
)
TABLES = (
    {
        "scores",
        "totals",
        "medians",
        "distributions",
        "familiarity",
        "sides",
        "ahp_priorities",
        "rejected_rows",
        "missing_values",
    }
    | {
        *(
            "tallies",
            "pair_medians",
            "ahp_intervals",
            "ahp_consistency",
            "worths",
            "worth_models",
            "pairs",
            "trend",
            "agreement",
        ),
        *(
            "notes",
            "participants",
            "side_balance",
            "sensitivity",
            "goodness",
            "contrasts",
            "omnibus",
            "by_images",
            "order_effects",
            "familiarity_interaction",
        ),
    }
    | {f"ahp_matrix_{name}" for name in ("close-up", "head-shot", "half-length")}
)


def table(files, name):
    return pd.read_csv(io.BytesIO(files[f"tables/{name}.csv"]))


def banner(png):
    """The share of pixels in the picture's top edge that have the colour of the mark."""
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return float(
        (pixels[:10] == [int(VERMILLION[place : place + 2], 16) for place in (1, 3, 5)])
        .all(axis=2)
        .mean()
    )


class Page(HTMLParser):
    """Text, tags and images of a page; fails on a tag that is not closed in its place."""

    VOID = {"meta", "img", "br", "hr", "link", "input"}

    def __init__(self, html):
        super().__init__()
        self.open, self.seen, self.images, self.text = [], [], [], ""
        self.feed(html)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.seen.append(tag)
        if tag == "img":
            self.images.append(dict(attributes))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_every_table_figure_and_the_page_are_there(real, simulated):
    for files, pictures, tables in (
        (simulated, PICTURES, TABLES),
        (
            real,
            PICTURES | {"objective_milliseconds"},
            TABLES | {"objective", "objective_correlations"},
        ),
    ):
        names = {f"tables/{name}.csv" for name in tables} | {
            "report.html",
            "report.pdf",
            "report.tex",
            "methods.md",
        }
        names |= {f"figures/{name}.{kind}" for name in pictures for kind in ("pdf", "svg", "png")}
        assert set(files) == names


def test_the_columns_that_others_rely_on(real):
    assert list(table(real, "scores")) == ["framing", "technique", "score"]
    assert list(table(real, "ahp_priorities")) == [
        "framing",
        "technique",
        "priority",
        "lambda_max",
        "ci",
        "cr",
    ]
    matrix = table(real, "ahp_matrix_close-up")
    assert next(iter(matrix)) == "technique" and list(matrix)[1:] == matrix.technique.tolist()
    values = matrix.set_index("technique").to_numpy()
    assert values * values.T == pytest.approx(np.ones((5, 5)))


def test_figures_are_whole_drawings(real):
    for name in PICTURES:
        root = ElementTree.fromstring(real[f"figures/{name}.svg"])
        tags = {element.tag.split("}")[1] for element in root.iter()}
        assert "path" in tags and "text" not in tags, (
            "letters must be outlined: a reader may lack the font"
        )
        image = Image.open(io.BytesIO(real[f"figures/{name}.png"]))
        assert (
            image.width in (1000, 2100) and np.asarray(image.convert("L")).std() > 10
        )  # 84.7 and 177.8 mm, 300 dpi


def test_another_run_in_another_process_gives_the_same_bytes(
    tmp_path, simulated, write, random_study
):
    rows = [[*row, 1] for row in random_study(8, seed=4)]
    path = write(rows, header=HEADER + ",simulated")
    command = [
        sys.executable,
        "-m",
        "app.cli",
        "analyse",
        str(path),
        "--out",
        str(tmp_path / "out"),
    ]
    subprocess.run(
        command,
        check=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONHASHSEED": "1"},
        capture_output=True,
    )
    said = b"subdermal analyse responses.csv --out DIR"
    for name in simulated:
        other = (tmp_path / "out" / name).read_bytes()
        if name in ("report.html", "methods.md"):
            assert said in other and said not in simulated[name]
        else:
            assert other == simulated[name], name


def test_simulated_answers_are_marked_on_tables_figures_and_page(simulated):
    for name, content in simulated.items():
        if name.startswith("tables/"):
            rows = list(csv.DictReader(io.StringIO(content.decode())))
            assert next(iter(csv.reader(io.StringIO(content.decode()))))[-1] == "simulated"
            assert all(row["simulated"] == "1" for row in rows)
        elif name.endswith(".svg"):
            assert content.count(SIMULATED.encode()) >= 2, "title and drawn text"
        elif name.endswith(".png"):
            assert banner(content) > 0.9
        elif name in ("methods.md", "report.tex"):
            assert SIMULATED in content.decode()
            assert name != "report.tex" or content.count(SIMULATED.encode()) == 1 + content.count(
                b"\\caption"
            )
    page = Page(simulated["report.html"].decode())
    assert SIMULATED in page.text and "no person was asked" in page.text
    assert all(image["alt"].startswith(SIMULATED) for image in page.images)


def test_real_answers_carry_no_such_mark(real):
    for name, content in real.items():
        assert b"simulated" not in content.lower(), name
        if name.endswith(".png"):
            assert banner(content) == 0


def test_the_page_holds_everything_itself_and_is_whole_without_its_script(real):
    html = real["report.html"].decode()
    page = Page(html)
    assert not {"link", "iframe", "object"} & set(page.seen) and page.seen.count("script") == 1
    assert not re.search(r"<script[^>]+src|\bimport\b|fetch\(|innerHTML|eval\(", html)
    still = Page(re.sub(r"<script>.*?</script>", "", html, flags=re.DOTALL))
    assert len(still.images) == len(page.images) and "hidden" not in html.split("<script>")[0]
    assert not re.search(r"https?://|url\(", html)
    assert len(page.images) == len(PICTURES) + 1
    for image in page.images:
        assert len(image["alt"]) > 20
        assert image["src"].startswith("data:image/svg+xml;base64,")
        assert base64.b64decode(image["src"].split(",")[1]) in real.values()


def test_the_page_says_what_was_counted_and_how(studies, real):
    responses = studies[False]
    text = " ".join(Page(real["report.html"].decode()).text.split())
    assert "8 participants gave 240 answers at 3 framings." in text
    assert "above the diagonal" in text and "first appearance in the table" in text
    assert ", ".join(responses.codebook.techniques) in text
    left, right = (responses.frame.answer < 0).sum(), (responses.frame.answer > 0).sum()
    assert f"on the left was preferred {left} times, the one on the right {right} times" in text
    assert responses.sha256 in text
    for version in ("Python", "numpy", "pandas", "matplotlib"):
        assert re.search(rf"{version} \d", text)


def test_the_summary_names_winners_and_ties(undrawn, write, answer):
    rows = [
        answer("P1", "close-up", "a", "b", -2),
        answer("P1", "close-up", "a", "c", -1),
        answer("P1", "close-up", "b", "c", 0),
    ]
    rows += [answer("P1", "head-shot", *pair, 0) for pair in ("ab", "ac", "bc")]
    rows += [answer("P1", "half-length", *pair, 1) for pair in ("ab", "bc", "ca")]
    text = " ".join(
        Page(report_responses(read_responses(write(rows)))["report.html"].decode()).text.split()
    )
    assert (
        "close-up: a got the most points (3 of 3), b and c the fewest (0 each). The AHP "
        "priorities put a first too."
    ) in text
    assert "head-shot: all techniques have 0 points." in text
    assert "half-length: all techniques have 1 point. The judgements are incoherent" in text
    assert "preferences neither only weaken nor only grow" in text
    assert (
        "a against b, in answers for the first, for neither and for the second: close-up 1, "
        "0 and 0; head-shot 0, 1 and 0;"
    ) in text


def test_rejected_rows_are_in_the_table_and_on_the_page(undrawn, write, answer):
    rows = [
        answer("P1", "close-up", "a", "b", 1),
        answer("P<b>2", "close-up", "a", "b", 9),
        "short",
    ]
    files = report_responses(read_responses(write(rows)))
    result = table(files, "rejected_rows")
    assert result.line.tolist() == [3, 4] and result.row[1] == "short"
    html = files["report.html"].decode()
    assert "P&lt;b&gt;2" in html and "P<b>2" not in html
    text = Page(html).text
    assert "2 of 3 rows" in text and "has 1 fields, expected 9" in text


def test_pairs_without_answers_are_named_on_the_page(undrawn, write, answer):
    rows = [answer("P1", "close-up", "a", "b", 1), answer("P1", "close-up", "b", "c", 1)]
    files = report_responses(read_responses(write(rows)))
    assert (
        "Nobody compared a with c: no priorities are given."
        in Page(files["report.html"].decode()).text
    )
    assert table(files, "ahp_priorities").priority.isna().all()
    assert "figures/priorities.svg" not in files


@pytest.mark.parametrize("people", [1, 2])
def test_the_smallest_study_still_has_a_report(write, answer, people, request):
    if people == 2:
        request.getfixturevalue("undrawn")
    rows = [answer(f"P{number}", "a/b", "x", "y", 0) for number in range(people)]
    files = report_responses(read_responses(write(rows)))
    assert table(files, "ahp_priorities")[["priority", "cr"]].to_numpy().tolist() == [
        [0.5, 0],
        [0.5, 0],
    ]
    assert "figures/preferences_a_b.svg" in files


def test_eleven_techniques_have_priorities_and_no_ratio(undrawn, write, random_study):
    techniques = [f"technique_{number}" for number in range(11)]
    files = report_responses(
        read_responses(write(random_study(1, framings=["close-up"], techniques=techniques)))
    )
    result = table(files, "ahp_priorities")
    assert (
        result.priority.sum() == pytest.approx(1)
        and result.cr.isna().all()
        and result.ci.notna().all()
    )
    assert "no random index beyond 10" in Page(files["report.html"].decode()).text


def test_the_pair_of_the_box_plot(undrawn, write, answer, real):
    def about(files):
        return re.findall(r"<b>(\S+ against \S+) at each framing", files["report.html"].decode())

    assert about(real) == ["golubev against golubev_plus"]
    responses = read_responses(
        write([answer("P1", "close-up", *pair, 1) for pair in ("ab", "ac", "bc")])
    )
    assert about(report_responses(responses)) == ["a against b"]
    assert about(report_responses(responses, pair=("c", "a"))) == ["c against a"]
    for pair in (("a", "a"), ("a", "x"), ("a",)):
        with pytest.raises(InputError, match="expected two different ones of a, b, c"):
            report_responses(responses, pair=pair)


def test_dots_of_the_box_plot_are_as_many_as_answers_and_apart():
    for count in (1, 2, 7, 50, 1000):
        x, y, gap = _lattice(count)
        assert len(set(zip(x.round(9), y.round(9), strict=True))) == count
        assert np.abs(x).max() <= 0.2 and np.abs(y).max() <= 0.2 and gap > 0


def test_file_names_are_safe_and_told_apart():
    names = [
        "close-up",
        "../../etc/passwd",
        "a/b",
        "a_b",
        "A b",
        "",
        "...",
        "è",
        "x" * 300,
        "a\\b:c*?",
        "CON",
    ]
    slugs = file_names(names)
    assert slugs["close-up"] == "close-up"
    assert len({slug.lower() for slug in slugs.values()}) == len(names)
    assert all(re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,63}", slug) for slug in slugs.values())


def test_names_cannot_break_out_of_the_page_or_the_folder(undrawn, tmp_path, write, answer):
    evil = "<img src=x onerror=alert(1)>"
    files = report_responses(
        read_responses(write([answer("P1", f"../../{evil}", evil, "$x_{$", 1)]))
    )
    assert evil not in files["report.html"].decode()
    write_files(files, tmp_path / "in" / "out")
    outside = [
        path
        for path in tmp_path.rglob("*")
        if path.is_file() and tmp_path / "in" / "out" not in path.parents
    ]
    assert outside == [tmp_path / "responses.csv"]


def test_writing_leaves_other_files_and_no_parts(tmp_path):
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "mine.csv").write_text("mine")
    (tmp_path / "report.html").write_text("old")
    write_files({"tables/scores.csv": b"new", "report.html": b"new"}, tmp_path)
    files = {
        path.relative_to(tmp_path).as_posix(): path.read_text()
        for path in tmp_path.rglob("*")
        if path.is_file()
    }
    assert files == {"tables/mine.csv": "mine", "tables/scores.csv": "new", "report.html": "new"}


def test_a_file_that_cannot_be_written_leaves_the_old_one(tmp_path, monkeypatch):
    (tmp_path / "report.html").write_text("old")
    monkeypatch.setattr(
        "os.replace", lambda *_: (_ for _ in ()).throw(OSError(28, "No space left on device"))
    )
    with pytest.raises(InputError, match="No space left"):
        write_files({"report.html": b"new"}, tmp_path)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_matrices_give_the_published_priorities_in_the_table():
    files = report_matrices(read_matrices(MATRICES), "thesis_matrices.toml")
    result = table(files, "ahp_priorities").set_index(["framing", "technique"])
    # Vuletic's thesis, tables 5.2 and 5.4
    assert result.priority["close-up"].tolist() == pytest.approx(
        [0.0841, 0.1208, 0.2766, 0.3562, 0.1623], abs=1e-4
    )
    assert result.cr["half-length", "none"] == pytest.approx(0.0153, abs=1e-4)
    text = " ".join(Page(files["report.html"].decode()).text.split())
    assert "head-shot: highest priority for golubev and golubev_plus, 0.284." in text
    assert "that of items in thesis_matrices.toml" in text


# The command


def run(capsys, *arguments):
    code = main(["analyse", *map(str, arguments)])
    done = capsys.readouterr()
    return code, done.out, done.err


def test_the_command_writes_the_report_and_names_unused_rows(
    undrawn, tmp_path, write, answer, capsys
):
    path = write([answer("P1", "close-up", "a", "b", 1), answer("P2", "close-up", "a", "b", 7)])
    code, out, err = run(
        capsys, path, "--out", tmp_path / "out", "--order", "b, a", "--pair", "b,a"
    )
    assert code == 0 and "1 of 2 rows not used" in out and "line 3: answer is '7'" in err
    text = " ".join(Page((tmp_path / "out/report.html").read_text()).text.split())
    assert "subdermal analyse responses.csv --order b,a --pair b,a --out DIR" in text
    assert "b, a: as given on the command line" in text
    assert str(tmp_path) not in text


def test_the_manifest_beside_the_table_is_used_and_a_foreign_one_is_said(
    undrawn, tmp_path, write, answer, capsys
):
    path = write([answer("P1", "close-up", "a", "b", 1)])
    beside = tmp_path / "manifest.json"
    beside.write_text('{"name": "a web application"}')
    code, _, err = run(capsys, path, "--out", tmp_path / "out")
    assert (
        code == 0
        and "not one of a study" in err
        and "not one of a study" in (tmp_path / "out/report.html").read_text()
    )
    beside.write_text(
        '{"format": "subdermal-manifest/1", "study": {"framings": [{"name": "close-up"}],'
        ' "techniques": [{"name": "b", "label": "Bee"}, {"name": "a", "label": "Ay"}]}}'
    )
    for options in ([], ["--study", beside], ["--study", tmp_path]):
        assert run(capsys, path, "--out", tmp_path / "out", *options)[0] == 0
        text = " ".join(Page((tmp_path / "out/report.html").read_text()).text.split())
        assert "Bee, Ay: the study's (manifest.json)" in text
    beside.write_text('{"format": "subdermal-manifest/1"}')
    code, _, err = run(capsys, path, "--out", tmp_path / "out")
    assert code == 2 and "study is None" in err


def test_the_command_takes_matrices(tmp_path, capsys):
    code, out, _ = run(capsys, "--matrices", MATRICES, "--out", tmp_path)
    assert code == 0 and "3 matrices" in out
    assert {path.name for path in (tmp_path / "tables").iterdir()} == {
        "ahp_priorities.csv",
        "ahp_matrix_close-up.csv",
        "ahp_matrix_head-shot.csv",
        "ahp_matrix_half-length.csv",
    }


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ([], "expected either RESPONSES or --matrices"),
        (["{table}", "--matrices", "{matrices}"], "expected either RESPONSES or --matrices"),
        (["--matrices", "{matrices}", "--order", "a,b"], "--order cannot go with --matrices"),
        (["{folder}/nothing.csv"], "nothing.csv: cannot be read"),
        (["{matrices}"], "has no column"),
        (["{table}", "--order", "a"], "lacks 'b'"),
        (["{table}", "--pair", "a,x"], "the pair is 'a,x'"),
        (["{table}", "--study", "{folder}/nothing.json"], "nothing.json: cannot be read"),
        (["--matrices", "{table}"], "not TOML"),
    ],
)
def test_bad_input_gives_one_line_code_2_and_no_output(
    tmp_path, write, answer, capsys, options, expected
):
    places = {
        "table": write([answer("P1", "close-up", "a", "b", 1)]),
        "matrices": MATRICES,
        "folder": tmp_path,
    }
    code, out, err = run(
        capsys, *[option.format(**places) for option in options], "--out", tmp_path / "out"
    )
    assert code == 2 and out == "" and err.count("\n") == 1 and expected in err
    assert not (tmp_path / "out").exists()


def test_an_out_that_is_a_file_is_refused(undrawn, tmp_path, write, answer, capsys):
    path = write([answer("P1", "close-up", "a", "b", 1)])
    code, _, err = run(capsys, path, "--out", path)
    assert code == 2 and err.count("\n") == 1 and "cannot be written" in err
