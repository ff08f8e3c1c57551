"""The command line: each stage of the spine is a verb that leaves a file."""

from __future__ import annotations

import math
import sys
from enum import IntEnum
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from vgtsim import __version__
from vgtsim.control.inverse import Method
from vgtsim.description import load_manipulator, load_scene
from vgtsim.description.files import is_scene
from vgtsim.errors import DivergenceError, MissingLibraryError, VgtError
from vgtsim.runlog import RunLog, load_run
from vgtsim.verification.report import Report

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode="rich",
    help="Simulate a long-reach variable-geometry-truss arm in a waste tank, and verify every claim about it.",
)
MODELS = Path(__file__).parents[1] / "models"
_LISTED_SAMPLE = 500  # configurations that the listed reach is the greatest of
_out = Console(width=None if sys.stdout.isatty() else 140)  # a pipe has no width of its own
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
ArmFile = Annotated[Path, typer.Argument(help="TOML file of an arm.", show_default=False)]
OutFolder = Annotated[Path | None, typer.Option("--out", help="Folder for the results, by default out/NAME.")]


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
    from vgtsim.output.write import clear_folder, prepare_folder, save_log, write_outputs
    from vgtsim.simulation import run as simulate
    from vgtsim.verification import verify as judge

    scene = load_scene(scene_file)
    chain = scene_chain(scene)
    check_scene(scene, chain)
    folder = out or Path("out") / scene.task.name
    with _err.status("planning the tour"):
        program = make_program(scene, chain)
    clear_folder(prepare_folder(folder))
    first_goal = program.legs[0].q
    write_scene_files(scene, first_goal, folder)
    model = build_model(scene, {"first_goal": first_goal})
    try:
        log = simulate(model, program, scene)
    except DivergenceError as error:
        if isinstance(error.log, RunLog):
            save_log(scene, error.log, folder)
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
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.kinematics.sampling import check_strokes
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
        check_strokes(Chain(manipulator, hanging_mount(0.0)))
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


@app.command(epilog="Example: vgtsim capacity models/arm15/arm15.toml")
def capacity(
    model_file: Annotated[Path, typer.Argument(help="TOML file of an arm.", show_default=False)],
    out: OutFolder = None,
    payload: Annotated[float, typer.Option(help="Payload of the sag, kg.")] = 453.59237,
    safety_factor: Annotated[float, typer.Option(help="Omega of AISC 360.")] = 1.67,
    resolve: Annotated[bool, typer.Option("--resolve/--plane-only", help="Unload what governs by redundancy.")] = True,
) -> None:
    """Map what an arm may carry over radius and depth, what governs, and how far the tip sags."""
    import numpy as np

    from vgtsim.control.capacity import unload
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.output.capacity_map import write_capacity
    from vgtsim.output.write import prepare_folder
    from vgtsim.statics.capacity import draw_shapes, map_capacity

    arm, gravity = load_manipulator(model_file), 9.80665
    chain = Chain(arm, hanging_mount(0.0))
    with _err.status("solving shapes"):
        plane = map_capacity(chain, draw_shapes(chain), gravity, safety_factor, payload)
        moved = unload(chain, plane.q, payload, gravity, safety_factor) if resolve else plane.q[:0]
        found = map_capacity(chain, np.concatenate([plane.q, moved]), gravity, safety_factor, payload)
    for file in write_capacity(found, f"{arm.name}: {arm.title}", prepare_folder(out or Path("out") / arm.name)):
        _out.print(str(file), soft_wrap=True)
    far, least = int(found.radius.argmax()), int(found.payload.argmin())
    for words, i in (("at full reach", far), ("least", least)):
        _out.print(
            f"{words}: {found.payload[i]:.0f} kg at radius {found.radius[i]:.2f} m, depth {found.depth[i]:.2f} m, "
            f"by {found.limit[i]} of {found.member[i]}; sag {found.sag[i]:.3f} m with {found.reference:.0f} kg"
        )
    if resolve:
        gain = found.payload / plane.payload - 1
        _out.print(
            f"postures out of the plane carry {np.median(gain):.0%} more in the median of {len(gain)} cells, "
            f"{gain.max():.0%} at most; {np.mean(gain > 0.01):.0%} of the cells gain"
        )


@app.command(epilog="Example: vgtsim size models/arm15/arm15.toml --task scenes/type_ii_reach.toml --out sized.toml")
def size(
    model_file: Annotated[Path, typer.Argument(help="TOML file of an arm.", show_default=False)],
    task: Annotated[Path, typer.Option("--task", help="Scene whose tour and load cases it must stand.")],
    out: Annotated[Path, typer.Option("--out", help="File of the sized arm.")] = Path("sized.toml"),
    reserve: Annotated[float, typer.Option(help="Part of every strength kept back.", min=0.0, max=0.9)] = 0.05,
    catalogue_file: Annotated[Path | None, typer.Option("--catalogue", help="TOML file [default: built in].")] = None,
    anywhere: Annotated[bool, typer.Option("--anywhere/--tour-only", help="Any posture beside the tour too.")] = True,
) -> None:
    """Choose tubes and cylinders from a catalogue so that nothing is overloaded over a scene's tour and load cases."""
    import dataclasses

    from vgtsim.control.design import design_arm
    from vgtsim.description.catalogue import load_catalogue, write_sized_arm

    catalogue = load_catalogue(catalogue_file)
    scene = dataclasses.replace(load_scene(task), manipulator=load_manipulator(model_file))
    with _err.status("planning tours and choosing sizes"):
        design = design_arm(scene, catalogue, 1 - reserve, anywhere=anywhere)
    found, (tour, beside) = design.sizing, design.poses
    reach = " and in any posture" if anywhere else ""
    reason = f"{reserve:.0%} in reserve over the tour of {scene.task.name}{reach}, cases {', '.join(design.cases)}"
    write_sized_arm(model_file, out, found.manipulator, catalogue, reason)
    title = f"{scene.manipulator.name}: {tour} poses of the tour, {beside} beside it; {found.passes} passes"
    table = Table("module", "member", "section", "used", title=title)
    for place, section in found.chosen.items():
        used = found.utilisation.get(place)
        table.add_row(*place, section, "tip plate" if used is None else f"{used:.2f}")
    _out.print(table)
    _out.print(f"arm of {found.mass[0]:.0f} kg, now {found.mass[1]:.0f} kg; {out}", soft_wrap=True)


