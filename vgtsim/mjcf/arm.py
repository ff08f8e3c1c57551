"""The arm in MJCF: one body for every hub and every member, ball joints at one end, closures at the other."""

from __future__ import annotations

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.description.sections import Cylinder
from vgtsim.kinematics import Chain, Member
from vgtsim.kinematics.inertia import MemberInertia, make_hub_masses, make_member_inertia
from vgtsim.mjcf import names
from vgtsim.mjcf.pose import pinned_rotation, quaternions_to
from vgtsim.mjcf.rigging import Rigging, part_bits
from vgtsim.mjcf.ring import Seat, add_blocks, pin_barrel, pin_rod
from vgtsim.mjcf.rows import (
    LEAST_INERTIA,
    LEAST_MASS,
    SERVO_GROUP,
    SOLIMP,
    SOLREF_RATIO,
    SOLREF_STEPS,
    hold_sites,
)
from vgtsim.mjcf.tip import add_tip

Array = NDArray[np.float64]

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
SITE_GROUP = 4


def add_arm(spec: mujoco.MjSpec, chain: Chain, rigging: Rigging) -> None:
    """Add mast, hubs, members, tip plate, closures, drives and sensors.

    Lengths are commanded from the reference pose: zero holds it, for the rigid drives and for the servos.

    Args:
        spec: Changed in place.
        chain: The arm on its mount.
        rigging: What it hangs from and carries.
    """
    _add_defaults(spec)
    nodes = chain.nodes(rigging.reference)
    hubs = _add_mast(spec, chain, nodes, rigging)
    hubs |= _add_hubs(spec, chain, nodes)
    _weigh_hubs(hubs, chain, rigging)
    seats = {node: Seat(hub, np.zeros(3), np.eye(3)) for node, hub in hubs.items()}
    seats |= add_blocks(spec, chain, nodes)
    add_tip(spec, chain, nodes, rigging)
    inertia = make_member_inertia(chain.manipulator, chain.truss, split=rigging.elastic, lumped=rigging.lumped)
    for index, member in enumerate(chain.truss.members):
        _add_member(spec, chain, index, member, nodes, seats[member.ends[0]], inertia, rigging)


def _add_defaults(spec: mujoco.MjSpec) -> None:
    spec.default.site.group = SITE_GROUP
    spec.default.site.size = [0.01, 0.01, 0.01]
    for role, colour in ROLE_COLOURS.items():
        default = spec.add_default(role, spec.default)
        default.geom.rgba = colour
        default.geom.type = mujoco.mjtGeom.mjGEOM_CAPSULE


def _add_mast(spec: mujoco.MjSpec, chain: Chain, nodes: Array, rigging: Rigging) -> dict[int, mujoco.MjsBody]:
    """Add mast, feed and flange with the three fixed hubs; returns them by node."""
    origin, R = chain.mount[:3, 3], chain.mount[:3, :3]
    mast = spec.worldbody.add_body(name=names.MAST, pos=origin)
    mast.add_joint(
        name=names.FEED,
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, 1],
        range=rigging.feed_range,
        limited=mujoco.mjtLimited.mjLIMITED_FALSE,
        info="mast",
    )
    radius, length = rigging.mast_diameter / 2, rigging.mast_length
    mast.add_geom(
        name=names.MAST,
        default=spec.find_default("mast"),
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[radius, length / 2, 0],
        pos=[0, 0, length / 2],
        contype=part_bits(chain, -1)["contype"],
        conaffinity=part_bits(chain, -1)["conaffinity"] & ~1,  # it fills the riser by design; its fit is checked apart
    )
    _set_pipe_inertia(mast, radius, rigging.mast_wall, length, rigging.mast_density)
    _add_joint_drives(spec, names.FEED, names.FEED, rigging, force=None)
    flange = mast.add_body(name=names.FLANGE)
    flange.add_site(name=names.FLANGE, zaxis=R[:, 2])
    _add_force_sensors(spec, names.FLANGE, names.FLANGE)
    hubs = {}
    for node in range(3):
        hubs[node] = flange.add_body(name=chain.truss.nodes[node], pos=nodes[node] - origin)
        _dress_hub(spec, hubs[node], chain, node)
    return hubs


