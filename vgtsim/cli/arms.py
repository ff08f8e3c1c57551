"""Verbs for an arm alone: list, sample, map and size."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from vgtsim.cli.application import ERR, OUT, ArmName, OutFolder, app, list_files
from vgtsim.constants import GRAVITY, PAYLOAD, SAFETY_FACTOR

_LISTED_SAMPLE = 500  # configurations behind the listed reach: a tenth of a second for each arm


@app.command(epilog="Example: vgtsim models")
def models(
    folder: Annotated[
        Path | None, typer.Argument(help="Folder of arms, NAME/NAME.toml each [default: the shipped arms].")
    ] = None,
) -> None:
    """List the shipped arms with degrees of freedom, reach and mass."""
    from vgtsim.description import MODELS
    from vgtsim.errors import DescriptionError
    from vgtsim.kinematics.workspace import sample_workspace
    from vgtsim.site import load_arm
    from vgtsim.statics import weigh

    table = Table("name", "degrees of freedom", "modules", "reach/m", "mass/kg", "what it is")
    folder = folder or MODELS
    files = sorted(folder.glob("*/*.toml"))
    if not files:
        raise DescriptionError(folder, "", "no arms", "a folder with NAME/NAME.toml files")
    for file in files:
        chain = load_arm(file)
        arm, reach = chain.manipulator, sample_workspace(chain, _LISTED_SAMPLE, seed=0).reach
        figures = (str(chain.layout.actuators), str(len(arm.modules)), f"{reach:.1f}", f"{weigh(chain):.0f}")
        table.add_row(arm.name, *figures, arm.title)
    OUT.print(table)


@app.command(epilog="Example: vgtsim workspace arm15 --samples 20000")
def workspace(
    arm_name: ArmName,
    out: OutFolder = None,
    samples: Annotated[int, typer.Option(min=10, max=1_000_000, help="Number of configurations.")] = 5000,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random numbers.")] = 0,
) -> None:
    """Sample the workspace of an arm: volume, tilt range, dexterity and singular regions, as drawings and figures."""
    from vgtsim.kinematics.modules.stroke_boxes import check_strokes
    from vgtsim.kinematics.workspace import NEAR_SINGULAR, sample_workspace
    from vgtsim.output import prepare_folder
    from vgtsim.output.arm_drawing import write_drawing
    from vgtsim.output.maps import plot_workspace
    from vgtsim.site import load_arm

    chain = load_arm(arm_name)
    arm = chain.manipulator
    check_strokes(chain)
    found = sample_workspace(chain, samples, seed)
    table = Table("quantity", "value", title=f"{arm.name}: {samples} configurations, seed {seed}")
    table.add_row("reach", f"{found.reach:.3f} m")
    table.add_row("reachable volume, at least", f"{found.volume:.3g} m³ in cells of {found.cell:.3g} m")
    table.add_row("greatest tilt of the tool", f"{math.degrees(float(found.tilt.max())):.1f} degrees")
    table.add_row("directions the tool can move in", str(found.mobility))
    table.add_row("dexterity, least to greatest", f"{found.dexterity.min():.3g} to {found.dexterity.max():.3g}")
    table.add_row("least singular value of a module", f"{float(found.singular.min()):.3g}")
    table.add_row(f"configurations with one below {NEAR_SINGULAR}", f"{100 * found.near_singular:.2g} %")
    OUT.print(table)
    stem = prepare_folder(out or Path("out") / arm.name) / "workspace"
    list_files(*write_drawing(plot_workspace(found, arm.title), stem))


@app.command(epilog="Example: vgtsim capacity arm15")
def capacity(
    arm_name: ArmName,
    out: OutFolder = None,
    payload: Annotated[float, typer.Option(help="Payload of the sag, kg.", min=0.0, max=1e5)] = PAYLOAD,
    safety_factor: Annotated[float, typer.Option(help="Omega of AISC 360.", min=1.0, max=100.0)] = SAFETY_FACTOR,
    resolve: Annotated[
        bool,
        typer.Option("--resolve/--plane-only", help="Use redundancy to unload the governing member in every cell."),
    ] = True,
) -> None:
    """Map the allowable payload of an arm over radius and depth, the governing limit, and the sag of the tip."""
    import numpy as np

    from vgtsim.errors import DescriptionError
    from vgtsim.kinematics.ties import first_greatest, first_least
    from vgtsim.output import prepare_folder
    from vgtsim.output.maps import write_capacity
    from vgtsim.planning.capacity import PIECE, unload_map
    from vgtsim.site import load_arm
    from vgtsim.statics import draw_shapes, find_gain, map_capacity
    from vgtsim.study import spread_out

    chain = load_arm(arm_name)
    arm = chain.manipulator
    with ERR.status("solving shapes"):
        plane = map_capacity(chain, draw_shapes(chain), GRAVITY, safety_factor, payload)
    found = plane
    if resolve:
        with ERR.status("unloading postures"), spread_out(len(plane.q) // PIECE) as spread:
            found = unload_map(chain, plane, GRAVITY, safety_factor, spread)
    if not (np.isfinite(found.payload).all() and np.isfinite(found.sag).all()):
        allowed = "members and cylinders that carry a load in every pose of the map"
        raise DescriptionError(None, arm.name, "a payload or sag that is no number", allowed)
    list_files(*write_capacity(found, f"{arm.name}: {arm.title}", prepare_folder(out or Path("out") / arm.name)))
    far, least = int(first_greatest(found.radius)), int(first_least(found.payload))
    for words, i in (("at full reach", far), ("least", least)):
        OUT.print(
            f"{words}: {found.payload[i]:.0f} kg at radius {found.radius[i]:.2f} m, depth {found.depth[i]:.2f} m, "
            f"by {found.limit[i]} of {found.member[i]}; sag {found.sag[i]:.3f} m with {found.reference:.0f} kg"
        )
    if resolve:
        gain = find_gain(found, plane)
        OUT.print(
            f"postures out of the plane carry {np.median(gain):.0%} more in the median of {len(gain)} cells, "
            f"{gain.max():.0%} at most; {np.mean(gain > 0.01):.0%} of the cells gain"
        )


@app.command(epilog="Example: vgtsim size arm15 --task type_ii_reach --out sized.toml")
def size(
    arm_name: ArmName,
    task: Annotated[Path, typer.Option("--task", help="Scene, by file or name, with the tour and load cases.")],
    out: Annotated[Path, typer.Option("--out", help="File of the sized arm.")] = Path("sized.toml"),
    reserve: Annotated[float, typer.Option(help="Part of every strength that is not used.", min=0.0, max=0.9)] = 0.05,
    catalogue_file: Annotated[Path | None, typer.Option("--catalogue", help="TOML file [default: built in].")] = None,
    anywhere: Annotated[
        bool,
        typer.Option(
            "--anywhere/--tour-only", help="Carry the load cases in every posture too, at full reach all round."
        ),
    ] = True,
) -> None:
    """Choose tubes and cylinders from a catalogue so that no member is overloaded by a scene's tour and load cases."""
    import dataclasses

    from vgtsim.description import find_file, load_catalogue, load_manipulator, load_scene, write_sized_arm
    from vgtsim.output import prepare_file
    from vgtsim.planning.design import design_arm
    from vgtsim.site import Site

    catalogue = load_catalogue(catalogue_file)
    file = find_file(arm_name, "arm")
    scene = dataclasses.replace(load_scene(task), manipulator=load_manipulator(file))
    prepare_file(out)
    with ERR.status("planning tours and choosing sizes"):
        design = design_arm(Site(scene), catalogue, 1 - reserve, anywhere=anywhere)
    found, (tour, beside) = design.sizing, design.poses
    reach = " and in any posture" if anywhere else ""
    reason = f"{reserve:.0%} in reserve over the tour of {scene.task.name}{reach}, cases {', '.join(design.cases)}"
    write_sized_arm(file, out, found.manipulator, catalogue, reason)
    title = f"{scene.manipulator.name}: {tour} poses of the tour, {beside} beside it; {found.passes} passes"
    table = Table("module", "member", "section", "used", title=title)
    for place, section in found.chosen.items():
        used = found.utilisation.get(place)
        table.add_row(*place, section, "tip plate" if used is None else f"{used:.2f}")
    OUT.print(table)
    OUT.print(f"arm of {found.mass[0]:.0f} kg, now {found.mass[1]:.0f} kg; {out}", soft_wrap=True)
