"""Simulations of tests are kept out of the user's cache."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def cache_of_tests(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SUBDERMAL_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield
