"""Frameworks of the textbooks against their closed forms, each derived where it is used; loads are in kN, lengths in m."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studies.frameworks import deflect_framework, make_framework, solve_joints, tangent_stiffness
from vgtsim.errors import DescriptionError, TrussError
from vgtsim.statics import diagnose
from vgtsim.statics.framework import framework_of

ROUNDING = 1e-10  # of the largest force
PANELS = 8


def plane(nodes, bars, pin, roller):
    """A truss in the x-z plane: held along y everywhere, at a pin, and along z at a roller."""
    supports = dict.fromkeys(nodes, "y") | {pin: "xyz", roller: "yz"}
    return make_framework(list(nodes), bars, supports), np.array(list(nodes.values()), float)


def loads(frame, **at):
    force = np.zeros((len(frame.nodes), 3))
    for name, vector in at.items():
        force[frame.nodes.index(name)] = vector
    return force


def beam(at, panel, count):
    """Bending moments at the joints and shears in the panels of a simple beam under point loads at its joints."""
    x, weight = panel * np.arange(count + 1), np.array(at, float)
    left = np.sum(weight * (x[-1] - x)) / x[-1]
    moment = left * x - np.array([np.sum(weight[:i] * (x[i] - x[:i])) for i in range(count + 1)])
    shear = left - np.cumsum(weight)[:-1]
    return left, moment, shear


def warren(count=PANELS, side=2.0):
    """Equilateral triangles: lower joints L0 to Ln, upper joints U1 to Un over the panels."""
    height = side * np.sqrt(0.75)
    nodes = {f"L{i}": (side * i, 0, 0) for i in range(count + 1)}
    nodes |= {f"U{i}": (side * (i - 0.5), 0, height) for i in range(1, count + 1)}
    bars = [(f"L{i}", f"L{i + 1}") for i in range(count)] + [(f"U{i}", f"U{i + 1}") for i in range(1, count)]
    bars += [pair for i in range(1, count + 1) for pair in ((f"L{i - 1}", f"U{i}"), (f"U{i}", f"L{i}"))]
    return plane(nodes, bars, "L0", f"L{count}"), height


def solved(frame, nodes, force):
    bar, support = solve_joints(frame, nodes, force)
    return dict(zip(frame.bars, bar, strict=True)), dict(zip(frame.nodes, support, strict=True))


def test_warren_truss_by_sections():
    """Through panel i: about the upper joint the lower chord has M / h, about a lower joint the upper chord has -M / h;
    the diagonals have the shear over sin 60 degrees."""
    (frame, nodes), height = warren()
    weight = np.array([0, 10, 20, 5, 0, 40, 10, 25, 0.0])
    force = loads(frame, **{f"L{i}": (0, 0, -w) for i, w in enumerate(weight)})
    bar, support = solved(frame, nodes, force)
    left, moment, shear = beam(weight, 2.0, PANELS)
    assert support["L0"] == pytest.approx([0, 0, left])
    assert support[f"L{PANELS}"] == pytest.approx([0, 0, weight.sum() - left])
    for i in range(PANELS):
        middle = (moment[i] + moment[i + 1]) / 2
        assert bar[f"L{i}-L{i + 1}"] == pytest.approx(middle / height)
        assert bar[f"L{i}-U{i + 1}"] == pytest.approx(-shear[i] / np.sqrt(0.75))
        assert bar[f"U{i + 1}-L{i + 1}"] == pytest.approx(shear[i] / np.sqrt(0.75))
        if i:
            assert bar[f"U{i}-U{i + 1}"] == pytest.approx(-moment[i] / height)


def rectangular(count, side, height):
    nodes = {f"{row}{i}": (side * i, 0, level) for row, level in (("L", 0), ("U", height)) for i in range(count + 1)}
    bars = [(f"{row}{i}", f"{row}{i + 1}") for row in "LU" for i in range(count)]
    return nodes, bars


@pytest.mark.parametrize("kind", ["howe", "pratt"])
def test_howe_and_pratt_trusses_by_sections(kind):
    """Parallel chords h apart: chords M / h about the joint where the others meet, diagonals shear over sine."""
    side, height = 3.0, 4.0
    nodes, bars = rectangular(PANELS, side, height)
    bars += [(f"L{i}", f"U{i}") for i in range(PANELS + 1)]
    falls = [(i < PANELS // 2) == (kind == "pratt") for i in range(PANELS)]  # from upper left to lower right
    diagonals = [(f"U{i}", f"L{i + 1}") if down else (f"L{i}", f"U{i + 1}") for i, down in enumerate(falls)]
    frame, place = plane(nodes, bars + diagonals, "L0", f"L{PANELS}")
    weight = np.array([0, 12, 7, 30, 18, 0, 9, 21, 0.0])
    bar, _ = solved(frame, place, loads(frame, **{f"L{i}": (0, 0, -w) for i, w in enumerate(weight)}))
    _, moment, shear = beam(weight, side, PANELS)
    sine = height / np.hypot(side, height)
    for i, down in enumerate(falls):
        lower, upper = (moment[i], moment[i + 1]) if down else (moment[i + 1], moment[i])
        assert bar[f"L{i}-L{i + 1}"] == pytest.approx(lower / height, abs=1e-9)
        assert bar[f"U{i}-U{i + 1}"] == pytest.approx(-upper / height, abs=1e-9)
        assert bar["-".join(diagonals[i])] == pytest.approx((1 if down else -1) * shear[i] / sine)


def test_k_truss_by_sections():
    """A panel's two diagonals meet at the middle of a vertical, where nothing else pulls along the chords: they carry half
    the shear each, one pulled and one pushed, and both chords have M / h about that point."""
    side, height = 3.0, 4.0
    nodes, bars = rectangular(PANELS, side, height)
    nodes |= {f"M{i}": (side * i, 0, height / 2) for i in range(1, PANELS)}
    bars += [("L0", "U0"), (f"L{PANELS}", f"U{PANELS}"), (f"U{PANELS - 1}", f"L{PANELS}")]
    for i in range(1, PANELS):
        bars += [(f"L{i}", f"M{i}"), (f"M{i}", f"U{i}"), (f"L{i - 1}", f"M{i}"), (f"U{i - 1}", f"M{i}")]
    frame, place = plane(nodes, bars, "L0", f"L{PANELS}")
    weight = np.array([0, 12, 7, 30, 18, 0, 9, 21, 0.0])
    bar, _ = solved(frame, place, loads(frame, **{f"L{i}": (0, 0, -w) for i, w in enumerate(weight)}))
    _, moment, shear = beam(weight, side, PANELS)
    sine = height / 2 / np.hypot(side, height / 2)
    for i in range(1, PANELS):
        assert bar[f"U{i - 1}-M{i}"] == pytest.approx(shear[i - 1] / (2 * sine), abs=1e-9)
        assert bar[f"L{i - 1}-M{i}"] == pytest.approx(-shear[i - 1] / (2 * sine), abs=1e-9)
        assert bar[f"L{i - 1}-L{i}"] == pytest.approx(moment[i] / height, abs=1e-9)
        assert bar[f"U{i - 1}-U{i}"] == pytest.approx(-moment[i] / height, abs=1e-9)


def ring(count, radius, height, turn=0.0):
    angle = 2 * np.pi * np.arange(count) / count + turn
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)], axis=-1)


def test_tripod():
    """Legs of length L from feet at radius r to an apex at height h: -W L / (3 h) each under a weight W, and
    -2 H L cos(azimuth) / (3 r) under a side load H along x."""
    radius, height = 2.0, 5.0
    feet = ring(3, radius, 0.0, 0.3)
    names = ["A", "B", "C", "top"]
    frame = make_framework(names, [(name, "top") for name in "ABC"], dict.fromkeys("ABC", "xyz"))
    nodes = np.vstack([feet, [[0, 0, height]]])
    length, azimuth = np.hypot(radius, height), 2 * np.pi * np.arange(3) / 3 + 0.3
    bar, _ = solve_joints(frame, nodes, loads(frame, top=(0, 0, -30)))
    assert bar == pytest.approx(np.full(3, -30 * length / (3 * height)))
    bar, support = solve_joints(frame, nodes, loads(frame, top=(12, 0, 0)))
    assert bar == pytest.approx(-2 * 12 * length * np.cos(azimuth) / (3 * radius))
    assert support.sum(axis=0) == pytest.approx([-12, 0, 0])


@pytest.mark.parametrize("sides", [5, 6, 8])
def test_schwedler_dome_under_equal_weights(sides):
    """One tier: ribs -W L / h; the ring -W (R - r) / (2 h sin(pi / n)), which keeps the ribs' tops apart; diagonals idle."""
    low, high, height, weight = 6.0, 3.0, 2.0, 25.0
    nodes = np.vstack([ring(sides, low, 0.0), ring(sides, high, height)])
    names = [f"{row}{i}" for row in "BT" for i in range(sides)]
    ribs = [(f"B{i}", f"T{i}") for i in range(sides)]
    hoops = [(f"T{i}", f"T{(i + 1) % sides}") for i in range(sides)]
    diagonals = [(f"B{i}", f"T{(i + 1) % sides}") for i in range(sides)]
    frame = make_framework(names, [*ribs, *hoops, *diagonals], {f"B{i}": "xyz" for i in range(sides)})
    bar, support = solve_joints(frame, nodes, loads(frame, **{f"T{i}": (0, 0, -weight) for i in range(sides)}))
    rib, hoop, diagonal = bar.reshape(3, sides)
    assert rib == pytest.approx(np.full(sides, -weight * np.hypot(low - high, height) / height))
    assert hoop == pytest.approx(np.full(sides, -weight * (low - high) / (2 * height * np.sin(np.pi / sides))))
    assert np.abs(diagonal).max() < ROUNDING * np.abs(bar).max()
    assert support[:sides, 2] == pytest.approx(np.full(sides, weight))


