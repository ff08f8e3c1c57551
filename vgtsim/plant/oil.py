"""Oil in the two chambers of each cylinder: pressures, force and stiffness from the oil trapped and the length.

Each chamber keeps the volume its oil would take at the tank's pressure; valves and leakage change that, the piston does
not. So a shut cylinder cannot drift, however long it is stepped. Pressures are above the tank's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.kinematics import Chain
from vgtsim.statics import TRAPPED

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

    @cached_property
    def column(self) -> Array:
        """Stiffness of a column of oil times its volume, shape (2, J), N·m²."""
        return self.modulus * self.area**2

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

    bore, rod = collect("bore"), collect("rod")
    modulus = np.array([arm.materials[part.material].youngs_modulus for part in parts])
    return Cylinders(
        area=np.pi / 4 * np.stack([bore**2, bore**2 - rod**2]),
        modulus=collect("bulk_modulus"),
        rod=modulus * np.pi / 4 * rod**2 / collect("rod_length"),
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


def pressures(cylinders: Cylinders, free: Array, volume: Array) -> Array:
    """Pressures, shape (2, J), Pa, of oil of a free volume squeezed into chambers of a volume, both shape (2, J), m³.

    Where the pressure would fall below the vapour's, a cavity opens.
    """
    return np.maximum(cylinders.modulus * np.log(free / volume), VAPOUR)


def find_state(cylinders: Cylinders, oil: Oil, length: Array) -> ChamberState:
    """Find pressures and force of cylinders of given lengths from pin to pin, shape (J,), m.

    The piston stands where the force of the oil equals the force of the rod.
    """
    reach, x, rod, stroke = length - cylinders.retracted, oil.piston, cylinders.rod, cylinders.stroke
    pressure, columns, force = _squeeze(cylinders, oil, x)
    for _ in range(_PASSES):
        shift = (force - rod * (reach - x)) / (columns[0] + columns[1] + rod)
        x = x - shift
        pressure, columns, force = _squeeze(cylinders, oil, x)
        if np.abs(shift).max() < _CLOSE:
            break
    stopped, stiffness = (x < 0) | (x > stroke), 1 / (1 / np.maximum(columns[0] + columns[1], _SLACK) + 1 / rod)
    if stopped.any():
        x = np.minimum(np.maximum(x, 0.0), stroke)
        force, stiffness = np.where(stopped, rod * (reach - x), force), np.where(stopped, rod, stiffness)
    return ChamberState(piston=x, pressure=pressure, columns=columns, force=force, stiffness=stiffness, stopped=stopped)


def _squeeze(cylinders: Cylinders, oil: Oil, piston: Array) -> tuple[Array, Array, Array]:
    """Pressures and stiffness of either column, shape (2, J), and tension, shape (J,), for pistons between the ends."""
    volume = cylinders.volumes(np.minimum(np.maximum(piston, 0.0), cylinders.stroke))
    pressure = pressures(cylinders, oil.free, volume)
    columns = (pressure > VAPOUR) * (cylinders.column / volume)
    across = pressure * cylinders.area
    return pressure, columns, across[1] - across[0]
