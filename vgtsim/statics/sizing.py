"""Sections and bores from a catalogue so that nothing is used beyond its strength; iterated, because weight is load."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import INCH, Catalogue, Cylinder, CylinderSize, LoadCase, Manipulator, Payload, Tube, TubeSize
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.statics.cases import chunks, find_corners, find_effects
from vgtsim.statics.equilibrium import MemberForces
from vgtsim.statics.loads import make_load_model, weigh
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.rating import SLENDERNESS_ADVICE, describe_sections, rate
from vgtsim.statics.utilisation import use_axial, utilise

Place = tuple[str, str]
PlaceT = TypeVar("PlaceT")


@dataclass(frozen=True)
class Demand:
    """The poses, shape (K, N, 3), m, in frame G, and loads that an arm must stand: each of the cases, at least one, in each pose.

    `motion` is that of the nodes in those poses, absent where all are at rest; gravity is in m/s²; `safety_factor` is Omega of
    AISC 360.
    """

    nodes: Array
    motion: NodeMotion | None
    payload: Payload
    cases: Sequence[LoadCase]
    gravity: float
    safety_factor: float


@dataclass(frozen=True)
class Sizing:
    """A sized arm: the section chosen for each module and field, and its greatest utilisation over poses and cases.

    Fields are those of `sections` of a module: longerons of an octahedron that name the same section are sized as one.

    `mass` is that of the arm without payload, before and after, kg; `passes` are the iterations it took.
    """

    manipulator: Manipulator
    chosen: Mapping[Place, str]
    utilisation: Mapping[Place, float]
    mass: tuple[float, float]
    passes: int


def size_arm(chain: Chain, catalogue: Catalogue, demand: Demand, target: float = 1.0) -> Sizing:
    """Choose the lightest section for the members of each kind in each module, and the bore of its cylinders.

    Every place starts with the lightest size and only grows, until the arm stands the demand with its own weight; the
    result does not depend on the sections that the arm came with. `target` is the greatest utilisation.

    Raises:
        DescriptionError: No cylinder in the catalogue is short enough for the arm's strokes, or no size carries the load
            of a place; its forces are named.
    """
    sizes, used = _Sizes(catalogue, chain.manipulator), {}

    def choose(rank: Mapping[Place, int]) -> dict[Place, int]:
        arm, _ = _rebuild(chain.manipulator, rank, sizes)
        found, new = _find_carried(replace(chain, manipulator=arm), demand), {}
        for place, carried in found.items():
            new[place], used[place] = _choose(arm, place, carried, sizes, demand.safety_factor, target, rank[place])
        return new

    rank, count = grow_sizes(_places(chain), choose)
    arm, chosen = _rebuild(chain.manipulator, rank, sizes)
    masses = weigh(chain), weigh(replace(chain, manipulator=arm))
    return Sizing(manipulator=arm, chosen=chosen, utilisation=used, mass=masses, passes=count)


def grow_sizes(
    places: Iterable[PlaceT], choose: Callable[[Mapping[PlaceT, int]], dict[PlaceT, int]]
) -> tuple[Mapping[PlaceT, int], int]:
    """Start every place of any structure with the first of its sizes and let `choose` raise their ranks until it keeps them.

    Returns the ranks and how often it chose; it must not lower a rank.
    """
    rank, new, count = {}, dict.fromkeys(places, 0), 0
    while new != rank:  # ends: ranks only grow, and there are finitely many
        rank, new, count = new, choose(new), count + 1
    return rank, count


class _Sizes:
    """Sizes of the catalogue, the lightest first, as parts of an arm."""

    def __init__(self, catalogue: Catalogue, arm: Manipulator) -> None:
        least = min(part.retracted - part.stroke for part in arm.cylinders.values())
        # but for rounding of lengths
        fitting = [size for size in catalogue.cylinders if size.head + 2 * size.eye <= least + 1e-9]
        if not fitting:
            short = min(size.head + 2 * size.eye for size in catalogue.cylinders)
            found = f"{len(catalogue.cylinders)} in the catalogue, of {short:.4g} m or more in heads and eyes"
            allowed = f"one with at most {least:.4g} m, what the arm's strokes leave of its retracted cylinders"
            raise DescriptionError(None, "cylinders", found, allowed)
        longest = max(arm.cylinders.values(), key=lambda part: part.retracted)

        def weight(size: TubeSize) -> tuple[float, float]:
            """Lightest first; of equal weights the larger tube, which is the stiffer column."""
            return round(size.wall * (size.outer_diameter - size.wall), 12), -size.outer_diameter

        def volume(size: CylinderSize) -> float:
            """Of the steel, with the stroke of the arm's longest cylinder."""
            part = longest.model_copy(update=size.model_dump(exclude_none=True))
            return part.barrel_mass(1.0) + part.rod_mass(1.0)

        self.catalogue = catalogue
        self.tubes = sorted(catalogue.tubes, key=weight)
        self.cylinders = sorted(fitting, key=volume)

    def of(self, field: str) -> Sequence[TubeSize | CylinderSize]:
        """Sizes for a field of a module."""
        return self.cylinders if field.endswith("cylinder") else self.tubes

    def fit(self, arm: Manipulator, field: str, old: str, index: int) -> tuple[str, Tube | Cylinder]:
        """Name of a size and the part that it makes of an old one, whose pins and stroke stay."""
        size = self.of(field)[index]
        given = size.model_dump(exclude_none=True)
        if isinstance(size, CylinderSize):
            name = f"c{size.bore / INCH * 100:.0f}r{size.rod / INCH * 100:.0f}"
            return name, arm.cylinders[old].model_copy(update=given | {"material": self.catalogue.cylinder_material})
        name = f"t{size.outer_diameter / INCH * 100:.0f}x{size.wall / INCH * 1000:.0f}"
        return name, arm.tubes[old].model_copy(update=given | {"material": self.catalogue.tube_material})


