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
from vgtsim.kinematics import first_greatest
from vgtsim.plant.oil import VAPOUR, ChamberState, Cylinders, Oil, make_cylinders, pressures
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
    def widths(self) -> tuple[Array, Array]:
        """Flow per root of pressure through a full opening into either chamber, shape (2, J), extending and retracting."""
        parts = self.cylinders
        most = parts.rate * parts.area
        return most / np.sqrt(parts.supply * parts.area[0] / parts.both), most / np.sqrt(
            parts.supply * parts.area[1] / parts.both
        )


def advance(
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
    parts, step = hydraulics.cylinders, hydraulics.timestep
    error = command - length
    wanted = speed + hydraulics.gain * error
    going = (np.abs(error) >= hydraulics.lock_band) | (speed != 0)  # the others are locked
    # pressure that the load leaves across the valve, over what there is without load
    left = np.where(wanted > 0, 1 + state.force / parts.push, 1 - state.force / parts.pull)
    most = parts.rate * np.sqrt(np.maximum(left, 0.0))
    opening = going * np.minimum(np.maximum(wanted / np.maximum(most, _LEAST_SPEED * parts.rate), -1.0), 1.0)
    volume = parts.volumes(np.minimum(np.maximum(state.piston + step * velocity, 0.0), parts.stroke))
    found = pressures(parts, oil.free, volume)
    flow = _valve_flow(hydraulics, opening, volume, found)
    across = parts.leakage * (found[0] - found[1])  # through the piston's seal
    leak = across / (1 + step * parts.leakage * parts.modulus * (1 / volume[0] + 1 / volume[1]))
    flow[0] -= leak
    flow[1] += leak
    free, ceiling = oil.free * (1 + step * flow / volume), volume * hydraulics.fullest
    relieved, cavity = free > ceiling * hydraulics.relief, state.pressure <= VAPOUR
    saturated = FLOW * (going & (np.abs(wanted) > most)) + PRESSURE * (relieved[0] | relieved[1])
    saturated += STROKE * state.stopped + CAVITY * (cavity[0] | cavity[1])
    moved = state.columns * flow / parts.area
    drift = (moved[0] - moved[1]) / np.maximum(
        state.columns[0] + state.columns[1], 1.0
    )  # 1 N/m: cavities on both sides
    return Oil(np.minimum(free, ceiling), state.piston), drift, saturated


def _valve_flow(hydraulics: Hydraulics, opening: Array, volume: Array, found: Array) -> Array:
    """Flow into either chamber, shape (2, J), m³/s, through edges that let `rate` pass without load."""
    parts, extending = hydraulics.cylinders, opening > 0
    width = np.abs(opening) * np.where(extending, *hydraulics.widths)
    fed = np.array([extending, ~extending])
    drop = np.maximum(np.where(fed, parts.supply - found, found), 0.0)
    reach = parts.modulus * hydraulics.timestep * width / volume  # y² + reach y = drop: y is the root of the drop left
    root = 2 * drop / np.maximum(reach + np.sqrt(reach**2 + 4 * drop), _TINY)
    return np.where(fed, width, -width) * root


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