@pytest.mark.parametrize("degrees", [20, 45, 70])
def test_three_bars_that_meet_in_a_point(degrees):
    """Statically indeterminate once, all of one section: the middle bar carries P / (1 + 2 cos³ alpha), the others
    P cos² alpha / (1 + 2 cos³ alpha), because their ends stretch by the cosine of the same displacement."""
    alpha, length, stiff, load = np.radians(degrees), 1.5, 4.0e4, 60.0
    frame = make_framework("ABCD", [("A", "D"), ("B", "D"), ("C", "D")], dict.fromkeys("ABC", "xyz") | {"D": "y"})
    reach = length * np.tan(alpha)
    nodes = np.array([[-reach, 0, length], [0, 0, length], [reach, 0, length], [0, 0, 0]])
    spring = stiff / np.array([length / np.cos(alpha), length, length / np.cos(alpha)])
    moved, bar = deflect_framework(frame, nodes, spring, loads(frame, D=(0, 0, -load)))
    middle = load / (1 + 2 * np.cos(alpha) ** 3)
    assert bar == pytest.approx([middle * np.cos(alpha) ** 2, middle, middle * np.cos(alpha) ** 2])
    assert moved[3] == pytest.approx([0, 0, -middle * length / stiff])
    with pytest.raises(TrussError, match="1 self-stress"):
        solve_joints(frame, nodes, loads(frame, D=(0, 0, -load)))


