"""LaTeX, PDF, methods, declared choices, cost beside worth: whole, embedded, escaped, marked, and
true to the tables.
"""

import io
import json
import re
import shutil
import subprocess
from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from scipy import stats

from analysis import (
    InputError,
    declared,
    latex,
    methods,
    objective,
    pdf,
    read_responses,
    shown,
    worth_figures,
)
from analysis.codebook import Codebook
from analysis.figures import DOUBLE_MM, SIMULATED, SINGLE_MM, Picture
from analysis.options import Options
from analysis.shown import Shown

TABLE = Shown(
    "one",
    "A table",
    ("Name & co", "p"),
    (False, True),
    (("50 % of #1_x", "<0.001"), ("\N{MINUS SIGN}1", "[a]"), ("\N{MINUS SIGN}1", "2")),
)


# Numbers as they are printed


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0004, "<0.001"),
        (0.001, "0.001"),
        (0.0456, "0.046"),
        (0.1, "0.10"),
        (0.99, "0.99"),
        (0.996, ">0.99"),
        (1.0, ">0.99"),
        (np.nan, "\N{EN DASH}"),
    ],
)
def test_p_values_as_journals_print_them(value, text):
    assert shown.probability(value) == text


def test_numbers_have_a_true_minus_no_minus_zero_and_a_dash_for_nothing():
    assert (
        shown.number(-1.234) == "\N{MINUS SIGN}1.23"
        and shown.number(-0.001) == "0.00"
        and shown.number(np.nan) == "\N{EN DASH}"
    )
    assert (
        shown.interval(1, 0.5, np.nan) == "1.00"
        and shown.interval(1, -0.5, 2) == "1.00 [\N{MINUS SIGN}0.50, 2.00]"
    )


# LaTeX


def test_latex_escapes_and_keeps_every_row():
    text = latex.table(TABLE)
    assert (
        r"Name \& co & p \\" in text
        and r"50 \% of \#1\_\allowbreak{}x & \textless{}0.001 \\" in text
    )
    assert r"$-$1 & {}[a] \\" in text, "a bracket after a row's end would be read as a length"
    assert r" & 2 \\" in text and text.count(r"\addlinespace") == 1
    assert (
        all(rule in text for rule in (r"\toprule", r"\midrule", r"\bottomrule"))
        and r"\hline" not in text
        and "|" not in text
    )


def test_latex_of_simulated_answers_is_marked_in_every_caption():
    text = latex.document([TABLE, TABLE], "x", simulated=True)
    assert text.count(rf"\caption{{{SIMULATED}") == 2 and rf"\textbf{{{SIMULATED}}}" in text
    assert SIMULATED not in latex.document([TABLE], "x")


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no LaTeX here")
def test_latex_compiles_and_no_table_is_wider_than_the_page(tmp_path, study_report):
    escaped = latex.document([TABLE], "50 % & more", True, [("#", ["$x_1 & y$"])]).encode()
    for text in (escaped, study_report[False]["report.tex"]):
        (tmp_path / "report.tex").write_bytes(text)
        for _ in range(2):  # longtable takes widths from the run before
            run = subprocess.run(
                ["pdflatex", "-halt-on-error", "report.tex"], cwd=tmp_path, capture_output=True
            )
            assert run.returncode == 0
        assert b"Overfull \\hbox" not in run.stdout


def test_a_wide_table_is_set_smaller_in_latex():
    name = "a_technique_of_a_long_name"
    wide = Shown("w", "", tuple("abcdefghij"), (False, *(True,) * 9), ((name, *"123456789"),))
    text = latex.table(wide)
    assert r"{\scriptsize" in text and r"\arraybackslash}p{10em}rrrr" in text
    assert r"\scriptsize" not in latex.table(TABLE) and "p{" not in latex.table(TABLE)


def test_latex_braces_are_balanced(study_report):
    text = study_report[True]["report.tex"].decode()
    assert text.count(r"\begin{longtable}") == text.count(r"\end{longtable}") >= 5
    depth = 0
    for mark in re.sub(r"\\[{}]", "", text):
        depth += {"{": 1, "}": -1}.get(mark, 0)
        assert depth >= 0
    assert depth == 0


# The whole report


@pytest.fixture(scope="module")
def study_report(real, simulated):
    """simulated or not -> files of a report."""
    return {False: real, True: simulated}


