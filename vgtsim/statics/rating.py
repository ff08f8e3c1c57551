"""What members and cylinders can carry, and how much of it is used.

Tubes and cylinder bodies are rated for strength; what oil pressure can hold is rated apart, as drive
capacity, and so is buckling of the extended rod.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.manipulator import Manipulator
from vgtsim.kinematics.truss import Truss
from vgtsim.statics.bending import amplify, greatest_moments, interact, rod_bending_strength, tube_bending_strength
from vgtsim.statics.equilibrium import MemberForces

Array = NDArray[np.float64]

SLENDERNESS_ADVICE = 200.0  # AISC 360-22 E2, user note: KL/r preferably not above
MODES = ("yield", "column", "rod buckling", "pin shear", "axial force with bending")
ROD_FACTOR = 3.0  # on the Euler load of a cylinder's rod: makers ask for 3 to 5


@dataclass(frozen=True)
class Section:
    """What strength follows from, for every member of a truss; an actuator counts with its solid rod.

    Attributes:
        area: Shape (M,), m².
        gyration_radius: Shape (M,), m.
        yield_strength: Fy, shape (M,), Pa.
        youngs_modulus: E, shape (M,), Pa.
        push: Compression that the supply pressure holds, shape (M,), N; infinite for tubes.
        pull: Tension that the supply pressure holds, shape (M,), N; infinite for tubes.
        actuator: Whether the member is an actuator, shape (M,).
        pin: Nominal shear strength of the pins at its ends, shape (M,), N; absent or infinite where none is given.
        barrel_length: From the near end to the barrel's mouth, shape (M,), m; zero for tubes.
        barrel_moment: Nominal strength of the barrel in bending, shape (M,), N·m; infinite for tubes.
        rod_moment: Nominal strength of the rod in bending, shape (M,), N·m; infinite for tubes.
    """

    area: Array
    gyration_radius: Array
    yield_strength: Array
    youngs_modulus: Array
    push: Array
    pull: Array
    actuator: NDArray[np.bool_]
    pin: Array | None = None
    barrel_length: Array | float = 0.0
    barrel_moment: Array | float = np.inf
    rod_moment: Array | float = np.inf


@dataclass(frozen=True)
class Ratings:
    """Allowable forces of every member, positive, N; `...` are the instants.

    Attributes:
        tension: Yielding of the gross section, shape (..., M).
        compression: Column strength; of an actuator, that of its rod over the whole length, shape (..., M).
        rod: Euler load of an actuator's rod over `ROD_FACTOR`, shape (..., M); infinite for tubes.
        push: Compression that the cylinder's supply pressure holds, shape (..., M); infinite for tubes.
        pull: Tension that the cylinder's supply pressure holds, shape (..., M); infinite for tubes.
        slenderness: KL/r with K = 1, shape (..., M); at most `SLENDERNESS_ADVICE` is advised.
        pin: Shear of the pins at the ends, shape (..., M); infinite where none is given.
        mouth: Of an actuator's barrel, in parts of the length, shape (..., M); zero for tubes.
        barrel_moment: Bending of the barrel, shape (..., M), N·m; infinite for tubes.
        rod_moment: Bending of the rod, shape (..., M), N·m; infinite for tubes.
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


@dataclass(frozen=True)
class Utilisation:
    """Demand over capacity, each shape (..., M).

    Attributes:
        tension: Greatest tension along the member over its allowable.
        compression: Greatest compression along the member over its column strength.
        rod: Greatest compression over the allowable of the rod; zero for tubes.
        pressure: Drive force over what the supply pressure holds; zero for tubes.
        pin: Greatest force, pulled or pushed, over the pins' shear strength; zero where none is given.
        bent: Axial force and bending together, of the rod or of the barrel, whichever is used more; zero for members
            that do not bend.
    """

    tension: Array
    compression: Array
    rod: Array
    pressure: Array
    pin: Array
    bent: Array

    @property
    def strength(self) -> Array:
        """Worst of tension, column, rod, pin and bending: everything but the oil, shape (..., M)."""
        return self.by_mode.max(axis=0)

    @property
    def by_mode(self) -> Array:
        """Utilisation in each of `MODES`, shape (5, ..., M)."""
        return np.stack([self.tension, self.compression, self.rod, self.pin, self.bent])


