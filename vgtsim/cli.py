"""The command line: each stage of the spine is a verb that leaves a file."""

from __future__ import annotations

import sys
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from vgtsim import __version__
from vgtsim.control.inverse import Method
from vgtsim.description import load_manipulator, load_scene
from vgtsim.description.files import is_scene
from vgtsim.errors import DivergenceError, MissingLibraryError, VgtError
from vgtsim.runlog import RunLog, load_run, save_run
from vgtsim.verification.report import Report

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Simulate a long-reach variable-geometry-truss arm in a waste tank, and verify every claim about it.",
)
_out = Console()
_err = Console(stderr=True)


class Status(IntEnum):
    """Exit statuses."""

    PASSED = 0
    FAILED = 1
    BAD_INPUT = 2
    DIVERGED = 3
    MISSING_LIBRARY = 4


SceneFile = Annotated[Path, typer.Argument(help="TOML file of a scene.", show_default=False)]
RunFolder = Annotated[Path, typer.Argument(help="Folder that `vgtsim run` left.", show_default=False)]
OutFolder = Annotated[Path | None, typer.Option("--out", help="Folder for the results [default: out/NAME].")]


@app.callback(invoke_without_command=True)
def _root(version: Annotated[bool, typer.Option("--version", help="Print the version.")] = False) -> None:
    if version:
        _out.print(__version__)
        raise typer.Exit


@app.command(epilog="Example: vgtsim run scenes/type_ii_reach.toml --video")
def run(
    scene_file: SceneFile,
    out: OutFolder = None,
    video: Annotated[bool, typer.Option("--video", help="Film the run.")] = False,
) -> None:
    """Plan, simulate and verify a scene; leave model, log and report (and video) in a folder."""
    from vgtsim.control.program import check_scene, make_program
    from vgtsim.mjcf import build_model, scene_chain
    from vgtsim.mjcf.files import write_scene_files
    from vgtsim.output.write import prepare_folder, write_outputs
    from vgtsim.simulation import run as simulate
    from vgtsim.verification import verify as judge

    scene = load_scene(scene_file)
    chain = scene_chain(scene)
    check_scene(scene, chain)
    folder = out or Path("out") / scene.task.name
    with _err.status("planning the tour"):
        program = make_program(scene, chain)
    prepare_folder(folder)
    first_goal = program.legs[0].q
    write_scene_files(scene, first_goal, folder)
    model = build_model(scene, {"first_goal": first_goal})
    try:
        log = simulate(model, program, scene)
    except DivergenceError as error:
        if isinstance(error.log, RunLog):
            save_run(folder / "run.npz", scene, error.log)
        raise
    with _err.status("verifying"):
        report = judge(scene, log)
    missing = write_outputs(scene, log, report, chain, folder, video=video)
    _show(report, folder)
    _finish(report.passed, missing)


@app.command(epilog="Example: vgtsim build scenes/type_ii_reach.toml --out out/model")
def build(
    description: Annotated[Path, typer.Argument(help="TOML file of a scene or of an arm.", show_default=False)],
    out: OutFolder = None,
) -> None:
    """Write the MuJoCo model of a scene, or of an arm alone, as XML and MJB."""
    from vgtsim.control.program import check_scene, solve_first_goal
    from vgtsim.mjcf import scene_chain
    from vgtsim.mjcf.files import write_arm_files, write_scene_files
    from vgtsim.output.write import prepare_folder

    if is_scene(description):
        scene = load_scene(description)
        chain = scene_chain(scene)
        check_scene(scene, chain)
        folder = prepare_folder(out or Path("out") / scene.task.name)
        files = write_scene_files(scene, solve_first_goal(scene, chain), folder)
    else:
        manipulator = load_manipulator(description)
        files = write_arm_files(manipulator, prepare_folder(out or description.parent) / manipulator.name)
    for file in files:
        _out.print(str(file), soft_wrap=True)


@app.command(epilog="Example: vgtsim verify out/type_ii_reach")
def verify(folder: RunFolder) -> None:
    """Make every check again from a folder's log, and write its report anew."""
    from vgtsim.mjcf import scene_chain
    from vgtsim.output.write import prepare_folder, write_reports
    from vgtsim.verification import verify as judge

    scene, log = load_run(folder / "run.npz")
    report = judge(scene, log)
    write_reports(scene, log, report, scene_chain(scene), prepare_folder(folder))
    _show(report, folder)
    _finish(report.passed, None)


