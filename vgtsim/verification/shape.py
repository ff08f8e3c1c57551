"""Is it the mechanism? Closure and agreement with kinematics or stiffness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vgtsim.errors import AssemblyError, TrussError
from vgtsim.statics import NodeMotion, damping_time, settle, solve_members
from vgtsim.verification.evidence import Array, Evidence, Index
from vgtsim.verification.measures import Finding, absent, missing, report_as, when, worst_of

_OIL_PASSES = 6  # a millimetre of oil changes its own stiffness by a hundredth at most
_SETTLED = 60  # settled instants of a run whose shape is compared: each takes a nonlinear solve


@report_as("closure", "gap between member end and hub", limit="closure")
def check_closure(run: Evidence) -> Finding:
    """Greatest gap between a member's end and its hub."""
    return worst_of(run.gaps, run.log.time, run.names)


@report_as(
    "kinematics_agreement",
    "node to forward kinematics",
    limit="kinematics_agreement",
    applies=when(members=("rigid", "sections")),
)
def check_kinematics(run: Evidence) -> Finding:
    """Greatest distance of a node from the forward kinematics of the actual lengths."""
    log, chain = run.log, run.site.chain
    try:
        q = chain.inputs_from_lengths(log.actual)
    except AssemblyError as error:
        return missing(str(error), error.module)
    return worst_of(np.linalg.norm(log.nodes - run.carry(chain.nodes(q)), axis=-1), log.time, chain.truss.nodes)


@report_as(
    "kinematics_agreement",
    "settled node to stiffness solution",
    limit="kinematics_agreement",
    applies=when(members="elastic"),
)
def check_settled_shape(run: Evidence) -> Finding:
    """Greatest distance of a node of an elastic arm, at settled instants, from where the stiffness solve puts it.

    Forward kinematics of lengths says nothing of an arm whose tubes stretch. Its shape at rest follows from the commanded
    lengths, the stiffnesses and the weight: equilibrium at the deformed pose, with the inertia of the motion that is left.
    """
    log, site, settled = run.log, run.site, np.flatnonzero(run.outline.settled)
    picks = np.linspace(0, len(settled) - 1, min(len(settled), _SETTLED)).astype(int)
    picked = run.within(np.unique(settled[picks]))
    if not len(picked):
        return absent("the arm never settled: no instant to compare")
    nodes, known = log.nodes[picked], np.isfinite(run.motion.acceleration[picked])
    gained = run.motion.velocity + run.step * run.motion.acceleration  # dampers resist the speed at the end of the step
    left = NodeMotion(*(np.where(known, item[picked], 0.0) for item in (gained, run.motion.acceleration)))
    try:
        unloaded = _unload(run, picked, left)
        start = site.chain.nodes(site.chain.inputs_from_lengths(run.outline.commanded))
        beta = damping_time(site.elastic_model, start, site.task.simulation.damping_ratio)
        loaded = settle(site.elastic_model, unloaded, left, beta, _find_touches(run, picked))
        apart = np.linalg.norm(nodes - loaded, axis=-1)
    except (AssemblyError, TrussError) as error:
        return missing(str(error))
    sag = np.linalg.norm(nodes - unloaded, axis=-1).max()
    detail = f"{len(picked)} settled instants; sag below the unloaded shape up to {sag:.4g} m"
    return replace(worst_of(apart, log.time[picked], site.truss.nodes), detail=detail)


def _find_touches(run: Evidence, picked: Index) -> Array | None:
    """Forces of contacts at the nodes of some records, shape (S, N, 3), N."""
    return None if run.touches is None else run.touches.total(run.site.truss.ends)[picked]


def _unload(run: Evidence, picked: Index, left: NodeMotion) -> Array:
    """Shapes that some records would have without load, shape (S, N, 3), m.

    A valve holds the loaded length of its cylinder; the unloaded one is that less the deflection of the oil.
    """
    log, chain, elastic = run.log, run.site.chain, run.site.elastic_model
    lengths = log.commanded[picked]
    if run.site.task.simulation.drive != "rigid":
        bar = solve_members(elastic.loads, log.nodes[picked], left, _find_touches(run, picked)).bar
        lengths = log.actual[picked]
        for _ in range(_OIL_PASSES):
            lengths = log.actual[picked] - (bar / elastic.stiffness(lengths))[:, chain.truss.actuated]
    return run.carry(chain.nodes(chain.inputs_from_lengths(lengths)), picked)


@report_as("kinematics_agreement", "logged tool to its nodes", limit="kinematics_agreement")
def check_logged_tool(run: Evidence) -> Finding:
    """Greatest distance of the logged tool from where its nodes put it, a turn counted at a metre's radius."""
    position, direction = run.tool
    apart = np.linalg.norm(run.log.tool_position - position, axis=-1)
    turned = np.linalg.norm(run.log.tool_direction - direction, axis=-1)
    return worst_of(np.maximum(apart, turned)[:, None], run.log.time, ("tool",))
