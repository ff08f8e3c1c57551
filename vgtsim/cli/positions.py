"""Verbs for the tool: one goal, or a path."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from vgtsim.cli.application import ERR, OUT, OutFolder, SceneOrArm, app, finish, list_files
from vgtsim.constants import Method

if TYPE_CHECKING:
    from vgtsim.site import Place


@app.command(epilog="Example: vgtsim ik type_ii_reach --position 8 2 1 --direction 1 0 0 --plot ik.svg")
def ik(
    description: SceneOrArm,
    position: Annotated[tuple[float, float, float], typer.Option(help="Tool point in the tank's frame, m.")],
    direction: Annotated[tuple[float, float, float], typer.Option(help="Tool direction in the tank's frame.")],
    method: Annotated[
        Method | None, typer.Option(help="How redundancy is resolved [default: as in the scene, or nullspace].")
    ] = None,
    objective: Annotated[
        list[str] | None, typer.Option(help="NAME or NAME:WEIGHT; may be repeated [default: as in the scene].")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="Draw the posture to this .svg or .png file.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Write the solution to this file.")] = None,
) -> None:
    """Find a posture for a tool goal; an arm alone hangs with its base face at the origin.

    The lines that it prints under `motion.start` can be put into a scene, and so can the name of the file that `--json` writes.
    """
    from vgtsim.output import prepare_file
    from vgtsim.planning.resolution import make_problem, report_solution, usual_way
    from vgtsim.positioning import solve_by_method, tool_goal

    if json_file is not None:
        prepare_file(json_file)
    if plot is not None:
        prepare_file(plot, (".svg", ".png"))
    place = _load(description)
    usual = usual_way(place)
    method, terms = method or usual[0], tuple(objective or usual[1])
    problem = make_problem(place, tool_goal(position, direction), method, terms)
    found = solve_by_method("ik", problem, place.start)
    answer = report_solution(place, problem, found, terms)
    table = Table("row", "desired", "reached", "residual", title=f"{place.chain.manipulator.name}: {method}")
    for row in answer["rows"]:
        wanted = ["" if row[name] is None else f"{row[name]:.6f}" for name in ("desired", "reached")]
        table.add_row(row["name"], *wanted, f"{row['residual']:.2e}")
    OUT.print(table)
    for name, value in answer["facts"].items():
        if isinstance(value, list):
            value = ", ".join(value) or "none"
        told = f"{value:.4g}" if isinstance(value, float) else value
        OUT.print(f"{name}: {told}", soft_wrap=True)
    figures = ", ".join(repr(value) for value in answer["q"])
    OUT.print(f"\n[motion.start]\ninputs = [{figures}]", soft_wrap=True)
    if json_file is not None:
        json_file.write_text(json.dumps(answer, indent=2) + "\n", encoding="utf-8")
    if plot is not None:
        from vgtsim.output.truss_plot import draw_posture

        draw_posture(place.chain, found.q, position, plot)


@app.command(epilog="Example: vgtsim track type_ii_reach --path waste_raster")
def track(
    description: SceneOrArm,
    path_file: Annotated[
        Path, typer.Option("--path", help="TOML file of a path of the tool, or name of a shipped one.")
    ],
    out: OutFolder = None,
    objective: Annotated[list[str] | None, typer.Option(help="NAME or NAME:WEIGHT; may be repeated.")] = None,
) -> None:
    """Follow a path with the tool: lengths over time inside the cylinders' rates and accelerations, CSV and drawing."""
    from vgtsim.description import load_tool_path
    from vgtsim.output import prepare_folder
    from vgtsim.output.track_files import write_track
    from vgtsim.planning.following import follow_request, report

    place = _load(description)
    chain = place.chain
    path = load_tool_path(path_file)
    with ERR.status("solving the path"):
        followed = follow_request(place, path, tuple(objective or ("mid_stroke",)))
    facts = report(place, followed)
    table = Table("quantity", "value", title=f"{chain.manipulator.name} on {path.name}")
    for name, value in facts.items():
        table.add_row(name, f"{value:.4g}" if isinstance(value, float) else str(value))
    OUT.print(table)
    folder = prepare_folder(out or Path("out") / path.name)
    list_files(*write_track(chain, followed, facts, folder / path.name))
    wanted = place.clearance
    clear = float(facts.get("least clearance, m", wanted))
    spare = float(facts["least distance to the end of a stroke, m"])
    if clear < wanted or spare < 0:
        found = f"clearance {clear:.3f} m, wanted {wanted:.3f} m; stroke to spare {spare:.4f} m"
        ERR.print(found, style="bold red")
    finish(clear >= wanted and spare >= 0, None)


def _load(description: Path) -> Place:
    """A scene's site, or an arm alone, which hangs with its base face at the origin."""
    from vgtsim.description import find_file, is_scene
    from vgtsim.site import ArmAlone, load_arm, load_site

    file = find_file(description, "scene", "arm")
    return load_site(file) if is_scene(file) else ArmAlone(load_arm(file))
