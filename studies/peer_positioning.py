"""Positioning by others: `mink` on the arm as a serial chain, and scipy's `least_squares` on its goal rows."""

from __future__ import annotations

import importlib
import importlib.util
import time
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from vgtsim.description import Manipulator, Prism
from vgtsim.kinematics import Chain

Array = NDArray[np.float64]

MINK = importlib.util.find_spec("mink") is not None


def repeat(arm: Manipulator, modules: int) -> Manipulator:
    """An arm of that many active modules, each with its prism, from the description of another."""
    pairs = [arm.modules[2 * i : 2 * i + 2] for i in range(len(arm.modules) // 2)]
    chosen = [
        part.model_copy(update={"name": f"{part.name[0]}{k + 1}"})
        for k in range(modules)
        for part in pairs[k % len(pairs)]
    ]
    return arm.model_copy(update={"modules": tuple(chosen)})


def move_nearby(
    rng: np.random.Generator, position: Array, direction: Array, move: float, turn: float
) -> tuple[Array, Array]:
    """Goals that far, m, and turned that much, rad, from tools, shapes (B, 3), in directions drawn anew for each."""
    step = rng.standard_normal(position.shape)
    step *= move / np.linalg.norm(step, axis=1, keepdims=True)
    side = np.cross(direction, rng.standard_normal(direction.shape))
    side *= np.tan(turn) / np.linalg.norm(side, axis=1, keepdims=True)
    return position + step, direction + side


def by_least_squares(chain: Chain, q0: Array, position: Array, direction: Array) -> float:
    """Error left by least_squares on the goal rows alone, with their exact Jacobian: it has no optimum to find."""
    along = direction / np.linalg.norm(direction)
    across = np.linalg.svd(along[None])[2][1:]  # two directions across the goal's
    last: tuple[Array, Array, Array] = (np.full_like(q0, np.nan), q0, q0)

    def look(x: Array) -> tuple[Array, Array]:
        nonlocal last
        if not np.array_equal(x, last[0]):
            P, z, J = chain.tool_jacobian(x)
            turned = np.cross(J[3:].T, z).T
            last = x.copy(), np.append(P - position, across @ z), np.concatenate([J[:3], across @ turned])
        return last[1:]

    bound = np.tile([0.7, 0.7, np.inf], len(chain.layout.names))  # beyond them a mid-plane's normal may lie flat
    options: dict[str, Any] = {"jac": lambda x: look(x)[1], "ftol": None}
    found = least_squares(lambda x: look(x)[0], q0, bounds=(-bound, bound), xtol=1e-12, gtol=1e-9, **options)
    return float(np.max(np.abs(found.fun)))


def gimbal_chain(chain: Chain) -> str:
    """The arm as MuJoCo knows serial arms: every module two hinges, a slide and the same two hinges again, coupled.

    Not a truss: no members, no strokes. Its tool moves as the arm's does, which `by_mink` checks.
    """
    level, body, pairs = 0, "", []
    ball = '<geom size="0.01" mass="1" contype="0" conaffinity="0"/>'
    rise = 0.0
    for module in chain.manipulator.modules:
        if isinstance(module, Prism):
            rise += module.length
            continue
        offset = module.offset
        axes = {"x": "1 0 0", "y": "0 1 0"}
        first = "".join(f'<joint name="{axis}{level}a" axis="{axes[axis]}"/>' for axis in "xy")
        second = "".join(f'<joint name="{axis}{level}b" axis="{axes[axis]}"/>' for axis in "yx")
        slide = f'<joint name="z{level}" type="slide" axis="0 0 1"/>'
        body += f'<body pos="0 0 {rise}">{ball}{first}{slide}<body pos="0 0 {offset}">{ball}{second}'
        pairs += [f'<joint joint1="{axis}{level}b" joint2="{axis}{level}a"/>' for axis in "xy"]
        rise, level = 0.0, level + 1
    at = rise + chain.manipulator.tip_plate.tool_offset
    body += f'<site name="tool" pos="0 0 {at}"/>' + "</body>" * (2 * level)
    quat = Rotation.from_matrix(chain.mount[:3, :3]).as_quat()[[3, 0, 1, 2]]
    where = f'pos="{" ".join(map(repr, chain.mount[:3, 3].tolist()))}" quat="{" ".join(map(repr, quat.tolist()))}"'
    tree = f"<worldbody><body {where}>{body}</body></worldbody>"
    return f"<mujoco><compiler angle='radian'/>{tree}<equality>{''.join(pairs)}</equality></mujoco>"


def joints(q: Array) -> Array:
    """Hinges and slides of `gimbal_chain` for inputs of shape (n,)."""
    x, y, d = q.reshape(-1, 3).T
    a, b = np.arctan2(-y, np.sqrt(1 - x * x - y * y)), np.arcsin(x)
    return np.stack([a, b, 2 * d, b, a], axis=1).ravel()


def by_mink(chain: Chain, q0: Array, position: Array, direction: Array) -> tuple[float, float, float]:
    """CPU time a goal, mean number of steps and greatest error of mink's inverse kinematics, goal rows alone."""
    mink = importlib.import_module("mink")
    model = mujoco.MjModel.from_xml_string(gimbal_chain(chain))
    arm = mink.Configuration(model)
    hold = [mink.EqualityConstraintTask(model, cost=1.0)]
    task = mink.FrameTask("tool", "site", position_cost=1.0, orientation_cost=[1.0, 1.0, 0.0])
    spent, steps, left, off = 0.0, 0, 0.0, 0.0
    for start, point, along in zip(q0, position, direction / np.linalg.norm(direction, axis=1)[:, None], strict=True):
        arm.update(joints(start))
        tool = arm.get_transform_frame_to_world("tool", "site")
        assert np.linalg.norm(tool.translation() - chain.tool(start)[0]) < 1e-9  # the same arm
        turn = Rotation.align_vectors(along[None], tool.rotation().as_matrix()[None, :, 2])[0].as_matrix()
        goal = np.eye(4)
        goal[:3, :3], goal[:3, 3] = turn @ tool.rotation().as_matrix(), point
        task.set_target(mink.SE3.from_matrix(goal))
        clock = time.process_time()
        for _ in range(50):
            off = np.max(np.abs(task.compute_error(arm)[:5]))
            if off < 1e-9:
                break
            step = mink.solve_ik(arm, [task], 1.0, "daqp", damping=1e-8, limits=[], constraints=hold)
            arm.integrate_inplace(step, 1.0)
            steps += 1
        spent += time.process_time() - clock
        left = max(left, off)
    return spent / len(q0), steps / len(q0), left
