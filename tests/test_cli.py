"""The command line: every option explains itself, and bad input gives one line and exit code 2."""

import os
import subprocess
import sys

import click
import pytest

from app import cli

VERBS = {name: cli.cli.get_command(None, name) for name in cli.VERBS}
#: With those of verbs that have some of their own, such as "study new".
COMMANDS = VERBS | {
    f"{name} {sub}": command
    for name, group in VERBS.items()
    if isinstance(group, click.Group)
    for sub, command in group.commands.items()
}


def test_verbs():
    assert set(VERBS) >= {"render", "build", "power", "serve", "simulate", "analyse"}


@pytest.mark.parametrize("verb", COMMANDS)
def test_every_option_has_help(verb):
    command = COMMANDS[verb]
    assert command.help and command.help.rstrip().endswith(".")
    for parameter in command.params:
        if isinstance(parameter, click.Option):
            assert parameter.help and len(parameter.help) > 10, (
                f"{verb} {parameter.opts[0]} has no help text"
            )
        else:
            assert parameter.make_metavar(click.Context(command)).strip("[].") in command.help


@pytest.mark.parametrize("verb", COMMANDS)
def test_help(run, verb):
    code, out, err = run(*verb.split(), "--help")
    assert code == 0 and not err
    assert out.startswith(f"Usage: subdermal {verb} ")


def test_top_help_lists_the_verbs(run):
    code, out, _ = run("--help")
    assert code == 0
    assert all(f"\n  {verb} " in out for verb in VERBS)
    code, _, err = run()
    assert code == 2 and "Usage: subdermal" in err


def test_version(run):
    code, out, _ = run("--version")
    assert code == 0 and out.startswith("subdermal, version ")


def test_help_loads_nothing_heavy():
    """So that `subdermal --help` answers at once."""
    program = "import sys; from app.cli import main; main(['--help']); print(*sys.modules)"
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert not set(run.stdout.split()) & {
        "numpy",
        "pandas",
        "sqlalchemy",
        "matplotlib",
        "OpenGL",
        "trimesh",
    }


def test_analyse_takes_one_thread_of_blas_unless_told_otherwise():
    """Said before numpy is loaded, or it would not hold."""
    program = (
        "import os, sys, app.commands.analyse; "
        "print('numpy' in sys.modules, os.environ['OPENBLAS_NUM_THREADS'])"
    )
    for given, expected in (({}, "False 1"), ({"OPENBLAS_NUM_THREADS": "4"}, "False 4")):
        rest = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
        run = subprocess.run(
            [sys.executable, "-c", program], capture_output=True, text=True, env=rest | given
        )
        assert run.stdout.strip() == expected


@pytest.mark.parametrize(
    "args",
    [
        ["paint"],
        ["--quiet"],
        *([verb, "--no-such-option"] for verb in VERBS),
        *([verb] for verb in VERBS if verb not in ("cache", "techniques")),
        ["build", "no.toml", "--out", "out"],
        ["build", "bad.toml", "--out", "out"],
        ["build", "bad.toml"],
        ["serve", "nowhere"],
        ["simulate", "nowhere"],
        ["simulate", ".", "--participants", "none"],
        ["analyse", "no.csv", "--out", "out"],
        ["analyse", "bad.toml", "--out", "out"],
        [
            "render",
            "--technique",
            "no",
            "--framing",
            "close-up",
            "--size",
            "64x64",
            "--out",
            "a.png",
        ],
        ["render", "--technique", "none", "--framing", "no", "--size", "64x64", "--out", "a.png"],
        [
            "render",
            "-t",
            "none",
            "--identity",
            "woman",
            "--set",
            "objects.head.no=1",
            "-o",
            "a.png",
        ],
        [
            "render",
            "--technique",
            "none",
            "--framing",
            "close-up",
            "--size",
            "64",
            "--out",
            "a.png",
        ],
    ],
    ids=" ".join,
)
def test_bad_input_gives_one_line_and_exit_code_2(run, tmp_path, args):
    (tmp_path / "bad.toml").write_text("name = \n")
    code, out, err = run(*args)
    assert code == 2 and not out
    assert err.startswith("subdermal: ") and err.count("\n") == 1 and err.endswith("\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["bad.toml"]


def test_toml_fault_names_its_line(run, tmp_path):
    (tmp_path / "bad.toml").write_text('name = "x"\nseed = = 1\n')
    assert (
        "bad.toml: not TOML" in (err := run("build", "bad.toml", "--out", "out")[2])
        and "line 2" in err
    )


def raising(error):
    @click.command()
    def command():
        raise error

    return command


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (click.UsageError("two\nlines"), 2, "two lines"),
        (
            OSError(28, "No space left on device", "a.png"),
            1,
            "[Errno 28] No space left on device: 'a.png'",
        ),
        (KeyboardInterrupt(), 130, "stopped"),
    ],
)
def test_what_a_user_can_cause_is_one_line(run, monkeypatch, error, code, message):
    monkeypatch.setitem(VERBS, "fail", raising(error))
    monkeypatch.setattr(cli.cli, "get_command", lambda ctx, name: VERBS[name])
    got, _, err = run("fail")
    assert (
        got == code
        and err.strip().startswith(f"subdermal: {message}")
        and err.strip().count("\n") == 0
    )


def test_defects_and_asked_for_tracebacks_are_not_hidden(run, monkeypatch):
    monkeypatch.setattr(
        cli.cli,
        "get_command",
        lambda ctx, name: raising(ZeroDivisionError() if name == "fail" else OSError(1)),
    )
    with pytest.raises(ZeroDivisionError):
        run("fail")
    with pytest.raises(OSError):
        run("--traceback", "disk")
