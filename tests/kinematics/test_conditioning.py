"""Singular matrices are told by a figure, whatever the processor, the units and the way they come to be singular."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studies.octahedron import twist_jacobian
from vgtsim.description import load_manipulator
from vgtsim.errors import NearSingularWarning, SingularPoseError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.conditioning import POOR, SINGULAR, invert, invert_sound
from vgtsim.kinematics.modules import octahedron as longeron
from vgtsim.kinematics.ties import first_greatest, first_least, order_down

MODELS = Path(__file__).parents[2] / "models"


def turned(sine, seed, n=3):
    """Matrix whose last column is at that sine from the span of the others, in columns of very different units."""
    Q = np.linalg.qr(np.random.default_rng(seed).standard_normal((n, n)))[0]
    columns = np.array(Q)
    columns[:, -1] = np.sqrt(1 - sine**2) * Q[:, 0] + sine * Q[:, -1]
    return columns * np.logspace(-4, 5, n)


@pytest.mark.parametrize("sine", [1e-8, 1e-5])
@pytest.mark.parametrize("n", [2, 3, 6, 9])
def test_sine_of_a_column_is_found_whatever_the_units(sine, n):
    matrix = np.stack([turned(sine, seed, n) for seed in range(5)])
    _, found = invert(matrix, 0.0)
    assert found == pytest.approx(np.full(5, sine), rel=1e-5)


def test_singular_matrix_is_refused_by_whichever_road():
    """Exactly singular, singular but for rounding, and not a number: NumPy raises at the first, and is content with the rest."""
    exact, third = np.ones((3, 3)), np.arange(9.0).reshape(3, 3) / 3
    for bad in (exact, third, np.zeros((3, 3)), np.full((3, 3), np.nan), np.full((3, 3), np.inf), turned(1e-12, 4)):
        batch = np.stack([np.eye(3), bad, np.eye(3)])
        with pytest.raises(SingularPoseError, match=r"m1 is singular: .* allowed 1e-09") as caught:
            invert_sound(batch, 1.0, lambda where: f"m{where[0]}")
        assert caught.value.value < SINGULAR


def test_poor_matrix_is_warned_of_with_its_figure():
    with pytest.warns(NearSingularWarning, match=r"m0: smallest sine 3e-08"):
        invert_sound(turned(0.3 * POOR, 2)[None], 0.0, lambda where: f"m{where[0]}")
    invert_sound(turned(3 * POOR, 2)[None], 0.0, lambda where: f"m{where[0]}")


def test_flat_module_of_a_chain_is_named():
    """A hinge stretched out: its actuator lies along its base, and its length does not change to first order."""
    chain = Chain(load_manipulator(MODELS / "tetra4/tetra4.toml"), hanging_mount(0.0))
    place = chain.layout.places[0]
    row = np.array(chain.straight)
    row[place.columns[1]] = np.pi
    with pytest.raises(SingularPoseError, match=place.modules.names[1]):
        chain.input_rates(row)
    with pytest.raises(SingularPoseError, match=place.modules.names[1]):
        chain.conventional_jacobian(row)


def test_flat_octahedron_is_named():
    """Face in face, no longeron resists a motion out of the plane: three columns vanish, and no two are alike."""
    geometry = longeron.OctahedronGeometry((0.80, 0.85, 0.90), (0.70, 0.75, 0.65))
    for height in (0.0, 1e-17):
        with pytest.raises(SingularPoseError, match="octahedron is singular"):
            twist_jacobian(geometry, np.eye(3), np.array([0, 0, height]))


def test_first_of_equals():
    rounding = 1 + 4e-16 * np.array([1, -1, 2, 0])
    assert first_greatest(rounding) == first_least(rounding) == 0
    assert first_greatest([1.0, 2.0, 2.0 + 1e-6]) == 2
    assert first_greatest([[1.0, np.nan], [3.0, 2.0]]) == 1
    assert first_least([[2.0, 1.0], [1.0 + 1e-15, 1.0]], axis=-1).tolist() == [1, 0]
    assert order_down([1.0, 3.0, 1.0 + 1e-15, 3.0 - 1e-15, 2.0]).tolist() == [1, 3, 4, 0, 2]
    assert order_down([]).tolist() == []
