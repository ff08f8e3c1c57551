"""The verb that draws: arms, tanks and scenes, and runs for a browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vgtsim.cli.application import ERR, OUT, OutFolder, app, list_files, open_run


@app.command(epilog="Example: vgtsim show mixed --lengths 'm1=36 in,1.0,38 in' --inputs 'h1=60 deg'")
def show(
    name: Annotated[
        Path,
        typer.Argument(
            help="TOML file of an arm, a tank or a scene, or name of a shipped one; or a run's folder.",
            show_default=False,
        ),
    ],
    out: OutFolder = None,
    web: Annotated[
        bool, typer.Option("--web", help="The run as one page to play in a browser; needs vgtsim[live].")
    ] = False,
    lengths: Annotated[list[str] | None, typer.Option(help="MODULE=l1,l2,...: actuator lengths; repeatable.")] = None,
    inputs: Annotated[list[str] | None, typer.Option(help="MODULE=x1,...: canonical inputs; repeatable.")] = None,
) -> None:
    """Draw an arm, a tank, or a scene with its start and goals, as PNG and SVG; export an arm as GLB and STL.

    An arm is drawn straight and bent, or in a given pose. A tank and a scene are drawn from the side and from above, with
    azimuths. A run becomes replay.html in its folder, or what --out names: a folder, or a file that ends in .html.
    """
    from vgtsim.description import find_file, tell_file
    from vgtsim.errors import DescriptionError

    folder = (name / "log").is_dir()
    if web and (lengths or inputs):
        raise DescriptionError(None, "--web", "a pose", "the folder of a run alone")
    if web and not folder:
        raise DescriptionError(name, "--web", "no log of a run", "the folder that `vgtsim run` left")
    if folder and not web:
        raise DescriptionError(name, "", "the folder of a run", "a run with --web; or an arm, a tank or a scene")
    if web:
        _show_run(name, out)
        return
    file = find_file(name, "arm", "scene", "tank")
    kind = tell_file(file)
    pose = lengths or (), inputs or ()
    if kind == "tank" and any(pose):
        raise DescriptionError(file, "--lengths" if lengths else "--inputs", "a pose of a tank", "a pose of an arm")
    if kind == "tank":
        _show_tank(file, out)
    elif kind == "scene":
        _show_scene(file, out, pose)
    else:
        _show_arm(file, out, pose)


def _show_run(folder: Path, out: Path | None) -> None:
    from vgtsim.output import REPLAY, naming_folder, prepare_file
    from vgtsim.site import Site
    from vgtsim.verification import verify
    from vgtsim.web import write_recording

    place, scene, log = open_run(folder)
    path = out if out is not None and out.suffix == ".html" else (out or place) / REPLAY
    prepare_file(path)
    site = Site(scene)
    with ERR.status("verifying"):
        report = verify(site, log)
    with naming_folder(path.parent), ERR.status("recording"):
        recording = write_recording(site, log, report, path)
    list_files(path)
    size = f"{recording.size / 1e6:.1f} MB"
    OUT.print(f"{recording.frames} frames of {recording.records} records, {size}", soft_wrap=True)


def _show_tank(file: Path, out: Path | None) -> None:
    from vgtsim.description import load_tank
    from vgtsim.output import prepare_folder
    from vgtsim.output.arm_drawing import write_drawing
    from vgtsim.output.scene_drawing import draw_tank

    tank = load_tank(file)
    list_files(*write_drawing(draw_tank(tank), prepare_folder(out or Path("out") / tank.name) / tank.name))


def _show_scene(file: Path, out: Path | None, pose: tuple[list[str] | tuple[()], list[str] | tuple[()]]) -> None:
    from vgtsim.kinematics.given_pose import read_pose
    from vgtsim.output import prepare_folder
    from vgtsim.output.arm_drawing import write_drawing
    from vgtsim.output.scene_drawing import draw_scene
    from vgtsim.planning import list_collisions, tell_collisions
    from vgtsim.site import load_site

    site = load_site(file)
    q = read_pose(site.chain, *pose) if any(pose) else site.start
    collisions = list_collisions(site, q, site.clearance)
    name = site.task.name
    list_files(*write_drawing(draw_scene(site, q, collisions), prepare_folder(out or Path("out") / name) / name))
    OUT.print("\n".join(tell_collisions(collisions)) or "clear of everything", soft_wrap=True)


def _show_arm(file: Path, out: Path | None, pose: tuple[list[str] | tuple[()], list[str] | tuple[()]]) -> None:
    from vgtsim.kinematics.given_pose import read_pose
    from vgtsim.mjcf import reach_pose
    from vgtsim.output import prepare_folder
    from vgtsim.output.arm_drawing import draw_arm, make_solid, write_drawing, write_solid
    from vgtsim.site import load_arm

    chain = load_arm(file)
    arm, given = chain.manipulator, any(pose)
    q = read_pose(chain, *pose) if given else reach_pose(chain)
    stem = prepare_folder(out or Path("out") / arm.name) / arm.name
    files = write_drawing(draw_arm(chain, {"straight": chain.straight, "given" if given else "bent": q}), stem)
    list_files(*files, *write_solid(make_solid(chain, chain.nodes(q)), stem))
    point, axis = (" ".join(f"{value:.6f}" for value in item) for item in chain.tool(q))
    OUT.print(f"tool at {point} m, direction {axis}; base face at the origin, hanging", soft_wrap=True)
