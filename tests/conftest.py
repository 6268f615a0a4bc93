"""What tests of several rooms share."""

import pytest

from app import cli


@pytest.hookimpl(tryfirst=True)  # before xdist looks for the groups
def pytest_collection_modifyitems(items):
    """Which process of xdist runs what (--dist loadgroup): a file is one process's, and all files
    that look at the drawn head of tests/renderer are the same one's, which draws it once.
    """
    here = [item for item in items if item.path.parent.name == "renderer"]
    head = {item.path for item in here if "model" in item.fixturenames}
    for item in items:
        group = "head" if item.path in head else item.nodeid.partition("::")[0]
        item.add_marker(pytest.mark.xdist_group(group))


@pytest.fixture
def run(capfd, monkeypatch, tmp_path):
    """Runs the command line in an empty folder and returns its exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*args):
        code = cli.main([str(arg) for arg in args])
        return code, *capfd.readouterr()

    return run
