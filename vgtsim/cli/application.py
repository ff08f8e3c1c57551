"""The program, the common parts of its verbs, and its exit statuses."""

from __future__ import annotations

import sys
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from vgtsim import __version__
from vgtsim.errors import DivergenceError, MissingLibraryError, VgtError

if TYPE_CHECKING:  # the checks load SciPy, which `--help` does without
    from vgtsim.verification import Report

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Simulate a long-reach variable-geometry-truss arm in a waste tank, and verify every claim about it.",
)
OUT = Console(width=None if sys.stdout.isatty() else 140)  # a pipe has no width of its own
ERR = Console(stderr=True)


class Status(IntEnum):
    """Exit statuses."""

    PASSED = 0
    FAILED = 1
    BAD_INPUT = 2
    DIVERGED = 3
    MISSING_LIBRARY = 4


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


def show_report(report: Report, folder: Path) -> None:
    """Print the checks of a report as a table."""
    table = Table("check", "measured", "limit", "unit", "where", "t/s", title=f"{report.scene}")
    for check in report.checks:
        colour = "green" if check.passed else "bold red"
        sign = "<=" if check.sense == "at most" else ">="
        table.add_row(
            f"{check.name}: {check.quantity}",
            f"[{colour}]{check.measured:.3g}[/]",
            f"{sign} {check.limit:.3g}",
            check.unit,
            check.where,
            f"{check.when:.2f}",
        )
    OUT.print(table)
    factor = report.performance["real_time_factor"]
    OUT.print(f"{'PASSED' if report.passed else 'FAILED'}; {factor:.1f} times real time; {folder / 'report.html'}")


def finish(passed: bool, missing: MissingLibraryError | None) -> None:
    """End with the status of a verdict, or with the error that kept part of the work from being done."""
    if missing is not None:
        raise missing
    raise typer.Exit(Status.PASSED if passed else Status.FAILED)


def main() -> None:
    """Run the command line and turn errors into exit statuses."""
    try:
        app()
    except MissingLibraryError as error:
        _complain(str(error), Status.MISSING_LIBRARY)
    except DivergenceError as error:
        _complain(str(error), Status.DIVERGED)
    except VgtError as error:
        _complain(str(error), Status.BAD_INPUT)


def _complain(message: str, status: Status) -> None:
    ERR.print(f"[bold red]error:[/] {escape(message)}", soft_wrap=True, highlight=False)
    sys.exit(status)