def test_deflection_is_the_unit_load_sum():
    """Maxwell and Mohr: a displacement is the sum of N n / k, n of a unit load there; forces are those of the joints."""
    (frame, nodes), _ = warren()
    spring = np.random.default_rng(5).uniform(1e4, 5e4, len(frame.bars))
    force = loads(frame, L3=(0, 0, -40), U6=(15, 0, -10))
    moved, bar = deflect_framework(frame, nodes, spring, force)
    assert bar == pytest.approx(solve_joints(frame, nodes, force)[0], abs=ROUNDING * np.abs(bar).max())
    for name, axis in (("L4", 2), ("U2", 0), (f"L{PANELS}", 0)):
        unit = np.eye(3)[axis]
        virtual, _ = solve_joints(frame, nodes, loads(frame, **{name: unit}))
        assert moved[frame.nodes.index(name), axis] == pytest.approx(np.sum(bar * virtual / spring))


@pytest.mark.parametrize("degrees", [5, 20, 50])
def test_two_bar_truss_snaps_through_where_von_mises_says(degrees):
    """Bars of stiffness EA / L0 from feet 2 b apart, raised by alpha0: at the angle alpha the load is
    P = 2 EA (1 - cos alpha0 / cos alpha) sin alpha, greatest at cos³ alpha = cos alpha0, where the tangent stiffness goes."""
    start, half, stiff = np.radians(degrees), 1.0, 1.0e5
    frame = make_framework("ABC", [("A", "C"), ("B", "C")], {"A": "xyz", "B": "xyz", "C": "xy"})
    rest = half / np.cos(start)

    def state(angle):
        nodes = np.array([[-half, 0, 0], [half, 0, 0], [0, 0, half * np.tan(angle)]])
        bar = np.full(2, stiff * (half / np.cos(angle) / rest - 1))
        return nodes, bar, float(tangent_stiffness(frame, nodes, np.full(2, stiff / rest), bar)[0, 0])

    critical = np.arccos(np.cos(start) ** (1 / 3))
    nodes, bar, slope = state(critical)
    scale = 2 * stiff / rest * np.sin(critical) ** 2
    assert abs(slope) < 1e-9 * scale
    assert state(critical + 1e-3)[2] > 0 > state(critical - 1e-3)[2]
    load = 2 * stiff * (1 - np.cos(start) ** (2 / 3)) ** 1.5
    assert -(bar @ frame.directions(nodes))[2] == pytest.approx(load)  # what the bars push the apex up with


