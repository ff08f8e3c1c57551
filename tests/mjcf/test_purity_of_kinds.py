"""A model of every kind of module: 200 poses held, some reached by moving; loops, kinematics and pure axial force."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from standing import stand

from vgtsim.description import load_manipulator
from vgtsim.kinematics import Chain, sample_inputs

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2] / "models"
CLOSURE = 1e-8  # m
AGREEMENT = 1e-7  # m: the closures' gaps, longer by the arm's levers
END_MOMENT = 1e-6  # N·m
EXCESS_SHEAR = 1e-2  # N; forces are of the order of 1e3 N
AXIAL = 2e-6  # of the largest force: what the rest of motion and the solver leave
LUMPED_SHEAR = 1e-6  # N: none but the weight of the 1e-9 kg that MuJoCo wants of every body
POSES = 200


def part(name: str, *modules: str):
    arm = load_manipulator(ROOT / name / f"{name}.toml")
    kept = tuple(module for module in arm.modules if module.name in modules or not modules)
    return arm.model_copy(update={"modules": kept})


def general():
    """Two general modules of the shipped one's longerons about a symmetric one, prisms between; no joint offset."""
    arm, one = (
        load_manipulator(ROOT / "arm15/arm15.toml"),
        load_manipulator(ROOT / "octahedron_general/octahedron_general.toml"),
    )
    shape = one.modules[0].model_dump() | {"joint_offset": 0.0, "block": None}
    shape |= {name: getattr(arm.modules[0], name) for name in ("longeron_tube", "batten_tube", "cylinder")}
    first, last = shape | {"name": "g1", "base": None}, shape | {"name": "g2", "base": None}
    last["longerons"] = last["longerons"][::-1]
    modules = [first, *(module.model_dump() for module in arm.modules[1:4]), last]
    return arm.model_validate(arm.model_dump() | {"modules": modules})


ARMS = {
    "tetrahedral": part("tetra4", "s1", "h1", "s5"),
    "octahedral": part("stewart"),
    "double_octahedral": part("octahedron_double"),
    "mixed, static longerons": part("mixed"),
    "double_octahedral_general": general(),
}


@cache
def sample(kind):
    """Inputs of the poses, once for all tests of a kind."""
    return sample_inputs(Chain(ARMS[kind], np.eye(4)), POSES, seed=8)


@pytest.mark.parametrize("kind", ARMS)
@pytest.mark.parametrize("moved", [False, True])
def test_loops_close_and_members_carry_axial_force_alone(kind, moved):
    arm, poses = ARMS[kind], sample(kind)
    found = stand(arm, poses[:3] if moved else poses, moved)
    assert found.closure.max() < CLOSURE
    assert found.agreement.max() < AGREEMENT
    assert found.moment.max() < END_MOMENT
    assert found.shear.max() < EXCESS_SHEAR
    assert found.axial.max() < AXIAL
    assert np.abs(found.forces).max() > 100.0


@pytest.mark.parametrize("kind", ARMS)
@pytest.mark.parametrize("moved", [False, True])
def test_members_without_mass_of_their_own_carry_no_shear_at_all(kind, moved):
    arm, poses = ARMS[kind], sample(kind)
    found = stand(arm, poses[:3] if moved else poses[:20], moved, lumped=True)
    assert found.closure.max() < CLOSURE
    assert found.agreement.max() < AGREEMENT
    assert found.moment.max() < END_MOMENT
    assert found.shear.max() < LUMPED_SHEAR
    assert found.axial.max() < AXIAL
    assert np.abs(found.forces).max() > 100.0
