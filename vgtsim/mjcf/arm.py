"""The arm in MJCF: one body for every hub and every member, ball joints at one end, closures at the other."""

from __future__ import annotations

import numpy as np

from vgtsim.graphics import mujoco
from vgtsim.kinematics import Member, quaternions_to
from vgtsim.mjcf import names
from vgtsim.mjcf.defaults import add_defaults
from vgtsim.mjcf.fittings import add_drives, add_force_sensors, hold_sites, set_inertia
from vgtsim.mjcf.hubs import add_fixed_hubs, add_free_hub, add_tip
from vgtsim.mjcf.pose import pinned_rotation
from vgtsim.mjcf.rigging import Rigging
from vgtsim.mjcf.ring import Seat, add_block, pin_barrel, pin_rod


def add_arm(spec: mujoco.MjSpec, rigging: Rigging) -> None:
    """Add mast, hubs, members, tip plate, closures, drives and sensors.

    Servos are commanded by lengths from pin to pin, m, and rigid drives by what these differ from the reference pose's.
    Bodies go from the tip to the mast, as the solver eliminates the last ones first: a hub then comes after all members that
    are joined to it, which hang from it or from hubs nearer to the mast. The other way round its factor of the reference
    arm would have 2.6 times the entries and 6 times the work.
    """
    add_defaults(spec, rigging)
    truss = rigging.chain.truss
    row_of = {int(block[1]): row for row, block in enumerate(truss.rings.reshape(-1, 3))}
    ringed = set(truss.rings.ravel().tolist()) - set(row_of)
    add_tip(spec, rigging)
    seats: dict[int, Seat] = {}
    for node in sorted(set(truss.free.tolist()) - ringed, reverse=True):
        if node in row_of:
            seats |= add_block(spec, rigging, row_of[node])
        else:
            seats[node] = _seat(add_free_hub(spec, rigging, node))
    seats |= {node: _seat(hub) for node, hub in add_fixed_hubs(spec, rigging, range(3)).items()}
    for index, member in enumerate(truss.members):
        _add_member(spec, rigging, index, member, seats[member.ends[0]])


def _seat(hub: mujoco.MjsBody) -> Seat:
    return Seat(hub, np.zeros(3), np.eye(3))


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
        body.add_joint(spec.find_default(names.BALL), name=member.name)
    body.add_site(name=names.near(member.name))
    set_inertia(body, rigging.inertia, (index, 0), outward=1.0)
    add = _add_cylinder if member.role == "actuator" else _add_tube
    add(spec, rigging, index, member, body, length)
    far = rigging.chain.truss.nodes[member.ends[1]]
    hold_sites(spec, names.closure(member.name), names.far(member.name), far, info=member.name)
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
        size=[part.barrel_diameter / 2, (part.barrel_length - part.eye) / 2, 0],
        pos=[0, 0, (part.barrel_length + part.eye) / 2],
        **bits,
    )
    rod = barrel.add_body(name=names.rod(member.name), pos=[0, 0, length])
    kind = names.cylinder(member.section)
    rod.add_joint(spec.find_default(kind), name=slide, ref=length)
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
    add_drives(spec, member.name, slide, kind)
    sensor, sensed, far = mujoco.mjtSensor, mujoco.mjtObj, names.far(member.name)
    place = {"objtype": sensed.mjOBJ_JOINT, "objname": slide}
    spec.add_sensor(name=names.length(member.name), type=sensor.mjSENS_JOINTPOS, **place)
    place = {"objtype": sensed.mjOBJ_SITE, "objname": far}
    spec.add_sensor(name=names.drive_force(member.name), type=sensor.mjSENS_FORCE, **place)