def test_figures_have_the_widths_of_a_journals_columns_and_embedded_fonts(study_report):
    files = study_report[False]
    widths = set()
    for name, content in files.items():
        if name.startswith("figures/") and name.endswith(".pdf"):
            box = re.search(rb"/MediaBox \[ 0 0 ([0-9.]+) ([0-9.]+) \]", content)
            widths.add(round(float(box[1]) / 72 * 25.4, 1))
            assert b"/FontFile2" in content and b"/Type3" not in content, (
                f"{name}: TrueType, embedded"
            )
    assert widths == {SINGLE_MM, DOUBLE_MM}


def test_the_pdf_is_one_with_embedded_fonts_and_no_date(study_report):
    for _simulated, files in study_report.items():
        content = files["report.pdf"]
        assert content.startswith(b"%PDF-1.") and b"CreationDate" not in content
        assert content.count(b"/FontFile3") + content.count(b"/FontFile2") >= 2


def text_of(report, option):
    """What pdftotext makes of a PDF's bytes."""
    command = ["pdftotext", option, "-", "-"]
    return subprocess.run(command, input=report, capture_output=True, check=True).stdout.decode()


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no poppler here")
def test_the_pdf_says_what_the_page_says(study_report):
    for simulated, files in study_report.items():
        assert rb"\section*{Notes to the tables}" in files["report.tex"]
        text = text_of(files["report.pdf"], "-layout")
        pages = text.split("\f")[:-1]
        assert all((SIMULATED in page) == simulated for page in pages) and len(pages) > 5
        words = " ".join(text.split())
        for part in (
            "What can be concluded",
            "What cannot be concluded",
            "Notes to the tables",
            "Close-up, head-shot, half-length and All framings: no question was asked again",
            "Methods",
            "References",
            "TOST Holm p",
        ):
            assert part in words


def test_typst_markup_in_a_name_stays_text():
    table = Shown("x", "#panic(1)", ("*a*", "$b$"), (False, False), (('#import "x"', "_c_"),))
    content = pdf.make(
        "#panic()",
        "= x",
        [("h", ['#read("/etc/passwd")'])],
        [],
        [table],
        [("#h", ["$n$"])],
        [("h", "@x")],
        ["<r>"],
        True,
    )
    assert content.startswith(b"%PDF")


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no poppler here")
def test_no_page_is_left_half_empty_and_no_caption_without_its_table():
    """A low figure, one as tall as a page and two low ones, then a table, behind some text."""

    def picture(name, height_mm):
        size = f'width="{178 * 72 / 25.4}pt" height="{height_mm * 72 / 25.4}pt"'
        svg = f'<svg xmlns="http://www.w3.org/2000/svg" {size}/>'.encode()
        return Picture(name, f"picture {name}", "Caption.", "", svg, b"", b"")

    pictures = [picture("1", 60), picture("2", 220), picture("3", 50), picture("4", 30)]
    table = Shown("x", "Heading", ("A", "B"), (False, True), (("first", "1"), ("second", "2")))
    for lines in (4, 20, 21, 34, 35, 36, 37):
        summary = [("h", ["one line of text"] * lines)]
        made = pdf.make("t", "s", summary, pictures, [table], [], [], [], False)
        made_text = text_of(made, "-layout")
        pages = made_text.split("\f")[:-1]
        where = {
            words: next(k for k, page in enumerate(pages) if words in page)
            for words in ("Figures", *(f"picture {k}" for k in "1234"), "Heading", "first")
        }
        assert where["Heading"] == where["first"] and where["Figures"] == where["picture 1"]
        # the layout has come to rest: figures and pages have numbers of their own
        assert sorted(re.findall(r"Figure (\d+): picture", made_text)) == list("1234")
        for number, page in enumerate(pages, start=1):
            assert re.search(rf"\b{number} ?/ ?{len(pages)}\b", page)
        if lines == 4:  # the first page has room for all three that are low
            assert where["picture 1"] == where["picture 3"] == where["picture 4"] == 0
        assert where["first"] <= 2, (lines, where)


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="no poppler here")
def test_long_names_stay_in_their_columns():
    """Words of one line of a table do not lie over each other."""
    name = "technique_with_a_rather_long_name_{}"
    rows = tuple((name.format(k), name.format(f"{k}0"), *("0.50 [0.10, 0.90]",) * 4) for k in "123")
    columns = ("A", "B", "Rank-biserial", "Standardised mean", "Contrast, points", "Holm p")
    table = Shown("x", "", columns, (False, False, True, True, True, True), rows)
    result = text_of(pdf.make("t", "= x", [], [], [table], [], [], [], False), "-bbox")
    box = r'xMin="([\d.]+)" yMin="([\d.]+)" xMax="([\d.]+)"'
    lines: dict[str, list[tuple[float, float]]] = {}
    for left, top, right in re.findall(box, result):
        lines.setdefault(top, []).append((float(left), float(right)))
    assert any(len(words) > 8 for words in lines.values())
    for words in lines.values():
        for (_, right), (left, _) in pairwise(sorted(words)):
            assert left >= right - 5  # pt: the box of a word counts the break behind it


