"""The arm in MJCF: one body for every hub and every member, ball joints at one end, closures at the other."""

from __future__ import annotations

import numpy as np

from vgtsim.graphics import mujoco
from vgtsim.kinematics import Member
from vgtsim.mjcf import names
from vgtsim.mjcf.fittings import add_drives, add_force_sensors, hold_sites, set_inertia
from vgtsim.mjcf.hubs import add_hubs
from vgtsim.mjcf.pose import pinned_rotation, quaternions_to
from vgtsim.mjcf.rigging import Rigging
from vgtsim.mjcf.ring import Seat, add_blocks, pin_barrel, pin_rod
from vgtsim.mjcf.tip import add_tip

ROLE_COLOURS = {
    "longeron": (0.27, 0.45, 0.69, 1.0),
    "cross_longeron": (0.45, 0.67, 0.82, 1.0),
    "batten": (0.62, 0.62, 0.65, 1.0),
    "actuator": (0.86, 0.45, 0.13, 1.0),
    "rod": (0.93, 0.90, 0.85, 1.0),
    "hub": (0.20, 0.22, 0.26, 1.0),
    "tip": (0.35, 0.36, 0.40, 1.0),
    "payload": (0.60, 0.12, 0.16, 1.0),
    "mast": (0.50, 0.52, 0.55, 1.0),
}
SITE_GROUP = 4  # hidden in viewers until asked for


def add_arm(spec: mujoco.MjSpec, rigging: Rigging) -> None:
    """Add mast, hubs, members, tip plate, closures, drives and sensors.

    Lengths are commanded from the reference pose: zero holds it, for the rigid drives and for the servos.
    """
    add_defaults(spec)
    truss = rigging.chain.truss
    hubs = add_hubs(spec, rigging, range(3), np.setdiff1d(truss.free, truss.rings).tolist())
    seats = {node: Seat(hub, np.zeros(3), np.eye(3)) for node, hub in hubs.items()}
    seats |= add_blocks(spec, rigging)
    add_tip(spec, rigging)
    for index, member in enumerate(truss.members):
        _add_member(spec, rigging, index, member, seats[member.ends[0]])


def add_defaults(spec: mujoco.MjSpec) -> None:
    """Add the default of each role: its colour; sites are small and hidden."""
    spec.default.site.group = SITE_GROUP
    spec.default.site.size = [0.01, 0.01, 0.01]
    for role, colour in ROLE_COLOURS.items():
        default = spec.add_default(role, spec.default)
        default.geom.rgba = colour
        default.geom.type = mujoco.mjtGeom.mjGEOM_CAPSULE


def _add_member(spec: mujoco.MjSpec, rigging: Rigging, index: int, member: Member, seat: Seat) -> None:
    """Add one member, its closure and its sensors."""
    span = rigging.nodes[member.ends[1]] - rigging.nodes[member.ends[0]]
    length = float(np.linalg.norm(span))
    body = seat.body.add_body(name=member.name, pos=seat.place, info=member.name)
    if index in rigging.chain.truss.ring_actuators:
        mujoco.mju_mat2Quat(body.quat, pinned_rotation(seat.turn, span).ravel())
        pin_barrel(body, rigging.chain, member)
    else:
        body.quat = quaternions_to((seat.turn.T @ span)[None] / length)[0]
        body.add_joint(name=member.name, type=mujoco.mjtJoint.mjJNT_BALL)
    body.add_site(name=names.near(member.name))
    set_inertia(body, rigging.inertia, (index, 0), outward=1.0)
    add = _add_cylinder if member.role == "actuator" else _add_tube
    add(spec, rigging, index, member, body, length)
    far = rigging.chain.truss.nodes[member.ends[1]]
    hold_sites(spec, names.closure(member.name), names.far(member.name), far, rigging.timestep, info=member.name)
    add_force_sensors(spec, member.name, names.near(member.name))


def _add_tube(
    spec: mujoco.MjSpec, rigging: Rigging, index: int, member: Member, body: mujoco.MjsBody, length: float
) -> None:
    """Dress a tube; an elastic one gets its far half on a slide with a spring."""
    arm = rigging.chain.manipulator
    tube = arm.tubes[member.section]
    gap = min(arm.hub.radius, length / 4)  # the drawn tube ends at its hubs
    body.add_geom(
        name=member.name,
        fromto=[0, 0, gap, 0, 0, length - gap],
        default=spec.find_default(member.role),
        size=[tube.outer_diameter / 2, 0, 0],
        **rigging.bits(member.module),
    )
    if rigging.elastic:
        body = body.add_body(name=names.half(member.name), pos=[0, 0, length])
        body.add_joint(
            name=names.slide(member.name),
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[0, 0, 1],
            stiffness=arm.materials[tube.material].youngs_modulus * tube.area / length,
        )
        set_inertia(body, rigging.inertia, (index, 1), outward=-1.0)
        length = 0.0
    body.add_site(name=names.far(member.name), pos=[0, 0, length])


def _add_cylinder(
    spec: mujoco.MjSpec, rigging: Rigging, index: int, member: Member, barrel: mujoco.MjsBody, length: float
) -> None:
    """Dress the barrel and add the rod with its slide, drives and sensors."""
    part = rigging.chain.manipulator.cylinders[member.section]
    slide, bits = names.slide(member.name), rigging.bits(member.module)
    barrel.add_geom(
        name=member.name,
        default=spec.find_default("actuator"),
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[part.barrel_diameter / 2, (part.barrel_length - part.eye) / 2, 0],
        pos=[0, 0, (part.barrel_length + part.eye) / 2],
        **bits,
    )
    rod = barrel.add_body(name=names.rod(member.name), pos=[0, 0, length])
    rod.add_joint(
        name=slide,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, 1],
        ref=length - part.retracted,
        range=[0, part.stroke],
        limited=mujoco.mjtLimited.mjLIMITED_FALSE,  # drives hold the length; the stroke is judged afterwards
    )
    rod.add_geom(
        name=names.rod(member.name),
        default=spec.find_default("rod"),
        fromto=[0, 0, 0, 0, 0, -part.rod_length],
        size=[part.rod / 2, 0, 0],
        **bits,
    )
    set_inertia(rod, rigging.inertia, (index, 1), outward=-1.0)
    rod.add_site(name=names.far(member.name))
    if index in rigging.chain.truss.ring_actuators:
        pin_rod(spec, rigging, member, rod)
    spec.add_numeric(name=names.retracted(member.name), data=[part.retracted])
    add_drives(spec, member.name, slide, rigging, force=(part.pull, part.push))
    sensor, kind, far = mujoco.mjtSensor, mujoco.mjtObj, names.far(member.name)
    place = {"objtype": kind.mjOBJ_JOINT, "objname": slide}
    spec.add_sensor(name=names.length(member.name), type=sensor.mjSENS_JOINTPOS, **place)
    place = {"objtype": kind.mjOBJ_SITE, "objname": far}
    spec.add_sensor(name=names.drive_force(member.name), type=sensor.mjSENS_FORCE, **place)