def tension_yield(area: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength in tension by yielding of the gross section.

    Args:
        area: Shape (...), m².
        yield_strength: Fy, shape (...), Pa.

    Returns:
        Pn, shape (...), N.

    Source: AISC 360-22 equation D2-1.
    """
    return np.asarray(yield_strength, float) * np.asarray(area, float)


def column_strength(
    area: ArrayLike, slenderness: ArrayLike, yield_strength: ArrayLike, youngs_modulus: ArrayLike
) -> Array:
    """Nominal strength in compression by flexural buckling.

    Args:
        area: Shape (...), m².
        slenderness: KL/r, shape (...).
        yield_strength: Fy, shape (...), Pa.
        youngs_modulus: E, shape (...), Pa.

    Returns:
        Pn, shape (...), N.

    Source: AISC 360-22 equations E3-1 to E3-4.
    """
    fy, e, kl_r = (np.asarray(value, float) for value in (yield_strength, youngs_modulus, slenderness))
    elastic = pi**2 * e / kl_r**2
    stocky = kl_r <= 4.71 * np.sqrt(e / fy)
    critical = np.where(stocky, 0.658 ** (fy / elastic) * fy, 0.877 * elastic)
    return critical * np.asarray(area, float)


def rod_buckling(diameter: ArrayLike, youngs_modulus: ArrayLike, length: ArrayLike) -> Array:
    """Euler load of a cylinder's rod between pins.

    Args:
        diameter: Of the solid rod, shape (...), m.
        youngs_modulus: E, shape (...), Pa.
        length: From pin to pin, shape (...), m: the whole cylinder counts as its rod, on the safe side.

    Returns:
        Critical load, shape (...), N.

    Source: Euler, pinned ends; cylinder makers divide it by 3 to 5 (`ROD_FACTOR`).
    """
    inertia = pi * np.asarray(diameter, float) ** 4 / 64
    return pi**2 * np.asarray(youngs_modulus, float) * inertia / np.asarray(length, float) ** 2


def pin_shear(diameter: ArrayLike, yield_strength: ArrayLike) -> Array:
    """Nominal strength of a pin in double shear, by yielding.

    Args:
        diameter: Shape (...), m.
        yield_strength: Fy, shape (...), Pa.

    Returns:
        2 times 0.6 Fy times its area, shape (...), N.

    Source: AISC 360-22 equation J4-3, on two planes.
    """
    return 2 * 0.6 * np.asarray(yield_strength, float) * pi / 4 * np.asarray(diameter, float) ** 2


def make_sections(manipulator: Manipulator, truss: Truss) -> Section:
    """Collect section properties for every member.

    Args:
        manipulator: The arm.
        truss: Its truss.

    Returns:
        Arrays over the members.
    """
    rows, pins, bends = [], [], []
    for member in truss.members:
        if member.role == "actuator":
            cylinder = manipulator.cylinders[member.section]
            material = manipulator.materials[cylinder.material]
            shape = (pi / 4 * cylinder.rod**2, cylinder.rod / 4)
            oil, pin = (cylinder.push, cylinder.pull), cylinder.pin
            barrel = tube_bending_strength(cylinder.barrel_diameter, cylinder.bore, material.yield_strength)
            rod = rod_bending_strength(cylinder.rod, material.yield_strength)
            bends.append((cylinder.barrel_length, float(barrel), float(rod)))
        else:
            tube = manipulator.tubes[member.section]
            material = manipulator.materials[tube.material]
            shape = (tube.area, tube.gyration_radius)
            oil, pin = (np.inf, np.inf), tube.pin
            bends.append((0.0, np.inf, np.inf))
        rows.append((*shape, material.yield_strength, material.youngs_modulus, *oil))
        pins.append(np.inf if pin is None else float(pin_shear(pin, material.yield_strength)))
    actuator = np.zeros(len(rows), dtype=bool)
    actuator[truss.actuated] = True
    length, barrel, rod = np.array(bends).T
    return Section(
        *np.array(rows).T,
        actuator=actuator,
        pin=np.array(pins),
        barrel_length=length,
        barrel_moment=barrel,
        rod_moment=rod,
    )


def rate(section: Section, lengths: ArrayLike, safety_factor: float) -> Ratings:
    """Work out allowable forces.

    Args:
        section: Section properties.
        lengths: Of the members from hub to hub, shape (..., M), m; an actuator's changes with its stroke.
        safety_factor: Omega of AISC 360, dimensionless.

    Returns:
        Allowable forces.

    Source: AISC 360-22 D2, E3 with K = 1, F8, F11 and J4.2; `rod_buckling` for actuators.
    """
    length = np.asarray(lengths, float)
    slenderness = length / section.gyration_radius
    tension = tension_yield(section.area, section.yield_strength) / safety_factor
    column = column_strength(section.area, slenderness, section.yield_strength, section.youngs_modulus)
    euler = rod_buckling(4 * section.gyration_radius, section.youngs_modulus, length)
    spread = (np.broadcast_to(value, length.shape) for value in (tension, section.push, section.pull))
    tension, push, pull = spread
    rod = np.where(section.actuator, euler / ROD_FACTOR, np.inf)
    pin = np.broadcast_to(np.inf if section.pin is None else section.pin / safety_factor, length.shape)
    bending = (
        np.broadcast_to(part / safety_factor, length.shape) for part in (section.barrel_moment, section.rod_moment)
    )
    mouth = section.barrel_length / length
    return Ratings(tension, column / safety_factor, rod, push, pull, slenderness, pin, mouth, *bending)


def utilise(ratings: Ratings, forces: MemberForces) -> Utilisation:
    """Hold forces against ratings.

    The axial force of a member runs between its values at the near hub, where its segments meet, and at the
    far hub; the greatest of the three counts in tension and in compression.

    Args:
        ratings: Allowable forces, shape (..., M).
        forces: Found forces, shape (..., M).

    Returns:
        Demand over capacity; NaN where the forces are NaN.
    """
    along = forces.along
    pull, push = np.maximum(along.max(axis=0), 0.0), np.maximum(-along.min(axis=0), 0.0)
    drive = np.where(forces.bar > 0, forces.bar / ratings.pull, -forces.bar / ratings.push)
    sheared = np.maximum(pull, push) / ratings.pin
    tension, compression = pull / ratings.tension, push / ratings.compression
    bent = _use_bent(ratings, forces, np.maximum(tension, compression), push)
    return Utilisation(tension, compression, push / ratings.rod, drive, sheared, bent)


def _use_bent(ratings: Ratings, forces: MemberForces, axial: Array, push: Array) -> Array:
    """Axial force and bending together, shape (..., M); the barrel's axial part counts as the rod's, on the safe side."""
    barrel, rod = greatest_moments(forces.near_moment, forces.far_moment, ratings.mouth)
    moment = np.maximum(barrel / ratings.barrel_moment, rod / ratings.rod_moment)
    carried = np.where(moment > 0, amplify(push, ROD_FACTOR * ratings.rod), 1.0) * moment
    return np.where(moment > 0, interact(axial, carried), 0.0)
