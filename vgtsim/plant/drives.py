"""What holds the cylinders: imposed lengths, springs with imposed unloaded lengths, servos, or valves and oil.

Each drive takes the lengths wanted at the end of the coming step and tells what it saturated, and after the step the
forces that it exerted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.plant.addresses import Addresses, find_rows
from vgtsim.plant.hydraulics import FLOW, PRESSURE, STROKE, Bits, Hydraulics, step_oil
from vgtsim.plant.oil import ChamberState, Oil, fill, find_state, make_cylinders
from vgtsim.plant.springs import Springs
from vgtsim.site import Site
from vgtsim.statics import solve_members


@dataclass
class RigidDrive:
    """Lengths imposed by the equalities of the slides, rows of shape (J,); `zero` are the lengths at zero command, m."""

    model: mujoco.MjModel
    data: mujoco.MjData
    rows: Index
    zero: Array
    pressure: Array | None = None
    _forces: Index | None = None

    def command(self, lengths: Array) -> Bits:
        """Impose the lengths wanted at the end of the step, shape (J,), m; nothing saturates."""
        impose(self.model.eq_data, self.rows, lengths, self.zero)
        return np.zeros(len(lengths), dtype=np.int64)

    def force(self) -> Array:
        """Forces of the last step, tension positive, shape (J,), N."""
        if self._forces is None:
            self._forces = find_rows(self.data, self.rows)
        return -self.data.efc_force[self._forces]


@dataclass
class SpringDrive:
    """Unloaded lengths of elastic cylinders imposed, at a time step in s."""

    data: mujoco.MjData
    springs: Springs
    timestep: float
    pressure: Array | None = None
    _last: Array | None = None

    def command(self, lengths: Array) -> Bits:
        """Impose the unloaded lengths wanted at the end of the step, shape (J,), m; nothing saturates."""
        last = lengths if self._last is None else self._last
        self.springs.command(lengths, (lengths - last) / self.timestep)
        self._last = np.array(lengths)
        return np.zeros(len(lengths), dtype=np.int64)

    def force(self) -> Array:
        """Forces at the end of the last step, tension positive, shape (J,), N."""
        return self.springs.force(self.data)


@dataclass(frozen=True)
class ServoDrive:
    """Force-limited position control.

    Attributes:
        rows: Actuators, shape (J,).
        limit: Least and greatest force, shape (J, 2), N.
        rate: Rated speeds, shape (J,), m/s.
        reach: Least and greatest length, shape (J, 2), m.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    at: Addresses
    rows: Index
    limit: Array
    rate: Array
    reach: Array
    pressure: Array | None = None

    def command(self, lengths: Array) -> Bits:
        """Set the lengths wanted, shape (J,), m; returns what the last step left saturated, shape (J,)."""
        self.data.ctrl[self.rows] = lengths
        force, now = self.data.actuator_force[self.rows], self.data.qpos[self.at.position]
        forced = (force <= self.limit[:, 0]) | (force >= self.limit[:, 1])
        beyond = (now < self.reach[:, 0]) | (now > self.reach[:, 1])
        return PRESSURE * forced + FLOW * (np.abs(self.data.qvel[self.at.slide]) > self.rate) + STROKE * beyond

    def force(self) -> Array:
        """Forces at the end of the last step, as the integrator takes them, tension positive, shape (J,), N."""
        gain, bias = self.model.actuator_gainprm[self.rows, 0], self.model.actuator_biasprm[self.rows, :3]
        slide, speed = self.data.qpos[self.at.position], self.data.qvel[self.at.slide]
        push = gain * self.data.ctrl[self.rows] + bias[:, 0] + bias[:, 1] * slide + bias[:, 2] * speed
        return -np.clip(push, self.limit[:, 0], self.limit[:, 1])


