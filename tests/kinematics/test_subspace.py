"""The subspace of static longerons and linear rows: what is brought into it is in it, near, and at a right angle."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.errors import AssemblyError
from vgtsim.kinematics import Subspace
from vgtsim.site import load_arm

IN = 1e-11  # m and rad


@pytest.fixture(scope="module")
def chain():
    return load_arm("mixed")


@pytest.fixture(scope="module")
def guesses(chain):
    return chain.straight + 0.05 * np.random.default_rng(4).uniform(-1, 1, (30, chain.layout.inputs))


def coupled(chain):
    """The two double octahedra, which lean together."""
    owner, names = chain.layout.owner, chain.layout.names
    first, second = (np.flatnonzero(owner == names.index(name)) for name in ("m1", "m2"))
    rows = np.eye(chain.layout.inputs)[first] - np.eye(chain.layout.inputs)[second]
    return Subspace(chain, rows, np.zeros(3))


def test_static_longerons_have_their_length_after_projection(chain, guesses):
    space = Subspace(chain)
    q = space.project(guesses)
    assert space.find_errors(guesses).max() > 1e-3
    assert chain.lengths(q).shape == (30, chain.layout.actuators)  # which refuses poses outside the subspace
    static = [i for i, member in enumerate(chain.truss.members) if member.name.startswith("w/longeron")]
    lengths, straight = (chain.truss.lengths(chain.nodes(x))[..., static] for x in (q, chain.straight))
    assert np.abs(lengths - straight).max() < IN
    assert np.abs(q - guesses).max() < 0.1


def test_directions_stay_in_it_to_first_order_and_actuators_move_along_all_of_them(chain, guesses):
    for space in (Subspace(chain), coupled(chain)):
        q = space.project(guesses)
        basis = space.basis(chain.state(q))
        assert np.swapaxes(basis, 1, 2) @ basis == pytest.approx(
            np.broadcast_to(np.eye(basis.shape[2]), (30, *basis.shape[2:], basis.shape[2])), abs=1e-12
        )
        assert basis.shape[2] == chain.layout.actuators - 3 * (len(space.values) > 0)
        for column in np.moveaxis(basis, 2, 0):
            assert space.find_errors(q + 1e-6 * column).max() < 1e-11
        slopes = chain.length_jacobian(q)[1] @ basis
        assert np.linalg.svd(slopes, compute_uv=False).min() > 1e-3


def test_coupled_inputs_are_equal_after_projection(chain, guesses):
    space = coupled(chain)
    q = space.project(guesses)
    assert space.find_errors(q).max() < IN
    assert np.abs(q @ space.rows.T).max() < IN
    assert Subspace(chain).find_errors(q).max() < IN


def test_inputs_in_it_stay(chain, guesses):
    space = Subspace(chain)
    q = space.project(guesses)
    assert np.array_equal(space.project(q), q)


def test_a_pose_with_nothing_near_is_refused(chain):
    far = np.array(chain.straight)
    far[-6:-3] *= 40.0
    rows = np.eye(len(far))[-4:-3]  # its height is held
    with pytest.raises(AssemblyError, match="no pose near that keeps static longerons"):
        Subspace(chain, rows, far[-4:-3]).project(far[None])


def test_an_arm_without_static_longerons_uses_all_inputs(hanging_arm):
    space, q = Subspace(hanging_arm), hanging_arm.straight[None] + 0.1
    assert space.whole
    assert space.project(q) is q
