"""The arm as rigid parts, point masses and length rows, which every engine can have; and the task played by this project."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studies.peer_task import Played, Task
from studies.ringing import change_options
from vgtsim.kinematics import find_rigid_sections
from vgtsim.kinematics.inertia import make_plate_inertia
from vgtsim.plant import Plant

Array = NDArray[np.float64]
Index = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class RigidPart:
    """Nodes of one rigid body, shape (K,), with its mass, kg, in the pose in which the arm stands first.

    Its centre of mass, shape (3,), m, and its inertia about that, shape (3, 3), kg·m², are in frame G.
    """

    nodes: Index
    mass: float
    centre: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Parts:
    """An arm taken apart; N nodes.

    Attributes:
        start: Nodes of the pose in which the arm stands first, shape (N, 3), m, in frame G.
        fixed, free: Nodes on the mast, and point masses.
        bodies: Rigid parts; the last one has tip plate and payload.
        rows: Members whose lengths are imposed, shape (L,).
    """

    start: Array
    fixed: Index
    free: Index
    bodies: tuple[RigidPart, ...]
    rows: Index


def take_apart(task: Task, *, sections: bool) -> Parts:
    """Static sections as rigid bodies, or every hub but those of mast and tip plate as a point mass."""
    site, truss, q = task.site, task.site.truss, task.pose(np.zeros(1))[0]
    if sections:
        of_node = find_rigid_sections(site.chain).of_node
    else:
        of_node = np.full(len(truss.nodes), -1)
        of_node[truss.base], of_node[truss.tip] = 0, 1
    start, last = site.chain.nodes(q), int(of_node.max())
    near, far = of_node[truss.ends].T
    return Parts(
        start=start,
        fixed=np.flatnonzero(of_node == 0),
        free=np.flatnonzero(of_node < 0),
        bodies=tuple(_join(task, q, np.flatnonzero(of_node == n), tip=n == last) for n in range(1, last + 1)),
        rows=np.flatnonzero((near != far) | (near < 0)),
    )


def _join(task: Task, q: Array, nodes: Index, *, tip: bool) -> RigidPart:
    """Masses at nodes as one body, with plate and payload if it is the tip."""
    site, model = task.site, task.site.load_model
    masses, points, tensor = model.hub_mass[nodes], site.chain.nodes(q)[nodes], np.zeros((3, 3))
    if tip:
        R, P = (item[-1] for item in site.chain.frames(q))
        plate, load = make_plate_inertia(site.arm), model.payload
        masses = np.append(masses, [plate.mass, load.mass])
        points = np.vstack([points, P, P + R[:, 2] * model.tool_offset])
        tensor = R @ np.diag(plate.moments) @ R.T + 0.4 * load.mass * load.radius**2 * np.eye(3)
    centre = masses @ points / masses.sum()
    away = points - centre
    spread = np.einsum("p,pi,pj->ij", masses, away, away)
    return RigidPart(nodes, float(masses.sum()), centre, tensor + np.trace(spread) * np.eye(3) - spread)


def play_own(task: Task, step: float, members: str) -> Played:
    """The task played by the plant, its members as bodies (`rigid`) or as rigid sections (`sections`), at a step, s."""
    site = change_options(task.site, members=members, timestep=step)
    lengths, truss = task.lengths(task.instants(step)), site.truss
    plant = Plant(site, record_rate=task.rate)
    plant.reset(lengths[0], task.pose(np.zeros(1))[0])
    begin = time.process_time()
    for row in lengths[1:]:
        plant.command(row)
        plant.step()
    spent, log = time.process_time() - begin, plant.log
    gap = np.linalg.norm(log.ends - log.nodes[:, truss.ends], axis=-1).max() if members == "rigid" else 0.0
    return Played(log.time, log.nodes, log.axial(truss.ends), spent, len(lengths) - 1, float(gap))