@dataclass
class HydraulicDrive:
    """Cylinders, valves and oil; MuJoCo takes the force of the oil as a spring at the end of the step.

    `oil` is in the chambers now; `state` holds pressures and forces at the begin of the step.
    """

    data: mujoco.MjData
    springs: Springs
    hydraulics: Hydraulics
    oil: Oil
    state: ChamberState
    _last: Array | None = None

    def command(self, lengths: Array) -> Bits:
        """Open the valves towards the lengths wanted at the end of the step, shape (J,), m; returns what saturated."""
        springs, parts = self.springs, self.hydraulics.cylinders
        now = lengths if self._last is None else self._last
        speed = (lengths - now) / self.hydraulics.timestep
        self._last = np.array(lengths)
        length = self.data.qpos[springs.position]
        velocity = self.data.qvel[springs.slide]
        self.state = find_state(parts, self.oil, length)
        self.oil, drift, saturated = step_oil(self.hydraulics, self.oil, self.state, now, speed, length, velocity)
        after = find_state(parts, self.oil, length)
        springs.hold(after.stiffness, length - after.force / after.stiffness, drift)
        return saturated

    def force(self) -> Array:
        """Forces at the end of the last step, tension positive, shape (J,), N."""
        return self.springs.force(self.data)

    @property
    def pressure(self) -> Array:
        """Pressures of the bore's and the rod's side at the begin of the last step, shape (J, 2), Pa."""
        return self.state.pressure.T


@compiled
def impose(data: Array, rows: Index, lengths: Array, zero: Array) -> None:
    """Write lengths, shape (J,), m, beyond those at zero command, into rows of MuJoCo's data of equalities."""
    for i in range(len(rows)):
        data[rows[i], 0] = lengths[i] - zero[i]


Drive = RigidDrive | SpringDrive | ServoDrive | HydraulicDrive


def find_drive(
    model: mujoco.MjModel, data: mujoco.MjData, site: Site, at: Addresses, springs: Springs | None, nodes: Array
) -> Drive:
    """Look up the drive of a scene; `springs` are those of an elastic arm.

    The nodes are those of the start, in equilibrium, shape (N, 3), m: oil is filled in to carry the load there.
    """
    truss, simulation = site.truss, site.task.simulation
    actuators = [truss.members[i] for i in truss.actuated]
    if simulation.drive == "servo":
        rows = np.array([model.actuator(names.servo(member.name)).id for member in actuators])
        parts = [site.arm.cylinders[member.section] for member in actuators]
        mast = [names.FEED] if site.task.mast.turn is None else [names.FEED, names.TURN]
        damp_servos(model, np.append(rows, [model.actuator(names.servo(name)).id for name in mast]), site)
        return ServoDrive(
            model=model,
            data=data,
            at=at,
            rows=rows,
            limit=model.actuator_forcerange[rows],
            rate=np.array([part.rate for part in parts]),
            reach=np.array([(part.retracted, part.extended) for part in parts]),
        )
    if springs is None:
        rows = np.array([model.equality(names.drive(member.name)).id for member in actuators])
        return RigidDrive(model=model, data=data, rows=rows, zero=model.qpos0[at.position])
    timestep = model.opt.timestep
    if simulation.drive == "rigid":
        return SpringDrive(data, springs, timestep)
    parts = make_cylinders(site.chain)
    length = truss.lengths(nodes)[truss.actuated]
    oil = fill(parts, length, solve_members(springs.elastic.loads, nodes).bar[truss.actuated])
    hydraulics = Hydraulics(parts, simulation.valve_gain, simulation.lock_band, timestep)
    return HydraulicDrive(
        data=data, springs=springs, hydraulics=hydraulics, oil=oil, state=find_state(parts, oil, length)
    )


def damp_servos(model: mujoco.MjModel, rows: Index, site: Site) -> None:
    """Give servos the scene's damper less the one that the integrator brings, stiffness times step, see `springs`.

    Where the scene's is less than half of that share, a servo has half of it, the least that is stable.
    """
    simulation = site.task.simulation
    share = simulation.servo_stiffness * model.opt.timestep
    model.actuator_biasprm[rows, 2] = share - max(simulation.servo_damping, share / 2)


def find_row_drive(model: mujoco.MjModel, data: mujoco.MjData, site: Site) -> RigidDrive:
    """Look up the drive of an arm with rigid sections, whose cylinders are length rows."""
    labels = [names.row(site.truss.members[i].name) for i in site.truss.actuated]
    tendons = [model.tendon(label).id for label in labels]
    rows = np.array([model.equality(label).id for label in labels])
    return RigidDrive(model=model, data=data, rows=rows, zero=model.tendon_length0[tendons])
