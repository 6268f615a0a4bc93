"""`subdermal cache`: where caches are, how large, and how to empty one."""

import shutil
from pathlib import Path

import click

#: What is in each cache; the folder of the first holds those of the others.
CACHES = {
    "heads": "base data of generated people, fetched again when needed",
    "people": "generated people as arrays; made again",
    "light": "light baked on scenes; baked again",
    "shadows": "shadow maps of scenes; drawn again",
    "views": "what all techniques share in a view; drawn again",
    "skin": "colours of skin by its pigments; reckoned again",
    "montecarlo": "simulated light in media; simulated again",
    "reference": "walks of long reference renders; walked again",
    "converged": "pictures that experiments compare to; drawn again",
}


def caches() -> dict[str, tuple[Path, str]]:
    """name -> (folder, what is in it)."""
    from renderer.caches import folder
    from renderer.optics.montecarlo import cache_folder

    folders = {name: folder() / name for name in CACHES}
    folders |= {"heads": folder(), "montecarlo": cache_folder()}
    return {name: (folders[name], words) for name, words in CACHES.items()}


def size_of(folder: Path, without: tuple[Path, ...] = ()) -> int:
    """Bytes of the files below a folder, but for those below the folders `without`."""
    files = (path for path in folder.rglob("*") if path.is_file() and not path.is_symlink())
    return sum(
        path.stat().st_size
        for path in files
        if not any(
            other != folder and other.is_relative_to(folder) and path.is_relative_to(other)
            for other in without
        )
    )


@click.command()
@click.option(
    "--clear",
    metavar="NAME",
    type=click.Choice(list(CACHES)),
    help="Remove this cache by its name. Nothing in it is lost for good.",
)
def command(clear: str | None) -> None:
    """List the caches: where each is, and how large.

    A build's images and a study's answers are no caches: they lie where you put them.
    """
    all_caches = caches()
    folders = tuple(folder for folder, _ in all_caches.values())
    if clear:
        folder, _ = all_caches[clear]
        inner = tuple(other for other in folders if other != folder)
        before = size_of(folder, inner)
        for path in sorted(folder.iterdir()) if folder.is_dir() else ():
            if path not in inner:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
        click.echo(f"{clear}: {before / 2**20:.1f} MB removed from {folder}")
        return
    for name, (folder, words) in all_caches.items():
        click.echo(f"{name:<11}{size_of(folder, folders) / 2**20:>9.1f} MB  {folder}")
        click.echo(f"{'':<11}{words}")
