"""Pages of the documentation: their commands are commands, their pictures are there."""

import re
import shlex
import subprocess
from pathlib import Path

import click
import pytest

from app import cli

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md")) + [ROOT / "README.md"]
#: What stands for something else on the pages.
PLACES = re.compile(r"\$[A-Z]+|\.\.\.")


def commands(text):
    """The command lines of a page: `subdermal ...` in code and in blocks, joined where broken."""
    text = text.replace("\\\n", " ")
    blocks = re.findall(r"^    subdermal (.+)$", text, flags=re.M)
    return blocks + re.findall(r"`subdermal ([a-z]+ [^`]+)`", text)


def parsed(line):
    """A line's words through the command's own parser, without running it."""
    words = shlex.split(line, comments=True)
    command = cli.cli.get_command(None, words.pop(0))
    while isinstance(command, click.Group):
        command = command.get_command(click.Context(command), words.pop(0))
    with command.make_context("subdermal", words):
        pass


@pytest.mark.parametrize("name", ["gallery.md", "published.md", "reference.md", "techniques.md"])
def test_commands_of_a_page_are_commands(name):
    """Verbs, options and the values that options check."""
    lines = [
        line
        for line in commands((ROOT / "docs" / name).read_text(encoding="utf-8"))
        if not PLACES.search(line)
    ]
    assert len(lines) >= 2
    for line in lines:
        try:
            parsed(line)
        except (click.exceptions.Exit, click.MissingParameter):
            pass  # --help, or a part of a command that is spoken of
        except (click.ClickException, AttributeError) as error:
            pytest.fail(f"subdermal {line}: {getattr(error, 'message', error)}")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pictures_and_links_of_a_page_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if "://" not in target and not target.startswith("mailto:"):
            assert (page.parent / target).exists(), f"{page.name} names {target}"


def test_the_gallerys_commands_are_what_make_gallery_runs():
    text = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
    recipe = subprocess.run(
        ["make", "--no-print-directory", "-n", "gallery"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    ran = [line.removeprefix(".venv/bin/subdermal ") for line in recipe.splitlines()]
    assert [line for line in ran if line in commands(text)] == commands(text)
    for picture in re.findall(r"!\[[^]]*\]\(([^)]+)\)", text):
        drawn = f"docs/{picture}"
        assert drawn in recipe or drawn.startswith("docs/figures/"), f"nothing draws {picture}"
