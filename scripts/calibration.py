"""How fast this machine is: a fixed MuJoCo model, stepped for a second beside any benchmark that quotes absolute speeds."""

from __future__ import annotations

import time

import mujoco

LINKS, STEPS, ROUNDS = 40, 500, 5


def make_chain() -> mujoco.MjModel:
    """Hang a chain of capsules on ball joints."""
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    body = spec.worldbody
    for link in range(LINKS):
        body = body.add_body(pos=[0.2 if link else 0.0, 0, 0])
        body.add_joint(type=mujoco.mjtJoint.mjJNT_BALL, damping=[1.0, 0, 0])
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, fromto=[0, 0, 0, 0.2, 0, 0], size=[0.02, 0, 0], contype=0)
    return spec.compile()


def measure_machine() -> float:
    """Steps a second of processor time of the fixed model: the best of a few rounds."""
    model = make_chain()
    best = 0.0
    for _ in range(ROUNDS):
        data = mujoco.MjData(model)
        begin = time.process_time()
        for _ in range(STEPS):
            mujoco.mj_step(model, data)
        best = max(best, STEPS / (time.process_time() - begin))
    return best
