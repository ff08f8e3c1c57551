"""Every shipped arm in one posture, against values that were recorded before the kinematics became one engine."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain, hanging_mount

RECORDED = np.load(Path(__file__).with_name("recorded_chains.npz"))
NAMES = sorted({key.split("/")[0] for key in RECORDED})
SAME = 1e-12  # m, m/rad: rounding over a chain of twenty modules, some ten metres long


@pytest.mark.parametrize("name", NAMES)
def test_postures_are_those_of_the_record(name):
    file = Path(__file__).parents[2] / f"models/{name}/{name}.toml"
    chain = Chain(load_manipulator(file), hanging_mount(9.0))
    q, nodes, lengths, tool, jacobian = (
        RECORDED[f"{name}/{what}"] for what in ("q", "nodes", "lengths", "tool", "jacobian")
    )
    position, direction, J = chain.tool_jacobian(q)
    np.testing.assert_allclose(chain.nodes(q), nodes, rtol=0, atol=SAME)
    np.testing.assert_allclose(chain.lengths(q), lengths, rtol=0, atol=SAME)
    np.testing.assert_allclose([*position, *direction], tool, rtol=0, atol=SAME)
    np.testing.assert_allclose(J, jacobian, rtol=0, atol=SAME)
    np.testing.assert_allclose(chain.inputs_from_lengths(lengths, q), q, rtol=0, atol=1e3 * SAME)
