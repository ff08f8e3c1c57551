"""Verbs for a scene and for the folder of its run."""

from __future__ import annotations

from collections.abc import Sequence
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
    from vgtsim.description import Scene
    from vgtsim.log import LogBook, LogSource
    from vgtsim.plant import Programme
    from vgtsim.site import Site
    from vgtsim.verification import PlannedTour, Report


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
    from vgtsim.output import PHASES, stage_results, write_mission, write_verdict
    from vgtsim.plant import carry_waste
    from vgtsim.verification import JudgedRun, join_phases

    sites = _list_sites(scene_name)
    folder = out or Path("out") / sites[0].task.name
    programmes = _prepare(sites)
    with stage_results(folder, resume=resume) as stage:
        runs: list[JudgedRun] = []
        for number, (described, programme) in enumerate(zip(sites, programmes, strict=True), start=1):
            place = stage / PHASES / str(number) if len(sites) > 1 else stage
            site = carry_waste(described, runs[-1].source) if runs else described
            log, report = _play(site, programme, place, resume=resume)
            runs.append(JudgedRun(site, log, report))
            if len(sites) > 1:
                write_verdict(JudgedRun(site, log, report), place)  # apart, whose records are let go again
            if log.stopped:
                break
        if len(sites) == 1:
            report = runs[0].report
            missing = write_verdict(runs[0], stage, video=video)
        else:
            report = join_phases(runs)
            missing = write_mission(runs, report, stage, video=video)
    show_report(report, folder)
    finish(report.passed, missing)


def _list_sites(scene_name: Path) -> list[Site]:
    """Sites of a scene: one, or one for each phase of a mission in phases."""
    from vgtsim.description import list_phases
    from vgtsim.site import Site, load_site

    site = load_site(scene_name)
    phases = list_phases(site.scene)
    return [site] if len(phases) == 1 else [Site(scene) for scene in phases]


def _play(site: Site, programme: Programme, folder: Path, *, resume: bool) -> tuple[LogBook, Report]:
    """Simulate a programme and judge its log, both in a folder."""
    from vgtsim.log import open_log
    from vgtsim.mjcf import write_scene_files
    from vgtsim.output import LOG
    from vgtsim.planning import Tour
    from vgtsim.plant import begin_log, record
    from vgtsim.verification import verify as judge

    folder.mkdir(parents=True, exist_ok=True)
    write_scene_files(site, programme.legs[0].q if isinstance(programme, Tour) else site.start, folder)
    writer = begin_log(site, programme, folder / LOG, resume=resume)
    if not writer.ended:
        record(site, programme, writer)
    log = open_log(folder / LOG)
    with ERR.status("verifying"):
        return log, judge(site, log, _expect(site, programme, log))


def _prepare(sites: Sequence[Site]) -> Sequence[Programme]:
    """Plan the tour of a site, or those of a mission's phases, or take the record of an operator."""
    from vgtsim.control import check_operation
    from vgtsim.planning import plan_phases

    site = sites[0]
    if site.task.operator is not None:
        check_operation(site)
        return [site.scene.commands]
    with ERR.status("planning the tour"):
        return plan_phases(sites)


def _expect(site: Site, programme: Programme, log: LogSource) -> PlannedTour:
    """What a log is held against: the tour as it was revised in the run, or what the controller commands again."""
    from vgtsim.control import rehearse
    from vgtsim.planning import Tour, revise_as_run

    return revise_as_run(site, programme, log.revisions) if isinstance(programme, Tour) else rehearse(site, log)


@app.command(epilog="Example: vgtsim build type_ii_reach --out out/model")
def build(description: SceneOrArm, out: OutFolder = None) -> None:
    """Write the MuJoCo model of a scene, or of an arm alone, as XML and MJB."""
    from vgtsim.description import find_file, is_scene
    from vgtsim.kinematics.modules.stroke_boxes import check_strokes
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
    from vgtsim.output import find_results, list_runs, prepare_folder, write_mission, write_pdf, write_reports
    from vgtsim.plant import carry_waste
    from vgtsim.site import Site
    from vgtsim.verification import JudgedRun, join_phases
    from vgtsim.verification import verify as judge

    root = find_results(folder)
    loaded = [open_run(path) for path in list_runs(root)]
    found = [_choose_scene(copy) for _, copy, _ in loaded]
    sites = [Site(scene) for scene, _ in found]
    phase = sites[0].task.phase
    lacking = phase is not None and len(sites) < phase.count
    more = ("the commands are held against the plan only with all phases of the mission",) if lacking and plan else ()
    programmes = _prepare(sites) if plan and not lacking else None
    runs = []
    for index, ((place, _, log), site, (_, notes)) in enumerate(zip(loaded, sites, found, strict=True)):
        with ERR.status("verifying"):
            here = carry_waste(site, runs[-1].source) if runs else site
            report = judge(here, log, _expect(here, programmes[index], log) if programmes else None, (*notes, *more))
        write_reports(JudgedRun(here, log, report), prepare_folder(place))  # likewise
        runs.append(JudgedRun(here, log, report))
    report, missing = runs[0].report, None
    if loaded[0][0] != root:
        report = join_phases(runs)
        missing = write_mission(runs, report, root)
    elif pdf:
        missing = write_pdf(runs[0], root)
    show_report(report, root)
    finish(report.passed, missing)


def _choose_scene(copy: Scene) -> tuple[Scene, tuple[str, ...]]:
    """The scene that a log is judged by, of its file or else its own copy, with notes on how they differ."""
    from vgtsim.description import find_original, pick_phase
    from vgtsim.geometry import place_goals
    from vgtsim.site import Site

    scene, notes = find_original(copy, lambda whole: pick_phase(place_goals(whole), copy))
    site, held = Site(scene), Site(copy)
    if site.truss.member_names != held.truss.member_names or len(site.stages) != len(held.stages):
        changed = "the arm or the goals of the scene's file are others now: limits and description are those of the log"
        return copy, (*notes, changed)
    return scene, notes


@app.command(epilog="Example: vgtsim render out/type_ii_reach --camera tool")
def render(
    folder: RunFolder,
    camera: Annotated[str | None, typer.Option(help="One camera for the whole film.", show_default=False)] = None,
) -> None:
    """Film the log of a run."""
    from vgtsim.output import film_runs, find_results, list_runs
    from vgtsim.site import Site
    from vgtsim.verification import JudgedRun
    from vgtsim.verification import verify as judge

    place, runs = find_results(folder), []
    for path in list_runs(place):
        _, scene, log = open_run(path)
        site = Site(scene)
        runs.append(JudgedRun(site, log, judge(site, log)))
    list_files(film_runs(runs, place, camera))


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
    from vgtsim.verification import find_instant

    place, scene, log = open_run(folder)
    site = Site(scene)
    list_files(*write_truss(site, find_instant(site, log, time), prepare_folder(place), vtk=vtk))


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