def test_methods_name_every_choice_seed_version_and_source(study_report):
    text = study_report[False]["methods.md"].decode()
    assert "resample participants, with all of their answers, 100 times (seed 3)" in text
    assert (
        "\N{PLUS-MINUS SIGN}0.25 points" in text
        and "\N{PLUS-MINUS SIGN}0.5 JOD" in text
        and "declared in the study file" in text
    )
    for simulated, files in study_report.items():
        text = files["methods.md"].decode()
        assert (SIMULATED in text) == simulated and ("SIMULATED participants" in text) == simulated
        for version in ("numpy", "scipy", "pandas", "matplotlib", "typst", "subdermal", "Python"):
            assert re.search(rf"{version} \d", text)
        cited = set(methods.keys_in(text.split("## References")[0]))
        listed = set(re.findall(r"^- \[([a-z]+\d{4})\]", text, re.MULTILINE))
        assert cited == listed and cited <= set(methods.REFERENCES)


def test_methods_follow_the_options(write, answer):
    responses = read_responses(write([answer("P1", "close-up", "a", "b", 1)]))
    text = methods.markdown(
        responses, Options(test="sign", family="framing", ties="drop", level=0.9, seed=7), "nowhere"
    )
    for words in (
        "The declared test is the sign test",
        "over the pairs of each framing, at 0.1",
        "'no difference' left out",
        "at 90 %",
        "seed 7",
    ):
        assert words in text
    assert "No margin of equivalence was declared" in text


def test_objective_figures_tables_and_sentences_are_there(study_report):
    files = study_report[False]
    table = pd.read_csv(io.BytesIO(files["tables/objective.csv"]))
    assert list(table) == [
        "framing",
        "technique",
        "measure",
        "value",
        "estimate",
        "low",
        "high",
        "front",
    ]
    assert "figures/objective_milliseconds.pdf" in files
    page = files["report.html"].decode()
    assert "milliseconds an image against worth" in page and "The manifest holds no FLIP." in page


# Declared choices


def test_declared_choices_become_options_and_the_command_line_wins():
    result = declared.options(
        {"margin": 0.3, "test": "sign", "exclusions": {"zeta": 0.5, "median_rt_ms": False}},
        margin=0.2,
        seed=None,
    )
    assert (result.margin, result.test, result.seed) == (0.2, "sign", 0)
    assert (
        result.exclusions.zeta == 0.5
        and result.exclusions.median_rt_ms is None
        and result.exclusions.one_side_share == 0.9
    )
    assert declared.options({}) == Options()


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"margins": 1}, "names the unknown margins"),
        ({"margin": "1"}, "margin is '1', expected a number"),
        ({"margin": True}, "margin is True"),
        ({"margin": -1}, "margin is -1"),
        ({"exclusions": 3}, "exclusions is 3"),
        ({"exclusions": {"speed": 3}}, "unknown speed"),
        ({"exclusions": {"zeta": True}}, "zeta is True"),
        ({"test": "t"}, "test is 't'"),
        ({"resamples": 5}, "resamples is 5"),
    ],
)
def test_declared_nonsense_is_refused_in_one_line(table, message):
    with pytest.raises(InputError, match=message) as error:
        declared.options(table)
    assert "\n" not in str(error.value)


# Cost and fidelity


def manifest(tmp_path, images):
    (tmp_path / "manifest.json").write_text(
        json.dumps({"format": "subdermal-manifest/1", "images": images})
    )
    return tmp_path


