"""Is every member loaded along its axis, and by how much? The log against the method of joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain
from vgtsim.runlog import RunLog
from vgtsim.statics.equilibrium import MemberForces, solve
from vgtsim.statics.loads import make_load_model
from vgtsim.statics.motion import motion_from_log
from vgtsim.statics.rating import make_sections, rate, utilise
from vgtsim.verification.findings import Finding, worst_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Loads:
    """Measured and expected member forces; T records, M members.

    Attributes:
        axial: Measured at the near ends, tension positive, shape (T, M), N.
        shear: Measured across the members at the near ends, shape (T, M, 3), N.
        moment: Measured at the near ends, shape (T, M), N·m.
        moving: Expected with inertia, from the method of joints; NaN where the motion is unknown.
        settled: Records at rest, shape (S,).
        resting: Expected at rest, for the settled records alone.
    """

    axial: Array
    shear: Array
    moment: Array
    moving: MemberForces
    settled: NDArray[np.intp]
    resting: MemberForces


def find_loads(log: RunLog, chain: Chain, scene: Scene) -> Loads:
    """Read the measured forces and work out the expected ones.

    Args:
        log: The run.
        chain: The arm.
        scene: Gives payload and gravity.

    Returns:
        Both.
    """
    model = make_load_model(chain, scene.task.payload, scene.task.simulation.gravity)
    settled = np.flatnonzero(log.settled)
    return Loads(
        axial=log.axial(chain.truss.ends),
        shear=log.shear(chain.truss.ends),
        moment=np.linalg.norm(log.member_moment, axis=-1),
        moving=solve(model, log.nodes, motion_from_log(log.time, log.nodes)),
        settled=settled,
        resting=solve(model, log.nodes[settled]),
    )


def check_moment(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest moment at a member's end, N·m."""
    return worst_of(loads.moment, log.time, chain.truss.member_names)


def check_shear(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest shear at a member's end beyond its share of the member's own weight and inertia, N."""
    excess = np.linalg.norm(loads.shear - loads.moving.near_transverse, axis=-1)
    return worst_of(excess, log.time, chain.truss.member_names)


def check_axial_settled(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest error of an axial force at rest, over the largest force of the instant."""
    if not len(loads.settled):
        return Finding(float("nan"), "none", float("nan"), "the arm never settled")
    error = relative_error(loads.axial[loads.settled], loads.resting.near_axial)
    return worst_of(error, log.time[loads.settled], chain.truss.member_names)


def check_axial_moving(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest error of an axial force at any instant, inertia included, over the largest force of the instant."""
    return worst_of(relative_error(loads.axial, loads.moving.near_axial), log.time, chain.truss.member_names)


def relative_error(measured: Array, expected: Array) -> Array:
    """Difference over the largest expected force of each instant: straight poses leave many members near zero.

    Args:
        measured: Shape (T, M), N.
        expected: Shape (T, M), N.

    Returns:
        Shape (T, M).
    """
    return np.abs(measured - expected) / np.max(np.abs(expected), axis=-1, keepdims=True)


def find_utilisation(log: RunLog, chain: Chain, scene: Scene, loads: Loads) -> Array:
    """Demand over strength of every member under the measured forces.

    The force varies along a member by its own weight and inertia, which the expected forces give.

    Args:
        log: The run.
        chain: The arm.
        scene: Gives the safety factor.
        loads: Measured and expected forces.

    Returns:
        Shape (T, M).
    """
    off = loads.axial - loads.moving.near_axial
    expected = loads.moving
    forces = replace(expected, bar=expected.bar + off, near_axial=loads.axial, far_axial=expected.far_axial + off)
    span = log.nodes[:, chain.truss.ends[:, 1]] - log.nodes[:, chain.truss.ends[:, 0]]
    section = make_sections(chain.manipulator, chain.truss)
    ratings = rate(section, np.linalg.norm(span, axis=-1), scene.task.limits.safety_factor)
    return utilise(ratings, forces).strength


def check_actuators(log: RunLog, chain: Chain) -> Finding:
    """Greatest drive force over what the supply pressure holds."""
    members = [chain.truss.members[i] for i in chain.truss.actuated]
    cylinders = [chain.manipulator.cylinders[member.section] for member in members]
    pull, push = np.array([item.pull for item in cylinders]), np.array([item.push for item in cylinders])
    used = np.where(log.actuator_force > 0, log.actuator_force / pull, -log.actuator_force / push)
    return worst_of(used, log.time, [member.name for member in members])
