"""The examples of docs/analysis.md print what the page says; the public names stand on it."""

import doctest
import re
from pathlib import Path

import analysis

PAGE = Path(__file__).parents[2] / "docs/analysis.md"
#: Told by name in no example and no table of the page: values and what reports are made of.
ELSEWHERE = {
    *("Codebook", "Comparison", "Exclusions", "Finding", "InputError", "Priorities", "Responses"),
    "Results",
}


def test_the_examples_print_what_the_page_says():
    result = doctest.testfile(str(PAGE), module_relative=False)
    assert result.attempted > 15 and not result.failed


def test_every_public_function_is_on_the_page():
    text = PAGE.read_text()
    assert {name for name in analysis.__all__ if not re.search(rf"\b{name}\b", text)} == ELSEWHERE
