"""The shape a scene starts from, as inputs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import DoubleOctahedral, Octahedral
from vgtsim.description.scene import Scene
from vgtsim.kinematics.bending import bend_all
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]


def start_inputs(scene: Scene, chain: Chain) -> Array:
    """Inputs of the shape a scene starts from: every module bent symmetrically, see `bending.bend_all`.

    Args:
        scene: The scene.
        chain: Its arm.

    Returns:
        Shape (*q).
    """
    bends, modules = scene.task.motion.start, scene.manipulator.actuated
    row = bend_all(chain, [bend.angle for bend in bends], [bend.azimuth for bend in bends]).ravel()
    for a, (bend, module) in enumerate(zip(bends, modules, strict=True)):
        if bend.extension is None:
            continue
        columns = np.flatnonzero(chain.layout.owner == a)
        if isinstance(module, DoubleOctahedral):
            row[columns[2]] = (bend.extension - module.joint_offset) / 2
        elif isinstance(module, Octahedral):
            row[columns[:3]] *= bend.extension / np.linalg.norm(row[columns[:3]])
    return row.reshape(chain.input_shape)
