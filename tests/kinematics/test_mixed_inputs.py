"""Mixed inputs: both pure cases are the chain's own, any mix agrees with differences, and names are checked."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.mixed_inputs import mix_inputs
from vgtsim.description import load_manipulator
from vgtsim.errors import DescriptionError, SingularityError
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs

ROOT = Path(__file__).parents[2] / "models"
MIXES = {
    "tetra4": ("h2", "h4"),
    "octahedron_double": ("m",),
    "arm9": ("m2",),
    "arm30": ("p2", "p5"),
    "mixed": ("h1", "w"),
}
EXACT = 1e-10  # m and rad: rounding over a chain


@pytest.fixture(scope="module", params=MIXES)
def mixed(request):
    arm = load_manipulator(ROOT / request.param / f"{request.param}.toml")
    return mix_inputs(Chain(arm, hanging_mount(9.0)), MIXES[request.param])


@pytest.fixture(scope="module")
def q(mixed):
    return sample_inputs(mixed.chain, 3, seed=14, part=0.8)


def test_each_module_takes_as_many_inputs_as_it_has(mixed):
    for share in mixed.shares:
        module = next(item for item in mixed.chain.manipulator.modules if item.name == share.name)
        canonical = {"tetrahedral": 1, "double_octahedral": 3, "octahedral": 6}[module.kind]
        conventional = len(module.actuated) if module.kind == "octahedral" else canonical
        assert share.own.stop - share.own.start == (conventional if share.name in mixed.conventional else canonical)


def test_forward_undoes_the_row(mixed, q):
    y = mixed.from_canonical(q)
    assert np.allclose(mixed.canonical(y), q, atol=EXACT)
    assert np.allclose(mixed.canonical(y, q[::-1]), q, atol=EXACT)
    assert np.allclose(mixed.canonical(y.reshape(3, 1, -1))[:, 0], q, atol=EXACT)


def test_all_of_one_kind_is_the_chain_s_own(mixed, q):
    chain = mixed.chain
    lengths, plain = mix_inputs(chain, chain.layout.names), mix_inputs(chain, ())
    order = np.concatenate([share.actuators for share in lengths.shares])
    assert np.allclose(lengths.from_canonical(q), chain.lengths(q)[:, order], atol=EXACT)
    assert np.array_equal(plain.from_canonical(q), q)


def test_lengths_beyond_a_singularity_are_refused():
    chain = Chain(load_manipulator(ROOT / "arm9/arm9.toml"), hanging_mount(9.0))
    mixed = mix_inputs(chain, ["m2"])
    y = mixed.from_canonical(chain.straight)
    y[mixed.shares[1].own] = [1.0, 1.0, 1.9]
    with pytest.raises(SingularityError, match="m2"):
        mixed.canonical(y)


def test_other_names_and_shapes_are_refused():
    chain = Chain(load_manipulator(ROOT / "arm9/arm9.toml"), hanging_mount(9.0))
    with pytest.raises(DescriptionError, match=r"'s1'; allowed: an active module of arm9.*known: m1, m2, m3"):
        mix_inputs(chain, ["s1"])
    with pytest.raises(ValueError, match=r"takes \(\.\.\., 9\)"):
        mix_inputs(chain, ["m1"]).canonical(np.zeros(8))
