"""Everything a run leaves in its folder."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from vgtsim.description.judging import CameraName, Cut
from vgtsim.description.schema import closest
from vgtsim.errors import DescriptionError, MissingLibraryError
from vgtsim.replacing import replacing

if TYPE_CHECKING:  # plots, MuJoCo and the checks are loaded where a file needs them
    from vgtsim.runlog import RunLog
    from vgtsim.site import Site
    from vgtsim.verification import Report

LOG, JSON, HTML, VIDEO = "run.npz", "report.json", "report.html", "video.mp4"


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


def clear_folder(folder: Path) -> None:
    """Take away the files of an earlier run, so that no old verdict or film stands beside a new log."""
    with naming_folder(folder):
        for name in (LOG, JSON, HTML, VIDEO):
            (folder / name).unlink(missing_ok=True)


def save_log(site: Site, log: RunLog, folder: Path) -> None:
    """Write `run.npz` of a run, finished or not, into an existing folder, whole or not at all."""
    from vgtsim.runlog import save_run

    with naming_folder(folder), replacing(folder / LOG) as partial:
        save_run(partial, site.scene, log)


def write_outputs(
    site: Site, log: RunLog, report: Report, out_dir: str | Path, *, video: bool = False
) -> MissingLibraryError | None:
    """Write `run.npz`, `report.json`, `report.html` and, if asked for, `video.mp4`; the film comes last.

    Give the reason why the film could not be made. Raise a `DescriptionError` if the folder cannot be made or written.
    """
    folder = prepare_folder(out_dir)
    save_log(site, log, folder)
    write_reports(site, log, report, folder)
    if video:
        try:
            film(site, log, report, folder)
        except MissingLibraryError as error:
            return error
    return None


def write_reports(site: Site, log: RunLog, report: Report, folder: Path) -> None:
    """Write `report.json` and `report.html` into an existing folder."""
    from vgtsim.output.html_report import write_report_html

    with naming_folder(folder):
        write_report_json(report, folder / JSON)
        write_report_html(site, log, report, folder / HTML)


def write_report_json(report: Report, path: Path) -> None:
    """Write `report.json`, whole or not at all: verdict, checks, performance, versions; null for figures not finite."""
    text = json.dumps(report.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def film(site: Site, log: RunLog, report: Report, out_dir: str | Path, camera: str | None = None) -> Path:
    """Write `video.mp4`, with a progress bar on a terminal; one camera may take the place of the scene's cuts.

    Raises:
        DescriptionError: The folder cannot be written, or there is no such camera.
        MissingLibraryError: There is no EGL or no encoder.
    """
    from vgtsim.output.video import render_video

    known = get_args(CameraName)
    if camera is not None and camera not in known:
        raise DescriptionError(None, "camera", repr(camera), f"a camera of the scene{closest(camera, known)}")
    cuts = None if camera is None else (Cut.model_validate({"camera": camera}),)
    path = prepare_folder(out_dir) / VIDEO
    with naming_folder(path.parent), _progress_bar() as advance:
        render_video(site, log, report, path, advance, cuts)
    return path


@contextmanager
def _progress_bar() -> Iterator[Callable[[int, int], None] | None]:
    """Give the function that `render_video` calls for each frame; nothing in a pipe."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("filming")
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def naming_folder(folder: Path) -> Iterator[None]:
    """Name the folder in an error of the file system."""
    try:
        yield
    except OSError as error:
        found = f"{folder}, {error.strerror or error}"
        raise DescriptionError(None, "output folder", found, "a folder that can be written") from None
