from __future__ import annotations

import itertools
from types import SimpleNamespace

import numpy as np
import pytest

from vgtsim.description import Equipment
from vgtsim.errors import PathError
from vgtsim.kinematics import bend_all
from vgtsim.planning.carousel import Carousel, Net
from vgtsim.planning.path import plan_path
from vgtsim.planning.sampling import Ground, search, shorten_way
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import Surroundings, make_box

BENDS = np.radians([10.0, 32.0, 32.0, 25.0, 10.0])
MOST = 3000  # motions


def ground_of(chain, tank):
    return Ground(Corridor(make_box(chain, 0.005), Surroundings(chain, tank, 0.15, 0.4572), 0.10))


@pytest.fixture(scope="module")
def ground(hanging_arm, type_ii):
    return ground_of(hanging_arm, type_ii)


@pytest.fixture(scope="module")
def ends(hanging_arm):
    """Two postures between which neither swing nor its smoothing is clear: both ways round something stands."""
    return bend_all(hanging_arm, BENDS, -np.radians(110)), bend_all(hanging_arm, BENDS, -np.radians(10))


@pytest.fixture(scope="module")
def way(ground, ends):
    return search(ground, ends[0][None], ends[1][None], MOST)


def test_clear_configurations_are_those_of_the_exact_clearance(ground, hanging_arm):
    rng = np.random.default_rng(0)
    q = bend_all(hanging_arm, rng.uniform(-0.6, 0.6, (60, 5)), rng.uniform(-3, 3, (60, 1)))
    state = hanging_arm.state(q)
    q = q[state.assembles & (ground.corridor.box.spare(state.lengths).min(axis=1) > 0)]
    rows = ground.corridor.surroundings.rows(q, 0.10, slopes=False)
    expected = np.ones(len(q), bool)
    expected[rows.config] = False
    assert expected.any()
    assert not expected.all()
    assert np.array_equal(ground.clear(q), expected)
    first = int(np.argmin(expected))
    assert not ground.clear(q, all_of_them=True)[first:].any()


def test_a_configuration_outside_its_strokes_is_not_clear(ground, hanging_arm):
    bent = np.array(hanging_arm.straight)
    bent[2] *= 1.5
    assert not ground.clear(np.array([hanging_arm.straight * np.nan, bent])).any()


def test_a_search_joins_its_ends_by_clear_motions(ground, way, ends):
    np.testing.assert_allclose(way[[0, -1]], ends, atol=1e-12)
    for first, last in itertools.pairwise(way):
        fine = first + np.linspace(0, 1, 200)[:, None] * (last - first)
        assert ground.corridor.surroundings.clearance(fine)[0].min() > 0.08  # checked every 0.12 m, kept at 0.10 m


def test_the_same_search_gives_the_same_bits(ground, way, ends):
    assert np.array_equal(search(ground, ends[0][None], ends[1][None], MOST), way)
    other = search(ground, ends[0][None], ends[1][None], MOST, seed=2)
    assert other is None or not np.array_equal(other, way)


def test_a_search_gives_up_after_its_motions(ground, ends):
    before = ground.checked
    assert search(ground, ends[0][None], ends[1][None], 3) is None
    assert ground.checked - before <= 5


def test_a_way_is_made_shorter_and_keeps_its_ends(ground, ends):
    first = ends[0]
    aside = first + np.tile([0.02, 0.0, 0.0], 5)
    corners = np.array([first, aside, first + np.tile([0.0, 0.02, 0.0], 5)])
    short = shorten_way(ground, corners)
    assert np.allclose(short[[0, -1]], corners[[0, -1]], atol=1e-12)

    def length(way):
        return np.linalg.norm(np.diff(way, axis=0) * ground.scale, axis=1).sum()

    assert length(short) < length(corners) - 1e-3


def test_a_net_gives_its_shortest_way():
    stations = np.arange(5.0)[:, None]
    net = Net(stations, np.array([[0, 1, 0, 3], [1, 2, 2, 4]]), np.array([1.0, 1.0, 5.0, 1.0]))
    assert net.way(2, 0).ravel().tolist() == [2.0, 1.0, 0.0]
    assert net.way(1, 1).ravel().tolist() == [1.0]
    assert net.way(0, 4) is None


@pytest.mark.parametrize(("reached", "last"), [(True, 1_000), (False, 5_000)])
def test_a_last_search_is_short_where_it_has_no_prospect(monkeypatch, reached, last):
    """Both ends come to parts of the net that hang apart, or one does not come to it."""
    asked = []

    def search(_, starts, goals, most):
        asked.append(most)
        return np.array([starts[0], goals[0]]) if most == 5_000 and reached else None

    monkeypatch.setattr("vgtsim.planning.carousel.search", search)
    carousel = Carousel(SimpleNamespace(scale=np.ones(1)))
    net = Net(np.array([[0.0], [1.0], [9.0]]), np.array([[0], [1]]), np.array([1.0]))
    carousel.__dict__["net"] = net
    assert list(carousel.ways(np.zeros(1), np.full(1, 9.0))) == []
    assert asked == [1_000, *([5_000] * (1 + reached)), last]


@pytest.mark.long
def test_a_path_is_found_where_no_guess_is_clear(hanging_arm, type_ii):
    """Random postures past the observation well, a query that the guesses miss; the path is judged by other code."""
    ground = ground_of(hanging_arm, type_ii)
    rng = np.random.default_rng(0)
    carousel, solved = Carousel(ground), 0
    while solved < 12:
        q = bend_all(hanging_arm, rng.uniform(-0.08, 0.78, (2, 5)), rng.uniform(-3.1, 3.1, (2, 1)))
        if not ground.clear(q).all():
            continue
        path = plan_path(ground.corridor, *q, "query", carousel)
        samples = path.curve(np.linspace(0, 1, 777))
        assert ground.corridor.surroundings.clearance(samples)[0].min() > 0.09
        np.testing.assert_allclose(path.curve([0.0, 1.0]), q, atol=1e-12)
        solved += 1


@pytest.mark.long
def test_no_way_out_is_said_with_what_blocks_it(hanging_arm, type_ii, monkeypatch):
    for name in ("_LAST", "_LOCKED"):
        monkeypatch.setattr(f"vgtsim.planning.carousel.{name}", 500)
    fence = Equipment(name="fence", diameter=0.9, radius=3.2, azimuth=0.1, bottom=0.0, count=16)
    shut = type_ii.model_copy(update={"equipment": (*type_ii.equipment, fence)})
    ground = ground_of(hanging_arm, shut)
    straight = Carousel(ground)
    q = bend_all(hanging_arm, BENDS, [[-2.95], [0.2]])
    with pytest.raises(PathError) as caught:
        plan_path(ground.corridor, *q, "shut in", straight)
    assert caught.value.clearance < 0.10
    assert caught.value.place.startswith("fence_")
