"""The force scale is symmetric: sign is hue, magnitude is depth."""

import numpy as np
import pytest

from vgtsim.output.colours import force_colours, scale_end

LUMA = np.array([0.299, 0.587, 0.114, 0.0])  # ITU-R BT.601
NEUTRAL = 1e-12  # grey means equal channels
BALANCE = 0.12  # the two ends differ in lightness by less than this part of full scale


def test_zero_is_grey():
    assert np.ptp(force_colours(0.0, 5.0)[:3]) < NEUTRAL


def test_hue_tells_the_sign():
    force = np.linspace(0.02, 1.0, 50) * 3e5
    tension, compression = force_colours(force, 3e5), force_colours(-force, 3e5)
    assert (tension[:, 2] > tension[:, 0]).all()
    assert (compression[:, 0] > compression[:, 2]).all()


def test_opposite_forces_are_equally_dark_and_darker_when_greater():
    force = np.linspace(0.0, 1.0, 101)
    tension, compression = force_colours(force, 1.0) @ LUMA, force_colours(-force, 1.0) @ LUMA
    assert (np.diff(tension) < 0).all()
    assert (np.diff(compression) < 0).all()
    assert np.abs(tension - compression).max() < BALANCE


def test_forces_beyond_the_scale_keep_the_end_colour():
    np.testing.assert_array_equal(force_colours([-9.0, 9.0], 2.0), force_colours([-2.0, 2.0], 2.0))


def test_shape_is_kept():
    assert force_colours(np.zeros((3, 4)), 1.0).shape == (3, 4, 4)


@pytest.mark.parametrize(("force", "end"), [([-286298.0, 172018.0], 290e3), ([1e5, -3.0], 1e5), ([0.0], 1.0)])
def test_scale_covers_both_signs_with_a_round_figure(force, end):
    assert scale_end(force) == pytest.approx(end)


def test_missing_forces_do_not_set_the_scale():
    assert scale_end([np.nan, -40.0]) == pytest.approx(40.0)
