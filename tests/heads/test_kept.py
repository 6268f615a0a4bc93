"""A generated person that was kept is the one that was made."""

import dataclasses
import os
import subprocess
import sys

import numpy as np
import pytest
from scipy import sparse

from stimuli.heads import kept
from stimuli.heads.person import Eyes, Person


def assert_same(one, other, where="model"):
    if dataclasses.is_dataclass(one):
        for field in dataclasses.fields(one):
            name = field.name
            assert_same(getattr(one, name), getattr(other, name), f"{where}.{name}")
    elif isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key in one:
            assert_same(one[key], other[key], f"{where}.{key}")
    elif isinstance(one, tuple):
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            assert_same(a, b, f"{where}[{k}]")
    elif sparse.issparse(one):
        assert (one != other).nnz == 0 and one.dtype == other.dtype, where
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        np.testing.assert_array_equal(one, other, err_msg=where)
    else:
        assert one == other, where


@pytest.fixture
def cache(tmp_path, monkeypatch, request):
    from stimuli.heads import fetch

    data = fetch.mpfb_data()
    monkeypatch.setenv("SUBDERMAL_CACHE", str(tmp_path))
    monkeypatch.setattr(fetch, "mpfb_data", lambda: data)
    monkeypatch.setattr(kept.anatomy, "LEVELS", 1)
    return tmp_path / "people"


def test_a_person_comes_back_as_they_were_made(cache, monkeypatch):
    person = Person(eyes=Eyes(iris=(0.3, 0.2, 0.1)), skin={"melanin": 0.4})
    first = kept.person_model(person, 3)
    monkeypatch.setattr(kept, "default_model", None)  # would fail if it were called
    assert_same(first, kept.person_model(person, 3))
    assert first.eyes[0].colours["iris"] == (0.3, 0.2, 0.1)
    assert first.material.melanin == 0.4
    for other in ((person, 4), (Person(skin={"melanin": 0.4}), 3)):
        with pytest.raises(TypeError):  # neither seed nor colours are left out of the key
            kept.person_model(*other)
    assert len(list(cache.iterdir())) == 1


def test_arms_are_the_same_to_the_bit_in_every_process():
    """Light is kept by the content of what it falls on: one bit would have it baked anew."""
    code = """
import hashlib
from stimuli.heads import fetch, mpfb
data = fetch.mpfb_data()
base = mpfb.read_base(data)
print(hashlib.sha256(mpfb.lower_arms(data, base, base.positions, 40.0).tobytes()).hexdigest())
"""
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"PYTHONHASHSEED": str(seed)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in range(1, 5)
    }
    assert len(found) == 1
