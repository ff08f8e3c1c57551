"""Allowable forces of members and cylinders: AISC 360-22, Euler's load of rods, and the oil's pressure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from math import pi

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import compiled
from vgtsim.description import Cylinder, Material, Tube
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain

SLENDERNESS_ADVICE = 200.0  # AISC 360-22 E2, user note: KL/r preferably not above
ROD_FACTOR = 3.0  # on the Euler load of a cylinder's rod: makers ask for 3 to 5
# of axial force, as `Ratings.limits` has them
LIMITS = ("yield", "column", "rod buckling", "oil pressure", "pin shear")


@dataclass(frozen=True)
class MemberSections:
    """The properties that strength follows from, shapes (M,), SI, of an actuator's solid rod and of a tube's design wall.

    Attributes:
        slimness: Outer diameter over design wall, D/t; zero for solid rods.
        push: Compression that the supply pressure holds, N, as `pull` is the tension; infinite for tubes.
        pin: Nominal shear strength of the pins at the ends, N; infinite where none is given.
        barrel_length: From the near end to the barrel's mouth, m; zero for tubes.
        barrel_moment: Nominal strength of the barrel in bending, N·m, as `rod_moment` is the rod's; infinite for tubes.
    """

    area: Array
    gyration_radius: Array
    yield_strength: Array
    youngs_modulus: Array
    push: Array
    pull: Array
    actuator: Mask
    slimness: Array | float = 0.0
    pin: Array | float = np.inf
    barrel_length: Array | float = 0.0
    barrel_moment: Array | float = np.inf
    rod_moment: Array | float = np.inf

    @cached_property
    def figures(self) -> Array:
        """What compiled functions rate each member of any length by, shape (9, M).

        Area in compression, radius of gyration, Fy, E, and forces: yield in tension, shear of the pins, what a rod of 1 m may
        have, what the pressure holds in compression and in tension.
        """
        steel = self.yield_strength, self.youngs_modulus
        rod = rod_buckling(4 * self.gyration_radius, self.youngs_modulus, 1.0) / ROD_FACTOR
        table = np.empty((9, len(self.area)))
        table[:4] = effective_area(self.area, self.slimness, *steel), self.gyration_radius, *steel
        table[4], table[5] = tension_yield(self.area, self.yield_strength), self.pin
        table[6:] = np.where(self.actuator, rod, np.inf), self.push, self.pull
        return table


@dataclass(frozen=True)
class Ratings:
    """Allowable forces of every member, positive, shapes (..., M), N; `...` are the instants. Infinite without a limit.

    Attributes:
        tension: Yielding of the gross section.
        compression: Column strength; of an actuator, that of its rod over the whole length.
        rod: Euler load of an actuator's rod over `ROD_FACTOR`.
        push: Compression that the cylinder's supply pressure holds; `pull` is the tension.
        slenderness: KL/r with K = 1; at most `SLENDERNESS_ADVICE` is advised.
        pin: Shear of the pins at the ends.
        mouth: Of an actuator's barrel, in parts of the length; zero for tubes.
        barrel_moment: Bending of the barrel, N·m; `rod_moment` is that of the rod.
    """

    tension: Array
    compression: Array
    rod: Array
    push: Array
    pull: Array
    slenderness: Array
    pin: Array
    mouth: Array
    barrel_moment: Array
    rod_moment: Array

    def of(self, members: Index) -> Ratings:
        """The ratings of some members."""
        return Ratings(**{item.name: getattr(self, item.name)[..., members] for item in fields(self)})

    @property
    def limits(self) -> Mapping[str, tuple[Array, Array]]:
        """Greatest pull and greatest push by each of `LIMITS`, N; the drive force alone counts for the oil pressure."""
        endless = np.full(1, np.inf)
        pulls = (self.tension, endless, endless, self.pull, self.pin)
        pushes = (endless, self.compression, self.rod, self.push, self.pin)
        return dict(zip(LIMITS, zip(pulls, pushes, strict=True), strict=True))


def tension_yield(area: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength in tension by yielding of the gross section: Pn, shape (...), N, for m² and Fy in Pa.

    Source: AISC 360-22 equation D2-1.
    """
    return np.asarray(yield_strength, float) * np.asarray(area, float)