def test_what_the_manifest_does_not_hold_is_said_and_nothing_is_made_up(tmp_path):
    result = objective.read_measures(
        manifest(tmp_path, [{"framing": "x", "technique": "a", "parameters": {"samples": 22}}])
    )
    assert result.table.empty
    text = " ".join(result.notes)
    assert (
        "No condition is called 'reference'" in text
        and "no samples a scattering pixel and no milliseconds an image" in text
    )


def test_measures_are_read_and_partial_ones_are_said(tmp_path):
    images = [
        {"framing": "x", "technique": "a", "measures": {"milliseconds": 2}},
        {"framing": "x", "technique": "b"},
    ]
    result = objective.read_measures(manifest(tmp_path, images))
    assert result.table.to_numpy().tolist() == [["x", "a", "milliseconds", 2.0, "manifest"]]
    assert "1 of 2 images in the manifest have no milliseconds an image." in result.notes


@pytest.mark.parametrize(
    "measures",
    [{"ms": 1}, {"milliseconds": -1}, {"milliseconds": True}, {"milliseconds": "1"}, [1]],
)
def test_bad_measures_are_refused(tmp_path, measures):
    with pytest.raises(InputError, match=r"images\[0\].measures"):
        objective.read_measures(
            manifest(tmp_path, [{"framing": "x", "technique": "a", "measures": measures}])
        )


def test_dssim_is_wang_and_others_formula_window_by_window():
    """Against an independent way: explicit 11 x 11 windows with normalised Gaussian weights, as the
    paper's section III-B says.
    """
    rng = np.random.default_rng(0)
    x = rng.random((16, 18))
    y = np.clip(x + rng.normal(0, 0.2, x.shape), 0, 1)
    line = np.exp(-(np.arange(-5, 6) ** 2) / (2 * 1.5**2))
    weight = np.outer(line, line) / line.sum() ** 2
    values = []
    for row in range(6):
        for column in range(8):
            a, b = (image[row : row + 11, column : column + 11] for image in (x, y))
            mean_a, mean_b = (weight * a).sum(), (weight * b).sum()
            var_a, var_b = (weight * (a - mean_a) ** 2).sum(), (weight * (b - mean_b) ** 2).sum()
            cov = (weight * (a - mean_a) * (b - mean_b)).sum()
            values.append(
                (2 * mean_a * mean_b + 1e-4)
                * (2 * cov + 9e-4)
                / ((mean_a**2 + mean_b**2 + 1e-4) * (var_a + var_b + 9e-4))
            )
    grey_x, grey_y = (np.repeat(image[..., None], 3, axis=2) for image in (x, y))
    assert objective.dssim(grey_x, grey_y) == pytest.approx((1 - np.mean(values)) / 2, rel=1e-9)
    assert objective.dssim(grey_x, grey_x) == pytest.approx(0, abs=1e-12)
    assert objective.dssim(grey_x, grey_y) == pytest.approx(objective.dssim(grey_y, grey_x))


def test_distances_to_the_reference_come_from_the_images(tmp_path):
    rng = np.random.default_rng(1)
    base = rng.integers(0, 255, (20, 24), np.uint8)
    images = []
    for name, noise in (("reference", 0), ("near", 10), ("far", 60)):
        picture = np.clip(base + rng.normal(0, 1, base.shape) * noise, 0, 255).astype(np.uint8)
        Image.fromarray(picture).save(tmp_path / f"{name}.png")
        images.append({"framing": "x", "technique": name, "file": f"{name}.png"})
    table = objective.read_measures(manifest(tmp_path, images)).table
    for measure in ("dssim", "flip"):
        result = table[table.measure == measure].set_index("technique").value
        assert 0 < result["near"] < result["far"] < 1 and "reference" not in result
    assert not objective.read_measures(tmp_path, reference="near").table.empty
    (tmp_path / "far.png").unlink()
    assert "not beside the manifest" in " ".join(objective.read_measures(tmp_path).notes)


