"""The tank as MuJoCo feels it, held against meshes of the same surfaces: distances of balls, and an arm pushed in the riser."""

from __future__ import annotations

import dataclasses

import mujoco
import numpy as np
import pytest
import trimesh

from vgtsim.description import load_tank
from vgtsim.geometry import make_profile
from vgtsim.mjcf import build_spec, finish_model, names, qpos_from_nodes
from vgtsim.mjcf import tank as tank_mjcf
from vgtsim.site import Site

pytestmark = pytest.mark.long

TANK = load_tank("type_ii")
PROFILE = make_profile(TANK.shell)
BORE = TANK.arm_riser.bore / 2
RIM, TOP = PROFILE.rim(BORE), TANK.grade + TANK.arm_riser.above_grade
NEAR_RISER, ELSEWHERE = 2e-3, 1e-2  # m by which the arm may be felt late
MESH = 1e-4  # m by which the meshes' chords lie off the surfaces
BALL = 0.02  # m
WEDGE = 0.4  # rad of the tank about the axis that is meshed: several boxes wide everywhere
FREE = 0.0381  # m between the stowed reference arm and the bore


def sweep(curve):
    """A mesh of the surface that a curve (r, z) sweeps through the wedge."""
    return trimesh.creation.revolve(curve, angle=WEDGE, sections=80, process=False)


def arcs(pieces):
    parts = [piece.at(np.linspace(0, piece.length, max(round(piece.turn / 0.02), 8))) for piece in pieces]
    return np.concatenate(parts)


def spin(points, seed):
    """Points (r, z) at seeded azimuths away from the wedge's edges."""
    turn = np.random.default_rng(seed).uniform(0.05, WEDGE - 0.05, len(points))
    return np.stack([points[:, 0] * np.cos(turn), points[:, 0] * np.sin(turn), points[:, 1]], -1)


def place_around(curve, count, seed):
    """Points (r, z) within 6 cm of seeded ones on a curve."""
    rng = np.random.default_rng(seed)
    along = np.insert(np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1)), 0, 0.0)
    s = rng.uniform(0, along[-1], count)
    on = np.stack([np.interp(s, along, curve[:, k]) for k in range(2)], -1)
    return on + rng.uniform(-0.06, 0.06, on.shape)


def measure_felt(points):
    """Least gap between a ball at each point and the boxes, m, by MuJoCo."""
    spec = mujoco.MjSpec()
    tank_mjcf.add_tank(spec, TANK)
    for index, point in enumerate(points):
        body = spec.worldbody.add_body(name=f"ball{index}", pos=point)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[BALL, 0, 0], contype=0, conaffinity=0)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    boxes = np.flatnonzero(model.geom_type == mujoco.mjtGeom.mjGEOM_BOX)
    reach = np.linalg.norm(model.geom_size[boxes], axis=1)
    found = []
    for index, point in enumerate(points):
        ball = model.body(f"ball{index}").geomadr[0]
        near = boxes[np.linalg.norm(data.geom_xpos[boxes] - point, axis=1) < reach + 0.2]
        found.append(min(mujoco.mj_geomDistance(model, data, int(box), ball, 0.2, None) for box in near))
    return np.array(found)


BORE_CURVE = np.array([[BORE, TOP - 0.1], [BORE, RIM]])
RIM_CURVE = np.stack([r := np.linspace(BORE, 1.4, 40), PROFILE.ceiling_at(r)], -1)
PLACES = {
    "bore": (np.array([[BORE, TOP + 0.2], [BORE, RIM]]), BORE_CURVE, NEAR_RISER),
    "rim": (np.concatenate([BORE_CURVE, RIM_CURVE[1:]]), np.array([[BORE, RIM + 0.02], *RIM_CURVE[:4]]), NEAR_RISER),
    "crown": (np.concatenate([BORE_CURVE, RIM_CURVE[1:]]), RIM_CURVE[:-3], NEAR_RISER),
    "shell": (arcs(PROFILE.pieces), arcs(PROFILE.pieces)[4:-12], ELSEWHERE),
}


@pytest.mark.parametrize("place", PLACES)
def test_mujoco_feels_what_a_mesh_library_measures(place):
    surface, curve, late = PLACES[place]
    flat = place_around(curve, 60, seed=len(place))
    points = spin(flat, 2)
    _, apart, _ = trimesh.proximity.closest_point_naive(sweep(surface), points)
    r, z = flat.T
    free = ((r < PROFILE.radius_at(z)) & (z < PROFILE.ceiling_at(r))) | ((r < BORE) & (z > RIM - 0.1))
    gap = np.where(free, apart, -apart) - BALL
    picked = np.abs(gap) < 0.04
    assert picked.sum() > 20
    off = measure_felt(points[picked]) - gap[picked]
    assert off.min() > -MESH  # never felt before it is there
    assert off.max() < late


def test_an_arm_pushed_in_the_riser_is_felt_as_deep_as_it_is(reach_scene):
    site = Site(reach_scene)
    spec = build_spec(site)
    push = 0.06 * np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0])  # towards a hub of every other face
    mast = spec.body(names.MAST)
    mast.pos = mast.pos + push
    model = finish_model(spec, site)
    lift = float(model.key("stowed").qpos[model.joint(names.FEED).qposadr[0]])
    nodes = site.chain.nodes(site.chain.stowed) + push + [0.0, 0.0, lift]
    data = mujoco.MjData(model)
    data.qpos[:] = qpos_from_nodes(model, site.truss, nodes)
    mujoco.mj_forward(model, data)
    felt = min(contact.dist for contact in data.contact)
    within = nodes[nodes[:, 2] > RIM]
    true = BORE - np.hypot(within[:, 0], within[:, 1]).max() - site.arm.hub.radius
    assert true == pytest.approx(FREE - 0.06, abs=1e-4)
    assert felt == pytest.approx(true, abs=NEAR_RISER)


def test_a_mast_without_a_guide_touches_the_bore(reach_scene):
    def touch(tank):
        scene = dataclasses.replace(reach_scene, tank=tank)
        spec = build_spec(Site(scene))
        mast = spec.body(names.MAST)
        mast.pos = mast.pos + [0.09, 0.0, 0.0]  # 76 mm are free
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        mujoco.mj_collision(model, data)
        return [c.dist for c in data.contact if names.MAST in {model.geom(int(g)).name for g in c.geom}]

    assert not touch(TANK)
    found = touch(TANK.model_copy(update={"guide": None}))
    assert min(found) == pytest.approx(BORE - reach_scene.task.mast.outer_diameter / 2 - 0.09, abs=NEAR_RISER)
