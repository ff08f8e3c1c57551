"""Sections and bores from a catalogue so that nothing is used beyond its strength; iterated, because weight is load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.catalogue import INCH, Catalogue, CylinderSize, TubeSize
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.description.sections import Cylinder, Material, Tube
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.statics.cases import bound_case
from vgtsim.statics.elasticity import require_no_offset
from vgtsim.statics.loads import make_load_model, weigh
from vgtsim.statics.motion import Motion
from vgtsim.statics.rating import (
    ROD_FACTOR,
    SLENDERNESS_ADVICE,
    column_strength,
    pin_shear,
    rod_buckling,
    tension_yield,
)

Array = NDArray[np.float64]
Place = tuple[str, str]
_Sized = TypeVar("_Sized", Tube, Cylinder)

_FIELDS = {"longeron": "longeron_tube", "cross_longeron": "cross_longeron_tube", "batten": "batten_tube"}


@dataclass(frozen=True)
class Demand:
    """What an arm must stand.

    Attributes:
        nodes: Poses, shape (K, N, 3), m, in frame G.
        motion: Velocities and accelerations in those poses; absent where all are at rest.
        payload: What the arm carries.
        cases: Load cases, at least one, each in every pose.
        gravity: m/s².
        safety_factor: Omega of AISC 360.
    """

    nodes: Array
    motion: Motion | None
    payload: Payload
    cases: Sequence[LoadCase]
    gravity: float
    safety_factor: float


@dataclass(frozen=True)
class Sizing:
    """A sized arm.

    Attributes:
        manipulator: The arm with its chosen sections.
        chosen: Section of each module and field.
        utilisation: Greatest of each place over poses and cases.
        mass: Of the arm without payload, before and after, kg.
        passes: Iterations it took.
    """

    manipulator: Manipulator
    chosen: Mapping[Place, str]
    utilisation: Mapping[Place, float]
    mass: tuple[float, float]
    passes: int


@dataclass(frozen=True)
class _Carried:
    """What the members of one place carry, the worst of all cases, along each member; shapes (K, m)."""

    pull: Array
    push: Array
    drive_pull: Array
    drive_push: Array
    length: Array


def size_arm(chain: Chain, catalogue: Catalogue, demand: Demand, target: float = 1.0) -> Sizing:
    """Choose the lightest section for the members of each kind in each module, and the bore of its cylinders.

    Every place starts with the lightest size and only grows, until the arm stands the demand with its own weight; the
    result does not depend on the sections that the arm came with.

    Args:
        chain: The arm to start from.
        catalogue: What may be chosen; cylinders too long for the arm's strokes are left out.
        demand: What the arm must stand.
        target: Greatest utilisation.

    Returns:
        The sizing.

    Raises:
        DescriptionError: No cylinder in the catalogue is short enough for the arm's strokes, or no size carries the load
            of a place; its forces are named. A module has a joint offset: bending is not rated here.
    """
    require_no_offset(chain, "an arm is sized")
    tubes = sorted(catalogue.tubes, key=_tube_area)
    fitting = [size for size in catalogue.cylinders if _fits(size, chain.manipulator)]
    if not fitting:
        least = min(part.retracted - part.stroke for part in chain.manipulator.cylinders.values())
        short = min(size.head + 2 * size.eye for size in catalogue.cylinders)
        found = f"{len(catalogue.cylinders)} in the catalogue, of {short:.4g} m or more in heads and eyes"
        allowed = f"one with at most {least:.4g} m, what the arm's strokes leave of its retracted cylinders"
        raise DescriptionError(None, "cylinders", found, allowed)
    parts = sorted(fitting, key=lambda size: _cylinder_mass(size, chain.manipulator))
    rank = dict.fromkeys(_places(chain), 0)
    count, settled = 0, not rank
    arm, chosen = _rebuild(chain.manipulator, rank, tubes, parts, catalogue)
    used: dict[Place, float] = {}
    while not settled:  # ends: ranks only grow, and there are finitely many
        now, count = replace(chain, manipulator=arm), count + 1
        new = {}
        for place, carried in _find_carried(now, demand).items():
            sizes = parts if place[1] == "cylinder" else tubes
            steel = catalogue.material_of(place[1])
            pin = _pin(arm, place)
            new[place], used[place] = _choose(place, carried, sizes, steel, pin, demand, target, rank[place])
        settled, rank = new == rank, new
        arm, chosen = _rebuild(chain.manipulator, rank, tubes, parts, catalogue)
    return Sizing(arm, chosen, used, (weigh(chain), weigh(replace(chain, manipulator=arm))), count)


def _tube_area(size: TubeSize) -> tuple[float, float]:
    """Lightest first; of equal weights the larger tube, which is the stiffer column."""
    return round(size.wall * (size.outer_diameter - size.wall), 12), -size.outer_diameter


def _cylinder_mass(size: CylinderSize, arm: Manipulator) -> float:
    """Of steel, with the stroke of an arm's longest cylinder, for a density of one."""
    longest = max(arm.cylinders.values(), key=lambda part: part.retracted)
    part = longest.model_copy(update=size.model_dump(exclude_none=True))
    return part.barrel_mass(1.0) + part.rod_mass(1.0)


