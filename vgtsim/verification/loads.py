"""Is every member loaded along its axis, and by how much? The log against the method of joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain
from vgtsim.runlog import RunLog
from vgtsim.statics.cases import find_envelope
from vgtsim.statics.equilibrium import MemberForces, solve
from vgtsim.statics.loads import make_load_model
from vgtsim.statics.motion import Motion, motion_from_log
from vgtsim.statics.rating import (
    MODES,
    SLENDERNESS_ADVICE,
    Ratings,
    Utilisation,
    make_sections,
    rate,
    utilise,
)
from vgtsim.verification.findings import Finding, worst_of

Array = NDArray[np.float64]

LEAST_FORCE = 1.0  # N; errors are relative to this where an arm without weight carries less

_BESIDE = 2  # records on either side of one that its acceleration is made of, see `motion_from_log`
_CASE_POSES = 1000  # recorded poses held against the load cases, evenly spread over the run


@dataclass(frozen=True)
class Loads:
    """Measured and expected member forces; T records, M members.

    Attributes:
        axial: Measured at the near ends, tension positive, shape (T, M), N.
        shear: Measured across the members at the near ends, shape (T, M, 3), N.
        moment: Measured at the near ends, shape (T, M), N·m.
        moving: Expected with inertia, from the method of joints; NaN where the motion is unknown.
        settled: Records at rest, shape (S,).
        resting: Expected for the settled records alone: at rest, or with the inertia of an elastic arm's ringing.
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
    simulation = scene.task.simulation
    model = make_load_model(
        chain,
        scene.task.payload,
        simulation.gravity,
        split=simulation.members == "elastic",
        lumped=simulation.lumped,
    )
    motion = motion_from_log(log.time, log.nodes)
    settled = np.flatnonzero(log.settled)
    # an elastic arm still rings a little when it counts as settled
    ringing = simulation.members == "elastic"
    if ringing:  # accelerations beside a record that is not settled are partly those of the motion to or from it
        settled = settled[np.isin(settled - _BESIDE, settled) & np.isin(settled + _BESIDE, settled)]
    at_rest = Motion(motion.velocity[settled], motion.acceleration[settled]) if ringing else None
    return Loads(
        axial=log.axial(chain.truss.ends),
        shear=log.shear(),
        moment=np.linalg.norm(log.member_moment, axis=-1),
        moving=solve(model, log.nodes, motion),
        settled=settled,
        resting=solve(model, log.nodes[settled], at_rest),
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
    return np.abs(measured - expected) / np.maximum(np.max(np.abs(expected), axis=-1, keepdims=True), LEAST_FORCE)


def find_utilisation(log: RunLog, chain: Chain, scene: Scene, loads: Loads) -> tuple[Utilisation, Ratings]:
    """Demand over strength of every member under the measured forces.

    The force varies along a member by its own weight and inertia, which the expected forces give.

    Args:
        log: The run.
        chain: The arm.
        scene: Gives the safety factor.
        loads: Measured and expected forces.

    Returns:
        Each mode's, shapes (T, M), and the allowable forces.
    """
    off = loads.axial - loads.moving.near_axial
    expected = loads.moving
    forces = replace(expected, bar=expected.bar + off, near_axial=loads.axial, far_axial=expected.far_axial + off)
    span = log.nodes[:, chain.truss.ends[:, 1]] - log.nodes[:, chain.truss.ends[:, 0]]
    section = make_sections(chain.manipulator, chain.truss)
    ratings = rate(section, np.linalg.norm(span, axis=-1), scene.task.limits.safety_factor)
    return utilise(ratings, forces), ratings


def check_utilisation(log: RunLog, chain: Chain, use: Utilisation, ratings: Ratings) -> Finding:
    """Greatest demand over strength, with what governs and what margin is left."""
    found = worst_of(use.strength, log.time, chain.truss.member_names)
    if not np.isfinite(found.value):
        return found
    record, member = np.unravel_index(np.nanargmax(use.strength), use.strength.shape)
    mode = MODES[int(np.argmax(use.by_mode[:, record, member]))]
    slender = ratings.slenderness[record, member]
    text = f"governed by {mode}, KL/r {slender:.0f}, margin {1 / found.value - 1:.3g}"
    most = float(np.nanmax(ratings.slenderness))
    if most > SLENDERNESS_ADVICE:
        name = chain.truss.member_names[int(np.nanargmax(np.nanmax(ratings.slenderness, axis=0)))]
        text += f"; {name} has KL/r {most:.0f}, more than the {SLENDERNESS_ADVICE:.0f} that AISC 360 E2 advises"
    return replace(found, detail=text)


def check_cases(log: RunLog, chain: Chain, scene: Scene) -> tuple[Finding, Finding] | None:
    """Worst strength and drive capacity used in any load case at any recorded pose; None without cases."""
    if not scene.task.loads:
        return None
    picked = np.unique(np.linspace(0, len(log.time) - 1, min(len(log.time), _CASE_POSES)).astype(int))
    simulation = scene.task.simulation
    model = make_load_model(chain, scene.task.payload, simulation.gravity, lumped=simulation.lumped)
    section = make_sections(chain.manipulator, chain.truss)
    worst = find_envelope(model, section, log.nodes[picked], scene.task.loads, scene.task.limits.safety_factor)
    found = []
    for used in (worst.strength, worst.pressure):
        case, *_ = np.unravel_index(np.argmax(used), used.shape)
        finding = worst_of(used[case], log.time[picked], chain.truss.member_names)
        found.append(replace(finding, detail=f"case {worst.cases[int(case)]}, margin {1 / finding.value - 1:.3g}"))
    return found[0], found[1]


def check_drives(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest error of a drive's force against the method of joints, over the largest force of the instant."""
    names = [chain.truss.member_names[i] for i in chain.truss.actuated]
    return worst_of(relative_error(log.actuator_force, loads.moving.bar[:, chain.truss.actuated]), log.time, names)


def check_reaction(log: RunLog, loads: Loads) -> Finding:
    """Greatest error of the mast's force and moment on the arm, each over the greatest of the instant or the run."""
    error = np.abs(log.mast_reaction - loads.moving.reaction)
    force = np.linalg.norm(loads.moving.reaction[:, :3], axis=-1, keepdims=True)
    moment = np.linalg.norm(loads.moving.reaction[:, 3:], axis=-1, keepdims=True)
    lever = np.maximum(moment, np.nanmax(force, initial=LEAST_FORCE))  # a metre's lever where the arm hangs straight
    relative = error / np.concatenate([np.repeat(np.maximum(force, LEAST_FORCE), 3, 1), np.repeat(lever, 3, 1)], axis=1)
    return worst_of(relative, log.time, ("mast force x", "y", "z", "mast moment x", "y", "z"))
