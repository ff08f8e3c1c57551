"""Is every member loaded along its axis, and by how much? The log against the method of joints."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics import Chain, Truss
from vgtsim.kinematics.ties import first_greatest
from vgtsim.runlog import RunLog
from vgtsim.statics.cases import find_envelope
from vgtsim.statics.equilibrium import MemberForces, solve_members
from vgtsim.statics.loads import make_load_model
from vgtsim.statics.motion import Motion, motion_from_log
from vgtsim.statics.rating import SLENDERNESS_ADVICE, Ratings, make_sections, rate
from vgtsim.statics.utilisation import MODES, Utilisation, utilise
from vgtsim.verification.findings import Finding, worst_of

Array = NDArray[np.float64]

LEAST_FORCE = 1.0  # N; errors are relative to this where an arm without weight carries less
LEAST_MOMENT = 1.0  # N·m; the same of bending

_BESIDE = 2  # records on either side of one that its acceleration is made of, see `motion_from_log`
_CASE_POSES = 1000  # recorded poses held against the load cases, evenly spread over the run


@dataclass(frozen=True)
class Loads:
    """Measured and expected member forces; T records, M members.

    Attributes:
        axial: Measured at the near ends, tension positive, shape (T, M), N.
        shear: Measured across the members at the near ends, shape (T, M, 3), N.
        moment: Measured at the near ends, shape (T, M, 3), N·m.
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
        moment=log.member_moment,
        moving=solve_members(model, log.nodes, motion),
        settled=settled,
        resting=solve_members(model, log.nodes[settled], at_rest),
    )


def check_moment(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest moment at the end of a member that has a ball there, N·m."""
    straight, names = _unbent(chain.truss)
    return worst_of(np.linalg.norm(loads.moment[:, straight], axis=-1), log.time, names)


def check_shear(log: RunLog, chain: Chain, loads: Loads) -> Finding:
    """Greatest shear at a member's end beyond its share of the member's own weight and inertia, N.

    Actuators between joint blocks are left to `check_bending`.
    """
    straight, names = _unbent(chain.truss)
    excess = (loads.shear - loads.moving.near_transverse)[:, straight]
    return worst_of(np.linalg.norm(excess, axis=-1), log.time, names)


def _unbent(truss: Truss) -> tuple[NDArray[np.intp], list[str]]:
    """Members that a joint offset does not bend, and their names."""
    straight = np.setdiff1d(np.arange(len(truss.members)), truss.ring_actuators)
    return straight, [truss.member_names[i] for i in straight]


def check_bending(log: RunLog, chain: Chain, loads: Loads, *, settled: bool) -> Finding:
    """Greatest error of what bends an actuator between joint blocks, over the greatest bending moment of the run.

    At the near pin the moment and, times the length, the shear; torsion and moments about the pin are errors.

    Args:
        log: The run.
        chain: The arm, with a joint offset.
        loads: Measured and expected forces.
        settled: Whether to look at the records at rest alone, or at all of them.

    Returns:
        The finding; its detail has the greatest moment itself.
    """
    pinned, rows = chain.truss.ring_actuators.ravel(), loads.settled if settled else np.arange(len(log.time))
    expected = loads.resting if settled else loads.moving
    if not len(rows):
        return Finding(float("nan"), "none", float("nan"), "the arm never settled")
    names, ends = [chain.truss.member_names[i] for i in pinned], chain.truss.ends[pinned]
    length = np.linalg.norm(log.nodes[rows][:, ends[:, 1]] - log.nodes[rows][:, ends[:, 0]], axis=-1)
    moment = loads.moment[rows][:, pinned]
    turned = np.linalg.norm(moment - expected.near_moment[:, pinned], axis=-1)
    pushed = np.linalg.norm(loads.shear[rows][:, pinned] - expected.near_transverse[:, pinned], axis=-1)
    size = np.linalg.norm(np.stack([expected.near_moment, expected.far_moment])[:, :, pinned], axis=-1).max(axis=0)
    greatest = worst_of(np.nan_to_num(size), log.time[rows], names)
    error = np.maximum(turned, pushed * length) / max(greatest.value, LEAST_MOMENT)
    detail = f"bending moment up to {greatest.value:.4g} N*m in {greatest.where} at {greatest.when:.2f} s"
    return replace(worst_of(error, log.time[rows], names), detail=detail)


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
    expected, pinned = loads.moving, chain.truss.ring_actuators.ravel()
    moment = expected.near_moment.copy()
    moment[:, pinned] = loads.moment[:, pinned]
    forces = replace(
        expected,
        bar=expected.bar + off,
        near_axial=loads.axial,
        far_axial=expected.far_axial + off,
        near_moment=moment,
    )
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
    mode = MODES[int(first_greatest(use.by_mode[:, record, member]))]
    slender = ratings.slenderness[record, member]
    text = f"governed by {mode}, KL/r {slender:.0f}, margin {_margin(found.value):.3g}"
    most = float(np.nanmax(ratings.slenderness))
    if most > SLENDERNESS_ADVICE:
        name = chain.truss.member_names[int(np.nanargmax(np.nanmax(ratings.slenderness, axis=0)))]
        text += f"; {name} has KL/r {most:.0f}, more than the {SLENDERNESS_ADVICE:.0f} that AISC 360 E2 advises"
    return replace(found, detail=text)


def _margin(used: float) -> float:
    """Part by which a demand could grow."""
    return 1 / used - 1 if used else float("inf")


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
        case, *_ = np.unravel_index(first_greatest(used), used.shape)
        finding = worst_of(used[case], log.time[picked], chain.truss.member_names)
        found.append(replace(finding, detail=f"case {worst.cases[int(case)]}, margin {_margin(finding.value):.3g}"))
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
