"""The lock: pinned, hashed, without addresses, and nothing that pyproject.toml asks for is
missing.
"""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="module")
def lock():
    """The entries of requirements.lock by name: the requirement and its hashes."""
    entries = {}
    for entry in (ROOT / "requirements.lock").read_text().replace("\\\n", " ").splitlines():
        if not entry.startswith("#"):
            text, *hashes = re.split(r"\s+--hash=", entry)
            requirement = Requirement(text)
            entries[canonicalize_name(requirement.name)] = requirement, hashes
    return entries


def test_every_entry_is_pinned_and_hashed(lock):
    assert len(lock) > 40
    for requirement, hashes in lock.values():
        assert re.fullmatch(r"==[\w.]+", str(requirement.specifier)) and requirement.url is None
        assert hashes and all(re.fullmatch(r"sha256:[0-9a-f]{64}", text.strip()) for text in hashes)


def test_lock_names_no_address():
    assert not re.search(r"://|index-url|find-links|@ ", (ROOT / "requirements.lock").read_text())


def test_lock_holds_what_the_project_asks_for(lock):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    for text in [*project["dependencies"], *project["optional-dependencies"]["dev"]]:
        wanted = Requirement(text)
        requirement, _ = lock[canonicalize_name(wanted.name)]
        version = str(requirement.specifier).removeprefix("==")
        assert version in wanted.specifier, text
