"""Descriptions to compiled models: the arm alone, or a whole scene."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from vgtsim.arrays import Array
from vgtsim.constants import GRAVITY, STEEL
from vgtsim.description import Feed, Manipulator, Payload
from vgtsim.errors import VgtError
from vgtsim.geometry import MastPipe
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, Truss, hanging_mount
from vgtsim.mjcf import names
from vgtsim.mjcf.arm import add_arm
from vgtsim.mjcf.keyframes import HOLDING_WEIGHTS, add_keyframes, reach_pose, withdrawn_poses
from vgtsim.mjcf.rigging import MastDuty, Rigging
from vgtsim.mjcf.rows import select_drive, stiffen
from vgtsim.mjcf.sections import add_sections
from vgtsim.mjcf.tank import add_tank
from vgtsim.mjcf.views import add_arm_views, add_floor, add_goal_markers, add_tank_cameras, light_tank
from vgtsim.site import Site
from vgtsim.statics import weigh

VIEW_TIMESTEP = 0.001  # of model files for viewers, s: without the scaled weights the sag grows as its square
# Of the solver: at 1e-24 joints are short of equilibrium by 6e-8 N*m, at 1e-20 by more than a micronewton metre; below
# 1e-28 rounding keeps it from stopping, and it spends all of its hundred iterations.
SOLVED = 1e-29
SHOWN = 1e-10  # of model files: MJCF writes nothing smaller, and zero would cost all hundred iterations
EXTENT = 20.0  # m, about a tank's diameter
# the reference scene's, cut short
_SHORT_MAST = MastPipe(outer_diameter=0.9144, wall=0.0127, density=STEEL, length=2.0)
_FLOOR_GAP = 1.0  # between the tool of a hanging arm alone and its floor, m
# Of a hoist that nothing describes: how often it lifts mast, arm and payload, how fast, m/s, and how far that of an arm alone, m.
_RESERVE, _LIFT_RATE, _LIFT = 3.0, 0.05, 1.0
_MODELS: WeakKeyDictionary[Site, mujoco.MjModel] = WeakKeyDictionary()


def build_spec(
    site: Site, poses: Mapping[str, Array] | None = None, timestep: float | None = None, *, limited: bool = False
) -> mujoco.MjSpec:
    """Lay out a scene in MJCF; the servos hold the arm until `select_drive` says otherwise.

    Keyframes besides `stowed` and `straight` are given as inputs, shape (n,), by name; a time step, s, replaces the scene's.
    Strokes, commands and speeds are limited in model files, and not for a plant; see `Rigging.limited`.
    """
    task, simulation = site.task, site.task.simulation
    step = timestep or site.timestep
    keyed = withdrawn_poses(site) | {name: (q, 0.0) for name, q in dict(poses or {}).items()}
    rigging = replace(_rig(site, step, [lift for _, lift in keyed.values()]), limited=limited)
    spec, bare = (
        _start_spec(task.name, step, simulation.gravity, simulation.weight_scale, limited=limited) for _ in range(2)
    )
    add_tank(spec, site.tank, site.bed)
    for each in (spec, bare):
        add_arm(each, rigging)
    add_goal_markers(spec, task.motion.goals)
    light_tank(spec, site.tank)
    add_tank_cameras(spec, site.tank, site.scene.pivot_height)
    add_keyframes(spec, bare, site.chain, keyed)
    return spec


def build_arm_spec(
    manipulator: Manipulator,
    timestep: float = VIEW_TIMESTEP,
    *,
    lumped: bool = False,
    floor: bool = True,
    limited: bool = True,
) -> mujoco.MjSpec:
    """Lay out an arm alone, hanging over an empty, lit floor unless told otherwise; members' mass is in their hubs if lumped.

    Its keyframes are `straight`, `reach` (see `reach_pose`) and, of an arm that stows, `stowed`.
    """
    free = Chain(manipulator, np.eye(4))
    poses = {"straight": free.straight, "reach": reach_pose(free)}
    if manipulator.stowed is not None:
        poses = {"stowed": free.stowed} | poses
    height = _FLOOR_GAP + float(np.linalg.norm(free.tool(next(iter(poses.values())))[0]))
    chain = Chain(manipulator, hanging_mount(height))
    rigging = Rigging(
        chain=chain,
        mast=_SHORT_MAST,
        feed=_make_lift(_SHORT_MAST, weigh(chain), ()),
        payload=Payload(mass=0.0, radius=0.1),
        reference=chain.straight,
        timestep=timestep,
        servo_stiffness=1e8,
        servo_damping=1e6,
        lumped=lumped,
        limited=limited,
    )
    spec = _start_spec(manipulator.name, timestep, GRAVITY, HOLDING_WEIGHTS, limited=limited)
    add_arm(spec, rigging)
    add_arm_views(spec, height)
    if floor:
        add_floor(spec)
    add_keyframes(spec, spec, chain, {name: (q, 0.0) for name, q in poses.items()})
    return spec


def build_model(site: Site) -> mujoco.MjModel:
    """Compile a scene for simulation: weights are scaled and the scene's drive is selected.

    The model is compiled once for a site; each call returns a copy, which may be changed. Errors are those of
    `finish_model`.
    """
    if site not in _MODELS:
        sections = site.task.simulation.members == "sections"
        _MODELS[site] = _build_sections(site) if sections else finish_model(build_spec(site), site)
    return copy.copy(_MODELS[site])


def _build_sections(site: Site) -> mujoco.MjModel:
    """Compile the arm with rigid sections, without tank and keyframes."""
    simulation = site.task.simulation
    spec = _start_spec(site.task.name, site.timestep, simulation.gravity, simulation.weight_scale)
    add_sections(spec, replace(_rig(site, site.timestep, ()), lumped=True))
    return _finish(spec, site)


def finish_model(spec: mujoco.MjSpec, site: Site) -> mujoco.MjModel:
    """Compile a specification with the scene's weights and drive; a VgtError where it is not the truss that was described."""
    model = _finish(spec, site)
    _check_compiled(model, site.truss)
    return model