def test_symmetric_loads_give_symmetric_forces():
    (frame, nodes), _ = warren()
    weight = {f"L{i}": (0, 0, -w) for i, w in enumerate([0, 10, 20, 5, 30, 5, 20, 10, 0])}
    bar, support = solved(frame, nodes, loads(frame, **weight))
    for i in range(PANELS):
        assert bar[f"L{i}-L{i + 1}"] == pytest.approx(bar[f"L{PANELS - 1 - i}-L{PANELS - i}"])
        assert bar[f"L{i}-U{i + 1}"] == pytest.approx(bar[f"U{PANELS - i}-L{PANELS - i}"])
    assert support["L0"] == pytest.approx(support[f"L{PANELS}"])


def test_mirrored_framework_gives_mirrored_results():
    rng = np.random.default_rng(6)
    (frame, nodes), _ = warren()
    spring, mirror = rng.uniform(1e4, 5e4, len(frame.bars)), np.array([-1.0, 1.0, 1.0])
    nodes = nodes + np.array([0.1, 0, 0.1]) * rng.uniform(-1, 1, nodes.shape)
    force = rng.normal(0, 10, nodes.shape) * [1, 0, 1]
    moved, bar = deflect_framework(frame, nodes, spring, force)
    other, same = deflect_framework(frame, nodes * mirror, spring, force * mirror)
    assert same == pytest.approx(bar)
    assert other == pytest.approx(moved * mirror)


def test_missing_bar_is_named_a_mechanism_and_one_too_many_a_self_stress():
    (frame, nodes), _ = warren()
    less = np.arange(len(frame.bars)) != frame.bars.index("U3-U4")
    loose = replace(frame, bars=tuple(np.array(frame.bars)[less]), ends=frame.ends[less])
    for attempt in (lambda: diagnose(loose, nodes), lambda: solve_joints(loose, nodes, np.zeros(nodes.shape))):
        with pytest.raises(TrussError, match="1 mechanism"):
            attempt()
    with pytest.raises(TrussError, match="1 mechanism"):
        deflect_framework(loose, nodes, np.ones(less.sum()), np.zeros(nodes.shape))
    ends = [frame.nodes.index("L2"), frame.nodes.index("U4")]
    stiff = replace(frame, bars=(*frame.bars, "brace"), ends=np.vstack([frame.ends, ends]))
    with pytest.raises(TrussError, match="1 self-stress") as caught:
        solve_joints(stiff, nodes, np.zeros(nodes.shape))
    assert set(caught.value.members) <= {"brace", "L2-L3", "U3-U4", "U3-L3", "L3-U4", "L2-U3"}


def test_groups_only_order_the_work(hanging_arm):
    """An arm solved group by group and as one group of all its nodes."""
    frame = framework_of(hanging_arm.truss)
    rng = np.random.default_rng(7)
    nodes = hanging_arm.nodes(hanging_arm.straight + 0.1 * rng.uniform(-1, 1, (2, *hanging_arm.straight.shape)))
    force = rng.normal(0, 1e3, nodes.shape)
    whole = replace(frame, group=np.where(frame.group > 0, 1, 0))
    (bar, support), (other, same) = (solve_joints(item, nodes, force) for item in (frame, whole))
    assert np.abs(bar - other).max() < 1e-9 * np.abs(bar).max()
    assert np.abs(support - same).max() < 1e-9 * np.abs(bar).max()
    assert support.sum(axis=1) == pytest.approx(-force.sum(axis=1), abs=1e-6)


def test_support_or_bar_on_no_node_is_named():
    with pytest.raises(DescriptionError, match="supports: found node C; allowed: one of A, B"):
        make_framework("AB", [("A", "B")], {"A": "xyz", "C": "yz"})
    with pytest.raises(DescriptionError, match=r"bars\.0: found node D; allowed: one of A, B"):
        make_framework("AB", [("A", "D")], {})
