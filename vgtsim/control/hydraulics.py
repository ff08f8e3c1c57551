"""Hydraulic cylinders under position control: valve, oil, supply, leakage and lock, one step at a time.

The oil column is a spring; its unloaded length moves with the flow through the valve. The valve opens in proportion to
the length error and follows the command's own speed; its flow falls with the root of the pressure left across it. A
relief valve holds the pressure at the supply's. Near the command the lock valve shuts: nothing flows, nothing leaks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.statics.equilibrium import solve
from vgtsim.statics.loads import make_load_model

Array = NDArray[np.float64]

FLOW, PRESSURE, STROKE = 1, 2, 4  # bits of a saturation


@dataclass(frozen=True)
class Hydraulics:
    """The cylinders of an arm and their valves; arrays of shape (J,).

    Attributes:
        push: Force at supply pressure on the bore, N.
        pull: Force at supply pressure on the annulus, N.
        bore: Piston area, m².
        rate: Speed at the valve's flow limit without load, m/s.
        leakage: Flow across the piston per pressure while the lock is open, m³/(s·Pa).
        retracted: Least length, m.
        extended: Greatest length, m.
        gain: Speed per length error, 1/s.
        lock_band: Length error at which the lock valve shuts, m.
        timestep: s.
    """

    push: Array
    pull: Array
    bore: Array
    rate: Array
    leakage: Array
    retracted: Array
    extended: Array
    gain: float
    lock_band: float
    timestep: float

    def advance(
        self, unloaded: Array, command: Array, speed: Array, length: Array, stiffness: Array
    ) -> tuple[Array, NDArray[np.int64]]:
        """Move the oil by one step.

        Args:
            unloaded: Length at which each oil column carries nothing, shape (J,), m.
            command: Length wanted, shape (J,), m.
            speed: Rate of the command, shape (J,), m/s.
            length: Present length, shape (J,), m.
            stiffness: Of oil and rod in series, shape (J,), N/m.

        Returns:
            Unloaded lengths after the step and what saturated, bits of `FLOW`, `PRESSURE` and `STROKE`, shape (J,).

        Source: valve flow in proportion to the root of the pressure drop, H. E. Merritt, Hydraulic Control Systems
            (1967), chapter 5. Differs: the pressures of the two chambers are not followed apart.
        """
        force = stiffness * (length - unloaded)
        error = command - length
        wanted = speed + self.gain * error
        against = np.where(wanted > 0, -force / self.push, force / self.pull)
        most = self.rate * np.sqrt(np.clip(1 - against, 0.0, 1.0))
        flow = np.clip(wanted, -most, most)
        locked = (np.abs(error) < self.lock_band) & (speed == 0)
        leak = self.leakage * force / self.bore**2
        moved = unloaded + self.timestep * np.where(locked, 0.0, flow + leak)
        relieved = np.clip(moved, length - self.pull / stiffness, length + self.push / stiffness)
        held = np.clip(relieved, self.retracted, self.extended)
        saturated = FLOW * (~locked & (np.abs(wanted) > most)) + PRESSURE * (relieved != moved)
        return held, saturated + STROKE * (held != relieved)


def make_hydraulics(scene: Scene, chain: Chain) -> Hydraulics:
    """Collect the cylinders and valves of a scene.

    Args:
        scene: Gives gain, lock and step.
        chain: The arm.

    Returns:
        The hydraulics.
    """
    parts = [chain.manipulator.cylinders[chain.truss.members[i].section] for i in chain.truss.actuated]
    simulation = scene.task.simulation

    def collect(name: str) -> Array:
        return np.array([getattr(part, name) for part in parts])

    return Hydraulics(
        collect("push"),
        collect("pull"),
        np.pi / 4 * collect("bore") ** 2,
        collect("rate"),
        collect("leakage"),
        collect("retracted"),
        collect("extended"),
        simulation.valve_gain,
        simulation.lock_band,
        simulation.timestep,
    )


def require_pressure(scene: Scene, chain: Chain, q: Array) -> None:
    """Refuse a scene whose supply pressure cannot hold the dead load in a pose.

    Args:
        scene: The scene.
        chain: Its arm.
        q: Inputs of the pose, shape (A, 3).

    Raises:
        DescriptionError: A cylinder carries more than its pressure holds; both are given.
    """
    forces = solve(make_load_model(chain, scene.task.payload, scene.task.simulation.gravity), chain.nodes(q)).bar
    for index in chain.truss.actuated:
        member, force = chain.truss.members[index], float(forces[index])
        part = chain.manipulator.cylinders[member.section]
        most = part.pull if force > 0 else part.push
        if abs(force) > most:
            area = most / part.pressure
            raise DescriptionError(
                None,
                f"cylinders.{member.section}.pressure",
                f"{part.pressure / 1e6:.4g} MPa, which holds {most / 1e3:.4g} kN",
                f"at least {abs(force) / area / 1e6:.4g} MPa: {member.name} carries {force / 1e3:.4g} kN of dead load",
            )
