"""Sections and bores from a catalogue so that nothing is used beyond its strength; iterated, because weight is load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.catalogue import INCH, Catalogue, CylinderSize, TubeSize
from vgtsim.description.manipulator import Manipulator
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.description.sections import Cylinder, Tube
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.statics.cases import bound_case
from vgtsim.statics.elasticity import require_no_offset
from vgtsim.statics.loads import make_load_model, weigh
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.rating import SLENDERNESS_ADVICE, describe_sections, rate
from vgtsim.statics.utilisation import use_axial

Array = NDArray[np.float64]
Place = tuple[str, str]

_FIELDS = {"longeron": "longeron_tube", "cross_longeron": "cross_longeron_tube", "batten": "batten_tube"}


@dataclass(frozen=True)
class Demand:
    """What an arm must stand.

    Attributes:
        nodes: Poses, shape (K, N, 3), m, in frame G.
        motion: Of the nodes in those poses; absent where all are at rest.
        payload: The load at the tool.
        cases: Load cases, at least one, each in every pose.
        gravity: m/s².
        safety_factor: Omega of AISC 360.
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

    `mass` is that of the arm without payload, before and after, kg; `passes` are the iterations it took.
    """

    manipulator: Manipulator
    chosen: Mapping[Place, str]
    utilisation: Mapping[Place, float]
    mass: tuple[float, float]
    passes: int


@dataclass(frozen=True)
class _Carried:
    """Greatest forces of all cases along the members of one place; shapes (K, m), N, and their lengths, m."""

    pull: Array
    push: Array
    drive_pull: Array
    drive_push: Array
    length: Array


def size_arm(chain: Chain, catalogue: Catalogue, demand: Demand, target: float = 1.0) -> Sizing:
    """Choose the lightest section for the members of each kind in each module, and the bore of its cylinders.

    Every place starts with the lightest size and only grows, until the arm stands the demand with its own weight; the
    result does not depend on the sections that the arm came with. `target` is the greatest utilisation.

    Raises:
        DescriptionError: No cylinder in the catalogue is short enough for the arm's strokes, or no size carries the load
            of a place; its forces are named. A module has a joint offset: bending is not rated here.
    """
    require_no_offset(chain, "an arm is sized")
    sizes = _Sizes(catalogue, chain.manipulator)
    rank = dict.fromkeys(_places(chain), 0)
    count, settled = 0, not rank
    arm, chosen = _rebuild(chain.manipulator, rank, sizes)
    used: dict[Place, float] = {}
    while not settled:  # ends: ranks only grow, and there are finitely many
        now, count, new = replace(chain, manipulator=arm), count + 1, {}
        for place, carried in _find_carried(now, demand).items():
            new[place], used[place] = _choose(arm, place, carried, sizes, demand.safety_factor, target, rank[place])
        settled, rank = new == rank, new
        arm, chosen = _rebuild(chain.manipulator, rank, sizes)
    masses = weigh(chain), weigh(replace(chain, manipulator=arm))
    return Sizing(manipulator=arm, chosen=chosen, utilisation=used, mass=masses, passes=count)


class _Sizes:
    """Sizes of the catalogue, the lightest first, as parts of an arm."""

    def __init__(self, catalogue: Catalogue, arm: Manipulator) -> None:
        fitting = [size for size in catalogue.cylinders if _fits(size, arm)]
        if not fitting:
            least = min(part.retracted - part.stroke for part in arm.cylinders.values())
            short = min(size.head + 2 * size.eye for size in catalogue.cylinders)
            found = f"{len(catalogue.cylinders)} in the catalogue, of {short:.4g} m or more in heads and eyes"
            allowed = f"one with at most {least:.4g} m, what the arm's strokes leave of its retracted cylinders"
            raise DescriptionError(None, "cylinders", found, allowed)
        self.catalogue = catalogue
        self.tubes = sorted(catalogue.tubes, key=_tube_area)
        self.cylinders = sorted(fitting, key=lambda size: _cylinder_mass(size, arm))

    def of(self, field: str) -> Sequence[TubeSize | CylinderSize]:
        """Sizes for a field of a module."""
        return self.cylinders if field == "cylinder" else self.tubes

    def fit(self, arm: Manipulator, field: str, old: str, index: int) -> tuple[str, Tube | Cylinder]:
        """Name of a size and the part that it makes of an old one, whose pins and stroke stay."""
        size = self.of(field)[index]
        given = size.model_dump(exclude_none=True)
        if isinstance(size, CylinderSize):
            name = f"c{size.bore / INCH * 100:.0f}r{size.rod / INCH * 100:.0f}"
            return name, arm.cylinders[old].model_copy(update=given | {"material": self.catalogue.cylinder_material})
        name = f"t{size.outer_diameter / INCH * 100:.0f}x{size.wall / INCH * 1000:.0f}"
        return name, arm.tubes[old].model_copy(update=given | {"material": self.catalogue.tube_material})


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
    length = chain.truss.lengths(demand.nodes)
    pull = push = drive_pull = drive_push = np.zeros(length.shape)
    for case in demand.cases:
        high, low = bound_case(model, demand.nodes, case, demand.motion)
        pull, push = np.maximum(pull, high.along.max(axis=0)), np.maximum(push, -low.along.min(axis=0))
        drive_pull, drive_push = np.maximum(drive_pull, high.bar), np.maximum(drive_push, -low.bar)
    found: dict[Place, list[int]] = {}
    for index in range(len(chain.truss.members)):
        found.setdefault(_place(chain, index), []).append(index)
    arrays = {"pull": pull, "push": push, "drive_pull": drive_pull, "drive_push": drive_push, "length": length}
    return {
        place: _Carried(**{name: array[:, rows] for name, array in arrays.items()}) for place, rows in found.items()
    }


def _choose(
    arm: Manipulator, place: Place, carried: _Carried, sizes: _Sizes, safety_factor: float, target: float, least: int
) -> tuple[int, float]:
    """Rank of the lightest size that carries the load, and how much of it is used."""
    old = getattr(next(module for module in arm.modules if module.name == place[0]), place[1])
    steel, offered, used = sizes.catalogue.material_of(place[1]), sizes.of(place[1]), np.inf
    for index in range(least, len(offered)):
        part = sizes.fit(arm, place[1], old, index)[1]
        ratings = rate(describe_sections([(part, steel)]), carried.length, safety_factor)
        if isinstance(part, Tube) and ratings.slenderness.max() > SLENDERNESS_ADVICE:
            continue
        use = use_axial(ratings, carried.pull, carried.push, carried.drive_pull, carried.drive_push)
        used = float(use.worst.max())
        if used <= target:
            return index, used
    forces = f"{carried.pull.max() / 1e3:.1f} kN of pull and {carried.push.max() / 1e3:.1f} kN of push"
    allowed = f"what the largest of {len(offered)} sizes in the catalogue carries, 1/{used / target:.3g} of it"
    raise DescriptionError(None, f"modules.{place[0]}.{place[1]}", forces, allowed)


def _rebuild(arm: Manipulator, rank: Mapping[Place, int], sizes: _Sizes) -> tuple[Manipulator, dict[Place, str]]:
    """The arm with the chosen sizes, and their names."""
    new: dict[str, dict[str, Tube | Cylinder]] = {"tubes": {}, "cylinders": {}}
    chosen: dict[Place, str] = {}
    modules = []
    for module in arm.modules:
        update = {}
        for field in (*_FIELDS.values(), "cylinder"):
            if not hasattr(module, field):
                continue
            # the last module's battens are the tip plate, but the file names a tube
            index = rank.get((module.name, field), 0)
            name, part = sizes.fit(arm, field, getattr(module, field), index)
            parts = new["cylinders" if field == "cylinder" else "tubes"]
            if parts.setdefault(name, part) != part:  # modules differ in pins or strokes
                name = f"{name}_{module.name}"
                parts[name] = part
            chosen[module.name, field] = update[field] = name
        modules.append(module.model_copy(update=update))
    changes = {"materials": arm.materials | sizes.catalogue.materials, **new, "modules": tuple(modules)}
    return arm.model_copy(update=changes), chosen
