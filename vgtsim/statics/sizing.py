"""Sections and bores from a catalogue so that nothing is used beyond its strength; iterated, because weight is load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.catalogue import INCH, Catalogue, CylinderSize, TubeSize
from vgtsim.description.manipulator import DoubleOctahedral, Manipulator
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.description.sections import Cylinder, Material, Tube
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.statics.cases import solve_case
from vgtsim.statics.loads import make_load_model
from vgtsim.statics.rating import ROD_FACTOR, SLENDERNESS_ADVICE, column_strength, rod_buckling, tension_yield

Array = NDArray[np.float64]
Place = tuple[str, str]

_PASSES = 30
_GROW_ONLY = 10  # passes after which a section may no longer shrink: two sizes can take turns for ever
_FIELDS = {"longeron": "longeron_tube", "cross_longeron": "cross_longeron_tube", "batten": "batten_tube"}


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
class _Demand:
    """What the members of one place carry over cases and poses, greatest along each member; shapes (K,)."""

    pull: Array
    push: Array
    drive: Array
    length: Array


def size_arm(
    chain: Chain,
    catalogue: Catalogue,
    nodes: ArrayLike,
    payload: Payload,
    cases: Sequence[LoadCase],
    gravity: float,
    safety_factor: float,
    target: float = 1.0,
) -> Sizing:
    """Choose the lightest section for the members of each kind in each module, and the bore of its cylinders.

    Nothing larger than the arm already has is taken: its clearances were checked with those.

    Args:
        chain: The arm to start from.
        catalogue: What may be chosen.
        nodes: Poses of the task, shape (K, N, 3), m, in frame G.
        payload: What the arm carries.
        cases: Load cases, at least one.
        gravity: m/s².
        safety_factor: Omega of AISC 360.
        target: Greatest utilisation.

    Returns:
        The sizing.

    Raises:
        DescriptionError: No size in the catalogue carries the load of a place; its forces are named.
    """
    n = np.asarray(nodes, float)
    widest = max(tube.outer_diameter for tube in chain.manipulator.tubes.values())
    bore = max(part.bore for part in chain.manipulator.cylinders.values())
    tubes = sorted((t for t in catalogue.tubes if t.outer_diameter <= widest + 1e-9), key=_tube_area)
    parts = sorted((c for c in catalogue.cylinders if c.bore <= bore + 1e-9), key=lambda c: (c.bore, c.rod))
    before = make_load_model(chain, payload, gravity).mass - payload.mass
    rank: dict[Place, int] = {}
    now, used = chain, {}
    for count in range(1, _PASSES + 1):
        demands = _find_demands(now, n, payload, cases, gravity)
        new, used = {}, {}
        for place, demand in demands.items():
            least = rank.get(place, 0) if count > _GROW_ONLY else 0
            new[place], used[place] = _choose(
                chain.manipulator, place, demand, tubes, parts, safety_factor, target, least
            )
        settled = new == rank
        rank = new
        arm, chosen = _rebuild(chain.manipulator, rank, tubes, parts)
        now = replace(chain, manipulator=arm)
        if settled:
            after = make_load_model(now, payload, gravity).mass - payload.mass
            return Sizing(arm, chosen, used, (before, after), count)
    raise DescriptionError(None, "sizes", f"still changing after {_PASSES} passes", "a task with a fixed point")


def _find_demands(
    chain: Chain, nodes: Array, payload: Payload, cases: Sequence[LoadCase], gravity: float
) -> dict[Place, _Demand]:
    model = make_load_model(chain, payload, gravity)
    ends = chain.truss.ends
    length = np.linalg.norm(nodes[:, ends[:, 1]] - nodes[:, ends[:, 0]], axis=-1)
    pulls, pushes, drives = [], [], []
    for case in cases:
        forces = solve_case(model, nodes, case)
        along = np.stack([forces.near_axial, forces.bar, forces.far_axial])
        pulls.append(np.maximum(along.max(axis=0), 0.0))
        pushes.append(np.maximum(-along.min(axis=0), 0.0))
        drives.append(forces.bar)
    found: dict[Place, list[int]] = {}
    for index, member in enumerate(chain.truss.members):
        module = chain.manipulator.modules[member.module].name
        found.setdefault((module, _FIELDS.get(member.role, "cylinder")), []).append(index)
    spread = np.broadcast_to(length, (len(cases), *length.shape))
    arrays = [np.stack(pulls), np.stack(pushes), np.stack(drives), spread]
    return {place: _Demand(*(array[..., rows].ravel() for array in arrays)) for place, rows in found.items()}


def _choose(
    arm: Manipulator,
    place: Place,
    demand: _Demand,
    tubes: Sequence[TubeSize],
    parts: Sequence[CylinderSize],
    safety_factor: float,
    target: float,
    least: int,
) -> tuple[int, float]:
    """Rank of the lightest size that carries the demand, and how much of it is used."""
    steel = _material(arm, place)
    sizes: Sequence[TubeSize | CylinderSize] = parts if place[1] == "cylinder" else tubes
    used = np.inf
    for index in range(least, len(sizes)):
        size = sizes[index]
        if isinstance(size, TubeSize):
            used = _tube_use(size, steel, demand, safety_factor)
        else:
            used = _cylinder_use(size, steel, demand, safety_factor)
        if used <= target:
            return index, used
    forces = f"{demand.pull.max() / 1e3:.1f} kN of pull and {demand.push.max() / 1e3:.1f} kN of push"
    allowed = f"what the largest of {len(sizes)} sizes in the catalogue carries, 1/{used / target:.3g} of it"
    raise DescriptionError(None, f"modules.{place[0]}.{place[1]}", forces, allowed)


def _material(arm: Manipulator, place: Place) -> Material:
    module = next(item for item in arm.modules if item.name == place[0])
    name = getattr(module, place[1])
    section = arm.cylinders[name] if place[1] == "cylinder" else arm.tubes[name]
    return arm.materials[section.material]


def _tube_use(size: TubeSize, steel: Material, demand: _Demand, safety_factor: float) -> float:
    tube = Tube(outer_diameter=size.outer_diameter, wall=size.wall, material="steel")
    slender = demand.length / tube.gyration_radius
    if slender.max() > SLENDERNESS_ADVICE:
        return np.inf
    column = column_strength(tube.area, slender, steel.yield_strength, steel.youngs_modulus)
    tension = demand.pull / tension_yield(tube.area, steel.yield_strength)
    return float(safety_factor * max(tension.max(), (demand.push / column).max()))


def _cylinder_use(size: CylinderSize, steel: Material, demand: _Demand, safety_factor: float) -> float:
    rod = pi / 4 * size.rod**2
    column = column_strength(rod, demand.length / (size.rod / 4), steel.yield_strength, steel.youngs_modulus)
    euler = rod_buckling(size.rod, steel.youngs_modulus, demand.length) / ROD_FACTOR
    full = size.pressure * pi / 4 * size.bore**2
    oil = np.where(demand.drive > 0, demand.drive / (full - size.pressure * rod), -demand.drive / full)
    strength = safety_factor * np.maximum(demand.pull / tension_yield(rod, steel.yield_strength), demand.push / column)
    return float(max(strength.max(), (demand.push / euler).max(), oil.max()))


def _rebuild(
    arm: Manipulator, rank: Mapping[Place, int], tubes: Sequence[TubeSize], parts: Sequence[CylinderSize]
) -> tuple[Manipulator, dict[Place, str]]:
    """The arm with the chosen sizes, and their names."""
    new_tubes: dict[str, Tube] = {}
    new_parts: dict[str, Cylinder] = {}
    chosen: dict[Place, str] = {}
    modules = []
    for module in arm.modules:
        update = {}
        for (name, field), index in rank.items():
            if name != module.name:
                continue
            if field == "cylinder" and isinstance(module, DoubleOctahedral):
                size, old = parts[index], arm.cylinders[module.cylinder]
                update[field] = f"c{size.bore / INCH * 100:.0f}r{size.rod / INCH * 100:.0f}"
                new_parts[update[field]] = old.model_copy(update=size.model_dump())
            else:
                tube, old_tube = tubes[index], arm.tubes[getattr(module, field)]
                update[field] = f"t{tube.outer_diameter / INCH * 100:.0f}x{tube.wall / INCH * 1000:.0f}"
                new_tubes[update[field]] = old_tube.model_copy(update=tube.model_dump())
            chosen[name, field] = update[field]
        rest = {field: getattr(module, field) for field in _FIELDS.values() if hasattr(module, field)}
        for field, name in rest.items():  # the last module's battens are the tip plate, but the file names a tube
            if field not in update:
                new_tubes.setdefault(name, arm.tubes[name])
        modules.append(module.model_copy(update=update))
    changes = {"tubes": new_tubes, "cylinders": new_parts, "modules": tuple(modules)}
    return arm.model_copy(update=changes), chosen


def _tube_area(size: TubeSize) -> float:
    return size.wall * (size.outer_diameter - size.wall)
