"""Allowable payload: exact at the boundary, and what governs is named."""

from __future__ import annotations

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.planning.capacity import unload
from vgtsim.statics import make_load_model, make_sections, rate, solve_members, utilise
from vgtsim.statics.capacity import draw_shapes, find_allowance, find_gain, map_capacity
from vgtsim.statics.rating import LIMITS

BOUNDARY = 1e-9  # forces are linear in the payload
OMEGA, GRAVITY = 1.67, 9.80665


@pytest.fixture(scope="module")
def nodes(hanging_arm):
    rng = np.random.default_rng(41)
    q = np.repeat(hanging_arm.straight[None], 12, axis=0)
    q.reshape(12, 5, 3)[..., :2] += 0.25 * rng.uniform(-1, 1, (12, 5, 2))
    return hanging_arm.nodes(q)


def greatest_use(chain, nodes, mass):
    forces = solve_members(make_load_model(chain, Payload(mass=mass, radius=0.15), GRAVITY), nodes)
    ends = chain.truss.ends
    length = np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=-1)
    use = utilise(rate(make_sections(chain), length, OMEGA), forces)
    every = np.stack([use.tension, use.compression, use.rod, use.pressure, use.pin, use.bent])
    return every.max(), np.unravel_index(np.argmax(every), every.shape)


def test_allowable_payload_uses_the_governing_member_to_the_full(hanging_arm, nodes):
    found = find_allowance(hanging_arm, nodes, GRAVITY, OMEGA, 0.15)
    assert len(set(found.limit.tolist())) > 1
    for pose, mass, member, limit in zip(nodes, found.payload, found.member, found.limit, strict=True):
        used, (kind, worst) = greatest_use(hanging_arm, pose, mass)
        assert used == pytest.approx(1.0, rel=BOUNDARY)
        assert (LIMITS[kind], worst) == (LIMITS[limit], member)


def test_arm_that_cannot_hold_itself_has_a_negative_allowance(hanging_arm, nodes):
    """Oil at a tenth of the pressure cannot hold the dead load; the cylinder is named."""
    arm = hanging_arm.manipulator
    weak = {name: part.model_copy(update={"pressure": part.pressure / 10}) for name, part in arm.cylinders.items()}
    chain = type(hanging_arm)(arm.model_copy(update={"cylinders": weak}), hanging_arm.mount)
    found = find_allowance(chain, nodes, GRAVITY, OMEGA, 0.15)
    held = found.payload < 0
    assert held.any()
    assert all(LIMITS[i] == "oil pressure" for i in found.limit[held])
    assert set(found.member[held]) <= set(chain.truss.actuated.tolist())


@pytest.mark.long
def test_map_has_one_best_posture_a_cell_and_repeats_itself(hanging_arm):
    first, second = (map_capacity(hanging_arm, draw_shapes(hanging_arm, 2000), cell=1.0) for _ in range(2))
    assert np.array_equal(first.payload, second.payload)
    cells = np.stack([first.radius, first.depth], axis=1)
    assert len(np.unique(cells, axis=0)) == len(cells)
    more = map_capacity(hanging_arm, draw_shapes(hanging_arm, 2000), cell=3.0)
    assert more.payload.max() == pytest.approx(first.payload.max())
    assert np.all(first.sag > 0)
    # the arm was sized for 1000 lb anywhere
    assert first.payload.min() > 453.6


def test_posture_of_a_cell_is_in_it_and_carries_what_the_map_says(hanging_arm):
    found = map_capacity(hanging_arm, draw_shapes(hanging_arm, 500), cell=2.0)
    tool = hanging_arm.tool(found.q)[0]
    assert np.all(np.abs(np.hypot(tool[:, 0], tool[:, 1]) - found.radius) <= 1.0)
    assert np.all(np.abs(hanging_arm.mount[2, 3] - tool[:, 2] - found.depth) <= 1.0)
    for q, mass in zip(found.q[::5], found.payload[::5], strict=True):
        assert greatest_use(hanging_arm, hanging_arm.nodes(q), mass)[0] == pytest.approx(1.0, rel=BOUNDARY)
    bent = np.array(found.q)
    bent[:, ::3], bent[:, 1::3] = (np.sin(found.bends / 2) * f(found.azimuths) for f in (np.cos, np.sin))
    assert bent == pytest.approx(found.q, abs=1e-12)


@pytest.mark.parametrize("name", ["mixed", "tetra4", "stewart", "octahedron_general"])
def test_postures_of_every_kind_carry_what_their_map_says(name):
    """And no more: with a little more a member is used beyond its strength. Bends are angles between faces of members."""
    chain = Chain(load_manipulator(name), hanging_mount(9.0))
    found = map_capacity(chain, draw_shapes(chain, 200), cell=0.5)
    nodes = chain.nodes(found.q)
    assert len(found.q) >= 1
    for pose, mass in zip(nodes, found.payload, strict=True):
        assert greatest_use(chain, pose, mass)[0] == pytest.approx(1.0, rel=BOUNDARY)
        assert greatest_use(chain, pose, 1.001 * mass)[0] > 1.0
    first = chain.layout.modules[0]
    faces = chain.frames(found.q)[0][..., 2][:, [first, first + 1]]
    assert np.cos(found.bends[:, 0]) == pytest.approx(np.sum(faces[:, 0] * faces[:, 1], axis=1), abs=1e-12)


@pytest.mark.long
def test_unloaded_postures_keep_their_tool_and_carry_more(hanging_arm):
    plane = map_capacity(hanging_arm, draw_shapes(hanging_arm, 500), cell=3.0)
    moved = unload(hanging_arm, plane.q, 453.6, GRAVITY, OMEGA)
    tools = [hanging_arm.tool(q)[0] for q in (plane.q, moved)]
    apart = np.linalg.norm(tools[1][:, None] - tools[0][None], axis=-1)
    assert len(moved) > 0.8 * len(plane.q)
    assert apart.min(axis=1).max() < 2e-4
    before = np.array([greatest_use(hanging_arm, hanging_arm.nodes(q), 453.6)[0] for q in plane.q])
    after = np.array([greatest_use(hanging_arm, hanging_arm.nodes(q), 453.6)[0] for q in moved])
    assert np.median(after / before[apart.argmin(axis=1)]) < 0.97
    length, (low, high) = hanging_arm.lengths(moved), hanging_arm.stroke
    assert np.all((length >= low) & (length <= high))


def test_gain_counts_the_cells_that_both_maps_have(hanging_arm):
    """Postures that came into other cells are more than the plain map has, and shift the order."""
    plain = map_capacity(hanging_arm, draw_shapes(hanging_arm, 60), cell=3.0)
    more = map_capacity(hanging_arm, draw_shapes(hanging_arm, 500), cell=3.0)
    fewer = map_capacity(hanging_arm, plain.q[1:], cell=3.0)
    assert len(more.payload) > len(plain.payload)
    gain = find_gain(map_capacity(hanging_arm, np.concatenate([plain.q, more.q]), cell=3.0), plain)
    assert len(gain) == len(plain.payload)
    assert np.all(gain > -1e-12)
    assert find_gain(plain, fewer) == pytest.approx(np.zeros(len(fewer.payload)), abs=1e-12)