def _finish(spec: mujoco.MjSpec, site: Site) -> mujoco.MjModel:
    model = spec.compile()
    stiffen(model, site.task.simulation.weight_scale)
    select_drive(model, site.task.simulation.drive)
    return model


def _rig(site: Site, timestep: float, lifts: Sequence[float]) -> Rigging:
    simulation = site.task.simulation
    return Rigging(
        chain=site.chain,
        mast=site.mast,
        feed=_make_lift(site.mast, weigh(site.chain) + site.task.payload.mass, lifts, site.task.mast.feed),
        payload=site.task.payload,
        reference=site.start,
        timestep=timestep,
        servo_stiffness=simulation.servo_stiffness,
        servo_damping=simulation.servo_damping,
        elastic=simulation.members == "elastic",
        lumped=simulation.lumped,
        guided=site.tank.guide is not None,
        line=site.task.conveyance.density if site.task.conveyance else 0.0,
        turn=None if (slew := site.task.mast.turn) is None else MastDuty(slew.range, slew.torque, slew.rate),
    )


def _make_lift(mast: MastPipe, hung: float, lifts: Sequence[float], feed: Feed | None = None) -> MastDuty:
    """The hoist of a mast that comes to some heights above the working depth, m; if no feed is described, one for a mass, kg."""
    reach = (min([0.0, *lifts]), max([feed.stroke if feed else _LIFT, *lifts]))
    if feed:
        return MastDuty(reach, feed.force, feed.rate)
    return MastDuty(reach, _RESERVE * GRAVITY * (mast.mass + hung), _LIFT_RATE)


def _start_spec(
    name: str, timestep: float, gravity: float, weight_scale: float, *, limited: bool = False
) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.modelname = name
    spec.compiler.degree = False
    option = spec.option
    option.timestep = timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    option.gravity = [0, 0, -gravity]
    option.tolerance = SHOWN if limited else SOLVED
    option.disableflags |= mujoco.mjtDisableBit.mjDSBL_REFSAFE  # closures are stiffer than two steps
    if not limited:
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET  # a diverged state must be seen, not hidden
        # an arm hangs together: the search finds one, in each step
        option.disableflags |= mujoco.mjtDisableBit.mjDSBL_ISLAND
    spec.add_numeric(name=names.WEIGHT_SCALE, data=[weight_scale])
    spec.visual.global_.offwidth, spec.visual.global_.offheight = 3840, 2160  # the largest film, pixels
    spec.visual.map.znear, spec.visual.map.zfar = 0.002, 10.0  # of the extent: from 4 cm to 200 m
    spec.stat.extent = EXTENT
    return spec


def _check_compiled(model: mujoco.MjModel, truss: Truss) -> None:
    """Hold the compiled model against the description by what both can count."""
    closures = int(np.sum(model.eq_type == mujoco.mjtEq.mjEQ_CONNECT))
    balls = int(np.sum(model.jnt_type == mujoco.mjtJoint.mjJNT_BALL))
    members, blocks = len(truss.members), truss.ring_actuators.size  # a block and an actuator pinned to it, each a ball
    if (closures, balls) != (members + blocks, members):
        found = f"{balls} ball joints and {closures} closures for {members} members and {blocks} blocks"
        raise VgtError(f"compiled model has {found}")
