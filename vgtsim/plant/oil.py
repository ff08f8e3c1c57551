"""Oil in the two chambers of each cylinder: pressures, force and stiffness from the oil trapped and the length.

Each chamber keeps the volume its oil would take at the tank's pressure; valves and leakage change that, the piston does
not. So a shut cylinder cannot drift, however long it is stepped. Pressures are above the tank's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array, Mask
from vgtsim.compilation import compiled
from vgtsim.kinematics import Chain
from vgtsim.statics import TRAPPED

Figures = tuple[NDArray[Any], ...]

VAPOUR = -0.1013e6  # Pa above the tank's: an atmosphere less, where oil leaves a cavity
# Newton's iterations for the piston's position, and the last correction, m: the next would be its square over 5 mm.
_PASSES, _CLOSE = 20, 1e-7
_SLACK = 1e3  # N/m: stiffness given to a cylinder with cavities on both sides


@dataclass(frozen=True)
class Cylinders:
    """The cylinders of an arm; arrays of shape (J,), or (2, J) with the bore's side first and the rod's second.

    Attributes:
        area: Area of the piston on either side, shape (2, J), m².
        modulus: Bulk modulus of the oil, Pa.
        rod: Stiffness of the rod, N/m.
        retracted, stroke: Least length and what the cylinder adds to it, m.
        supply: Supply pressure, Pa.
        rate: Speed at the valve's flow limit without load, m/s.
        leakage: Flow across the piston per pressure, m³/(s·Pa).
    """

    area: Array
    modulus: Array
    rod: Array
    retracted: Array
    stroke: Array
    supply: Array
    rate: Array
    leakage: Array

    @cached_property
    def push(self) -> Array:
        """Force at supply pressure on the bore, shape (J,), N."""
        return self.supply * self.area[0]

    @cached_property
    def pull(self) -> Array:
        """Force at supply pressure on the annulus, shape (J,), N."""
        return self.supply * self.area[1]

    @cached_property
    def both(self) -> Array:
        """Sum of the two areas, shape (J,), m²."""
        return self.area[0] + self.area[1]

    def volumes(self, piston: Array) -> Array:
        """Volumes of the chambers, shape (2, J), m³, with the piston at a distance from the retracted end, shape (J,), m."""
        result = np.empty_like(self.area)
        result[0] = piston
        np.subtract(self.stroke, piston, out=result[1])
        result += TRAPPED
        result *= self.area
        return result


@dataclass(frozen=True)
class Oil:
    """Volume of the oil at the tank's pressure, shape (2, J), m³, and where the piston was last found, shape (J,), m."""

    free: Array
    piston: Array


@dataclass(frozen=True)
class ChamberState:
    """Cylinders at given lengths.

    Attributes:
        piston: Distance from the retracted end, shape (J,), m.
        pressure: Above the tank's, shape (2, J), Pa.
        columns: Stiffness of the oil on either side, shape (2, J), N/m.
        force: Tension, shape (J,), N; at an end of the stroke it includes the force of the head or the gland.
        stiffness: Of oil and rod in series, or of the rod alone at an end, shape (J,), N/m.
        stopped: Whether the piston is at an end, shape (J,).
    """

    piston: Array
    pressure: Array
    columns: Array
    force: Array
    stiffness: Array
    stopped: Mask


def make_cylinders(chain: Chain) -> Cylinders:
    """Collect the cylinders of an arm, in the order of its actuators."""
    arm = chain.manipulator
    parts = [arm.cylinders[chain.truss.members[i].section] for i in chain.truss.actuated]

    def collect(name: str) -> Array:
        return np.array([getattr(part, name) for part in parts])

    return Cylinders(
        area=np.stack([collect("bore_area"), collect("ring_area")]),
        modulus=collect("bulk_modulus"),
        rod=np.array([part.rod_stiffness(arm.materials[part.material].youngs_modulus) for part in parts]),
        retracted=collect("retracted"),
        stroke=collect("stroke"),
        supply=collect("pressure"),
        rate=collect("rate"),
        leakage=collect("leakage"),
    )


