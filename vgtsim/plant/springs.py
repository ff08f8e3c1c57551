"""Elastic members in the step loop: structural damping, and cylinders whose springs follow the command.

MuJoCo's discrete integrator takes spring forces at the end of the step. That equals the leap-frog step, which damps
nothing, plus a damper of stiffness times step. So the damper wanted, beta times stiffness, is written less that share:
what is left may be negative, and the whole is stable at any step from beta = dt / 2 on.
"""

from __future__ import annotations

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain
from vgtsim.mjcf import names
from vgtsim.statics.elasticity import ElasticModel, hold_cylinders, make_elastic_model
from vgtsim.statics.modes import damping_time, find_modes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Springs:
    """Springs of the cylinders, which change with the commanded length.

    Attributes:
        model: Compiled model.
        elastic: Stiffnesses of the arm.
        joints: Slides of the actuators, shape (J,).
        retracted: Their lengths at zero slide, shape (J,), m.
        excess: Damper over stiffness beyond what the integrator brings, s.
        period: Of the slowest mode in the start posture, s.
    """

    model: mujoco.MjModel
    elastic: ElasticModel
    joints: NDArray[np.intp]
    retracted: Array
    excess: float
    period: float

    def command(self, lengths: Array, rate: Array) -> None:
        """Set the unloaded lengths of the cylinders, shape (J,), m, and their rates, m/s."""
        self.hold(self.elastic.stiffness(lengths)[self.elastic.truss.actuated], lengths, rate)

    def hold(self, stiffness: Array, lengths: Array, rate: Array) -> None:
        """Set the cylinders' springs; their dampers resist stretching, not the stroke.

        Args:
            stiffness: Shape (J,), N/m.
            lengths: Unloaded, at the end of the step, shape (J,), m.
            rate: At which those move, shape (J,), m/s.
        """
        model = self.model
        model.jnt_stiffness[self.joints] = stiffness
        model.dof_damping[model.jnt_dofadr[self.joints]] = self.excess * stiffness
        model.qpos_spring[model.jnt_qposadr[self.joints]] = lengths + self.excess * rate - self.retracted


def find_damping_time(elastic: ElasticModel, nodes: Array, scene: Scene) -> float:
    """Damper over stiffness that gives the slowest mode its structural damping.

    Args:
        elastic: Masses, and stiffnesses with what moves the cylinders.
        nodes: Start posture, unloaded, shape (N, 3), m.
        scene: Gives ratio and step.

    Returns:
        beta, s.

    Raises:
        DescriptionError: The ratio is below what the step can hold.
    """
    simulation = scene.task.simulation
    least = simulation.timestep / 2
    if simulation.damping_ratio == 0:
        return least
    beta = damping_time(elastic, nodes, simulation.damping_ratio)
    if beta < least:
        raise scene.error(
            "simulation.damping_ratio",
            f"{simulation.damping_ratio:.4g}",
            f"at least {simulation.damping_ratio * least / beta:.4g} at a step of {simulation.timestep:.4g} s, "
            "or 0 for that least",
        )
    return beta


def fit_springs(model: mujoco.MjModel, data: mujoco.MjData, chain: Chain, scene: Scene, nodes: Array) -> Springs:
    """Damp the tubes and put springs in place of the cylinders' rigid drives.

    Args:
        model: Built with elastic members; changed in place.
        data: Its drives of the cylinders are released.
        chain: The arm.
        scene: The scene.
        nodes: Start posture, unloaded, shape (N, 3), m.

    Returns:
        The springs.

    Raises:
        DescriptionError: The damping ratio is below what the step can hold, or the arm buckles in its start posture.
    """
    task, truss = scene.task, chain.truss
    elastic = make_elastic_model(chain, task.payload, task.simulation.gravity, lumped=task.simulation.lumped)
    held = elastic
    if task.simulation.drive == "servo":  # in place of oil and rod; behind valves the oil is still what gives
        held = hold_cylinders(elastic, task.simulation)
    slowest = float(find_modes(held, nodes, 1).frequency[0])
    if not slowest > 0:
        key, found = "members", "elastic ones that buckle"
        if held is not elastic:
            key, found = "servo_stiffness", f"{task.simulation.servo_stiffness:.4g} N/m"
        raise scene.error(f"simulation.{key}", found, "enough to hold the arm up in its start posture")
    excess = find_damping_time(held, nodes, scene) - task.simulation.timestep
    actuators = [truss.members[i].name for i in truss.actuated]
    tubes = [member.name for member in truss.members if member.role != "actuator"]
    joints = np.array([model.joint(names.slide(name)).id for name in tubes])
    model.dof_damping[model.jnt_dofadr[joints]] = excess * model.jnt_stiffness[joints]
    if task.simulation.drive != "servo":
        data.eq_active[[model.equality(names.drive(name)).id for name in actuators]] = 0
    return Springs(
        model,
        elastic,
        np.array([model.joint(names.slide(name)).id for name in actuators]),
        np.array([model.numeric(f"{name}/retracted").data[0] for name in actuators]),
        excess,
        1 / slowest,
    )
