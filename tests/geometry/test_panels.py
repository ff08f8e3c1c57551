from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import KDTree

from vgtsim.description import load_tank
from vgtsim.geometry.clearance import enclosure_distance, interior_distance
from vgtsim.geometry.panels import DEPTH, TOLERANCE, make_panels
from vgtsim.geometry.profile import make_profile

pytestmark = pytest.mark.long

TANK = load_tank(Path(__file__).parents[2] / "scenes/tanks/type_ii.toml")
FLAT = TANK.model_copy(update={"shell": TANK.shell.model_copy(update={"dish_depth": 0.0})})
TALL = TANK.model_copy(update={"shell": TANK.shell.model_copy(update={"wall_top": 9.5, "crown": 13.4})})
BORE = TANK.arm_riser.bore / 2

ROUNDING = 1e-9  # m
# m; the tolerance for sectors and the tolerance for rings, and a twentieth for second order
STANDS_BACK = 2.1 * TOLERANCE


def in_panels(panels, points):
    hit, tree = np.zeros(len(points), bool), KDTree(points)
    for panel in panels:
        near = np.array(tree.query_ball_point(panel.centre, np.linalg.norm(panel.half)), int)
        near = near[~hit[near]]
        hit[near] = np.all(np.abs((points[near] - panel.centre) @ panel.axes) <= panel.half, axis=1)
    return hit


def surface_points(profile, count, seed):
    rng = np.random.default_rng(seed)
    curve = profile.points(0.02)
    curve = curve[(curve[:, 0] > BORE + STANDS_BACK) | (curve[:, 1] < 5)]
    curve = curve[rng.integers(0, len(curve), count)]
    turn = rng.uniform(0, 2 * np.pi, count)
    return np.stack([curve[:, 0] * np.cos(turn), curve[:, 0] * np.sin(turn), curve[:, 1]], -1)


@pytest.mark.parametrize("tank", [TANK, FLAT, TALL], ids=["dished", "flat", "tall"])
def test_no_panel_comes_inside_tank_or_riser(tank):
    profile = make_profile(tank.shell)
    panels = make_panels(tank, profile)
    rng = np.random.default_rng(1)
    points = rng.uniform([-11.5, -11.5, 0], [11.5, 11.5, 15], (30_000, 3))
    near = surface_points(profile, 20_000, 2)
    near = near + interior_distance(profile, near)[1] * rng.uniform(ROUNDING, 0.01, (len(near), 1))
    bore = rng.uniform([-BORE, -BORE, 8], [BORE, BORE, 14], (5_000, 3))
    points = np.concatenate([points, near, bore])
    inside = enclosure_distance(tank, profile, points)[0] > ROUNDING
    assert inside.sum() > 30_000
    assert not in_panels(panels, points[inside]).any()


@pytest.mark.parametrize("tank", [TANK, FLAT, TALL], ids=["dished", "flat", "tall"])
def test_panels_leave_no_hole(tank):
    profile = make_profile(tank.shell)
    panels = make_panels(tank, profile)
    points = surface_points(profile, 10_000, 3)
    outward = -interior_distance(profile, points)[1]
    for depth in np.linspace(STANDS_BACK, DEPTH - TOLERANCE, 6):
        assert in_panels(panels, points + depth * outward).all()
    rng = np.random.default_rng(4)
    turn, height = rng.uniform(0, 2 * np.pi, 5000), rng.uniform(profile.crown, profile.crown + 2.4, 5000)
    pipe = BORE + rng.uniform(STANDS_BACK, DEPTH - TOLERANCE, 5000)
    assert in_panels(panels, np.stack([pipe * np.cos(turn), pipe * np.sin(turn), height], -1)).all()


def test_a_coarser_enclosure_takes_fewer_panels(monkeypatch):
    profile, counts = make_profile(TANK.shell), []
    for tolerance in (0.01, 0.02, 0.05):
        monkeypatch.setattr("vgtsim.geometry.panels.TOLERANCE", tolerance)
        counts.append(len(make_panels(TANK, profile)))
    assert counts == sorted(counts, reverse=True)
    fine = sum(panel.name.startswith(("rim", TANK.arm_riser.name)) for panel in make_panels(TANK, profile))
    assert counts[2] - fine < 300


def test_panels_are_right_handed_and_have_names_of_their_own():
    panels = make_panels(TANK, make_profile(TANK.shell))
    assert len({panel.name for panel in panels}) == len(panels)
    for panel in panels:
        assert np.allclose(panel.axes.T @ panel.axes, np.eye(3), atol=ROUNDING)
        assert np.linalg.det(panel.axes) > 0
        assert panel.half.min() > 0