def _set_pipe_inertia(body: mujoco.MjsBody, radius: float, wall: float, length: float, density: float) -> None:
    inner = radius - wall
    mass = density * np.pi * (radius**2 - inner**2) * length
    across = mass * (3 * (radius**2 + inner**2) + length**2) / 12
    body.explicitinertial = True
    body.mass, body.ipos = mass, [0, 0, length / 2]
    body.inertia = [across, across, mass * (radius**2 + inner**2) / 2]


def _dress_hub(spec: mujoco.MjSpec, body: mujoco.MjsBody, chain: Chain, node: int) -> None:
    arm, name = chain.manipulator, chain.truss.nodes[node]
    bits = part_bits(chain, int(chain.truss.node_module[node]))
    body.add_geom(
        name=name,
        default=spec.find_default("hub"),
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[arm.hub.radius, 0, 0],
        **bits,
    )
    body.add_site(name=name)


def _weigh_hubs(hubs: dict[int, mujoco.MjsBody], chain: Chain, rigging: Rigging) -> None:
    arm = chain.manipulator
    inertia = 0.4 * arm.hub_mass * arm.hub.radius**2
    for node, mass in zip(hubs, make_hub_masses(arm, chain.truss, lumped=rigging.lumped)[list(hubs)], strict=True):
        hubs[node].explicitinertial = True
        hubs[node].ipos = [0, 0, 0]  # without a place MuJoCo writes no inertia into the XML
        hubs[node].mass, hubs[node].inertia = mass, [inertia] * 3


