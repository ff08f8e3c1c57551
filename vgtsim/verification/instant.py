"""The truss at one instant of a run: loads on its nodes, and forces and stiffnesses of its bars."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.errors import DescriptionError
from vgtsim.log import BESIDE, LogSource, cut, outline
from vgtsim.site import Site
from vgtsim.statics import NodeMotion, node_loads, require_no_offset, solve_members
from vgtsim.verification.evidence import Array, Evidence, Index

STIFF_EDGE = 1e3  # stiffness of the rigid tip plate's edges over that of the stiffest member


@dataclass(frozen=True)
class Instant:
    """A truss of N nodes and B bars: the M members, then the edges of the tip plate. Frame G, tension positive.

    Attributes:
        time: Simulated, s.
        nodes: Shape (N, 3), m.
        load: Weight, inertia and contact forces shared between the nodes, shape (N, 3), N.
        ends: Node indices of the bars, shape (B, 2).
        length: Shape (B,), m.
        spring: Axial stiffness, shape (B,), N/m.
        force: In equilibrium with the loads, shape (B,), N; zero on the edges.
        measured: The simulation's at the near end, shape (B,), N; zero on the edges.
    """

    time: float
    nodes: Array
    load: Array
    ends: Index
    length: Array
    spring: Array
    force: Array
    measured: Array


def find_instant(site: Site, log: LogSource, time: float | None = None) -> Instant:
    """Collect the truss of a time, s, or without one of the instant of the greatest axial force.

    Raises:
        DescriptionError: A module has a joint offset, or the time is not in the log.
    """
    require_no_offset(site.chain, "a truss is exported")
    model, truss, times = site.elastic_model, site.truss, outline(log).time
    if time is None:
        greatest = [np.abs(stretch.log.axial(truss.ends)).max(axis=1) for stretch in cut(log)]
        record = int(np.argmax(np.concatenate(greatest)))
    elif times[0] <= time <= times[-1]:
        record = int(np.argmin(np.abs(times - time)))
    else:
        raise DescriptionError(None, "time", f"{time:.6g} s", f"{times[0]:.6g} to {times[-1]:.6g} s, as logged")
    first = max(record - BESIDE, 0)
    run, at = Evidence(site, log.read(first, min(record + BESIDE + 1, log.count))), record - first
    nodes, motion = run.log.nodes[at], NodeMotion(run.motion.velocity[at], run.motion.acceleration[at])
    now = motion if np.isfinite(motion.acceleration).all() else None
    touched = 0.0 if run.touches is None else run.touches.total(truss.ends)[at]
    edges, spring = np.zeros(len(truss.tip_edges)), model.stiffness_at(nodes)
    ends = np.concatenate([truss.ends, truss.tip_edges])
    return Instant(
        time=float(times[record]),
        nodes=nodes,
        load=node_loads(model, nodes, now) + touched,
        ends=ends,
        length=np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=-1),
        spring=np.append(spring, edges + STIFF_EDGE * spring.max()),
        force=np.append(solve_members(model.loads, nodes, now, touched).bar, edges),
        measured=np.append(run.axial[at], edges),
    )
