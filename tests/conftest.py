"""What tests of several rooms share."""

import pytest

from app import cli


@pytest.fixture
def run(capfd, monkeypatch, tmp_path):
    """Runs the command line in an empty folder and returns its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*args):
        code = cli.main([str(arg) for arg in args])
        return code, *capfd.readouterr()

    return run
