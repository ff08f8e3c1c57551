"""Oil in the two chambers of each cylinder: pressures, force and stiffness from the oil trapped and the length.

Each chamber keeps the volume its oil would take at the tank's pressure; valves and leakage change that, the piston does
not. So a shut cylinder cannot drift, however long it is stepped. Pressures are above the tank's.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Chain
from vgtsim.statics import TRAPPED

Array = NDArray[np.float64]

VAPOUR = -0.1013e6  # Pa above the tank's: an atmosphere less, where oil leaves a cavity
# Newton's iterations for the piston's position, and the last correction, m: the next would be its square over 5 mm.
_PASSES, _CLOSE = 20, 1e-7
_SLACK = 1e3  # N/m: stiffness told of a cylinder with cavities on both sides


@dataclass(frozen=True)
class Cylinders:
    """The cylinders of an arm; arrays of shape (J,), or (2, J) with the bore's side first and the rod's second.

    Attributes:
        area: Of the piston on either side, shape (2, J), m².
        modulus: Bulk modulus of the oil, Pa.
        rod: Stiffness of the rod, N/m.
        retracted: Least length, m.
        stroke: m.
        supply: Pressure, Pa.
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

    @property
    def push(self) -> Array:
        """Force at supply pressure on the bore, shape (J,), N."""
        return self.supply * self.area[0]

    @property
    def pull(self) -> Array:
        """Force at supply pressure on the annulus, shape (J,), N."""
        return self.supply * self.area[1]

    def volumes(self, piston: Array) -> Array:
        """Volumes of the chambers, shape (2, J), m³, with the piston at a distance from the retracted end, shape (J,), m."""
        return self.area * (np.array([piston, self.stroke - piston]) + TRAPPED)


@dataclass(frozen=True)
class Oil:
    """Oil in the chambers.

    Attributes:
        free: Volume of the oil at the tank's pressure, shape (2, J), m³.
        piston: Where the piston was last found, shape (J,), m.
    """

    free: Array
    piston: Array


@dataclass(frozen=True)
class ChamberState:
    """Cylinders at given lengths.

    Attributes:
        piston: Distance from the retracted end, shape (J,), m.
        pressure: Above the tank's, shape (2, J), Pa.
        columns: Stiffness of the oil on either side, shape (2, J), N/m.
        force: Tension, shape (J,), N; at an end of the stroke with what the head or the gland takes.
        stiffness: Of oil and rod in series, or of the rod alone at an end, shape (J,), N/m.
        stopped: Whether the piston is at an end, shape (J,).
    """

    piston: Array
    pressure: Array
    columns: Array
    force: Array
    stiffness: Array
    stopped: NDArray[np.bool_]


def make_cylinders(chain: Chain) -> Cylinders:
    """Collect the cylinders of an arm, in the order of its actuators."""
    arm = chain.manipulator
    parts = [arm.cylinders[chain.truss.members[i].section] for i in chain.truss.actuated]
    bore, rod = (np.array([getattr(part, name) for part in parts]) for name in ("bore", "rod"))
    modulus = np.array([arm.materials[part.material].youngs_modulus for part in parts])
    return Cylinders(
        area=np.pi / 4 * np.stack([bore**2, bore**2 - rod**2]),
        modulus=np.array([part.bulk_modulus for part in parts]),
        rod=modulus * np.pi / 4 * rod**2 / np.array([part.rod_length for part in parts]),
        retracted=np.array([part.retracted for part in parts]),
        stroke=np.array([part.stroke for part in parts]),
        supply=np.array([part.pressure for part in parts]),
        rate=np.array([part.rate for part in parts]),
        leakage=np.array([part.leakage for part in parts]),
    )


def fill(cylinders: Cylinders, length: Array, force: Array) -> Oil:
    """Fill the chambers so that each cylinder carries a force at a length.

    The two pressures sum up to the supply's, as they do about the middle of a valve whose edges match the areas.

    Args:
        cylinders: The cylinders.
        length: From pin to pin, shape (J,), m.
        force: Tension, shape (J,), N.

    Source: H. E. Merritt, Hydraulic Control Systems (1967), section 5-2, for unequal areas.
    """
    piston = length - cylinders.retracted - force / cylinders.rod
    pulling = (cylinders.push + force) / cylinders.area.sum(axis=0)
    pressure = np.stack([cylinders.supply - pulling, pulling])
    return Oil(cylinders.volumes(piston) * np.exp(pressure / cylinders.modulus), piston)


def pressures(cylinders: Cylinders, free: Array, volume: Array) -> Array:
    """Pressures of oil squeezed into volumes, shape (2, J), Pa; where they would fall below the vapour's, a cavity opens.

    Args:
        cylinders: Give the bulk modulus.
        free: Volume of the oil at the tank's pressure, shape (2, J), m³.
        volume: Of the chambers, shape (2, J), m³.
    """
    return np.maximum(cylinders.modulus * np.log(free / volume), VAPOUR)


def find_state(cylinders: Cylinders, oil: Oil, length: Array) -> ChamberState:
    """Find pressures and force of cylinders of given lengths from pin to pin, shape (J,), m.

    The piston stands where the force of the oil is that of the rod.
    """
    reach, x = length - cylinders.retracted, oil.piston
    pressure, columns, force = _squeeze(cylinders, oil, x)
    for _ in range(_PASSES):
        shift = (force - cylinders.rod * (reach - x)) / (columns[0] + columns[1] + cylinders.rod)
        x = x - shift
        pressure, columns, force = _squeeze(cylinders, oil, x)
        if np.abs(shift).max() < _CLOSE:
            break
    stopped = (x < 0) | (x > cylinders.stroke)
    x, column = np.clip(x, 0.0, cylinders.stroke), np.maximum(columns[0] + columns[1], _SLACK)
    return ChamberState(
        piston=x,
        pressure=pressure,
        columns=columns,
        force=np.where(stopped, cylinders.rod * (reach - x), force),
        stiffness=np.where(stopped, cylinders.rod, 1 / (1 / column + 1 / cylinders.rod)),
        stopped=stopped,
    )


def _squeeze(cylinders: Cylinders, oil: Oil, piston: Array) -> tuple[Array, Array, Array]:
    """Pressures and stiffness of either column, shape (2, J), and tension, shape (J,), for pistons between the ends."""
    volume = cylinders.volumes(np.minimum(np.maximum(piston, 0.0), cylinders.stroke))
    pressure = pressures(cylinders, oil.free, volume)
    columns = np.where(pressure > VAPOUR, cylinders.modulus * cylinders.area**2 / volume, 0.0)
    return pressure, columns, pressure[1] * cylinders.area[1] - pressure[0] * cylinders.area[0]
