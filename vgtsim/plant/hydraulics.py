"""Valves and their control: position control of hydraulic cylinders, leakage and lock, one step at a time.

A spool valve opens both chambers, one to the supply and one to the tank; its edges match the piston's areas. It is told
the command's speed plus a gain on the length error, and opens the wider the less pressure the load leaves. Relief valves
hold each chamber at the supply's pressure or less. Near a command at rest the lock valves shut; the piston's seal leaks on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.kinematics import first_greatest
from vgtsim.plant.oil import VAPOUR, ChamberState, Cylinders, Figures, Oil, chamber, make_cylinders, squeeze
from vgtsim.site import Site
from vgtsim.statics import solve_members

Bits = NDArray[np.int64]

FLOW, PRESSURE, STROKE, CAVITY = 1, 2, 4, 8  # bits of a saturation
_LEAST_SPEED = 1e-3**0.5  # of the rate, what a thousandth of the unloaded pressure gives: no valve divides by less
_TINY = np.finfo(float).tiny  # against a division of nothing by nothing
_OVER = 1e-9  # of the supply's pressure, by which rounding may exceed it


@dataclass(frozen=True)
class Hydraulics:
    """Cylinders with valves; speed per length error, 1/s; length error at which the lock valves shut, m; time step, s."""

    cylinders: Cylinders
    gain: float
    lock_band: float
    timestep: float

    @cached_property
    def fullest(self) -> Array:
        """Oil in a chamber at the supply's pressure, over the chamber's volume, shape (J,)."""
        return np.exp(self.cylinders.supply / self.cylinders.modulus)

    @cached_property
    def relief(self) -> Array:
        """Oil at which a relief valve is told to be open, over the oil at the supply's pressure, shape (J,)."""
        return 1 + _OVER * self.cylinders.supply / self.cylinders.modulus

    @cached_property
    def widths(self) -> Array:
        """Flow per root of pressure through a full opening, extending and retracting, into either chamber, shape (2, 2, J)."""
        parts = self.cylinders
        return parts.rate * parts.area / np.sqrt(parts.supply * parts.area / parts.both)[:, None]


def step_oil(
    hydraulics: Hydraulics, oil: Oil, state: ChamberState, command: Array, speed: Array, length: Array, velocity: Array
) -> tuple[Oil, Array, Bits]:
    """Let oil flow for one step.

    Flows are taken at the pressures they lead to at the end of the step, so that no step is too long for a chamber.

    Args:
        state: The cylinders at the present length.
        command: Length wanted now, shape (J,), m.
        speed: Rate of the command, shape (J,), m/s.
        length: Present length, shape (J,), m.
        velocity: Rate of the length, shape (J,), m/s.

    Returns:
        The oil after the step, the speed at which the flows move an unloaded piston, shape (J,), m/s, and the
        saturations, bits of `FLOW`, `PRESSURE`, `STROKE` and `CAVITY`, shape (J,).

    Source: valve flow in proportion to the root of the pressure drop, H. E. Merritt, Hydraulic Control Systems (1967),
        chapter 5. Differs: the edges of the valve match the areas of the piston.
    """
    parts, free, drift = hydraulics.cylinders, np.empty(oil.free.shape), np.empty(len(length))
    saturated = np.empty(len(length), np.int64)
    figures = parts.area, parts.modulus, parts.stroke, parts.leakage
    drives = parts.supply, parts.rate, parts.push, parts.pull
    valves = hydraulics.widths, hydraulics.fullest, hydraulics.relief
    settings = hydraulics.gain, hydraulics.lock_band, hydraulics.timestep
    chambers, pistons = (oil.free, state.pressure, state.columns), (state.piston, state.force, state.stopped)
    motion, found = (command, speed, length, velocity), (free, drift, saturated)
    let_flow((figures, drives, valves), settings, (chambers, pistons), motion, found)
    return Oil(free, state.piston), drift, saturated


