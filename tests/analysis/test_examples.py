"""The example page runs as written, on a table of people and on a simulated one."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HEADER = "participant,familiarity,framing,left,right,answer,order,rt_ms,started_at,simulated"


@pytest.mark.parametrize("simulated", [0, 1])
def test_the_example_page_draws_its_figure(tmp_path, write, random_study, simulated):
    path = write([[*row, simulated] for row in random_study(6, seed=2)], header=HEADER)
    command = [
        sys.executable,
        ROOT / "examples" / "golubev_against_plus.py",
        path,
        tmp_path / "own.svg",
    ]
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env={"PYTHONPATH": str(ROOT), "PATH": ""},
    )
    assert "180 answers of 6 people" in done.stdout and "half-length" in done.stdout
    assert ("SIMULATED" in done.stdout) == bool(simulated)
    assert (tmp_path / "own.svg").read_text().startswith("<?xml")
