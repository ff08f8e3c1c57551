"""Is it the mechanism? Closure, agreement with kinematics, tracking and strokes, from the log and the description."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.errors import AssemblyError, TrussError
from vgtsim.kinematics import Chain
from vgtsim.runlog import RunLog
from vgtsim.statics.elasticity import make_elastic_model
from vgtsim.statics.equilibrium import solve_members
from vgtsim.statics.modes import damping_time
from vgtsim.statics.motion import Motion, motion_from_log
from vgtsim.statics.settling import settle
from vgtsim.verification.findings import Finding, worst_of

Array = NDArray[np.float64]

_OIL_PASSES = 6  # a millimetre of oil changes its own stiffness by a hundredth at most
_SETTLED = 60  # settled instants of a run whose shape is compared: each takes a nonlinear solve


def find_gaps(log: RunLog, chain: Chain) -> Array:
    """Distance of each member's ends from its hubs, the greater of the two.

    Args:
        log: The run.
        chain: The arm.

    Returns:
        Shape (T, M), m.
    """
    return np.linalg.norm(log.ends - log.nodes[:, chain.truss.ends], axis=-1).max(axis=-1)


def check_closure(log: RunLog, chain: Chain) -> Finding:
    """Greatest gap between a member's end and its hub, m."""
    gaps = find_gaps(log, chain)
    return worst_of(gaps, log.time, chain.truss.member_names)


def check_kinematics(log: RunLog, chain: Chain) -> Finding:
    """Greatest distance of a node from the forward kinematics of the actual lengths, m."""
    try:
        q = chain.inputs_from_lengths(log.actual)
    except AssemblyError as error:
        return Finding(float("nan"), error.module, float("nan"), str(error))
    apart = np.linalg.norm(log.nodes - chain.nodes(q), axis=-1)
    return worst_of(apart, log.time, chain.truss.nodes)


def check_settled_shape(log: RunLog, chain: Chain, scene: Scene) -> Finding:
    """Greatest distance of a node of an elastic arm, at settled instants, from where the stiffness solve puts it, m.

    Forward kinematics of lengths says nothing of an arm whose tubes stretch. What it should look like at rest follows
    from the commanded lengths, the stiffnesses and the weight: equilibrium at the deformed pose, with the inertia of
    what motion is left.
    """
    settled = np.flatnonzero(log.settled)
    if not len(settled):
        return Finding(float("nan"), "none", float("nan"), "the arm never settled: no instant to compare")
    picked = np.unique(settled[np.linspace(0, len(settled) - 1, min(len(settled), _SETTLED)).astype(int)])
    motion = motion_from_log(log.time, log.nodes)
    simulation = scene.task.simulation
    elastic = make_elastic_model(chain, scene.task.payload, simulation.gravity, lumped=simulation.lumped)
    velocity, acceleration = motion.velocity[picked], motion.acceleration[picked]
    try:
        known = np.isfinite(acceleration)
        left = Motion(np.where(known, velocity, 0.0), np.where(known, acceleration, 0.0))
        lengths = log.commanded[picked]
        if scene.task.simulation.drive != "rigid":
            # the valve holds the loaded length; what the oil would have without its load is that less the deflection
            bar = solve_members(elastic.loads, log.nodes[picked], left).bar
            lengths = log.actual[picked]
            for _ in range(_OIL_PASSES):
                lengths = log.actual[picked] - (bar / elastic.stiffness(lengths))[:, chain.truss.actuated]
        unloaded = chain.nodes(chain.inputs_from_lengths(lengths))
        start = chain.nodes(chain.inputs_from_lengths(log.commanded[0]))
        beta = damping_time(elastic, start, scene.task.simulation.damping_ratio)
        apart = np.linalg.norm(log.nodes[picked] - settle(elastic, unloaded, left, beta), axis=-1)
    except (AssemblyError, TrussError) as error:
        return Finding(float("nan"), "none", float("nan"), str(error))
    worst = worst_of(apart, log.time[picked], chain.truss.nodes)
    sag = np.linalg.norm(log.nodes[picked] - unloaded, axis=-1).max()
    return replace(worst, detail=f"{len(picked)} settled instants; sag below the unloaded shape up to {sag:.4g} m")


