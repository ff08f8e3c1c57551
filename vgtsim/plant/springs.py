"""Elastic members in the step: structural damping, and cylinders whose springs follow the command.

MuJoCo's discrete integrator takes spring forces at the end of the step. That equals the leap-frog step, which damps
nothing, plus a damper of stiffness times step. So the damper wanted, beta times stiffness, is written less that share:
what is left may be negative, and the whole is stable at any step from beta = dt / 2 on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.site import Site
from vgtsim.statics import ElasticModel, damping_time, find_modes


@dataclass(frozen=True)
class Springs:
    """Springs of the cylinders, which change with the commanded length.

    Attributes:
        joints: Slides of the actuators, shape (J,).
        position: Coordinates of the slides in qpos, the lengths of the cylinders, shape (J,).
        slide: Degrees of freedom of the slides, shape (J,).
        excess: Damper over stiffness beyond what the integrator brings, s.
        period: Period of the slowest mode in the start posture, s.
    """

    model: mujoco.MjModel
    elastic: ElasticModel
    joints: Index
    position: Index
    slide: Index
    excess: float
    period: float

    def command(self, lengths: Array, rate: Array) -> None:
        """Set the unloaded lengths of the cylinders, shape (J,), m, and their rates, m/s."""
        self.hold(self.elastic.stiffness(lengths)[self.elastic.truss.actuated], lengths, rate)

    def hold(self, stiffness: Array, lengths: Array, rate: Array) -> None:
        """Set the cylinders' springs; their dampers resist stretching, not the stroke.

        Given are stiffnesses, N/m, unloaded lengths at the end of the step, m, and the rates of those, m/s, each (J,).
        """
        model = self.model
        model.jnt_stiffness[self.joints] = stiffness
        model.dof_damping[self.slide] = self.excess * stiffness
        model.qpos_spring[self.position] = lengths + self.excess * rate

    def force(self, data: mujoco.MjData) -> Array:
        """Forces of springs and dampers as the integrator takes them, tension positive, shape (J,), N."""
        model = self.model
        stretch = data.qpos[self.position] - model.qpos_spring[self.position]
        return model.jnt_stiffness[self.joints] * stretch + model.dof_damping[self.slide] * data.qvel[self.slide]


def fit_springs(model: mujoco.MjModel, data: mujoco.MjData, site: Site, nodes: Array) -> Springs:
    """Damp the tubes of a model in place, and put springs in place of the rigid drives of its data.

    The nodes are those of the start posture, unloaded, shape (N, 3), m.

    Raises:
        DescriptionError: The damping ratio is below what the step can hold, or the arm buckles in its start posture.
    """
    truss, servo = site.truss, site.task.simulation.drive == "servo"
    held = site.held_model if servo else site.elastic_model  # servos stand in for oil and rod; behind valves oil gives
    slowest = float(find_modes(held, nodes, 1).frequency[0])
    if not slowest > 0:
        key, found = "members", "elastic ones that buckle"
        if servo:
            key, found = "servo_stiffness", f"{site.task.simulation.servo_stiffness:.4g} N/m"
        raise site.scene.error(f"simulation.{key}", found, "enough to hold the arm up in its start posture")
    excess = _find_damping_time(site, held, nodes, model.opt.timestep) - model.opt.timestep
    tubes = [member.name for member in truss.members if member.role != "actuator"]
    tube_joints = np.array([model.joint(names.slide(name)).id for name in tubes])
    model.dof_damping[model.jnt_dofadr[tube_joints]] = excess * model.jnt_stiffness[tube_joints]
    actuators = [truss.members[i].name for i in truss.actuated]
    if not servo:
        data.eq_active[[model.equality(names.drive(name)).id for name in actuators]] = 0
    joints = np.array([model.joint(names.slide(name)).id for name in actuators])
    return Springs(
        model=model,
        elastic=site.elastic_model,
        joints=joints,
        position=model.jnt_qposadr[joints],
        slide=model.jnt_dofadr[joints],
        excess=excess,
        period=1 / slowest,
    )


def _find_damping_time(site: Site, held: ElasticModel, nodes: Array, timestep: float) -> float:
    """Damper over stiffness, s, that gives the slowest mode its structural damping."""
    ratio, least = site.task.simulation.damping_ratio, timestep / 2
    if ratio == 0:
        return least
    beta = damping_time(held, nodes, ratio)
    if beta < least:
        allowed = f"at least {ratio * least / beta:.4g} at a step of {timestep:.4g} s, or 0 for that least"
        raise site.scene.error("simulation.damping_ratio", f"{ratio:.4g}", allowed)
    return beta