def test_an_image_is_compared_within_its_cell_over_its_region(tmp_path):
    """Two people: each one's images go by their own reference; a factor's values are means over the
    cells of its level; what lies outside of the region does not count.
    """
    rng = np.random.default_rng(2)
    images = []
    for place, person in enumerate(("anna", "bert")):
        face = rng.integers(60, 180, (24, 40, 3), np.uint8)
        for light in ("noon", "dusk"):
            for name in ("reference", "near"):
                picture = face + (place + 1) * 20 * (name == "near" and light == "dusk")
                if name == "near":
                    picture[:, 20:] = 0  # outside
                file = f"{person}-{light}-{name}.png"
                Image.fromarray(picture.astype(np.uint8)).save(tmp_path / file)
                levels = {"person": person, "light": light}
                images.append({"framing": "x", "levels": levels, "technique": name, "file": file})
                images[-1] |= {"region": [0, 0, 0.5, 1], "measures": {"milliseconds": place}}
    folder = manifest(tmp_path, images)

    def values(factor, measure):
        table = objective.read_measures(folder, factor=factor).table
        table = table[(table.measure == measure) & (table.technique == "near")]
        return dict(zip(table.framing, table.value, strict=True))

    lights, people = values("light", "flip"), values("person", "flip")
    assert lights["noon"] == pytest.approx(0, abs=1e-6) and lights["dusk"] > 0.01
    assert 0 < people["anna"] < people["bert"]
    assert values("framing", "flip") == {"x": pytest.approx(np.mean(list(lights.values())))}
    assert values("person", "milliseconds") == {"anna": 0.0, "bert": 1.0}
    assert "Images have no day" in " ".join(objective.read_measures(folder, factor="day").notes)


def test_the_front_is_what_no_other_beats_in_both():
    measured = pd.DataFrame(
        [
            ("x", name, "milliseconds", cost, "manifest")
            for name, cost in (("a", 1.0), ("b", 2.0), ("c", 2.0), ("d", 3.0))
        ],
        columns=["framing", "technique", "measure", "value", "source"],
    )
    worths = pd.DataFrame(
        [
            ("x", "thurstone_jod", name, worth, np.nan, np.nan)
            for name, worth in (("a", 0.0), ("b", 1.0), ("c", 0.5), ("d", 1.0))
        ],
        columns=["framing", "model", "technique", "estimate", "low", "high"],
    )
    table = objective.against_worth(measured, worths)
    assert table[table.front].technique.tolist() == ["a", "b"]


def test_rank_correlations_are_spearmans_with_every_order_counted():
    rng = np.random.default_rng(2)
    for n in (4, 5, 6):
        table = pd.DataFrame(
            {"framing": "x", "measure": "flip", "value": rng.random(n), "estimate": rng.random(n)}
        )
        row = objective.correlations(table).iloc[0]
        exact = stats.permutation_test(
            (table.value,),
            lambda x, estimate=table.estimate: stats.spearmanr(x, estimate).statistic,
            permutation_type="pairings",
            n_resamples=np.inf,
        )
        assert (row.spearman, row.p) == pytest.approx((exact.statistic, exact.pvalue))
    short = objective.correlations(table.head(3)).iloc[0]
    assert np.isnan(short.spearman) and np.isnan(short.p)


# Figures


def test_labels_keep_their_distance_and_their_order():
    for values in ([0.0, 0.0, 0.0], [0, 1, 2], [0, 0.1, 0.1, 3, 3.05], [5.0]):
        places = worth_figures._apart(np.array(values, float), 0.5)
        assert (np.diff(places) >= 0.5 - 1e-9).all() and places.mean() == pytest.approx(
            np.mean(values)
        )


def test_pairs_are_drawn_on_their_side_with_the_margin():
    book = Codebook(("x",), ("a", "b"), "", "")
    row = {
        "framing": "x",
        "a": "a",
        "b": "b",
        "mean_preference": 1.2,
        "low": 0.8,
        "high": 1.5,
        "equivalence_low": 0.9,
        "equivalence_high": 1.4,
        "simultaneous_low": 0.5,
        "simultaneous_high": 1.9,
    }
    table = pd.DataFrame([row | {"verdict": "different"}])
    axes = worth_figures._pairs((["x"], [("a", "b")]), table, book, 0.25).axes
    dot = next(line for line in axes[0].lines if line.get_marker() == "o")
    assert dot.get_xdata()[0] == 1.2
    band = axes[0].patches[0]
    assert (band.get_x(), band.get_width()) == pytest.approx((-0.25, 0.5))