def tool_from_nodes(nodes: Array, chain: Chain) -> tuple[Array, Array]:
    """Tool point and direction of the plane through the tip nodes.

    Args:
        nodes: Shape (T, N, 3), m, in frame G.
        chain: The arm.

    Returns:
        Position, shape (T, 3), m, and outward unit normal, shape (T, 3), in frame G.
    """
    corner = nodes[:, chain.truss.tip]
    normal = np.cross(corner[:, 0] - corner[:, 2], corner[:, 1] - corner[:, 2])
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return corner.mean(axis=1) + chain.manipulator.tip_plate.tool_offset * normal, normal


def check_logged_tool(log: RunLog, chain: Chain) -> Finding:
    """Greatest distance of the logged tool from where its nodes put it, a turn counted at a metre's radius, m."""
    position, direction = tool_from_nodes(log.nodes, chain)
    apart = np.linalg.norm(log.tool_position - position, axis=-1)
    turned = np.linalg.norm(log.tool_direction - direction, axis=-1)
    return worst_of(np.maximum(apart, turned)[:, None], log.time, ("tool",))


def check_command(log: RunLog, chain: Chain) -> Finding:
    """Greatest distance of a cylinder's length from its command, m."""
    names = [chain.truss.member_names[i] for i in chain.truss.actuated]
    return worst_of(np.abs(log.actual - log.commanded), log.time, names)


def find_tool_errors(log: RunLog, chain: Chain, scene: Scene) -> tuple[Array, Array]:
    """Distance and angle of the tool from the goal approached or held at each record.

    Args:
        log: The run.
        chain: The arm.
        scene: Names the goals.

    Returns:
        Shapes (T,), m and rad; NaN where there is no goal.
    """
    position, direction = tool_from_nodes(log.nodes, chain)
    goals = scene.task.motion.goals
    wanted = np.array([goal.position for goal in goals])[log.goal]
    aimed = np.array([goal.direction for goal in goals])[log.goal]
    distance = np.linalg.norm(position - wanted, axis=-1)
    angle = np.arctan2(np.linalg.norm(np.cross(direction, aimed), axis=-1), np.sum(direction * aimed, axis=-1))
    none = log.goal < 0
    distance[none] = angle[none] = np.nan
    return distance, angle


def check_tracking(log: RunLog, errors: Array, scene: Scene) -> Finding:
    """Greatest error at a settled goal; it could not be made when a goal was never settled.

    Args:
        log: The run.
        errors: Distance or angle at each record, shape (T,).
        scene: Names the goals.

    Returns:
        The finding, at the goal's name.
    """
    labels = [goal.name for goal in scene.task.motion.goals]
    least = int(scene.task.motion.hold * scene.task.simulation.log_rate) - 1
    count = [np.sum(log.settled & (log.goal == index)) for index in range(len(labels))]
    missed = [name for name, records in zip(labels, count, strict=True) if records < max(least, 1)]
    if missed:
        return Finding(float("nan"), missed[0], float("nan"), f"not held, settled, at {', '.join(missed)}")
    held = np.flatnonzero(log.settled)
    worst = held[np.argmax(errors[held])]
    return Finding(float(errors[worst]), labels[int(log.goal[worst])], float(log.time[worst]))


def check_strokes(log: RunLog, chain: Chain) -> Finding:
    """Least distance of a cylinder from the ends of its stroke, m."""
    low, high = chain.stroke
    room = np.minimum(log.actual - low, high - log.actual)
    names = [chain.truss.member_names[i] for i in chain.truss.actuated]
    worst = worst_of(-room, log.time, names)
    return Finding(-worst.value, worst.where, worst.when)