@compiled
def let_flow(
    hydraulics: tuple[Figures, Figures, Figures],
    settings: tuple[float, float, float],
    state: tuple[Figures, Figures],
    motion: Figures,
    found: Figures,
) -> None:
    """Write what `step_oil` finds; trapped is the oil before the step, free the oil after it."""
    figures, drives, valves = hydraulics
    area, modulus, stroke, leakage = figures
    supply, rate, push, pull = drives
    widths, fullest, relief = valves
    gain, lock_band, step = settings
    (trapped, pressure, columns), (piston, force, stopped) = state
    command, speed, length, velocity = motion
    free, drift, saturated = found
    volume, flow = np.empty(2), np.empty(2)
    for j in range(len(length)):
        error = command[j] - length[j]
        wanted = speed[j] + gain * error
        going = abs(error) >= lock_band or speed[j] != 0  # the others are locked
        # pressure that the load leaves across the valve, over what there is without load
        left = 1 + force[j] / push[j] if wanted > 0 else 1 - force[j] / pull[j]
        most = rate[j] * np.sqrt(max(left, 0.0))
        opening = min(max(wanted / max(most, _LEAST_SPEED * rate[j]), -1.0), 1.0) if going else 0.0
        across = 0.0
        for side in range(2):
            volume[side] = chamber(side, piston[j] + step * velocity[j], stroke[j], area[side, j])
            inside = squeeze(trapped[side, j], volume[side], modulus[j])
            fed = (opening > 0) == (side == 0)
            width = abs(opening) * widths[0 if opening > 0 else 1, side, j]
            drop = max(supply[j] - inside if fed else inside, 0.0)
            reach = modulus[j] * step * width / volume[side]  # y² + reach y = drop: y is the root of the drop left
            root = 2 * drop / max(reach + np.sqrt(reach**2 + 4 * drop), _TINY)
            flow[side] = width * root if fed else -width * root
            across += -inside if side else inside  # through the piston's seal
        leak = leakage[j] * across / (1 + step * leakage[j] * modulus[j] * (1 / volume[0] + 1 / volume[1]))
        saturated[j] = (FLOW if going and abs(wanted) > most else 0) + (STROKE if stopped[j] else 0)
        moved, spring, relieved, cavity = 0.0, 0.0, False, False
        for side in range(2):
            flow[side] += leak if side else -leak
            ceiling = volume[side] * fullest[j]
            after = trapped[side, j] * (1 + step * flow[side] / volume[side])
            free[side, j] = min(after, ceiling)
            relieved |= after > ceiling * relief[j]
            cavity |= pressure[side, j] <= VAPOUR
            moved += (-columns[side, j] if side else columns[side, j]) * flow[side] / area[side, j]
            spring += columns[side, j]
        saturated[j] += (PRESSURE if relieved else 0) + (CAVITY if cavity else 0)
        drift[j] = moved / max(spring, 1.0)  # 1 N/m: cavities on both sides


def require_pressure(site: Site, time: Array, lengths: Array) -> None:
    """Refuse a tour over which a supply pressure cannot hold the dead load.

    Poses are given by their time in motion, shape (T,), s, and their commanded lengths, shape (T, J), m.

    Raises:
        DescriptionError: A cylinder carries more than its pressure holds. It names the cylinder that needs the most
            relative to its supply, both pressures, and when.
    """
    chain = site.chain
    nodes = chain.nodes(chain.inputs_from_lengths(lengths))
    forces, parts = solve_members(site.case_model, nodes).bar[:, chain.truss.actuated], make_cylinders(chain)
    used = np.where(forces > 0, forces / parts.pull, -forces / parts.push)
    record, worst = (int(i) for i in np.unravel_index(first_greatest(used), used.shape))
    if used[record, worst] <= 1:
        return
    member, force = chain.truss.members[chain.truss.actuated[worst]], float(forces[record, worst])
    holds = float(parts.pull[worst] if force > 0 else parts.push[worst])
    raise site.scene.error(
        f"cylinders.{member.section}.pressure",
        f"{parts.supply[worst] / 1e6:.4g} MPa, which holds {holds / 1e3:.4g} kN",
        f"at least {used[record, worst] * parts.supply[worst] / 1e6:.4g} MPa: {member.name} carries "
        f"{force / 1e3:.4g} kN of dead load after {time[record]:.1f} s of motion",
    )