def _fits(size: CylinderSize, arm: Manipulator) -> bool:
    """Whether heads, eyes and stroke of every cylinder of an arm go into its retracted length."""
    least = min(part.retracted - part.stroke for part in arm.cylinders.values())
    return size.head + 2 * size.eye <= least + 1e-9


def _places(chain: Chain) -> list[Place]:
    return list(dict.fromkeys(_place(chain, index) for index in range(len(chain.truss.members))))


def _place(chain: Chain, index: int) -> Place:
    """Module and field that give a member its section."""
    member = chain.truss.members[index]
    return chain.manipulator.modules[member.module].name, _FIELDS.get(member.role, "cylinder")


def _find_carried(chain: Chain, demand: Demand) -> dict[Place, _Carried]:
    model = make_load_model(chain, demand.payload, demand.gravity)
    nodes, ends = demand.nodes, chain.truss.ends
    length = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
    pull = push = drive_pull = drive_push = np.zeros(length.shape)
    for case in demand.cases:
        high, low = bound_case(model, nodes, case, demand.motion)
        for along in ("near_axial", "bar", "far_axial"):
            pull, push = np.maximum(pull, getattr(high, along)), np.maximum(push, -getattr(low, along))
        drive_pull, drive_push = np.maximum(drive_pull, high.bar), np.maximum(drive_push, -low.bar)
    found: dict[Place, list[int]] = {}
    for index in range(len(ends)):
        found.setdefault(_place(chain, index), []).append(index)
    arrays = (pull, push, drive_pull, drive_push, length)
    return {place: _Carried(*(array[:, rows] for array in arrays)) for place, rows in found.items()}


def _choose(
    place: Place,
    carried: _Carried,
    sizes: Sequence[TubeSize | CylinderSize],
    steel: Material,
    pin: float | None,
    demand: Demand,
    target: float,
    least: int,
) -> tuple[int, float]:
    """Rank of the lightest size that carries the load, and how much of it is used."""
    used = np.inf
    for index in range(least, len(sizes)):
        size = sizes[index]
        if isinstance(size, TubeSize):
            used = _tube_use(size, steel, pin, carried, demand.safety_factor)
        else:
            used = _cylinder_use(size, steel, pin, carried, demand.safety_factor)
        if used <= target:
            return index, used
    forces = f"{carried.pull.max() / 1e3:.1f} kN of pull and {carried.push.max() / 1e3:.1f} kN of push"
    allowed = f"what the largest of {len(sizes)} sizes in the catalogue carries, 1/{used / target:.3g} of it"
    raise DescriptionError(None, f"modules.{place[0]}.{place[1]}", forces, allowed)


