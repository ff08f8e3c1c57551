"""The arm in MuJoCo as a user builds it: rigid parts and point masses, lengths kept by tendon equalities, weights as compiled.

What this project adds to MuJoCo is left out: scaled weights, the closure correction, forces by statics. Settings are the
best of what MuJoCo offers without it: Newton's method, the greatest impedance that MuJoCo accepts, and, for each integrator,
the stiffest reference that it follows: two steps, critically damped, under `implicitfast`; a fifth of a step, hardly damped,
under `discrete`.
"""

from __future__ import annotations

import time

import mujoco
import numpy as np

from studies.peer_arms import Parts, take_apart
from studies.peer_task import Played, Task

_SETTINGS = {  # integrator, time constant in steps and damping ratio of the rows
    "implicitfast": (mujoco.mjtIntegrator.mjINT_IMPLICITFAST, 2.0, 1.0),
    "discrete": (mujoco.mjtIntegrator.mjINT_DISCRETE, 0.2, 0.1),
}
_IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 2.0)


def build_plain(task: Task, parts: Parts, step: float, integrator: str) -> mujoco.MjModel:
    """The model at a step, s; rows are equalities in the order of `parts.rows`, nodes are sites by their names."""
    truss, model = task.site.truss, task.site.load_model
    kind, constant, ratio = _SETTINGS[integrator]
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.integrator = step, kind
    spec.option.gravity = model.gravity
    spec.option.tolerance = 1e-12
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_REFSAFE
    for node in parts.fixed:
        spec.worldbody.add_site(name=truss.nodes[node], pos=parts.start[node])
    for node in parts.free:
        body = spec.worldbody.add_body(pos=parts.start[node])
        for axis in np.eye(3):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        body.explicitinertial, body.mass, body.inertia, body.ipos = True, model.hub_mass[node], [1e-6] * 3, [0, 0, 0]
        body.add_site(name=truss.nodes[node])
    for part in parts.bodies:
        body = spec.worldbody.add_body(pos=part.centre)
        body.add_freejoint()
        body.explicitinertial, body.mass, body.ipos = True, part.mass, [0, 0, 0]
        tensor = part.inertia
        body.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
        for node in part.nodes:
            body.add_site(name=truss.nodes[node], pos=parts.start[node] - part.centre)
    for member in parts.rows:
        name = truss.member_names[member]
        tendon = spec.add_tendon(name=name)
        for node in truss.ends[member]:
            tendon.wrap_site(truss.nodes[node])
        spec.add_equality(
            name=name,
            type=mujoco.mjtEq.mjEQ_TENDON,
            objtype=mujoco.mjtObj.mjOBJ_TENDON,
            name1=name,
            solref=[constant * step, ratio],
            solimp=_IMPEDANCE,
            data=[0.0] * 12,
        )
    return spec.compile()


def play_plain(task: Task, step: float, *, integrator: str) -> Played:
    """The task with rigid sections at a step, s, each step commanded to the lengths at its end.

    It begins in equilibrium, after as many steps at rest as that takes.
    """
    parts, truss = take_apart(task, sections=True), task.site.truss
    model = build_plain(task, parts, step, integrator)
    data = mujoco.MjData(model)
    rows = [int(np.flatnonzero(parts.rows == member)[0]) for member in truss.actuated]
    sites = [model.site(name).id for name in truss.nodes]
    lengths, every = task.lengths(task.instants(step)), max(round(1 / task.rate / step), 1)
    moves = lengths - lengths[0]
    mujoco.mj_step(model, data, round(2 / step))
    clock, nodes, forces = [], [], []
    begin = time.process_time()
    for index, row in enumerate(moves[1:]):
        model.eq_data[rows, 0] = row
        mujoco.mj_step(model, data)
        if index % every == 0:
            clock.append(index * step)
            nodes.append(data.site_xpos[sites])
            forces.append(-data.efc_force[: len(parts.rows)])
    spent = time.process_time() - begin
    axial = np.full((len(clock), len(truss.ends)), np.nan)
    axial[:, parts.rows] = forces
    return Played(np.array(clock), np.array(nodes), axial, spent, len(moves) - 1)
