"""What holds the cylinders: imposed lengths, springs with imposed unloaded lengths, servos, or valves and oil."""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain
from vgtsim.mjcf import names
from vgtsim.plant.hydraulics import FLOW, PRESSURE, STROKE, Hydraulics, advance, make_hydraulics
from vgtsim.plant.oil import Oil, State, fill, find_state
from vgtsim.plant.springs import Springs
from vgtsim.statics.equilibrium import solve_members

Array = NDArray[np.float64]
Bits = NDArray[np.int64]


@dataclass(frozen=True)
class RigidDrive:
    """Lengths imposed by equalities.

    Attributes:
        model: Changed by every command.
        rows: Equalities of the slides, shape (J,).
        zero: Lengths at zero command, shape (J,), m.
    """

    model: mujoco.MjModel
    rows: NDArray[np.intp]
    zero: Array

    def command(self, lengths: Array) -> Bits:
        """Impose the lengths wanted at the end of the step, shape (J,), m; nothing saturates."""
        self.model.eq_data[self.rows, 0] = lengths - self.zero
        return np.zeros(len(lengths), dtype=np.int64)


@dataclass
class SpringDrive:
    """Unloaded lengths of elastic cylinders imposed.

    Attributes:
        springs: Of the cylinders.
        timestep: s.
    """

    springs: Springs
    timestep: float
    _last: Array | None = None

    def command(self, lengths: Array) -> Bits:
        """Impose the unloaded lengths wanted at the end of the step, shape (J,), m; nothing saturates."""
        last = lengths if self._last is None else self._last
        self.springs.command(lengths, (lengths - last) / self.timestep)
        self._last = np.array(lengths)
        return np.zeros(len(lengths), dtype=np.int64)


@dataclass(frozen=True)
class ServoDrive:
    """Force-limited position control.

    Attributes:
        data: Its controls are set.
        rows: Actuators, shape (J,).
        zero: Lengths at zero command, shape (J,), m.
        limit: Least and greatest force, shape (J, 2), N.
        position: Coordinates of the slides, shape (J,).
        velocity: Their degrees of freedom, shape (J,).
        rate: Rated speeds, shape (J,), m/s.
        ends: Slides at the ends of the stroke, shape (2, J), m.
    """

    data: mujoco.MjData
    rows: NDArray[np.intp]
    zero: Array
    limit: Array
    position: NDArray[np.intp]
    velocity: NDArray[np.intp]
    rate: Array
    ends: Array

    def command(self, lengths: Array) -> Bits:
        """Set the lengths wanted, shape (J,), m; returns what the last step left saturated, shape (J,)."""
        self.data.ctrl[self.rows] = lengths - self.zero
        force, at = self.data.actuator_force[self.rows], self.data.qpos[self.position]
        forced = (force <= self.limit[:, 0]) | (force >= self.limit[:, 1])
        beyond = (at < self.ends[0]) | (at > self.ends[1])
        return PRESSURE * forced + FLOW * (np.abs(self.data.qvel[self.velocity]) > self.rate) + STROKE * beyond


@dataclass
class HydraulicDrive:
    """Cylinders, valves and oil; the oil's force goes to MuJoCo as a spring, which it takes at the end of the step.

    Attributes:
        data: Gives lengths and their rates.
        springs: Of the cylinders.
        hydraulics: Cylinders and valves.
        oil: What the chambers hold now.
        state: Pressures and forces at the begin of the step.
    """

    data: mujoco.MjData
    springs: Springs
    hydraulics: Hydraulics
    oil: Oil
    state: State
    _last: Array | None = None

    def command(self, lengths: Array) -> Bits:
        """Open the valves towards the lengths wanted at the end of the step, shape (J,), m; returns what saturated."""
        springs, parts = self.springs, self.hydraulics.cylinders
        now = lengths if self._last is None else self._last
        speed = (lengths - now) / self.hydraulics.timestep
        self._last = np.array(lengths)
        length = springs.retracted + self.data.qpos[springs.model.jnt_qposadr[springs.joints]]
        velocity = self.data.qvel[springs.model.jnt_dofadr[springs.joints]]
        self.state = find_state(parts, self.oil, length)
        self.oil, drift, saturated = advance(self.hydraulics, self.oil, self.state, now, speed, length, velocity)
        after = find_state(parts, self.oil, length)
        springs.hold(after.stiffness, length - after.force / after.stiffness, drift)
        return saturated

    @property
    def pressure(self) -> Array:
        """Pressures of the bore's and the rod's side, shape (J, 2), Pa."""
        return self.state.pressure.T


Drive = RigidDrive | SpringDrive | ServoDrive | HydraulicDrive


def find_drive(
    model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, scene: Scene, springs: Springs | None, nodes: Array
) -> Drive:
    """Look up the drive of a scene.

    Args:
        model: Compiled model.
        data: Its data.
        chain: The arm.
        scene: Says which drive.
        springs: Of an elastic arm.
        nodes: Pose at the start, in equilibrium, shape (N, 3), m: oil is filled in to carry its load.

    Returns:
        The drive.
    """
    truss, simulation = chain.truss, scene.task.simulation
    actuators = [truss.members[i].name for i in truss.actuated]
    slides = [model.joint(names.slide(name)) for name in actuators]
    position = np.array([slide.qposadr[0] for slide in slides])
    retracted = np.array([model.numeric(f"{name}/retracted").data[0] for name in actuators])
    zero = retracted + model.qpos0[position]
    if simulation.drive == "servo":
        rows = np.array([model.actuator(names.servo(name)).id for name in actuators])
        parts = [chain.manipulator.cylinders[truss.members[i].section] for i in truss.actuated]
        # the model's servos push with the reference pose's holding forces besides, so that a viewer's reset holds still
        push = model.actuator_biasprm[rows, 0] + model.actuator_biasprm[rows, 1] * model.qpos0[position]
        zero = zero + push / model.actuator_gainprm[rows, 0]
        ends = np.array([[0.0, part.stroke] for part in parts]).T
        velocity = np.array([slide.dofadr[0] for slide in slides])
        rate = np.array([part.rate for part in parts])
        return ServoDrive(data, rows, zero, model.actuator_forcerange[rows], position, velocity, rate, ends)
    if springs is None:
        return RigidDrive(model, np.array([model.equality(names.drive(name)).id for name in actuators]), zero)
    if simulation.drive == "rigid":
        return SpringDrive(springs, simulation.timestep)
    hydraulics = make_hydraulics(scene, chain)
    span = nodes[truss.ends[truss.actuated]]
    length = np.linalg.norm(span[:, 1] - span[:, 0], axis=-1)
    oil = fill(hydraulics.cylinders, length, solve_members(springs.elastic.loads, nodes).bar[truss.actuated])
    return HydraulicDrive(data, springs, hydraulics, oil, find_state(hydraulics.cylinders, oil, length))
