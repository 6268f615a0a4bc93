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


EXTRAS = ("bayes", "cluster", "parquet", "postgres", "visibility")
LOCKS = ("requirements.lock", *(f"requirements-{extra}.lock" for extra in EXTRAS))
MORE_THAN = dict(zip(LOCKS, (40, 4, 12, 0, 2, 20)))


def read(name):
    """The entries of a lock by name: the requirement and its hashes."""
    entries = {}
    for entry in (ROOT / name).read_text().replace("\\\n", " ").splitlines():
        if not entry.startswith("#"):
            text, *hashes = re.split(r"\s+--hash=", entry)
            requirement = Requirement(text)
            entries[canonicalize_name(requirement.name)] = requirement, hashes
    return entries


@pytest.mark.parametrize("name", LOCKS)
def test_every_entry_is_pinned_and_hashed(name):
    lock = read(name)
    assert len(lock) > MORE_THAN[name]
    for requirement, hashes in lock.values():
        assert re.fullmatch(r"==[\w.]+", str(requirement.specifier)) and requirement.url is None
        assert hashes and all(re.fullmatch(r"sha256:[0-9a-f]{64}", text.strip()) for text in hashes)


@pytest.mark.parametrize("name", LOCKS)
def test_lock_names_no_address(name):
    assert not re.search(r"://|index-url|find-links|@ ", (ROOT / name).read_text())


@pytest.mark.parametrize(("name", "extra"), list(zip(LOCKS, ("dev", *EXTRAS))))
def test_lock_holds_what_the_project_asks_for(name, extra):
    project, lock = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"], read(name)
    asked = project["dependencies"] if extra == "dev" else []
    for text in [*asked, *project["optional-dependencies"][extra]]:
        wanted = Requirement(text)
        requirement, _ = lock[canonicalize_name(wanted.name)]
        version = str(requirement.specifier).removeprefix("==")
        assert version in wanted.specifier, text


def test_the_locks_share_no_package():
    for name in LOCKS[1:]:
        assert not set(read(LOCKS[0])) & set(read(name))
