"""Valves and their control: position control of hydraulic cylinders, leakage and lock, one step at a time.

A spool valve opens both chambers, one to the supply and one to the tank; its edges match the piston's areas. It is told
the command's speed plus a gain on the length error, and opens the wider the less pressure the load leaves. Relief valves
hold each chamber at the supply's pressure or less. Near a command at rest the lock valves shut; the piston's seal leaks on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.ties import first_greatest
from vgtsim.plant.oil import VAPOUR, ChamberState, Cylinders, Oil, make_cylinders, pressures
from vgtsim.site import Site
from vgtsim.statics import solve_members

Array = NDArray[np.float64]
Bits = NDArray[np.int64]

FLOW, PRESSURE, STROKE, CAVITY = 1, 2, 4, 8  # bits of a saturation
_LEAST_OPENING = 1e-3  # of the pressure the valve would have without load: no valve divides by less
_OVER = 1e-9  # of the supply's pressure, by which rounding may exceed it


@dataclass(frozen=True)
class Hydraulics:
    """Cylinders, valves and the settings of their control.

    Attributes:
        cylinders: The cylinders.
        gain: Speed per length error, 1/s.
        lock_band: Length error at which the lock valves shut, m.
        timestep: s.
    """

    cylinders: Cylinders
    gain: float
    lock_band: float
    timestep: float


def make_hydraulics(site: Site, timestep: float) -> Hydraulics:
    """Collect the cylinders and valves of a scene, for steps of a given time, s."""
    simulation = site.task.simulation
    return Hydraulics(make_cylinders(site.chain), simulation.valve_gain, simulation.lock_band, timestep)


def advance(
    hydraulics: Hydraulics, oil: Oil, state: ChamberState, command: Array, speed: Array, length: Array, velocity: Array
) -> tuple[Oil, Array, Bits]:
    """Let oil flow for one step.

    Flows are taken at the pressures they lead to at the end of the step, so that no step is too long for a chamber.

    Args:
        hydraulics: Cylinders and valves.
        oil: What the chambers hold.
        state: The cylinders at the present length.
        command: Length wanted now, shape (J,), m.
        speed: Rate of the command, shape (J,), m/s.
        length: Present length, shape (J,), m.
        velocity: Its rate, shape (J,), m/s.

    Returns:
        The oil after the step, the speed at which the flows move an unloaded piston, shape (J,), m/s, and what
        saturated, bits of `FLOW`, `PRESSURE`, `STROKE` and `CAVITY`, shape (J,).

    Source: valve flow in proportion to the root of the pressure drop, H. E. Merritt, Hydraulic Control Systems (1967),
        chapter 5. Differs: the edges of the valve match the areas of the piston.
    """
    parts, step = hydraulics.cylinders, hydraulics.timestep
    error = command - length
    wanted = speed + hydraulics.gain * error
    locked = (np.abs(error) < hydraulics.lock_band) & (speed == 0)
    most = parts.rate * np.sqrt(np.clip(_pressure_left(parts, state.force, wanted), 0.0, None))
    opening = np.clip(wanted / np.maximum(most, np.sqrt(_LEAST_OPENING) * parts.rate), -1.0, 1.0)
    volume = parts.volumes(np.clip(state.piston + step * velocity, 0.0, parts.stroke))
    found = pressures(parts, oil.free, volume)
    flow = _valve_flow(parts, step, np.where(locked, 0.0, opening), volume, found)
    flow += _leakage(parts, step, volume, found)
    free = oil.free * (1 + step * flow / volume)
    ceiling = volume * np.exp(parts.supply / parts.modulus)
    relieved = free > ceiling * (1 + _OVER * parts.supply / parts.modulus)
    saturated = FLOW * (~locked & (np.abs(wanted) > most)) + PRESSURE * relieved.any(axis=0) + STROKE * state.stopped
    saturated = saturated + CAVITY * (state.pressure <= VAPOUR).any(axis=0)
    share = state.columns / np.maximum(state.columns.sum(axis=0), 1.0)
    drift = np.sum(share * np.array([[1.0], [-1.0]]) * flow / parts.area, axis=0)
    return Oil(np.minimum(free, ceiling), state.piston), drift, saturated


def _pressure_left(parts: Cylinders, force: Array, wanted: Array) -> Array:
    """Pressure that a load leaves across the valve, over what there is without load, shape (J,)."""
    return np.where(wanted > 0, 1 + force / parts.push, 1 - force / parts.pull)


def _valve_flow(parts: Cylinders, step: float, opening: Array, volume: Array, found: Array) -> Array:
    """Flow into either chamber, shape (2, J), m³/s, through edges that let `rate` pass without load."""
    extending = opening > 0
    unloaded = parts.supply * np.where(extending, parts.area[0], parts.area[1]) / parts.area.sum(axis=0)
    width = np.abs(opening) * parts.rate * parts.area / np.sqrt(unloaded)
    fed = np.stack([extending, ~extending])
    drop = np.maximum(np.where(fed, parts.supply - found, found), 0.0)
    reach = parts.modulus * step * width / volume  # y² + reach y = drop: y is the root of the drop that is left
    root = 2 * drop / np.maximum(reach + np.sqrt(reach**2 + 4 * drop), np.finfo(float).tiny)
    return np.where(fed, 1.0, -1.0) * width * root


def _leakage(parts: Cylinders, step: float, volume: Array, found: Array) -> Array:
    """Flow across the piston's seal, into either chamber, shape (2, J), m³/s."""
    across = found[0] - found[1]
    flow = parts.leakage * across / (1 + step * parts.leakage * parts.modulus * np.sum(1 / volume, axis=0))
    return np.stack([-flow, flow])


def require_pressure(site: Site, time: Array, lengths: Array) -> None:
    """Refuse a tour over which a supply pressure cannot hold the dead load.

    Args:
        site: The scene with its arm.
        time: Of the poses, in motion, shape (T,), s.
        lengths: Commanded lengths, shape (T, J), m.

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
