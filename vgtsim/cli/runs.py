"""Verbs for a scene and for the folder of its run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vgtsim.cli.application import (
    ERR,
    OutFolder,
    RunFolder,
    SceneName,
    SceneOrArm,
    app,
    finish,
    list_files,
    open_run,
    show_report,
)

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vgtsim.logbook import LogWriter
    from vgtsim.site import Site
    from vgtsim.stretch import LogSource
    from vgtsim.verification.evidence import PlannedTour


@app.command(epilog="Example: vgtsim run type_ii_reach --video")
def run(
    scene_name: SceneName,
    out: OutFolder = None,
    video: Annotated[bool, typer.Option("--video", help="Film the run.")] = False,
    resume: Annotated[bool, typer.Option("--resume", help="End the interrupted run in the folder.")] = False,
) -> None:
    """Plan, simulate and verify a scene; leave model, log and report (and video) in a folder.

    The results of an earlier run stay there until the new ones are whole. Of a run that is interrupted the log is kept, and
    `--resume` ends it with the same log.
    """
    from vgtsim.logbook import open_log
    from vgtsim.mjcf import write_scene_files
    from vgtsim.output import LOG, stage_results, write_verdict
    from vgtsim.site import load_site
    from vgtsim.verification import verify as judge

    site = load_site(scene_name)
    folder = out or Path("out") / site.task.name
    programme = _prepare(site)
    with stage_results(folder, resume=resume) as stage:
        write_scene_files(site, programme.pose, stage)
        writer = programme.begin(stage / LOG, resume)
        if not writer.ended:
            programme.record(writer)
        log = open_log(stage / LOG)
        with ERR.status("verifying"):
            report = judge(site, log, programme.plan(log))
        missing = write_verdict(site, log, report, stage, video=video)
    show_report(report, folder)
    finish(report.passed, missing)


@dataclass(frozen=True)
class _Programme:
    """What a scene's run plays: how its log is begun and recorded, inputs for a picture, and the plan of a log."""

    pose: NDArray[np.float64]
    begin: Callable[[Path, bool], LogWriter]
    record: Callable[[LogWriter], None]
    plan: Callable[[LogSource], PlannedTour]


def _prepare(site: Site) -> _Programme:
    """Plan the tour of a site, or take the record of its operator."""
    from vgtsim.control import check_operation, rehearse
    from vgtsim.planning import plan_site
    from vgtsim.plant import begin_log, begin_operation, record, record_operation

    if site.task.operator is not None:
        check_operation(site)
        return _Programme(
            pose=site.start,
            begin=lambda folder, resume: begin_operation(site, folder, resume=resume),
            record=lambda writer: record_operation(site, writer),
            plan=lambda log: rehearse(site, log),
        )
    with ERR.status("planning the tour"):
        tour = plan_site(site)
    return _Programme(
        pose=tour.legs[0].q,
        begin=lambda folder, resume: begin_log(site, tour, folder, resume=resume),
        record=lambda writer: record(site, tour, writer),
        plan=lambda _: tour,
    )


@app.command(epilog="Example: vgtsim build type_ii_reach --out out/model")
def build(description: SceneOrArm, out: OutFolder = None) -> None:
    """Write the MuJoCo model of a scene, or of an arm alone, as XML and MJB."""
    from vgtsim.description import find_file, is_scene
    from vgtsim.kinematics.stroke_boxes import check_strokes
    from vgtsim.mjcf import write_arm_files, write_scene_files
    from vgtsim.output import prepare_folder
    from vgtsim.planning import check_site, solve_first_goal
    from vgtsim.site import load_arm, load_site

    file = find_file(description, "scene", "arm")
    if is_scene(file):
        site = load_site(file)
        check_site(site)
        files = write_scene_files(site, solve_first_goal(site), prepare_folder(out or Path("out") / site.task.name))
    else:
        arm = load_arm(file)
        check_strokes(arm)
        name = arm.manipulator.name
        beside = file.parent if file == description else Path("out") / name  # not among the shipped files
        files = write_arm_files(arm.manipulator, prepare_folder(out or beside))
    list_files(*files)


@app.command(epilog="Example: vgtsim verify out/type_ii_reach")
def verify(
    folder: RunFolder,
    plan: Annotated[
        bool, typer.Option("--plan/--no-plan", help="Hold the commands against the plan, made again.")
    ] = True,
    pdf: Annotated[bool, typer.Option("--pdf", help="Also write report.pdf; needs vgtsim[pdf].")] = False,
) -> None:
    """Make every check again from the log of a run, by its scene's file where that is there; write the report again."""
    from vgtsim.description import find_original
    from vgtsim.geometry import place_goals
    from vgtsim.output import prepare_folder, write_pdf, write_reports
    from vgtsim.site import Site
    from vgtsim.verification import verify as judge

    place, copy, log = open_run(folder)
    scene, notes = find_original(copy, place_goals)
    site, held = Site(scene), Site(copy)
    if site.truss.member_names != held.truss.member_names or len(site.task.stages) != len(held.task.stages):
        notes += (
            "the arm or the goals of the scene's file are others now: limits and description are those of the log",
        )
        site = held
    with ERR.status("verifying"):
        report = judge(site, log, _prepare(site).plan(log) if plan else None, notes)
    write_reports(site, log, report, prepare_folder(place))
    missing = write_pdf(site, log, report, place) if pdf else None
    show_report(report, place)
    finish(report.passed, missing)


@app.command(epilog="Example: vgtsim render out/type_ii_reach --camera tool")
def render(
    folder: RunFolder,
    camera: Annotated[str | None, typer.Option(help="One camera for the whole film.", show_default=False)] = None,
) -> None:
    """Film the log of a run."""
    from vgtsim.output import film
    from vgtsim.site import Site
    from vgtsim.verification import verify as judge

    place, scene, log = open_run(folder)
    site = Site(scene)
    list_files(film(site, log, judge(site, log), place, camera))


@app.command(epilog="Example: vgtsim export out/type_ii_reach --time 12.5")
def export(
    folder: RunFolder,
    time: Annotated[float | None, typer.Option(help="Simulated time, s [default: of the greatest force].")] = None,
    vtk: Annotated[bool, typer.Option("--vtk/--no-vtk", help="Also write truss.vtu, for ParaView.")] = True,
) -> None:
    """Write the truss of one instant with loads and forces, for other tools: JSON, PyNiteFEA, VTK."""
    from vgtsim.output import prepare_folder
    from vgtsim.output.truss_export import write_truss
    from vgtsim.site import Site

    place, scene, log = open_run(folder)
    list_files(*write_truss(Site(scene), log, prepare_folder(place), time, vtk=vtk))


@app.command(epilog="Example: vgtsim view out/type_ii_reach/scene.xml")
def view(
    model_file: Annotated[
        Path, typer.Argument(help="Generated .xml or .mjb, or name of a shipped arm.", show_default=False)
    ],
) -> None:
    """Open a generated model in MuJoCo's viewer with its scaled weights."""
    from vgtsim.graphics import require_display
    from vgtsim.mjcf import load_model

    model = load_model(model_file)
    require_display()
    import mujoco.viewer

    mujoco.viewer.launch(model)
