"""The shape a scene starts from, as inputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]


def start_inputs(scene: Scene, chain: Chain) -> Array:
    """Inputs of the shape a scene starts from.

    Args:
        scene: The scene.
        chain: Its arm.

    Returns:
        Shape (A, 3).
    """
    q = np.array(chain.straight)
    for a, (bend, module) in enumerate(zip(scene.task.motion.start, scene.manipulator.active, strict=True)):
        tilt = np.sin(bend.angle / 2)
        q[a, :2] = tilt * np.cos(bend.azimuth), tilt * np.sin(bend.azimuth)
        if bend.extension is not None:
            q[a, 2] = (bend.extension - module.joint_offset) / 2
    return q