@app.command(epilog="Example: vgtsim render out/type_ii_reach --camera tool")
def render(
    folder: RunFolder,
    camera: Annotated[str | None, typer.Option(help="One camera for the whole film.", show_default=False)] = None,
) -> None:
    """Film a folder's log."""
    from vgtsim.mjcf import scene_chain
    from vgtsim.output.write import film
    from vgtsim.verification import verify as judge

    scene, log = load_run(folder / "run.npz")
    path = film(scene, log, judge(scene, log), scene_chain(scene), folder, camera)
    _out.print(str(path), soft_wrap=True)


@app.command(epilog="Example: vgtsim view out/type_ii_reach/scene.xml")
def view(
    model_file: Annotated[Path, typer.Argument(help="Generated .xml or .mjb.", show_default=False)],
) -> None:
    """Open a generated model in MuJoCo's viewer with its scaled weights."""
    from vgtsim.mjcf import load_model

    model = load_model(model_file)
    try:
        import mujoco.viewer

        mujoco.viewer.launch(model)
    except (ImportError, RuntimeError) as error:
        raise MissingLibraryError(f"a display ({error})", "run it on a desktop, or use `vgtsim render`") from None


@app.command(epilog="Example: vgtsim ik scenes/type_ii_reach.toml --position 8 2 1 --direction 1 0 0 --plot ik.svg")
def ik(
    description: Annotated[Path, typer.Argument(help="TOML file of a scene or of an arm.", show_default=False)],
    position: Annotated[tuple[float, float, float], typer.Option(help="Tool point in the tank's frame, m.")],
    direction: Annotated[tuple[float, float, float], typer.Option(help="Tool direction in the tank's frame.")],
    method: Annotated[Method, typer.Option(help="How redundancy is resolved.")] = Method.NULLSPACE,
    objective: Annotated[list[str] | None, typer.Option(help="NAME or NAME:WEIGHT; may be repeated.")] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the posture to this .svg or .png file.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the solution to this file.")] = None,
) -> None:
    """Find a posture for a tool goal; an arm alone hangs with its base face at the origin."""
    from vgtsim.control.inverse import Request, answer_as_json, solve_request
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.mjcf import scene_chain

    scene = load_scene(description) if is_scene(description) else None
    chain = scene_chain(scene) if scene else Chain(load_manipulator(description), hanging_mount(0.0))
    answer = solve_request(chain, Request(position, direction, method, tuple(objective or ("mid_stroke",))), scene)
    table = Table("row", "desired", "reached", "residual", title=f"{chain.manipulator.name}: {method}")
    for row in answer.rows:
        wanted = ["" if value is None else f"{value:.6f}" for value in (row.desired, row.reached)]
        table.add_row(row.name, *wanted, f"{row.residual:.2e}")
    _out.print(table)
    for name, value in answer.facts.items():
        _out.print(f"{name}: {value}", soft_wrap=True)
    if json_file is not None:
        json_file.write_text(answer_as_json(answer), encoding="utf-8")
    if plot is not None:
        from vgtsim.output.posture_plot import draw_posture

        draw_posture(chain, answer.q, position, plot)


def _show(report: Report, folder: Path) -> None:
    table = Table("check", "measured", "limit", "unit", "where", "t/s", title=f"{report.scene}")
    for check in report.checks:
        colour = "green" if check.passed else "bold red"
        sign = "<=" if check.sense == "at most" else ">="
        row = (
            f"{check.name}: {check.quantity}",
            f"[{colour}]{check.measured:.3g}[/]",
            f"{sign} {check.limit:.3g}",
            check.unit,
            check.where,
            f"{check.when:.2f}",
        )
        table.add_row(*row)
    _out.print(table)
    factor = report.performance["real_time_factor"]
    _out.print(f"{'PASSED' if report.passed else 'FAILED'}; {factor:.1f} times real time; {folder / 'report.html'}")


def _finish(passed: bool, missing: MissingLibraryError | None) -> None:
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
    _err.print(f"[bold red]error:[/] {message}", soft_wrap=True, highlight=False)
    sys.exit(status)
