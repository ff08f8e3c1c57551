"""Use of members: what is compiled for poses at rest against ratings and forces held against each other one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import Payload, load_manipulator
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.statics import find_use, make_load_model, make_sections, rate, solve_members, utilise
from vgtsim.statics.rating import LIMITS

MODELS = Path(__file__).parents[2] / "models"
ROUNDING = 1e-12


@pytest.mark.parametrize("name", ["arm9", "tetra4", "mixed", "octahedron_general", "octahedron_offset"])
def test_use_at_rest_is_that_of_ratings_and_forces(name):
    """The offset arm's cylinders are bent; all others go by limits of axial force, taken here from the ratings' own table."""
    arm = load_manipulator(MODELS / name / f"{name}.toml")
    chain = Chain(arm, hanging_mount(9.0))
    nodes = chain.nodes(np.stack([chain.straight, chain.straight]))
    model, sections = make_load_model(chain, Payload(mass=200.0, radius=0.1), 9.81), make_sections(chain)
    ratings, forces = rate(sections, chain.truss.lengths(nodes), 1.67), solve_members(model, nodes)
    found = find_use(model, sections, nodes, 1.67)
    assert found.strength == pytest.approx(utilise(ratings, forces).strength, rel=ROUNDING)
    values = (found.tension, found.compression, found.rod, found.pressure, found.pin)
    for limit, value in zip(LIMITS, values, strict=True):
        pull, push = ratings.limits[limit]
        along = forces.bar[None] if limit == "oil pressure" else forces.along
        expected = np.maximum(along.max(axis=0) / pull, -along.min(axis=0) / push)
        assert value == pytest.approx(np.maximum(expected, 0.0), rel=ROUNDING), limit
    one = find_use(model, sections, nodes[1], 1.67)
    assert np.array_equal(one.strength, found.strength[1])  # a pose has the bits that it has among others
