"""Poses along a programme, for whatever judges a task without simulating it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.control.program import LengthProgram
from vgtsim.kinematics.chain import Chain


def sample_poses(chain: Chain, program: LengthProgram, spacing: float = 0.2) -> NDArray[np.float64]:
    """Nodes along a tour, the goals included.

    Args:
        chain: The arm.
        program: Lengths at every step.
        spacing: Of the poses in time, s.

    Returns:
        Shape (K, N, 3), m, in frame G.
    """
    every = max(1, round(spacing / program.timestep))
    lengths = np.concatenate([part for leg in program.legs for part in (leg.lengths[::every], leg.lengths[-1:])])
    return chain.nodes(chain.inputs_from_lengths(lengths.reshape(len(lengths), *chain.length_shape)))
