"""Verbs that write a first file of an arm, a tank or a scene, to be changed by hand."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from vgtsim.cli.application import ERR, OUT, app, list_files

if TYPE_CHECKING:
    from vgtsim.description import Scene

_Value = TypeVar("_Value", int, str)

new = typer.Typer(no_args_is_help=True, help="Write a first file of an arm, a tank or a scene, with comments.")
app.add_typer(new, name="new")

NewFile = Annotated[Path, typer.Argument(help="File to write, such as my_arm.toml.", show_default=False)]
Force = Annotated[bool, typer.Option("--force", help="Write over a file that is there.")]


@new.command(
    epilog="Example: vgtsim new arm my_arm.toml --reach '45 ft' --riser '42 in' --payload '1000 lb' --modules 6"
)
def arm(
    file: NewFile,
    reach: Annotated[
        str | None, typer.Option(help="Base face to tool point of the straight arm [default: 45 ft].")
    ] = None,
    riser: Annotated[str | None, typer.Option(help="Bore of the riser that it passes [default: 42 in].")] = None,
    payload: Annotated[str | None, typer.Option(help="Load at the tool [default: 1000 lb].")] = None,
    modules: Annotated[
        int | None,
        typer.Option(min=1, max=40, help="Active modules [default: 5, or as many as the reach has room for]."),
    ] = None,
    force: Force = False,
) -> None:
    """Lay out an arm for a reach and a riser and size it for a payload; on a terminal it asks for what no option says."""
    from vgtsim.description import load_catalogue
    from vgtsim.planning.drafting import USUAL_MODULES, ArmRequest, draft_arm, most_modules

    name = _prepare(file, force)
    length = _quantity("--reach", _ask("Reach, base face to tool point", reach, "45 ft"), "m")
    bore = _quantity("--riser", _ask("Bore of the riser", riser, "42 in"), "m")
    asked = ArmRequest(
        name=name,
        reach=length,
        bore=bore,
        payload=_quantity("--payload", _ask("Payload", payload, "1000 lb"), "kg"),
        modules=_ask("Active modules", modules, max(1, min(USUAL_MODULES, most_modules(length, bore)))),
    )
    with ERR.status("choosing sizes"):
        found = draft_arm(asked, load_catalogue())
    made = found.manipulator
    _write("arm.toml", file, arm=made, asked=asked, steel=made.materials["steel"])
    used = max(found.utilisation.values())
    OUT.print(
        f"{made.title}: {found.mass[1]:.0f} kg, strengths used up to {used:.2f}, stows in a bore of {bore:.3f} m",
        soft_wrap=True,
    )
    _follow_up(file, f"vgtsim new scene my_scene.toml --arm {file}")


@new.command(epilog="Example: vgtsim new tank my_tank.toml --type type_ii")
def tank(
    file: NewFile,
    kind: Annotated[str | None, typer.Option("--type", help="Shipped tank to start from [default: type_ii].")] = None,
    force: Force = False,
) -> None:
    """Write a shipped tank under a name of its own, with plain figures, and what is known of each as a comment."""
    from vgtsim.description import find_file
    from vgtsim.description.files import read_tables

    name = _prepare(file, force)
    kind = _ask("Type of tank", kind, "type_ii")
    shipped = find_file(kind, "tank")
    data = read_tables(shipped, "tank")
    _copy_meshes(data, shipped.parent, file.parent, force)
    plain = [item for item in data.items() if not isinstance(item[1], list) and not _is_table(item[1])]
    figures = [_line(item) for item in plain if item[0] not in ("name", "title")]
    _write(
        "tank.toml",
        file,
        name=name,
        kind=kind,
        title=_plain(data["title"]),
        figures=figures,
        tables=list(_tables(data)),
    )
    _follow_up(file, f"vgtsim new scene my_scene.toml --tank {file}")


@new.command(epilog="Example: vgtsim new scene my_scene.toml --arm my_arm.toml --tank type_ii --goals 4")
def scene(
    file: NewFile,
    arm: Annotated[str | None, typer.Option(help="File of an arm, or name of a shipped one [default: arm15].")] = None,
    tank: Annotated[
        str | None, typer.Option(help="File of a tank, or name of a shipped one [default: type_ii].")
    ] = None,
    payload: Annotated[str | None, typer.Option(help="Load at the tool [default: 1000 lb].")] = None,
    riser: Annotated[str | None, typer.Option(help="Riser of the tank to hang in [default: the arm's own].")] = None,
    pivot_depth: Annotated[str, typer.Option(help="Of the arm's base face below the tank's crown.")] = "1.75 m",
    goals: Annotated[int, typer.Option(min=1, max=16, help="Goals to look for.")] = 4,
    mission: Annotated[
        bool, typer.Option("--mission", help="A whole mission: in through the riser, to the goals, and out.")
    ] = False,
    force: Force = False,
) -> None:
    """Write a scene with goals that the arm comes to: over the waste, at the wall, beside equipment."""
    from vgtsim.errors import DescriptionError
    from vgtsim.planning.drafting import choose_goals, draft_feed, sample_goals
    from vgtsim.site import Site

    name = _prepare(file, force)
    arm, tank = _ask("Arm", arm, "arm15"), _ask("Tank", tank, "type_ii")
    load = _quantity("--payload", _ask("Payload", payload, "1000 lb"), "kg")
    depth = _quantity("--pivot-depth", pivot_depth, "m")
    drafted, tables = _draft_scene(file, name, (arm, tank), load, depth, riser)
    feed = draft_feed(Site(drafted)) if mission else None
    with ERR.status("looking for goals"):
        chosen = choose_goals(Site(drafted), goals)
        if not chosen:
            tables = sample_goals(Site(drafted))
            chosen = choose_goals(Site(_with_goals(drafted, tables)), goals)
    if not chosen:
        found = f"no place that {drafted.manipulator.name} comes to"
        raise DescriptionError(file, "motion.goals", found, "a longer arm, another --pivot-depth or a wider tank")
    task = drafted.task
    _write(
        "scene.toml",
        file,
        file=file,
        name=name,
        title=task.title,
        arm=_beside(arm, file),
        tank=_beside(tank, file),
        mast=task.mast,
        feed=feed,
        payload=f"{load:.6g}",
        goals=[
            {"name": tables[k]["name"], "at": ", ".join(f"{key} = {_toml(at)}" for key, at in tables[k]["at"].items())}
            for k in chosen
        ],
    )
    OUT.print(f"{len(chosen)} goals that {drafted.manipulator.name} comes to one after another", soft_wrap=True)
    _follow_up(file, f"vgtsim run {file} --video")


def _draft_scene(
    file: Path, name: str, parts: tuple[str, str], payload: float, pivot_depth: float, riser: str | None
) -> tuple[Scene, list[dict[str, Any]]]:
    """A scene with all places to try as goals, and their tables."""
    from math import floor

    import numpy as np

    from vgtsim.constants import PAYLOAD_RADIUS
    from vgtsim.description import Scene, SceneFile, load_manipulator, load_tank
    from vgtsim.errors import DescriptionError
    from vgtsim.kinematics import Chain, hanging_mount
    from vgtsim.planning.checks import RISER_SPARE, riser_fit
    from vgtsim.planning.drafting import list_goals

    arm = load_manipulator(parts[0])
    try:
        tank = load_tank(parts[1]).enter_by(riser)
    except ValueError as error:
        raise DescriptionError(None, "--riser", repr(riser), str(error)) from None
    chain, bore = Chain(arm, hanging_mount(0.0)), tank.arm_riser.bore
    reach = float(np.linalg.norm(chain.tool(chain.straight)[0]))
    tables = list_goals(tank, tank.shell.crown - pivot_depth, reach)
    mast: dict[str, Any] = {"pivot_depth": pivot_depth, "outer_diameter": round(6 / 7 * bore, 4), "wall": 0.0127}
    if riser:
        mast["riser"] = riser
    if arm.stowed is not None or not arm.stowable:
        spare = riser_fit(chain, bore).spare
        if 1e-3 < spare < RISER_SPARE:
            mast["riser_spare"] = floor(spare * 1e3) / 1e3
    task = SceneFile.model_validate(
        {
            "name": name,
            "title": f"{arm.name} in {tank.name}, {payload:.4g} kg",
            "manipulator": parts[0],
            "tank": parts[1],
            "mast": mast,
            "payload": {"mass": payload, "radius": PAYLOAD_RADIUS},
            "motion": {"goals": tables},
        }
    )
    return Scene(task=task, manipulator=arm, tank=tank, file=file), tables


def _with_goals(scene: Scene, tables: list[dict[str, Any]]) -> Scene:
    from dataclasses import replace

    from vgtsim.description import Goal

    motion = scene.task.motion.model_copy(update={"goals": tuple(Goal.model_validate(table) for table in tables)})
    return replace(scene, task=scene.task.model_copy(update={"motion": motion}))


def _prepare(file: Path, force: bool) -> str:
    """Name of what a file will hold; the file can be written, or an error says why not."""
    import re

    from vgtsim.errors import DescriptionError
    from vgtsim.output import prepare_file

    prepare_file(file, (".toml",))
    if file.exists() and not force:
        raise DescriptionError(file, "", "a file that is there", "a new file, or --force")
    name = re.sub(r"\W", "_", file.stem, flags=re.ASCII)[:64]
    return name if name[0].isalpha() else f"my_{name}"[:64]


def _ask(question: str, given: _Value | None, default: _Value) -> _Value:
    """What an option says; else what a person at a terminal answers, or the default."""
    if given is not None:
        return given
    return typer.prompt(question, default, type=type(default), err=True) if sys.stdin.isatty() else default


def _quantity(option: str, text: str, unit: str) -> float:
    from vgtsim.errors import DescriptionError
    from vgtsim.units import to_si

    try:
        value = to_si(text, unit, bare=True)
    except ValueError as error:
        raise DescriptionError(None, option, repr(text), str(error)) from None
    if value <= 0:
        raise DescriptionError(None, option, repr(text), "more than zero")
    return value


def _write(template: str, target: Path, /, **values: Any) -> None:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    from vgtsim.description import INCH
    from vgtsim.replacing import replacing

    loader = PackageLoader("vgtsim.cli", "templates")
    env = Environment(loader=loader, undefined=StrictUndefined, keep_trailing_newline=True, trim_blocks=True)
    env.filters["inches"] = lambda value: f"{value / INCH:.6g}"
    text = env.get_template(template).render(values)
    with replacing(target) as partial:
        partial.write_text(text, encoding="utf-8")
    list_files(target)


def _follow_up(file: Path, command: str) -> None:
    OUT.print(f"next: vgtsim check {file}; vgtsim show {file}; {command}", soft_wrap=True)


def _beside(name: str, file: Path) -> str:
    """A shipped name as it is; a file by its path from the folder of another."""
    return os.path.relpath(name, file.parent) if os.path.isfile(name) else name


def _copy_meshes(data: dict[str, Any], source: Path, target: Path, force: bool) -> None:
    """Put the meshes that a tank's tables name beside its new file, and their names into the tables."""
    from shutil import copyfile

    from vgtsim.description.mesh_file import list_meshes
    from vgtsim.errors import DescriptionError

    for mesh in list_meshes(data):
        there, here = source / mesh["file"], target / Path(mesh["file"]).name
        if here.exists() and not force and here.read_bytes() != there.read_bytes():
            raise DescriptionError(here, "", "a file that is there", "a new file, or --force")
        copyfile(there, here)
        mesh["file"] = here.name
        list_files(here)


