"""The posture a scene starts from, as inputs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import DoubleOctahedral, Octahedral
from vgtsim.description.scene import Bend
from vgtsim.kinematics.bending import bend_all
from vgtsim.kinematics.chain import Chain

Array = NDArray[np.float64]


def bend_start(chain: Chain, bends: Sequence[Bend]) -> Array:
    """Inputs of a start posture: every module is bent symmetrically, see `bending.bend_all`.

    Args:
        chain: The arm.
        bends: One for each active module; an extension that is absent is that of the straight pose.

    Returns:
        Shape (n,).
    """
    row = bend_all(chain, [bend.angle for bend in bends], [bend.azimuth for bend in bends])
    for a, (bend, module) in enumerate(zip(bends, chain.manipulator.actuated, strict=True)):
        if bend.extension is None:
            continue
        columns = np.flatnonzero(chain.layout.owner == a)
        if isinstance(module, DoubleOctahedral):
            row[columns[2]] = (bend.extension - module.joint_offset) / 2
        elif isinstance(module, Octahedral):
            row[columns[:3]] *= bend.extension / np.linalg.norm(row[columns[:3]])
    return row