def column_strength(area: ArrayLike, slenderness: ArrayLike, yield_strength: ArrayLike, modulus: ArrayLike) -> Array:
    """Nominal strength in compression by flexural buckling: Pn, shape (...), N, for m², KL/r, Fy and E in Pa.

    Source: AISC 360-22 equations E3-1 to E3-4, whose constants stand here.
    """
    columns = np.stack(np.broadcast_arrays(area, slenderness, yield_strength, modulus)).astype(float)
    strength = np.empty(columns.shape[1:])
    _fill_columns(columns.reshape(4, -1), strength.reshape(-1))
    return strength


@compiled
def _fill_columns(columns: Array, strength: Array) -> None:
    for i in range(len(strength)):
        strength[i] = find_column(columns[0, i], columns[1, i], columns[2, i], columns[3, i])


@compiled
def elastic_stress(slenderness: float, modulus: float) -> float:
    """Stress at which a column of KL/r buckles elastically: Fe, Pa, for E in Pa (AISC 360-22 equation E3-4)."""
    return pi**2 * modulus / slenderness**2


@compiled
def is_inelastic(slenderness: float, yield_strength: float, modulus: float) -> bool:
    """Whether a column yields in part as it buckles, so that equation E3-2 holds and not E3-3."""
    return slenderness <= 4.71 * np.sqrt(modulus / yield_strength)


@compiled
def find_column(area: float, slenderness: float, yield_strength: float, modulus: float) -> float:
    """`column_strength` of one column, for compiled functions."""
    elastic = elastic_stress(slenderness, modulus)
    if is_inelastic(slenderness, yield_strength, modulus):
        return 0.658 ** (yield_strength / elastic) * yield_strength * area
    return 0.877 * elastic * area


def effective_area(area: ArrayLike, slimness: ArrayLike, yield_strength: ArrayLike, modulus: ArrayLike) -> Array:
    """Area that counts in compression of a round tube whose wall may buckle: Ae, shape (...), m², for D/t, Fy and E in Pa.

    Source: AISC 360-22 equations E7-6 and E7-7, whose constants stand here. They end at `find_slimmest`.
    """
    thin = np.asarray(slimness, float) * np.asarray(yield_strength, float) / np.asarray(modulus, float)
    part = np.where(thin <= 0.11, 1.0, 0.038 / np.maximum(thin, 0.11) + 2 / 3)
    return np.minimum(part, 1.0) * np.asarray(area, float)


def find_slimmest(yield_strength: float, modulus: float) -> float:
    """Greatest D/t of a round tube that AISC 360-22 rates in compression (E7.2), for Fy and E in Pa."""
    return 0.45 * modulus / yield_strength


def rod_buckling(diameter: ArrayLike, youngs_modulus: ArrayLike, length: ArrayLike) -> Array:
    """Euler load of a cylinder's solid rod between pins, shape (...), N, for m, Pa and m.

    The length is from pin to pin: the whole cylinder counts as its rod, on the safe side.
    Source: Euler, pinned ends; cylinder makers divide it by 3 to 5 (`ROD_FACTOR`).
    """
    inertia = pi * np.asarray(diameter, float) ** 4 / 64
    return pi**2 * np.asarray(youngs_modulus, float) * inertia / np.asarray(length, float) ** 2


