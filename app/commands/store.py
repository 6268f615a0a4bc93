"""`subdermal store`: a study's images in an object store, or from there."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click


@click.group(no_args_is_help=False)
def command() -> None:
    """Send a study's images to an object store, or fetch them from there.

    URL is any address of fsspec: s3://bucket/study, gs://..., abfs://..., https://... to fetch, a
    folder. Its package is to be installed (s3fs, gcsfs, adlfs) and finds the credentials by itself.
    """


@command.command()
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
@click.argument("url", metavar="URL")
def push(directory: Path, url: str) -> None:
    """Send the images of the study in DIR to URL, each read back and checked, and its manifest.

    What is there as the manifest says is not sent again.
    """
    from stimuli.store import push

    moved = push(directory, url, _progress)
    click.echo(f"{url}: {moved.moved} images sent, {moved.kept} were there")


@command.command()
@click.argument("url", metavar="URL")
@click.argument("directory", metavar="DIR", type=click.Path(file_okay=False, path_type=Path))
def pull(url: str, directory: Path) -> None:
    """Fetch the study at URL into DIR, its manifest where DIR has none, and check every hash.

    What is in DIR as the manifest says is not fetched again.
    """
    from stimuli.store import pull

    moved = pull(url, directory, _progress)
    click.echo(f"{directory}: {moved.moved} images fetched, {moved.kept} were there")


def _progress(steps: Iterable, total: int) -> Iterable:
    from tqdm import tqdm

    return tqdm(steps, total=total, unit="image", delay=2, leave=False, disable=None)
