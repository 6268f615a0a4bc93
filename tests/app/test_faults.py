"""What was acknowledged is there, once, whatever failed meanwhile: benchmarks/faults.py in small,
which also fills a real disk, sets the server's clock and kills PostgreSQL.
"""

import asyncio
import importlib.util
import sys
from collections import Counter
from pathlib import Path

import pytest
from sqlalchemy import event

from app.models import Response

pytestmark = pytest.mark.sqlite  # servers of their own
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def faults():
    """The bench, as a module; its neighbours are found from the root."""
    sys.path.insert(0, str(ROOT))
    try:
        place = ROOT / "benchmarks" / "faults.py"
        spec = importlib.util.spec_from_file_location("benchmarks.faults", place)
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module
        spec.loader.exec_module(module)
        return module
    finally:
        sys.path.remove(str(ROOT))


def test_no_acknowledged_answer_is_lost_or_doubled(faults, study_dir, monkeypatch):
    url = f"sqlite:///{study_dir}/study.sqlite3"
    kinds = ("worker", "cut", "server", "slow", "cookies")
    tally, count = asyncio.run(faults.run(study_dir, url, kinds, people=5, at_once=5, rounds=1))
    assert all(count[kind] for kind in kinds)
    assert tally.tries["broken off"] > 0 and tally.tries["without cookies"] > 0
    found = faults.compare(url, tally.acknowledged)
    assert len(tally.acknowledged) == found["answers"] == 5 * faults.QUESTIONS
    assert not any(found[wrong] for wrong in ("lost", "doubled", "changed", "not acknowledged"))


def test_what_was_lost_doubled_or_changed_is_counted(faults, app, person, study_dir):
    """The comparison above can fail."""
    person().begin().answer(1, 2, 0)
    app.extensions["database"].close()
    url = f"sqlite:///{study_dir}/study.sqlite3"
    assert faults.compare(url, {1: 1, 2: 2, 3: 0}) == Counter(answers=3)
    found = faults.compare(url, {1: 1, 2: -2, 9: 0})
    assert (found["lost"], found["changed"], found["not acknowledged"]) == (1, 1, 1)


def test_an_answer_that_found_the_disk_full_is_said_to_be_unsaved_and_taken_later(
    app, person, caplog
):
    """SQLite is let grow no further; it says then what it says of a full disk."""
    somebody, engine = person().begin(), app.extensions["database"]._engine
    acknowledged, failed = [], None
    engine.dispose()

    def grow_no_more(connection, _record):
        pages = connection.execute("PRAGMA page_count").fetchone()[0]
        connection.execute(f"PRAGMA max_page_count = {pages}")

    event.listen(engine, "connect", grow_no_more)
    while failed is None:
        form = somebody.form("trial") | {"answer": "1", "rt_ms": "321", "view": "x" * 5}
        form["reason_text"] = "y" * 1900  # so that pages fill soon
        reply = somebody.http.post("/question", data=form, headers={"Accept": "application/json"})
        if reply.status_code == 200:
            acknowledged.append(int(form["trial"]))
            somebody.get("/question")
        else:
            failed = form
            assert reply.status_code == 500 and "recorded" not in reply.text
    assert acknowledged, "nothing was taken before the disk was full"
    assert "disk is full" in caplog.text and "yyy" not in caplog.text
    event.remove(engine, "connect", grow_no_more)
    engine.dispose()
    reply = somebody.http.post("/question", data=failed, headers={"Accept": "application/json"})
    assert reply.json["outcome"] == "recorded"
    with app.extensions["database"].read() as db:
        kept = [row.trial_id for row in db.query(Response).order_by(Response.id)]
    assert kept == [*acknowledged, int(failed["trial"])]