def pin_shear(diameter: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength of a pin in double shear, by yielding, shape (...), N, for m and Fy in Pa.

    Source: AISC 360-22 equation J4-3, 0.6 Fy times the area, on two planes.
    """
    return 2 * 0.6 * np.asarray(yield_strength, float) * pi / 4 * np.asarray(diameter, float) ** 2


def rod_bending_strength(diameter: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength of a solid round in bending: Mn = Fy Z, at most 1.6 Fy S, shape (...), N·m; Z is 1.70 S.

    Diameter in m, Fy in Pa. Source: AISC 360-22 equation F11-1.
    """
    d, fy = np.asarray(diameter, float), np.asarray(yield_strength, float)
    return np.minimum(fy * d**3 / 6, 1.6 * fy * pi * d**3 / 32)


def tube_bending_strength(outer: ArrayLike, inner: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength of a compact round tube in bending: Mn = Fy Z, shape (...), N·m, for diameters in m and Fy in Pa.

    Source: AISC 360-22 equation F8-1. A cylinder's barrel is compact by far: D/t below 0.07 E/Fy, 44 for this steel.
    """
    shape = np.asarray(outer, float) ** 3 - np.asarray(inner, float) ** 3
    return np.asarray(yield_strength, float) * shape / 6


def make_sections(chain: Chain) -> MemberSections:
    """Section properties of every member of an arm; a DescriptionError where AISC 360-22 does not rate so thin a wall."""
    manipulator, members = chain.manipulator, chain.truss.members
    kinds = [manipulator.cylinders if member.role == "actuator" else manipulator.tubes for member in members]
    parts = [kind[member.section] for kind, member in zip(kinds, members, strict=True)]
    return describe_sections([(part, manipulator.materials[part.material]) for part in parts])


def describe_sections(parts: Sequence[tuple[Tube | Cylinder, Material]]) -> MemberSections:
    """Collect the section properties of tubes and cylinders, each with its steel, in their order."""
    rows = [_describe(part, steel) for part, steel in parts]
    return MemberSections(**{name: np.array([row[name] for row in rows]) for name in rows[0]})


def _describe(part: Tube | Cylinder, steel: Material) -> dict[str, float | bool]:
    """Fields of `MemberSections` of one member."""
    fy = steel.yield_strength
    pin = np.inf if part.pin is None else float(pin_shear(part.pin, fy))
    row = {"yield_strength": fy, "youngs_modulus": steel.youngs_modulus, "pin": pin}
    if isinstance(part, Tube):
        thinner = part.model_copy(update={"wall": steel.design_wall * part.wall})
        slimness, most = part.outer_diameter / thinner.wall, find_slimmest(fy, steel.youngs_modulus)
        if slimness >= most:
            found = f"{part.wall:.4g} m, a design wall of 1/{slimness:.4g} of the diameter"
            raise DescriptionError(None, "tubes.wall", found, f"1/{most:.4g} or more, which AISC 360-22 E7 rates")
        tube = {"area": thinner.area, "gyration_radius": thinner.gyration_radius, "slimness": slimness}
        row |= tube | {"barrel_length": 0.0, "actuator": False}
        return row | dict.fromkeys(("push", "pull", "barrel_moment", "rod_moment"), np.inf)
    return row | {
        "area": part.rod_area,
        "gyration_radius": part.rod / 4,
        "push": part.push,
        "pull": part.pull,
        "actuator": True,
        "slimness": 0.0,
        "barrel_length": part.barrel_length,
        "barrel_moment": float(tube_bending_strength(part.barrel_diameter, part.bore, fy)),
        "rod_moment": float(rod_bending_strength(part.rod, fy)),
    }


def rate(sections: MemberSections, lengths: ArrayLike, safety_factor: float) -> Ratings:
    """Allowable forces of members of lengths from hub to hub, shape (..., M), m, with Omega of AISC 360 as safety factor.

    Sections of one member rate lengths of any shape as of its like.
    Source: AISC 360-22 B4.2, D2, E3 and E7 with K = 1, F8, F11 and J4.2; `rod_buckling` for actuators.
    """
    length = np.asarray(lengths, float)
    slenderness = length / sections.gyration_radius
    steel = sections.yield_strength, sections.youngs_modulus
    column = column_strength(effective_area(sections.area, sections.slimness, *steel), slenderness, *steel)
    euler = rod_buckling(4 * sections.gyration_radius, sections.youngs_modulus, length)

    def spread(value: Array | float) -> Array:
        return np.broadcast_to(value, length.shape)

    return Ratings(
        tension=spread(tension_yield(sections.area, sections.yield_strength) / safety_factor),
        compression=column / safety_factor,
        rod=np.where(sections.actuator, euler / ROD_FACTOR, np.inf),
        push=spread(sections.push),
        pull=spread(sections.pull),
        slenderness=slenderness,
        pin=spread(sections.pin / safety_factor),
        mouth=sections.barrel_length / length,
        barrel_moment=spread(sections.barrel_moment / safety_factor),
        rod_moment=spread(sections.rod_moment / safety_factor),
    )