@app.command(epilog="Example: vgtsim export out/type_ii_reach --time 12.5")
def export(
    folder: RunFolder,
    time: Annotated[float | None, typer.Option(help="Simulated time, s [default: of the greatest force].")] = None,
    vtk: Annotated[bool, typer.Option("--vtk/--no-vtk", help="Also write truss.vtu, for ParaView.")] = True,
) -> None:
    """Write the truss of one instant with loads and forces, for other tools: JSON, PyNiteFEA, VTK."""
    from vgtsim.mjcf import scene_chain
    from vgtsim.output.truss_export import write_truss
    from vgtsim.output.write import prepare_folder

    scene, log = load_run(folder / "run.npz")
    for file in write_truss(scene, log, scene_chain(scene), prepare_folder(folder), time, vtk=vtk):
        _out.print(str(file), soft_wrap=True)


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


@app.command(epilog="Example: vgtsim models")
def models(
    folder: Annotated[Path, typer.Argument(help="Folder of arms, NAME/NAME.toml each.")] = MODELS,
) -> None:
    """List the shipped arms with degrees of freedom, reach and mass."""
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.kinematics.workspace import sample_workspace
    from vgtsim.statics.loads import weigh

    table = Table("name", "degrees of freedom", "modules", "reach/m", "mass/kg", "what it is")
    for file in sorted(folder.glob("*/*.toml")):
        arm = load_manipulator(file)
        chain = Chain(arm, hanging_mount(0.0))
        reach = sample_workspace(chain, _LISTED_SAMPLE, seed=0).reach
        freedom = chain.layout.actuators
        row = (arm.name, str(freedom), str(len(arm.modules)), f"{reach:.1f}", f"{weigh(chain):.0f}", arm.title)
        table.add_row(*row)
    _out.print(table)


@app.command(epilog="Example: vgtsim show models/mixed/mixed.toml --out out/mixed")
def show(arm_file: ArmFile, out: OutFolder = None) -> None:
    """Draw an arm as PNG and SVG line drawing, and export it as GLB and STL."""
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.mjcf.build import reach_pose
    from vgtsim.output.arm_drawing import draw_arm, make_solid, write_drawing, write_solid
    from vgtsim.output.write import prepare_folder

    arm = load_manipulator(arm_file)
    chain = Chain(arm, hanging_mount(0.0))
    stem = prepare_folder(out or Path("out") / arm.name) / arm.name
    bent = reach_pose(chain)
    files = write_drawing(draw_arm(chain, {"straight": chain.straight, "bent": bent}), stem)
    for file in (*files, *write_solid(make_solid(chain, chain.nodes(bent)), stem)):
        _out.print(str(file), soft_wrap=True)


@app.command(epilog="Example: vgtsim workspace models/arm15/arm15.toml --samples 20000")
def workspace(
    arm_file: ArmFile,
    out: OutFolder = None,
    samples: Annotated[int, typer.Option(min=10, help="Number of configurations.")] = 5000,
    seed: Annotated[int, typer.Option(help="Of the random numbers.")] = 0,
) -> None:
    """Sample what an arm reaches: volume, tilt range, dexterity and singular regions, drawn and in figures."""
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.kinematics.sampling import check_strokes
    from vgtsim.kinematics.workspace import NEAR_SINGULAR, sample_workspace
    from vgtsim.output.arm_drawing import write_drawing
    from vgtsim.output.workspace_plot import plot_workspace
    from vgtsim.output.write import prepare_folder

    arm = load_manipulator(arm_file)
    chain = Chain(arm, hanging_mount(0.0))
    check_strokes(chain)
    found = sample_workspace(chain, samples, seed)
    least, most = (float(value) for value in (found.dexterity.min(), found.dexterity.max()))
    table = Table("quantity", "value", title=f"{arm.name}: {samples} configurations, seed {seed}")
    table.add_row("reach", f"{found.reach:.3f} m")
    table.add_row("reachable volume, at least", f"{found.volume:.3g} m³ in cells of {found.cell:.3g} m")
    table.add_row("greatest tilt of the tool", f"{math.degrees(float(found.tilt.max())):.1f} degrees")
    table.add_row("directions the tool can move in", str(found.mobility))
    table.add_row("dexterity, least to greatest", f"{least:.3g} to {most:.3g}")
    table.add_row("least singular value of a module", f"{float(found.singular.min()):.3g}")
    table.add_row(f"configurations with one below {NEAR_SINGULAR}", f"{100 * found.near_singular:.2g} %")
    _out.print(table)
    stem = prepare_folder(out or Path("out") / arm.name) / "workspace"
    for file in write_drawing(plot_workspace(found, arm.title), stem):
        _out.print(str(file), soft_wrap=True)


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
    _err.print(f"[bold red]error:[/] {escape(message)}", soft_wrap=True, highlight=False)
    sys.exit(status)
