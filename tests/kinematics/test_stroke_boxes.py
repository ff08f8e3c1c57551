"""Strokes that hold a singularity: found between corners that are fine, and what is called clear is clear."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import numpy as np
import pytest

from studies.double_octahedron import MirrorModule
from vgtsim.description import load_manipulator
from vgtsim.description.catalogue import INCH
from vgtsim.errors import SingularityError
from vgtsim.kinematics import Chain, check_strokes
from vgtsim.kinematics.closure import angle_jacobian, closure_coefficients
from vgtsim.kinematics.mode_following import certify_box
from vgtsim.kinematics.modules import find_singular
from vgtsim.kinematics.modules import octahedron as single
from vgtsim.kinematics.modules import two_cells as cells
from vgtsim.kinematics.modules.octahedral import Octahedra
from vgtsim.kinematics.modules.stroke_boxes import prove_strokes, search_strokes
from vgtsim.kinematics.roll_pitch_yaw import pose_parameters

MODELS = sorted((Path(__file__).parents[2] / "models").glob("*/*.toml"))
LONG = MirrorModule(1.0, 1.5931)  # longerons much longer than the face
SKEW_LEGS, SKEW_LENGTH = (1, 3, 4), 0.786


def whole(geometry):
    """A set of one module."""
    return geometry.own


def box(middle, part, count=3):
    return np.full(count, middle * (1 - part)), np.full(count, middle * (1 + part))


def corners(low, high):
    return np.where(np.array(list(product((False, True), repeat=len(low)))), high, low)


def general_arm(**cylinder):
    arm = load_manipulator(Path(__file__).parents[2] / "models/octahedron_general/octahedron_general.toml")
    part = arm.cylinders["c400"].model_copy(update=cylinder)
    return Chain(arm.model_copy(update={"cylinders": {"c400": part}}), np.eye(4))


@pytest.fixture(scope="module")
def skew():
    """Three cylinders and three static longerons under a small top."""
    static = tuple(None if i in SKEW_LEGS else SKEW_LENGTH for i in range(6))
    geometry = single.OctahedronGeometry((1.0, 1.0, 1.0), (0.633, 0.633, 0.633), static)
    straight = pose_parameters(*single.forward(geometry, np.full(6, SKEW_LENGTH)))
    return Octahedra(("p",), straight[None], (geometry,)), straight


def reached(own, straight, lengths):
    legs = np.full((len(lengths), 1, 6), SKEW_LENGTH)
    legs[:, 0, own.actuated[0]] = lengths
    return own.attempt(legs, straight[None])[1]


@pytest.mark.long
@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_strokes_of_shipped_arms_are_clear(path):
    check_strokes(Chain(load_manipulator(path), np.eye(4)))


@pytest.mark.long
def test_double_octahedron_fine_at_its_corners_is_refused_for_what_lies_between():
    """Its longest actuator may pass its flat length only while the others are half out."""
    middle, half = 0.777 * np.sqrt(3) * (LONG.height + LONG.apothem), np.array([0.2869, 0.0434, 0.2122])
    low, high = middle * (1 - half), middle * (1 + half)
    assert whole(LONG).attempt(corners(low, high)[:, None], None)[1].min() == 1.0
    with pytest.raises(SingularityError, match=r"m does not assemble.*smallest singular value .* m/actuator/\d"):
        prove_strokes(whole(LONG), low, high)


def test_octahedron_fine_at_its_corners_is_refused_for_what_lies_between(skew):
    own, straight = skew
    low, high = box(SKEW_LENGTH, 0.315)
    assert reached(own, straight, corners(low, high)).min() == 1.0
    with pytest.raises(SingularityError, match=r"p does not assemble.*smallest singular value 0\.0.* p/actuator/\d"):
        search_strokes(own, low, high)


@pytest.mark.long
def test_general_double_octahedron_is_refused_for_a_corner_of_its_strokes():
    """Two actuators out and one in lay a cell flat: a single way there, without the search, ends at the same place."""
    chain = general_arm(retracted=33 * INCH, stroke=25 * INCH)
    low, high = chain.stroke
    with pytest.raises(SingularityError):
        chain.inputs_from_lengths(np.array([high[0], high[1], low[2]]))
    with pytest.raises(SingularityError, match=r"m does not assemble.*smallest singular value .* m/\w+/\d"):
        check_strokes(chain)


def test_value_of_a_general_double_octahedron_is_that_of_its_nearer_cell():
    chain = general_arm()
    own, rng = chain.layout.places[0].modules, np.random.default_rng(3)
    x = own.solve(rng.uniform(*chain.stroke, (40, 1, 3)), None)
    states = own.states(x)[:, 0]
    one_by_one = [cells.singularity(own.geometries[0], state)[0] for state in states]
    assert np.allclose(own.find_least(x)[:, 0], one_by_one, atol=1e-12)


@pytest.mark.long
def test_searched_value_is_below_that_of_many_more_samples(skew):
    """What a hundred times denser sample finds is no nearer to a singularity."""
    own, straight = skew
    low, high = box(SKEW_LENGTH, 0.28)
    found = search_strokes(own, low, high)
    legs = np.full((20000, 1, 6), SKEW_LENGTH)
    legs[:, 0, own.actuated[0]] = np.random.default_rng(1).uniform(low, high, (20000, 3))
    x, part = own.attempt(legs, straight[None])
    assert part.min() == 1.0
    assert 0 < found <= find_singular(own, x)[0].min()


@pytest.mark.parametrize("seed", range(6))
def test_what_is_proved_can_be_reached_everywhere(seed):
    rng = np.random.default_rng(seed)
    geometry = MirrorModule(1.0, rng.uniform(0.8, 1.5))
    widest = float(np.sqrt(3) * (geometry.height + geometry.apothem))
    low, high = box(rng.uniform(0.45, 0.65) * widest, 0.15)
    assert prove_strokes(whole(geometry), low, high) >= 8**3
    own = whole(geometry)
    x, part = own.attempt(rng.uniform(low, high, (3000, 1, 3)), None)
    assert part.min() == 1.0
    assert find_singular(own, x)[0].min() > 0


def test_lengths_that_turn_the_mid_plane_over_are_not_called_reached():
    """Its inputs (u_x, u_y, d) take the normal's z component for positive: lengths that need another come back wrong."""
    own, rng = whole(LONG), np.random.default_rng(4)
    lengths = rng.uniform(1.2, 3.2, (4000, 1, 3))
    lengths = lengths[(2 * lengths.max(axis=-1) < 0.99 * lengths.sum(axis=-1))[:, 0]]
    x, part = own.attempt(lengths, None)
    done = part[:, 0] == 1.0
    assert 100 < done.sum() < len(done)
    assert np.allclose(own.at(x[done]).legs[0], lengths[done], atol=1e-8)


