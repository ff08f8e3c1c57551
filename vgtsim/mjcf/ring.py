"""Joint blocks in MJCF, and how an actuator is pinned between two of them.

A block is one body on three slides and a ball, its middle at the origin and Z from its foot to its head. A barrel is a
child of its first block on a hinge about that axis, the pin; a rod turns in its barrel. At its far end the pin of the rod
is held to the second block at its middle and at its head, which leaves it to turn about the block's axis alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, Member, make_block_inertia
from vgtsim.mjcf import names
from vgtsim.mjcf.fittings import hold_sites
from vgtsim.mjcf.hubs import add_ball
from vgtsim.mjcf.pose import block_rotations
from vgtsim.mjcf.rigging import Rigging


@dataclass(frozen=True)
class Seat:
    """The hub or block that carries a node, the node's place in its frame, (3,), m, and its reference rotation, (3, 3)."""

    body: mujoco.MjsBody
    place: Array
    turn: Array


def add_block(spec: mujoco.MjSpec, rigging: Rigging, row: int) -> dict[int, Seat]:
    """Add the joint block of a row of the rings; returns the seats of its nodes."""
    truss, arm, nodes = rigging.chain.truss, rigging.chain.manipulator, rigging.nodes
    block, turn = truss.rings.reshape(-1, 3)[row], block_rotations(truss, nodes).reshape(-1, 3, 3)[row]
    middle = truss.nodes[block[1]]
    body = spec.worldbody.add_body(name=middle, pos=nodes[block[1]], info=middle)
    mujoco.mju_mat2Quat(body.quat, turn.ravel())
    for joint, axis in zip(names.slides(middle), turn, strict=True):  # along x, y and z of G
        body.add_joint(name=joint, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
    body.add_joint(name=names.turn(middle), type=mujoco.mjtJoint.mjJNT_BALL)
    seats = {}
    for node in block:
        place = turn.T @ (nodes[node] - nodes[block[1]])
        body.add_site(name=truss.nodes[node], pos=place)
        seats[int(node)] = Seat(body, place, turn)
    post, module = make_block_inertia(rigging.chain), int(truss.node_module[block[1]])
    half, (transverse, axial) = float(post.centre[row, 0]), post.centroidal[row, 0]
    body.explicitinertial = True
    body.mass, body.ipos = post.mass[row, 0] + 2 * arm.hub_mass, [0, 0, 0]
    # the masses of the balls stand at the ends of the post
    body.inertia = [transverse + 2 * arm.hub_mass * half**2] * 2 + [axial]
    for node, height in ((block[0], -half), (block[2], half)):
        add_ball(spec, body, rigging, int(node), (0, 0, height))
    body.add_geom(
        name=middle,
        default=spec.find_default("hub"),
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, -half, 0, 0, half],
        size=[arm.block_of(module).diameter / 2, 0, 0],
        **rigging.bits(module),
    )
    return seats


def pin_barrel(barrel: mujoco.MjsBody, chain: Chain, member: Member) -> None:
    """Let a barrel turn about the axis of its block, X of the barrel's frame, against a little friction."""
    damping = chain.manipulator.block_of(member.module).pin_damping
    barrel.add_joint(name=names.pin(member.name), type=mujoco.mjtJoint.mjJNT_HINGE, axis=[1, 0, 0], damping=damping)


def pin_rod(spec: mujoco.MjSpec, rigging: Rigging, member: Member, rod: mujoco.MjsBody) -> None:
    """Let a rod turn in its barrel and align its pin with the block at its far end, where its origin is."""
    truss, nodes = rigging.chain.truss, rigging.nodes
    _, middle, head = next(block for block in truss.rings.reshape(-1, 3) if block[1] == member.ends[1])
    lever = float(np.linalg.norm(nodes[head] - nodes[middle]))
    rod.add_joint(name=names.roll(member.name), type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
    rod.add_site(name=names.lug(member.name), pos=[lever, 0, 0])
    hold_sites(spec, names.alignment(member.name), names.lug(member.name), truss.nodes[head])