def _pin(arm: Manipulator, place: Place) -> float | None:
    """Pin that the arm gives the members of a place."""
    name = getattr(next(item for item in arm.modules if item.name == place[0]), place[1])
    return (arm.cylinders[name] if place[1] == "cylinder" else arm.tubes[name]).pin


def _tube_use(size: TubeSize, steel: Material, pin: float | None, carried: _Carried, safety_factor: float) -> float:
    tube = Tube(outer_diameter=size.outer_diameter, wall=size.wall, material="steel")
    slender = carried.length / tube.gyration_radius
    if slender.max() > SLENDERNESS_ADVICE:
        return np.inf
    column = column_strength(tube.area, slender, steel.yield_strength, steel.youngs_modulus)
    tension = carried.pull / tension_yield(tube.area, steel.yield_strength)
    shear = _pin_use(pin, steel, carried)
    return float(safety_factor * max(tension.max(), (carried.push / column).max(), shear))


def _cylinder_use(
    size: CylinderSize, steel: Material, pin: float | None, carried: _Carried, safety_factor: float
) -> float:
    rod = pi / 4 * size.rod**2
    column = column_strength(rod, carried.length / (size.rod / 4), steel.yield_strength, steel.youngs_modulus)
    euler = rod_buckling(size.rod, steel.youngs_modulus, carried.length) / ROD_FACTOR
    full = size.pressure * pi / 4 * size.bore**2
    oil = np.maximum(carried.drive_pull / (full - size.pressure * rod), carried.drive_push / full)
    tension = carried.pull / tension_yield(rod, steel.yield_strength)
    strength = max(tension.max(), (carried.push / column).max(), _pin_use(size.pin or pin, steel, carried))
    return float(max(safety_factor * strength, (carried.push / euler).max(), oil.max()))


def _pin_use(pin: float | None, steel: Material, carried: _Carried) -> float:
    """Greatest force over the nominal shear strength of the pins; zero where none is given."""
    if pin is None:
        return 0.0
    return float(np.maximum(carried.pull, carried.push).max() / pin_shear(pin, steel.yield_strength))


def _rebuild(
    arm: Manipulator,
    rank: Mapping[Place, int],
    tubes: Sequence[TubeSize],
    parts: Sequence[CylinderSize],
    catalogue: Catalogue,
) -> tuple[Manipulator, dict[Place, str]]:
    """The arm with the chosen sizes, and their names."""
    new_tubes: dict[str, Tube] = {}
    new_parts: dict[str, Cylinder] = {}
    chosen: dict[Place, str] = {}
    modules = []
    for module in arm.modules:
        update = {}
        for field in (*_FIELDS.values(), "cylinder"):
            if not hasattr(module, field):
                continue
            # the last module's battens are the tip plate, but the file names a tube
            index = rank.get((module.name, field), 0)
            old = getattr(module, field)
            if field == "cylinder":
                size = parts[index]
                changed = size.model_dump(exclude_none=True) | {"material": catalogue.cylinder_material}
                name = f"c{size.bore / INCH * 100:.0f}r{size.rod / INCH * 100:.0f}"
                update[field] = _add(new_parts, name, module.name, arm.cylinders[old].model_copy(update=changed))
            else:
                tube = tubes[index]
                changed = tube.model_dump() | {"material": catalogue.tube_material}
                name = f"t{tube.outer_diameter / INCH * 100:.0f}x{tube.wall / INCH * 1000:.0f}"
                update[field] = _add(new_tubes, name, module.name, arm.tubes[old].model_copy(update=changed))
            chosen[module.name, field] = update[field]
        modules.append(module.model_copy(update=update))
    changes = {
        "materials": arm.materials | catalogue.materials,
        "tubes": new_tubes,
        "cylinders": new_parts,
        "modules": tuple(modules),
    }
    return arm.model_copy(update=changes), chosen


def _add(sections: dict[str, _Sized], name: str, module: str, section: _Sized) -> str:
    """Keep a section under its size's name, with the module's where modules differ in pins or strokes."""
    if sections.setdefault(name, section) != section:
        name = f"{name}_{module}"
        sections[name] = section
    return name
