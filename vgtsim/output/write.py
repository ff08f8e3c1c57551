"""Everything a run leaves in its folder."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from vgtsim.description import CameraName, Cut, closest
from vgtsim.errors import DescriptionError, MissingLibraryError
from vgtsim.output.folders import HTML, JSON, LOG, PDF, VIDEO, naming_folder, prepare_folder, stage_results
from vgtsim.replacing import replacing

if TYPE_CHECKING:  # plots, MuJoCo and the checks are loaded where a file needs them
    from vgtsim.log import LogSource, RunLog
    from vgtsim.site import Site
    from vgtsim.verification import JudgedRun, Report


def write_outputs(
    site: Site, log: RunLog, report: Report, out_dir: str | Path, *, video: bool = False
) -> MissingLibraryError | None:
    """Write `log`, `report.json`, `report.html` and, if asked for, `video.mp4`, in place of those of an earlier run.

    Give the reason why the film could not be made. Raise a `DescriptionError` if the folder cannot be made or written.
    """
    from vgtsim.log import save_log
    from vgtsim.verification import JudgedRun

    with stage_results(out_dir) as stage:
        save_log(stage / LOG, site.scene, log)
        return write_verdict(JudgedRun(site, log, report), stage, video=video)


def write_verdict(run: JudgedRun, folder: Path, *, video: bool = False) -> MissingLibraryError | None:
    """Write the files that follow from a log, the film last; give the reason why it could not be made."""
    page = write_reports(run, folder)
    if video:
        from vgtsim.output.html_report import write_page

        try:
            film_runs([run], folder)
        except MissingLibraryError as error:
            return error
        with naming_folder(folder):
            write_page(page, folder / HTML)  # again, as it shows the film
    return None


def write_reports(run: JudgedRun, folder: Path) -> dict[str, Any]:
    """Write `report.json` and `report.html` into an existing folder; give what the page says, see `describe_run`."""
    from vgtsim.output.html_report import describe_run, write_page

    with naming_folder(folder):
        write_report_json(run.report, folder / JSON)
        page = describe_run(run)
        write_page(page, folder / HTML)
    return page


def write_pdf(run: JudgedRun, folder: Path) -> MissingLibraryError | None:
    """Write `report.pdf` into an existing folder; give the reason why it could not be made."""
    from vgtsim.output.html_report import write_report_pdf

    try:
        with naming_folder(folder):
            write_report_pdf(run, folder / PDF)
    except MissingLibraryError as error:
        return error
    return None


def write_report_json(report: Report, path: Path) -> None:
    """Write `report.json`, whole or not at all: verdict, checks, performance, versions; null for figures not finite."""
    text = json.dumps(report.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8")


def write_mission(
    runs: Sequence[JudgedRun], report: Report, folder: Path, *, video: bool = False
) -> MissingLibraryError | None:
    """Write the report of a mission in phases, whose own reports are written already, and film all if asked for.

    Give the reason why the film could not be made.
    """
    from vgtsim.output.html_report import describe_mission, write_page

    missing = None
    if video:
        try:
            film_runs(runs, folder)
        except MissingLibraryError as error:
            missing = error
    with naming_folder(folder):
        write_report_json(report, folder / JSON)
        write_page(describe_mission(runs, report), folder / HTML)
    return missing


def film(site: Site, log: LogSource, report: Report, out_dir: str | Path, camera: str | None = None) -> Path:
    """Write `video.mp4`, with a progress bar on a terminal; one camera may take the place of the scene's cuts.

    Raises:
        DescriptionError: The folder cannot be written, or there is no such camera.
        MissingLibraryError: There is no EGL or no encoder.
    """
    from vgtsim.verification import JudgedRun

    return film_runs([JudgedRun(site, log, report)], out_dir, camera)


def film_runs(runs: Sequence[JudgedRun], out_dir: str | Path, camera: str | None = None) -> Path:
    """Write `video.mp4` of a run, or of all phases of a mission one after the other; as `film`.

    Raises:
        DescriptionError: The folder cannot be written, or there is no such camera.
        MissingLibraryError: There is no EGL or no encoder.
    """
    from vgtsim.output.video import render_runs

    known = get_args(CameraName)
    if camera is not None and camera not in known:
        raise DescriptionError(None, "camera", repr(camera), f"a camera of the scene{closest(camera, known)}")
    cuts = None if camera is None else (Cut.model_validate({"camera": camera}),)
    path = prepare_folder(out_dir) / VIDEO
    with naming_folder(path.parent), _progress_bar() as advance:
        render_runs(runs, path, advance, cuts)
    return path


@contextmanager
def _progress_bar() -> Iterator[Callable[[int, int], None] | None]:
    """Give the function that `render_runs` calls for each frame; nothing in a pipe."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True)) as bar:
        task = bar.add_task("filming")
        yield lambda done, total: bar.update(task, completed=done, total=total)
