"""Verbs for the files that a user writes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from vgtsim.cli.application import ERR, OUT, app, complain, finish

if TYPE_CHECKING:
    from vgtsim.errors import VgtError


@app.command(epilog="Example: vgtsim schema arm > arm.json")
def schema(
    kind: Annotated[
        Literal["arm", "tank", "scene", "path", "catalogue", "study"],
        typer.Argument(help="Kind of file.", show_default=False),
    ],
) -> None:
    """Print the JSON schema of a kind of file; an editor takes it from the file's first line, `#:schema arm.json`."""
    from vgtsim.description.reference import write_schema

    typer.echo(write_schema(kind), nl=False)


@app.command(epilog="Example: vgtsim check my_scene.toml")
def check(
    file_name: Annotated[
        Path, typer.Argument(help="TOML file of any kind, or name of a shipped arm, tank or scene.", show_default=False)
    ],
) -> None:
    """Say everything that is wrong with a file; of a scene also with its arm, tank, start and goals, which are solved."""
    from vgtsim.description import find_file, list_faults, tell_file

    file = find_file(file_name, "scene", "arm", "tank", "path", "study")
    kind = tell_file(file)
    faults: list[VgtError] = [*list_faults(file, kind)]
    facts = ""
    if not faults and kind in ("scene", "arm", "tank"):
        with ERR.status("looking at the start and the goals"):
            faults, facts = {"scene": _inspect_scene, "arm": _inspect_arm, "tank": _inspect_tank}[kind](file)
    for fault in faults:
        complain(fault)
    if facts:
        OUT.print(facts, soft_wrap=True)
    OUT.print(f"{file}: {kind}, {len(faults) or 'nothing'} wrong", soft_wrap=True)
    finish(not faults, None)


def _inspect_scene(file: Path) -> tuple[list[VgtError], str]:
    from vgtsim.planning import inspect_site
    from vgtsim.site import load_site

    site = load_site(file)
    count, motion = len(site.task.motion.goals), site.task.motion
    faults = inspect_site(site)
    if faults:
        return faults, ""
    gap, place = site.surroundings.least(site.start)
    start = "a start was searched" if motion.start is None else "it starts as the file says"
    goals = f"{count} goal{'s' * (count != 1)} within reach"
    return [], f"{site.arm.name} in {site.tank.name}: {start}, {gap:.2f} m from {place}; {goals}"


def _inspect_arm(file: Path) -> tuple[list[VgtError], str]:
    import numpy as np

    from vgtsim.errors import VgtError
    from vgtsim.kinematics import check_strokes
    from vgtsim.planning.checks import RISER_SPARE, riser_fit
    from vgtsim.site import load_arm
    from vgtsim.statics import weigh

    chain = load_arm(file)
    try:
        check_strokes(chain)
    except VgtError as error:
        return [error], ""
    arm = chain.manipulator
    reach = float(np.linalg.norm(chain.tool(chain.straight)[0]))
    text = f"{arm.name}: {len(arm.active)} active modules, {chain.layout.actuators} actuators, {reach:.2f} m straight, "
    text += f"{weigh(chain):.0f} kg"
    if arm.stowed is not None or not arm.stowable:
        bore = 2 * (RISER_SPARE - riser_fit(chain, 0.0).spare)
        text += f"; it passes a riser with a bore of {bore:.3f} m, {RISER_SPARE * 1e3:.0f} mm left all round"
    return [], text


def _inspect_tank(file: Path) -> tuple[list[VgtError], str]:
    from vgtsim.description import load_tank
    from vgtsim.geometry import make_profile

    tank = load_tank(file)
    volume = make_profile(tank.shell).volume()
    text = f"{tank.name}: {tank.shell.inner_diameter:.2f} m across, {tank.shell.crown:.2f} m high, {volume:.0f} m³; "
    pieces = f"{len(tank.things)} piece{'s' * (len(tank.things) != 1)} of equipment"
    return [], f"{text}{pieces}, a riser with a bore of {tank.arm_riser.bore:.3f} m"
