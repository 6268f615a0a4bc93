"""responses.parquet: the rows of responses.jsonl, with the types of the codebook. Without pyarrow
one line says what to install.
"""

import csv
import hashlib
import io
import json
import zipfile
from datetime import datetime

import pytest

from app import parquet


@pytest.fixture
def study_dir(tmp_path, write_study):
    choice = {"name": "age", "kind": "choice", "text": "Age?", "options": ["18", "19"]}
    words = {"name": "words", "kind": "text", "text": "Remarks?", "required": False}
    own = [choice | {"required": False}, words]
    return write_study(tmp_path / "study", before=own)


def test_without_pyarrow_one_line_says_what_to_install(person, experimenter, monkeypatch):
    monkeypatch.setattr(parquet, "available", lambda: False)
    response = experimenter.get("/dashboard/responses.parquet")
    assert response.status_code == 404 and "requirements-parquet.lock" in response.text
    assert "needs the extra parquet" in experimenter.get("/dashboard/").text
    with zipfile.ZipFile(io.BytesIO(experimenter.get("/dashboard/export.zip").data)) as archive:
        assert "responses.parquet" not in archive.namelist()


def test_the_same_rows_with_the_types_of_the_codebook(person, experimenter, monkeypatch):
    pytest.importorskip(
        "pyarrow", reason="the extra [parquet] is not installed; see make test-parquet"
    )
    from pyarrow.parquet import ParquetFile

    monkeypatch.setattr(parquet, "GROUP_ROWS", 7)
    for age, words in (("2", "=1+1, ünïcode"), ("", "")):
        somebody = person()
        somebody.get("/")
        somebody.send("consent", consent="yes")
        somebody.send("familiarity", familiarity=3)
        somebody.send("stated", age=age, words=words)
        somebody.answer(*[1, -2, 0] * 5)
    response = experimenter.get("/dashboard/responses.parquet")
    assert response.headers["X-Row-Count"] == "30"
    file = ParquetFile(io.BytesIO(response.data))
    assert file.num_row_groups == 5  # of seven rows and the rest
    types = {"text": "string", "integer": "int64", "number": "double"}
    types["time"] = "timestamp[ms, tz=UTC]"
    text = experimenter.get("/dashboard/codebook.csv").text
    codebook = list(csv.DictReader(io.StringIO(text)))
    assert [(one.name, str(one.type)) for one in file.schema_arrow] == [
        (row["column"], types[row["type"]]) for row in codebook
    ]
    described = [one.metadata[b"description"].decode() for one in file.schema_arrow]
    assert described == [row["description"] for row in codebook]
    about = file.schema_arrow.metadata
    assert (about[b"study"], about[b"rows"], about[b"simulated"]) == (b"ready-made", b"30", b"0")

    lines = experimenter.get("/dashboard/responses.jsonl").text.splitlines()
    rows = file.read().to_pylist()
    assert len(rows) == 30 and rows[0]["age"] == 2 and rows[-1]["age"] is None
    for row, line in zip(rows, map(json.loads, lines), strict=True):
        for name, value in row.items():
            if isinstance(value, datetime):
                line[name] = datetime.fromisoformat(line[name])
            assert value == line[name] and type(value) is type(line[name]), name

    with zipfile.ZipFile(io.BytesIO(experimenter.get("/dashboard/export.zip").data)) as archive:
        data = archive.read("responses.parquet")
        assert data == response.data
        assert (
            f"{hashlib.sha256(data).hexdigest()}  responses.parquet"
            in archive.read("SHA256SUMS").decode()
        )


def test_an_empty_table_has_its_columns(experimenter):
    pytest.importorskip(
        "pyarrow", reason="the extra [parquet] is not installed; see make test-parquet"
    )
    from pyarrow.parquet import read_table

    table = read_table(io.BytesIO(experimenter.get("/dashboard/responses.parquet").data))
    assert table.num_rows == 0 and "rt_ms" in table.column_names