def _add_hubs(spec: mujoco.MjSpec, chain: Chain, nodes: Array) -> dict[int, mujoco.MjsBody]:
    """Add the free hubs, point masses on three slides each; returns them by node."""
    hubs = {}
    for node in np.setdiff1d(chain.truss.free, chain.truss.rings).tolist():
        name = chain.truss.nodes[node]
        hubs[node] = spec.worldbody.add_body(name=name, pos=nodes[node], info=name)
        for joint, axis in zip(names.slides(name), np.eye(3), strict=True):
            hubs[node].add_joint(name=joint, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        _dress_hub(spec, hubs[node], chain, node)
    return hubs


def _add_member(
    spec: mujoco.MjSpec,
    chain: Chain,
    index: int,
    member: Member,
    nodes: Array,
    seat: Seat,
    inertia: MemberInertia,
    rigging: Rigging,
) -> None:
    """Add one member, its closure and its sensors."""
    span = nodes[member.ends[1]] - nodes[member.ends[0]]
    length = float(np.linalg.norm(span))
    body = seat.body.add_body(name=member.name, pos=seat.place, info=member.name)
    if index in chain.truss.ring_actuators:
        mujoco.mju_mat2Quat(body.quat, pinned_rotation(seat.turn, span).ravel())
        pin_barrel(body, chain, member)
    else:
        body.quat = quaternions_to((seat.turn.T @ span)[None] / length)[0]
        body.add_joint(name=member.name, type=mujoco.mjtJoint.mjJNT_BALL)
    body.add_site(name=names.near(member.name))
    _set_inertia(body, inertia, (index, 0), outward=1.0)
    if member.role == "actuator":
        _add_cylinder(spec, chain, index, member, body, length, inertia, rigging)
    else:
        _add_tube(spec, chain, index, member, body, length, inertia, rigging)
    far = chain.truss.nodes[member.ends[1]]
    hold_sites(spec, names.closure(member.name), names.far(member.name), far, rigging.timestep, info=member.name)
    _add_force_sensors(spec, member.name, names.near(member.name))


def _add_tube(
    spec: mujoco.MjSpec,
    chain: Chain,
    index: int,
    member: Member,
    body: mujoco.MjsBody,
    length: float,
    inertia: MemberInertia,
    rigging: Rigging,
) -> None:
    """Dress a tube; an elastic one gets its far half on a slide with a spring."""
    tube = chain.manipulator.tubes[member.section]
    bits = part_bits(chain, member.module)
    gap = min(chain.manipulator.hub.radius, length / 4)
    ends = [0, 0, gap, 0, 0, length - gap]
    shape = {"default": spec.find_default(member.role), "size": [tube.outer_diameter / 2, 0, 0], **bits}
    body.add_geom(name=member.name, fromto=ends, **shape)
    if rigging.elastic:
        body = body.add_body(name=names.half(member.name), pos=[0, 0, length])
        modulus = chain.manipulator.materials[tube.material].youngs_modulus
        body.add_joint(
            name=names.slide(member.name),
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=[0, 0, 1],
            stiffness=modulus * tube.area / length,
        )
        _set_inertia(body, inertia, (index, 1), outward=-1.0)
        length = 0.0
    body.add_site(name=names.far(member.name), pos=[0, 0, length])


def _set_inertia(body: mujoco.MjsBody, inertia: MemberInertia, segment: tuple[int, int], outward: float) -> None:
    transverse, axial = np.maximum(inertia.centroidal[segment], LEAST_INERTIA)
    body.explicitinertial = True
    body.mass = max(inertia.mass[segment], LEAST_MASS)
    body.ipos = [0, 0, outward * inertia.centre[segment]]
    body.inertia = [transverse, transverse, axial]


def _add_cylinder(
    spec: mujoco.MjSpec,
    chain: Chain,
    index: int,
    member: Member,
    barrel: mujoco.MjsBody,
    length: float,
    inertia: MemberInertia,
    rigging: Rigging,
) -> None:
    """Dress the barrel and add the rod with its slide, drives and sensors."""
    part: Cylinder = chain.manipulator.cylinders[member.section]
    bits = part_bits(chain, member.module)
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
        name=names.slide(member.name),
        type=mujoco.mjtJoint.mjJNT_SLIDE,
        axis=[0, 0, 1],
        ref=length - part.retracted,
        range=[0, part.stroke],
        limited=mujoco.mjtLimited.mjLIMITED_FALSE,
    )
    rod.add_geom(
        name=names.rod(member.name),
        default=spec.find_default("rod"),
        fromto=[0, 0, 0, 0, 0, -part.rod_length],
        size=[part.rod / 2, 0, 0],
        **bits,
    )
    _set_inertia(rod, inertia, (index, 1), outward=-1.0)
    rod.add_site(name=names.far(member.name))
    if index in chain.truss.ring_actuators:
        pin_rod(spec, chain, member, rod, rigging)
    spec.add_numeric(name=f"{member.name}/retracted", data=[part.retracted])
    _add_joint_drives(spec, member.name, names.slide(member.name), rigging, force=(part.pull, part.push))
    add = spec.add_sensor
    site, joint = mujoco.mjtObj.mjOBJ_SITE, mujoco.mjtObj.mjOBJ_JOINT
    add(
        name=names.length(member.name),
        type=mujoco.mjtSensor.mjSENS_JOINTPOS,
        objtype=joint,
        objname=names.slide(member.name),
    )
    add(
        name=names.drive_force(member.name),
        type=mujoco.mjtSensor.mjSENS_FORCE,
        objtype=site,
        objname=names.far(member.name),
    )


def _add_joint_drives(
    spec: mujoco.MjSpec, owner: str, joint: str, rigging: Rigging, force: tuple[float, float] | None
) -> None:
    """Add the rigid drive and the servo of a slide; which one is active is chosen after compilation."""
    spec.add_equality(
        name=names.drive(owner),
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=joint,
        solref=[SOLREF_STEPS * rigging.timestep, SOLREF_RATIO],
        solimp=SOLIMP,
        active=False,
        data=[0.0] * 12,
    )
    servo = spec.add_actuator(
        name=names.servo(owner),
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        group=SERVO_GROUP,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
    )
    servo.gainprm[0] = rigging.servo_stiffness
    reference = spec.joint(joint).ref
    servo.biasprm[:3] = [rigging.servo_stiffness * reference, -rigging.servo_stiffness, -rigging.servo_damping]
    if force is not None:
        servo.forcelimited = mujoco.mjtLimited.mjLIMITED_TRUE
        servo.forcerange = [-force[0], force[1]]  # pushing the rod out compresses the member


def _add_force_sensors(spec: mujoco.MjSpec, owner: str, site: str) -> None:
    kind = mujoco.mjtSensor
    for name, sensor in ((names.force(owner), kind.mjSENS_FORCE), (names.torque(owner), kind.mjSENS_TORQUE)):
        spec.add_sensor(name=name, type=sensor, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)