@dataclass(frozen=True)
class _Carried:
    """What the m members of a place carry in all cases and K poses.

    Attributes:
        axial: Greatest pull and push anywhere along a member, then where its segments meet, shape (4, K, m), N.
        length: Of the members, shape (K, m), m.
        bent: States of actuators between joint blocks that can be the worst in bending, shapes (K, m); none of others.
    """

    axial: Array
    length: Array
    bent: list[MemberForces]

    def describe(self) -> str:
        """Greatest forces and moment in words."""
        pull, push = self.axial[0].max() / 1e3, self.axial[1].max() / 1e3
        text = f"{pull:.1f} kN of pull and {push:.1f} kN of push"
        if self.bent:
            moments = [np.linalg.norm([item.near_moment, item.far_moment], axis=-1).max() for item in self.bent]
            text += f" with {max(moments) / 1e3:.2f} kN m of bending"
        return text


def _places(chain: Chain) -> list[Place]:
    """Module and field that give each member its section."""
    modules = chain.manipulator.modules
    found = []
    for member in chain.truss.members:
        module = modules[member.module]
        found.append((module.name, module.section_of(member.role, int(member.name.rsplit("/", 1)[1]))))
    return found


def _find_carried(chain: Chain, demand: Demand) -> dict[Place, _Carried]:
    """What the members of each place carry in all cases and poses."""
    model, rings = make_load_model(chain, demand.payload, demand.gravity), chain.truss.ring_actuators.ravel()
    length = chain.truss.lengths(demand.nodes)
    most, parts = np.zeros((4, *length.shape)), []
    for part, poses, motion in chunks(demand.nodes, demand.motion):
        effects = find_effects(model, poses, motion)
        bounds = [effects.bound(case) for case in demand.cases]
        for high, low in bounds:
            forces = [high.along.max(axis=0), -low.along.min(axis=0), high.bar, -low.bar]
            most[:, part] = np.maximum(most[:, part], forces)
        if len(rings):
            parts.append([corner.of(rings) for high, low in bounds for corner in find_corners(high, low)])
    bent = [MemberForces.join(items) for items in zip(*parts, strict=True)]
    found: dict[Place, list[int]] = {}
    for index, place in enumerate(_places(chain)):
        found.setdefault(place, []).append(index)
    carried = {}
    for place, members in found.items():
        mine = np.flatnonzero(np.isin(rings, members))
        carried[place] = _Carried(
            most[:, :, members], length[:, members], [item.of(mine) for item in bent] if len(mine) else []
        )
    return carried


def _choose(
    arm: Manipulator, place: Place, carried: _Carried, sizes: _Sizes, safety_factor: float, target: float, least: int
) -> tuple[int, float]:
    """Rank of the lightest size that carries the load, and how much of it is used."""
    old = next(module for module in arm.modules if module.name == place[0]).sections()[place[1]]
    steel, offered, used = sizes.catalogue.material_of(place[1]), sizes.of(place[1]), np.inf
    for index in range(least, len(offered)):
        part = sizes.fit(arm, place[1], old, index)[1]
        ratings = rate(describe_sections([(part, steel)]), carried.length, safety_factor)
        if isinstance(part, Tube) and ratings.slenderness.max() > SLENDERNESS_ADVICE:
            continue
        used = float(use_axial(ratings, *carried.axial).worst.max())
        if used <= target:
            used = max([used, *(float(utilise(ratings, state).strength.max()) for state in carried.bent)])
        if used <= target:
            return index, used
    allowed = f"what the largest of {len(offered)} sizes in the catalogue carries, 1/{used / target:.3g} of it"
    raise DescriptionError(None, f"modules.{place[0]}.{place[1]}", carried.describe(), allowed)


def _rebuild(arm: Manipulator, rank: Mapping[Place, int], sizes: _Sizes) -> tuple[Manipulator, dict[Place, str]]:
    """The arm with the chosen sizes, and their names."""
    new: dict[str, dict[str, Tube | Cylinder]] = {"tubes": {}, "cylinders": {}}
    chosen: dict[Place, str] = {}
    modules = []
    for module in arm.modules:
        update = {}
        for field, old in module.sections().items():
            # the last module's battens are the tip plate, but the file names a tube
            index = rank.get((module.name, field), 0)
            name, part = sizes.fit(arm, field, old, index)
            parts = new["cylinders" if isinstance(part, Cylinder) else "tubes"]
            if parts.setdefault(name, part) != part:  # modules differ in pins or strokes
                name = f"{name}_{module.name}"
                parts[name] = part
            chosen[module.name, field] = update[field] = name
        modules.append(module.with_sections(update))
    changes = {"materials": arm.materials | sizes.catalogue.materials, **new, "modules": tuple(modules)}
    return arm.model_copy(update=changes), chosen