def fill(cylinders: Cylinders, length: Array, force: Array) -> Oil:
    """Fill the chambers so that cylinders carry tensions, shape (J,), N, at lengths from pin to pin, shape (J,), m.

    The two pressures sum up to the supply's, as they do about the middle of a valve whose edges match the areas.

    Source: H. E. Merritt, Hydraulic Control Systems (1967), section 5-2, for unequal areas.
    """
    piston = length - cylinders.retracted - force / cylinders.rod
    pulling = (cylinders.push + force) / cylinders.both
    pressure = np.stack([cylinders.supply - pulling, pulling])
    return Oil(cylinders.volumes(piston) * np.exp(pressure / cylinders.modulus), piston)


def find_state(cylinders: Cylinders, oil: Oil, length: Array) -> ChamberState:
    """Find pressures and force of cylinders of given lengths from pin to pin, shape (J,), m.

    The piston stands where the force of the oil equals the force of the rod.
    """
    shape = cylinders.area.shape
    piston, force, stiffness = (np.empty(shape[1]) for _ in range(3))
    pressure, columns = (np.empty(shape) for _ in range(2))
    stopped = np.empty(shape[1], np.bool_)
    figures = cylinders.area, cylinders.modulus, cylinders.rod, cylinders.stroke
    balance(
        figures,
        oil.free,
        oil.piston,
        length - cylinders.retracted,
        (pressure, columns),
        (piston, force, stiffness, stopped),
    )
    return ChamberState(
        piston=piston, pressure=pressure, columns=columns, force=force, stiffness=stiffness, stopped=stopped
    )


@compiled
def chamber(side: int, piston: float, stroke: float, area: float) -> float:
    """Volume of one chamber, m³, with the piston at a distance from the retracted end, m, or at the nearer end."""
    within = 0.0 if piston < 0 else stroke if piston > stroke else piston
    return ((stroke - within if side else within) + TRAPPED) * area


@compiled
def squeeze(free: float, volume: float, modulus: float) -> float:
    """Pressure of oil of a free volume in a chamber, m³, Pa; where it would fall below the vapour's, a cavity opens."""
    pressure = modulus * np.log(free / volume)
    return VAPOUR if pressure < VAPOUR else pressure


@compiled
def balance(figures: Figures, free: Array, last: Array, reach: Array, oil: Figures, found: Figures) -> None:
    """Write the parts of a `ChamberState`, from where the pistons were last and lengths beyond the retracted ones."""
    area, modulus, rod, stroke = figures
    (pressure, columns), (piston, force, stiffness, stopped) = oil, found
    for j in range(len(reach)):
        x, shift, pull, spring = last[j], np.inf, 0.0, 0.0
        for left in range(_PASSES, -1, -1):
            pull, spring = 0.0, 0.0
            for side in range(2):
                volume = chamber(side, x, stroke[j], area[side, j])
                pressure[side, j] = squeeze(free[side, j], volume, modulus[j])
                columns[side, j] = modulus[j] * area[side, j] ** 2 / volume if pressure[side, j] > VAPOUR else 0.0
                pull += (pressure[side, j] if side else -pressure[side, j]) * area[side, j]
                spring += columns[side, j]
            if left == 0 or abs(shift) < _CLOSE:
                break
            shift = (pull - rod[j] * (reach[j] - x)) / (spring + rod[j])
            x -= shift
        stopped[j] = x < 0 or x > stroke[j]
        piston[j] = 0.0 if x < 0 else stroke[j] if x > stroke[j] else x
        force[j] = rod[j] * (reach[j] - piston[j]) if stopped[j] else pull
        stiffness[j] = rod[j] if stopped[j] else 1 / (1 / max(spring, _SLACK) + 1 / rod[j])