def _tables(data: dict[str, Any]) -> Iterator[tuple[str, list[tuple[str, str, str]]]]:
    """Tables of a file of a tank with a heading each: keys, values as TOML, and notes."""
    for key, entry in data.items():
        several = isinstance(entry, list)
        if not (several or _is_table(entry)):
            continue
        tables: list[dict[str, Any]] = entry if several else [entry]
        for table in tables:
            heading = f"[[{key}]]" if several else f"[{key}]"
            yield heading, [_line(item) for item in table.items() if not _is_table(item[1])]
            for inner, figures in table.items():
                if _is_table(figures):
                    yield f"[{key}.{inner}]", [_line(item) for item in figures.items()]


def _is_table(entry: Any) -> bool:
    return isinstance(entry, dict) and "value" not in entry


def _line(item: tuple[str, Any]) -> tuple[str, str, str]:
    key, entry = item
    note = f"{entry['label']}: {entry['note']}" if isinstance(entry, dict) and "note" in entry else ""
    return key, _toml(_plain(entry)), note


def _plain(entry: Any) -> Any:
    if isinstance(entry, list):
        return [_plain(item) for item in entry]
    return entry["value"] if isinstance(entry, dict) and "value" in entry else entry


def _toml(value: Any) -> str:
    from vgtsim.description.catalogue import write_value

    return write_value(value)