def test_flat_module_is_refused():
    """Three equal actuators of sqrt(3) (h + apothem) lay the longerons flat: beyond that there is no assembly."""
    widest = float(np.sqrt(3) * (LONG.height + LONG.apothem))
    with pytest.raises(SingularityError):
        prove_strokes(whole(LONG), np.full(3, 0.7 * widest), np.full(3, 1.001 * widest))


def test_ball_of_a_box_holds_the_assemblies_of_its_points():
    rng = np.random.default_rng(2)
    geometry, own = MirrorModule(1.0, 1.0), whole(MirrorModule(1.0, 1.0))
    centre, half = rng.uniform(1.2, 1.8, (50, 3)) ** 2, np.full(3, 0.02)
    x = own.solve(np.sqrt(centre)[:, None], None)
    phi = own.angles(x)[:, 0]
    circles = geometry.geometry.circles
    radius, quality = certify_box(closure_coefficients(circles, np.sqrt(centre)[:, None]).reshape(5, 3, -1), half, phi)
    sure = quality <= 0.5
    assert 10 < sure.sum() < 50 or sure.all()
    for _ in range(20):
        point = np.sqrt(centre + half * rng.uniform(-1, 1, centre.shape))
        there = own.angles(own.solve(point[:, None], x))[:, 0]
        assert np.all(np.abs(there - phi).max(axis=1)[sure] <= radius[sure])
        assert np.abs(angle_jacobian(circles, there[:, None])[:, 0][sure]).max() > 0
        assert np.abs(np.linalg.det(angle_jacobian(circles, there[:, None])[:, 0]))[sure].min() > 1e-3


def test_box_with_a_singularity_is_never_certified():
    """A box about nearly flat lengths reaches beyond them."""
    geometry, own = MirrorModule(1.0, 1.0), whole(MirrorModule(1.0, 1.0))
    widest = float(np.sqrt(3) * (geometry.height + geometry.apothem))
    length = np.full((1, 3), 0.995 * widest)
    phi = own.angles(own.solve(length[:, None], None))[:, 0]
    reach = widest**2 - length[0] ** 2
    C = closure_coefficients(geometry.geometry.circles, length[:, None]).reshape(5, 3, -1)
    assert certify_box(C, reach, phi)[1][0] > 0.5
    assert certify_box(C, reach / 20, phi)[1][0] <= 0.5


def test_strokes_of_other_figures_alone_are_proved_anew(monkeypatch):
    proved = []
    monkeypatch.setattr(
        "vgtsim.kinematics.modules.double_octahedral.prove_strokes", lambda *asked: proved.append(asked)
    )
    arm = load_manipulator(Path(__file__).parents[2] / "models/arm15/arm15.toml")
    for part in (0.9871, 0.9871, 0.9872):  # strokes that no other test has
        cylinders = {
            key: cylinder.model_copy(update={"stroke": part * cylinder.stroke})
            for key, cylinder in arm.cylinders.items()
        }
        check_strokes(Chain(arm.model_copy(update={"cylinders": cylinders}), np.eye(4)))
    assert len(proved) == 2
