"""The program, the common parts of its verbs, and its exit statuses."""

from __future__ import annotations

import shlex
import sys
import tempfile
import traceback
import warnings
from enum import IntEnum
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from vgtsim import __version__
from vgtsim.ending import end_at_once
from vgtsim.errors import DivergenceError, MissingLibraryError, PostureError, VgtError

if TYPE_CHECKING:  # the checks load SciPy, which `--help` does without
    from vgtsim.description import Scene
    from vgtsim.log import LogBook
    from vgtsim.verification import Report

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Simulate a long-reach variable-geometry-truss arm in a waste tank, and verify every claim about it.",
)
# Texts from files and paths are no markup. A pipe has no width of its own.
OUT = Console(width=None if sys.stdout.isatty() else 140, markup=False, emoji=False)
ERR = Console(stderr=True, markup=False, emoji=False)
_LONGEST = 4000  # signs of a message


class Status(IntEnum):
    """Exit statuses."""

    PASSED = 0
    FAILED = 1
    BAD_INPUT = 2
    DIVERGED = 3
    MISSING_LIBRARY = 4
    DEFECT = 70  # of the program itself; EX_SOFTWARE of sysexits
    BROKEN_PIPE = 141  # as of a program that SIGPIPE ends


SceneName = Annotated[Path, typer.Argument(help="TOML file of a scene, or name of a shipped one.", show_default=False)]
ArmName = Annotated[Path, typer.Argument(help="TOML file of an arm, or name of a shipped one.", show_default=False)]
SceneOrArm = Annotated[
    Path, typer.Argument(help="TOML file of a scene or of an arm, or name of a shipped one.", show_default=False)
]
RunFolder = Annotated[Path, typer.Argument(help="Folder that `vgtsim run` left.", show_default=False)]
OutFolder = Annotated[Path | None, typer.Option("--out", help="Folder for the results, by default out/NAME.")]


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        OUT.print(__version__)
        raise typer.Exit


def list_files(*files: Path) -> None:
    """Print paths, one a line, unbroken."""
    for file in files:
        OUT.print(str(file), soft_wrap=True)


def open_run(folder: Path) -> tuple[Path, Scene, LogBook]:
    """Folder with the results of a run, the scene of its log, and the log.

    Raises:
        DescriptionError: There is no log, or one for each phase of a mission.
    """
    from vgtsim.errors import DescriptionError
    from vgtsim.log import open_log
    from vgtsim.output import LOG, find_results, list_runs

    place = find_results(folder)
    if (runs := list_runs(place)) != [place]:
        allowed = f"the folder of one of them, {runs[0]} to {runs[-1]}"
        raise DescriptionError(place, "", f"a mission in {len(runs)} phases", allowed)
    log = open_log(place / LOG)
    if log.stopped:
        ERR.print(f"the log is not that of a whole run: {plain(log.stopped)}")
    elif (folder / "unfinished").exists():
        ERR.print(f"beside it, a later run was interrupted: see {folder / 'unfinished'}")
    return place, log.scene, log


def show_report(report: Report, folder: Path) -> None:
    """Print the checks of a report as a table."""
    table = Table("check", "measured", "limit", "unit", "where", "t/s", title=f"{report.scene}")
    for check in report.checks:
        colour = "green" if check.passed else "bold red"
        sign = "<=" if check.sense == "at most" else ">="
        table.add_row(
            f"{check.name}: {check.quantity}",
            Text(f"{check.measured:.3g}", style=colour),
            f"{sign} {check.limit:.3g}",
            check.unit,
            plain(check.where),
            "" if isnan(check.when) else f"{check.when:.2f}",
        )
    OUT.print(table)
    for note in report.notes:
        OUT.print(Text(f"note: {plain(note)}", style="yellow"), soft_wrap=True)
    factor = report.performance["real_time_factor"]
    speed = "of unknown speed" if isnan(factor) else f"{factor:.1f} times real time"
    OUT.print(f"{'PASSED' if report.passed else 'FAILED'}; {speed}; {folder / 'report.html'}")


def finish(passed: bool, missing: MissingLibraryError | None) -> None:
    """End with the status of a verdict, or with the error that kept part of the work from being done."""
    if missing is not None:
        raise missing
    raise typer.Exit(Status.PASSED if passed else Status.FAILED)


def main() -> None:
    """Run the command line and turn errors into exit statuses."""
    end_at_once()
    warnings.showwarning = _show_warning
    try:
        app()
    except MissingLibraryError as error:
        _complain(str(error), Status.MISSING_LIBRARY)
    except DivergenceError as error:
        _complain(str(error), Status.DIVERGED)
    except VgtError as error:
        complain(error)
        sys.exit(Status.BAD_INPUT)
    except OSError as error:  # a full disk, a folder without permission
        place = f"{error.filename}: " if error.filename else ""
        _complain(f"{place}{error.strerror or error}", Status.BAD_INPUT)
    except SystemExit as error:
        if isinstance(error.__context__, BrokenPipeError):  # Typer would end with the status of a failed check
            sys.exit(Status.BROKEN_PIPE)
        raise
    except Exception as error:
        from pydantic import ValidationError

        if isinstance(error, ValidationError):  # of an option that becomes part of a description
            _complain(f"{error.title}: {error.errors()[0]['msg'].removeprefix('Value error, ')}", Status.BAD_INPUT)
        _report_defect(error)


def _picture(error: VgtError) -> str:
    """Draw a posture that was refused; the end of the message that says where."""
    if not isinstance(error, PostureError):
        return ""
    from vgtsim.output import prepare_folder
    from vgtsim.output.figure import save_figure
    from vgtsim.output.scene_drawing import draw_refusal

    file = prepare_folder(Path("out")) / f"{error.name}_refused.png"
    save_figure(draw_refusal(error), file, 130)
    return f"\npicture: {file}"


def _show_warning(message: Warning | str, category: type[Warning], filename: str, line: int, *_: object) -> None:
    """Print a warning as a message to the user; one of a library says where it comes from."""
    ours = category.__module__.startswith("vgtsim.")
    said = str(message) if ours else f"{category.__name__}: {message} ({Path(filename).name}, line {line})"
    ERR.print(Text("warning: ", style="bold yellow").append(plain(said), style="default"), soft_wrap=True)


def _report_defect(error: Exception) -> None:
    """Say that the program has a defect, and keep what a developer needs in a file."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    with tempfile.NamedTemporaryFile("w", prefix="vgtsim-defect-", suffix=".txt", delete=False) as file:
        file.write(f"vgtsim {__version__}, Python {sys.version}\n{shlex.join(sys.argv)}\n\n")
        traceback.print_exception(error, file=file)
    where = f"{Path(frame.filename).name}, line {frame.lineno}"
    said = f"a defect of vgtsim, not of your input: {type(error).__name__}: {error} ({where})"
    _complain(f"{said}; please report it with {file.name}", Status.DEFECT)


def plain(message: str) -> str:
    """A message of bearable length without signs that steer a terminal."""
    if len(message) > _LONGEST:
        message = f"{message[: _LONGEST // 2]} ... {message[-_LONGEST // 2 :]}"
    return "".join(sign if sign.isprintable() or sign == "\n" else repr(sign)[1:-1] for sign in message)


def complain(error: VgtError) -> None:
    """Print an error with its picture, where it has one."""
    ERR.print(
        Text("error: ", style="bold red").append(plain(f"{error}{_picture(error)}"), style="default"), soft_wrap=True
    )


def _complain(message: str, status: Status) -> None:
    ERR.print(Text("error: ", style="bold red").append(plain(message), style="default"), soft_wrap=True)
    sys.exit(status)
