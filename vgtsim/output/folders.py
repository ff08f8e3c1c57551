"""Folders and files that are going to be written: refused before any long work where that cannot be.

New results of a run are made beside the old ones and take their place once they are whole.
"""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vgtsim.errors import DescriptionError
from vgtsim.replacing import flush_to_disk, lock_folder, replacing

PHASES = "phases"  # folder of those of a mission, each with the files of a run in a folder by its number
LOG, JSON, HTML, PDF, VIDEO = "log", "report.json", "report.html", "report.pdf", "video.mp4"
REPLAY = "replay.html"  # the run as a page to play
UNFINISHED = "unfinished"  # folder within the folder of a run, in which a new run puts its results
RESULTS = ("scene.xml", "scene.mjb", LOG, PHASES, JSON, HTML, PDF, VIDEO, REPLAY)
_WHOLE = ".whole"  # lists the results of a finished run that are being moved


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


@contextmanager
def stage_results(out_dir: str | Path, *, resume: bool = False) -> Iterator[Path]:
    """Give a folder for new results, which take the place of the old ones when the block ends well.

    What was made is left there when the block raises; the next run begins anew, or goes on with it to `resume`.

    Raises:
        DescriptionError: The folder cannot be made or written, another run is at work in it, or there is nothing to resume.
    """
    folder = prepare_folder(out_dir)
    stage = folder / UNFINISHED
    with naming_folder(folder), lock_folder(folder, "run"):
        _finish_move(folder)
        if resume and not stage.is_dir():
            raise DescriptionError(folder, "", "no run that was interrupted", "a folder with `unfinished` in it")
        if not resume:
            _remove(stage)
        stage.mkdir(exist_ok=True)
        flush_to_disk(folder)
        yield stage
        with replacing(stage / _WHOLE) as partial:
            partial.write_text(json.dumps([name for name in RESULTS if (stage / name).exists()]), encoding="utf-8")
        _finish_move(folder)


def find_results(folder: Path) -> Path:
    """The folder itself, or what an interrupted run left in it where no run was ever finished."""
    stage = folder / UNFINISHED
    if (stage / _WHOLE).is_file():
        with naming_folder(folder), lock_folder(folder, "run"):
            _finish_move(folder)
    return stage if _holds_log(stage) and not _holds_log(folder) else folder


def list_runs(folder: Path) -> list[Path]:
    """Folders of the phases that results have, in their order; the folder itself where the run is no mission in phases."""
    found = [path for path in (folder / PHASES).glob("[0-9]*") if (path / LOG).is_dir()]
    return sorted(found, key=lambda path: int(path.name)) or [folder]


def _holds_log(folder: Path) -> bool:
    return (folder / LOG).is_dir() or (folder / PHASES).is_dir()


def _finish_move(folder: Path) -> None:
    """Put whole results in the place of the old ones; a move that was interrupted is ended."""
    stage = folder / UNFINISHED
    if not os.path.lexists(stage / _WHOLE):
        return
    from vgtsim.description import read_text  # slow to load, and a folder is made without it

    try:
        listed = json.loads(read_text(stage / _WHOLE, what="list of a run's results"))
    except (ValueError, RecursionError) as error:
        raise DescriptionError(stage / _WHOLE, "", str(error)[:80], "the list of a run's results") from None
    for name in RESULTS:
        if name not in listed:
            _remove(folder / name)
        elif (stage / name).exists():
            _remove(folder / name) if (folder / name).is_dir() else None
            os.replace(stage / name, folder / name)
    flush_to_disk(folder)  # before the list goes
    (stage / _WHOLE).unlink()
    _remove(stage)


def _remove(path: Path) -> None:
    """Remove a file, a link or a folder, if it is there."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
