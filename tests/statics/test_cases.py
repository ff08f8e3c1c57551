"""Load cases: superposition, hand calculations and symmetry."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.statics import make_load_model, make_sections, solve_members
from vgtsim.statics.cases import find_effects, find_envelope
from vgtsim.statics.motion import NodeMotion

ROUNDING = 1e-9  # of the largest force
SUMMED = 1e-13  # of the largest force: a case is a sum of a few effects of unit loads
SAMPLED = 2e-3  # of an amplitude, by which 40000 directions on a sphere or 200 on a circle may miss the worst
GRAVITY = 9.80665
OFFSET = Path(__file__).parents[2] / "models" / "octahedron_offset" / "octahedron_offset.toml"


@pytest.fixture(scope="module")
def model(hanging_arm):
    return make_load_model(hanging_arm, Payload(mass=400.0, radius=0.15), GRAVITY)


@pytest.fixture(scope="module")
def nodes(hanging_arm):
    q = np.array(hanging_arm.straight)
    q[:9:3], q[10] = 0.25, -0.1
    return hanging_arm.nodes(q)


def bars(model, nodes, **parts):
    return find_effects(model, nodes).solve(LoadCase(name="case", **parts)).bar


def test_plain_case_is_the_arm_under_its_weight(model, nodes):
    whole = solve_members(model, nodes).bar
    assert np.abs(bars(model, nodes) - whole).max() < SUMMED * np.abs(whole).max()


def test_cases_add_up(model, nodes):
    """Dead load, payload, wrench and seismic coefficient, each with its factor, superpose."""
    dead, wrench = bars(model, nodes, payload=0.0), (100.0, -300.0, 200.0)
    payload = bars(model, nodes) - dead
    pulled = bars(model, nodes, force=wrench, moment=(5.0, 6.0, 7.0)) - dead - payload
    shaken = bars(model, nodes, payload=0.0, seismic=(0.2, -0.1, 0.3)) - dead
    shaken_payload = bars(model, nodes, seismic=(0.2, -0.1, 0.3)) - dead - payload - shaken
    whole = bars(
        model,
        nodes,
        dead=1.2,
        payload=1.6,
        dynamic=1.1,
        seismic=(0.2, -0.1, 0.3),
        force=wrench,
        moment=(5.0, 6.0, 7.0),
    )
    parts = 1.2 * 1.1 * dead + 1.6 * 1.1 * payload + pulled + 1.2 * shaken + 1.6 * shaken_payload
    assert np.abs(whole - parts).max() < ROUNDING * np.abs(whole).max()


def test_seismic_reaction_is_mass_times_coefficient(model, nodes):
    still = find_effects(model, nodes).solve(LoadCase(name="still")).reaction
    shaken = find_effects(model, nodes).solve(LoadCase(name="shaken", seismic=(0.3, 0.0, 0.1))).reaction
    assert shaken[:3] - still[:3] == pytest.approx(-model.mass * GRAVITY * np.array([0.3, 0.0, 0.1]), abs=1e-6)


def test_wrench_at_the_tool_is_reacted_at_the_mast(model, nodes, hanging_arm):
    force, moment = np.array([150.0, -80.0, 40.0]), np.array([10.0, 20.0, -30.0])
    still = find_effects(model, nodes).solve(LoadCase(name="still")).reaction
    pulled = find_effects(model, nodes).solve(LoadCase(name="p", force=tuple(force), moment=tuple(moment))).reaction
    corner = nodes[-3:]
    normal = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    tool = corner.mean(axis=0) + 0.3 * normal / np.linalg.norm(normal)
    lever = tool - nodes[:3].mean(axis=0)
    assert pulled[:3] - still[:3] == pytest.approx(-force, abs=1e-6)
    assert pulled[3:] - still[3:] == pytest.approx(-moment - np.cross(lever, force), abs=1e-5)


def test_symmetric_load_on_the_straight_arm_gives_symmetric_forces(model, hanging_arm):
    """Threefold: a pull and a twist along the axis load the three members of a kind alike."""
    straight = hanging_arm.nodes(hanging_arm.straight)
    found = bars(model, straight, force=(0.0, 0.0, -500.0), moment=(0.0, 0.0, 100.0))
    for kind in ("m2/actuator", "s2/longeron", "s2/cross_longeron", "m3/batten"):
        rows = [i for i, name in enumerate(model.truss.member_names) if name.startswith(f"{kind}/")]
        assert found[rows] == pytest.approx(np.full(3, found[rows[0]]), abs=ROUNDING * np.abs(found).max())


def test_envelope_holds_every_case_and_keeps_tension_and_compression_apart(model, nodes, hanging_arm):
    cases = [
        LoadCase(name="dead", payload=0.0),
        LoadCase(name="jerk", dynamic=1.3),
        LoadCase(name="side", seismic=(0, 0.3, 0)),
    ]
    section = make_sections(hanging_arm)
    poses = np.stack([nodes, hanging_arm.nodes(hanging_arm.straight)])
    worst = find_envelope(model, section, poses, cases, 1.67)
    assert worst.cases == ("dead", "jerk", "side")
    assert worst.strength.shape == (3, 2, len(model.truss.members))
    for case in cases:
        forces = find_effects(model, poses).solve(case)
        assert np.all(worst.tension >= forces.near_axial.max(axis=0) - 1e-9)
        assert np.all(worst.compression >= -forces.bar.min(axis=0) - 1e-9)
    alone = find_envelope(model, section, poses, cases[1:2], 1.67)
    assert np.array_equal(alone.strength[0], worst.strength[1])


@pytest.mark.parametrize("kind", ["shaking", "reaction"])
def test_load_from_any_direction_is_the_worst_of_many_directions(model, nodes, kind):
    rng, plain = np.random.default_rng(5), bars(model, nodes)
    if kind == "shaking":
        turn = np.linspace(0, 2 * np.pi, 200)
        unit = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
        each = [bars(model, nodes, dead=1.2, payload=0.5, seismic=tuple(0.3 * way)) for way in unit]
        case = LoadCase(name="any", dead=1.2, payload=0.5, shaking=0.3)
    else:
        unit = rng.normal(size=(40000, 3))
        unit /= np.linalg.norm(unit, axis=1, keepdims=True)
        axes = [bars(model, nodes, force=tuple(800.0 * way)) - plain for way in np.eye(3)]
        each = plain + unit @ np.stack(axes)
        case = LoadCase(name="any", reaction=800.0)
    high, low = find_effects(model, nodes).bound(case)
    amplitude = (high.bar - low.bar) / 2
    assert amplitude.max() > 100.0
    for worst, found in ((high.bar, np.max(each, axis=0)), (-low.bar, -np.min(each, axis=0))):
        assert np.all(worst - found >= -ROUNDING * np.abs(plain).max())
        assert np.all(worst - found <= SAMPLED * amplitude + ROUNDING * np.abs(plain).max())


def test_shaking_and_reaction_act_together_each_at_its_worst(model, nodes):
    middle, *spans = (
        find_effects(model, nodes).bound(LoadCase(name="any", **parts))
        for parts in ({}, {"shaking": 0.2}, {"reaction": 500.0}, {"shaking": 0.2, "reaction": 500.0})
    )
    alone = [high.near_axial - middle[0].near_axial for high, _ in spans]
    assert alone[2] == pytest.approx(alone[0] + alone[1], abs=1e-6)
    assert np.array_equal(middle[0].bar, middle[1].bar)


def test_motion_adds_the_inertia_of_arm_and_factored_payload(model, nodes):
    rng = np.random.default_rng(8)
    turn = rng.normal(size=3)  # the arm turning about its pivot as a rigid body, speeding up
    lever = nodes - nodes[:3].mean(axis=0)
    motion = NodeMotion(np.zeros(nodes.shape), np.cross(turn, lever))
    whole = find_effects(model, nodes, motion).solve(LoadCase(name="run"))
    direct = solve_members(model, nodes, motion)
    assert whole.bar == pytest.approx(direct.bar, abs=ROUNDING * np.abs(direct.bar).max())
    assert whole.reaction == pytest.approx(direct.reaction, abs=ROUNDING * np.abs(direct.reaction).max())
    bare = make_model_of(model, 0.0)
    empty = find_effects(model, nodes, motion).solve(LoadCase(name="empty", payload=0.0))
    assert empty.bar == pytest.approx(solve_members(bare, nodes, motion).bar, abs=ROUNDING * np.abs(direct.bar).max())


def make_model_of(model, mass):
    return replace(model, payload=model.payload.model_copy(update={"mass": mass}))


def test_bending_counts_with_motion_and_from_any_direction():
    """A side force bends an offset arm's actuators: loads from any direction use it as much as from each one tried."""
    chain = Chain(load_manipulator(OFFSET), hanging_mount(4.0))
    nodes = chain.nodes(sample_inputs(chain, 2, seed=3))
    model = make_load_model(chain, Payload(mass=400.0, radius=0.1), GRAVITY)
    section = make_sections(chain)
    rng = np.random.default_rng(9)
    ways = rng.normal(size=(60, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    flat = ways[:, :2] / np.linalg.norm(ways[:, :2], axis=1, keepdims=True)
    tried = {
        "reaction": [LoadCase(name="tried", force=tuple(20e3 * way)) for way in ways],
        "shaking": [LoadCase(name="tried", seismic=(0.4 * way[0], 0.4 * way[1], 0.0)) for way in flat],
    }
    cases = [LoadCase(name="any", reaction=20e3), LoadCase(name="any", shaking=0.4)]
    for case, each in zip(cases, tried.values(), strict=True):
        bound = find_envelope(model, section, nodes, [case], 1.67).strength[0]
        found = find_envelope(model, section, nodes, each, 1.67).strength.max(axis=0)
        assert np.all(bound >= found * (1 - ROUNDING))
        assert bound.max() < 1.3 * found.max()  # two ends bent their worst at once, no more
    lever = nodes - nodes[:, :1]
    motion = NodeMotion(np.zeros(nodes.shape), np.cross(np.array([3.0, -2.0, 1.0]), lever))
    whole, direct = find_effects(model, nodes, motion).solve(LoadCase(name="run")), solve_members(model, nodes, motion)
    for name in ("near_moment", "far_moment"):
        most = np.abs(getattr(direct, name)).max()
        assert getattr(whole, name) == pytest.approx(getattr(direct, name), abs=ROUNDING * most)
