"""Trusses worked out in D. L. Logan, A First Course in the Finite Element Method, chapter 3, in the book's own units.

Displacements and stresses are the book's, as well as its hand calculation holds them.
"""

from __future__ import annotations

import numpy as np
import pytest

from studies.frameworks import deflect_framework, make_framework

PRINTED = 5e-3  # relative: three digits, the last one rounded
BY_HAND = 1.5e-2  # relative: the book's space truss goes on with direction cosines of two digits


def solved(places, bars, supports, area, modulus, load):
    """Displacements, in, and stresses, psi, of a truss of areas, in², under a load on its first node, lb."""
    nodes = np.array(list(places.values()), float)
    frame = make_framework(list(places), bars, supports)
    ends = nodes[frame.ends]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    force = np.zeros(nodes.shape)
    force[0] = load
    moved, bar = deflect_framework(frame, nodes, np.array(area) * modulus / length, force)
    return moved, bar / area


def test_plane_truss_of_three_bars():
    """10,000 lb down on a node held by a vertical, a diagonal and a horizontal bar; one bar more than needed."""
    places = {"1": (0, 0, 0), "2": (0, 120, 0), "3": (120, 120, 0), "4": (120, 0, 0)}
    supports = {"1": "z", "2": "xyz", "3": "xyz", "4": "xyz"}
    bars = [("1", "2"), ("1", "3"), ("1", "4")]
    moved, stress = solved(places, bars, supports, [2.0] * 3, 30e6, (0, -10_000, 0))
    assert moved[0, :2] == pytest.approx([0.414e-2, -1.59e-2], rel=PRINTED)
    assert stress == pytest.approx([3965, 1471, -1035], rel=PRINTED)


def test_space_truss_of_three_bars():
    """1000 lb along -z on a node that a roller keeps from moving along y."""
    places = {"1": (72, 0, 0), "2": (0, 36, 0), "3": (0, 36, 72), "4": (0, 0, -48)}
    supports = {"1": "y", "2": "xyz", "3": "xyz", "4": "xyz"}
    bars = [("1", "2"), ("1", "3"), ("1", "4")]
    moved, stress = solved(places, bars, supports, [0.302, 0.729, 0.187], 1.2e6, (0, 0, -1000))
    assert moved[0] == pytest.approx([-0.072, 0.0, -0.264], rel=BY_HAND)
    area = np.array([0.302, 0.729, 0.187])
    along = np.array([[-72, 36, 0], [-72, 36, 72], [-72, 0, -48]], float)
    pull = (stress * area) @ (along / np.linalg.norm(along, axis=1, keepdims=True))
    assert pull[[0, 2]] == pytest.approx([0, 1000], abs=1e-6)  # y is the roller's
