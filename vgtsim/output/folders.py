"""Folders and files that are going to be written: refused before any long work where that cannot be."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vgtsim.errors import DescriptionError


def prepare_folder(out_dir: str | Path) -> Path:
    """Make a folder, and make sure that files can be written in it, before any long work; else a `DescriptionError`."""
    folder = Path(out_dir)
    with naming_folder(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    return folder


def prepare_file(path: Path, suffixes: tuple[str, ...] = ()) -> Path:
    """Make sure that a file can be written, before any long work; its folder is made too.

    Raises:
        DescriptionError: Its ending is none of the suffixes (if any), it is a folder, or its folder cannot be written.
    """
    if suffixes and path.suffix.lower() not in suffixes:
        raise DescriptionError(path, "", f"the ending {path.suffix!r}", " or ".join(suffixes))
    prepare_folder(path.parent)
    if path.is_dir():
        raise DescriptionError(path, "", "a folder", "a file that can be written")
    return path


@contextmanager
def naming_folder(folder: Path) -> Iterator[None]:
    """Name the folder in an error of the file system."""
    try:
        yield
    except OSError as error:
        found = f"{folder}, {error.strerror or error}"
        raise DescriptionError(None, "output folder", found, "a folder that can be written") from None
