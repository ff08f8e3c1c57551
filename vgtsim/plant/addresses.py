"""Where the quantities of an arm stand in its MuJoCo model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Index
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Truss
from vgtsim.mjcf import names


@dataclass(frozen=True)
class Addresses:
    """Indices into the arrays of a model and its data; N nodes, M members, J cylinders, F free hubs and joint blocks.

    Attributes:
        nodes: Sites of the hubs, shape (N,).
        near, far: Sites of the ends of the members, shape (M,).
        force, torque: First sensor value of the force and torque of each member, shape (M,).
        length: Sensor value of the length of each cylinder, shape (J,).
        drive_force: First sensor value of the force of each drive, shape (J,).
        position: Coordinate in qpos of each slide, the length of its cylinder, shape (J,).
        slide: Degree of freedom of each slide, shape (J,).
        flange: Site of the mast flange.
        flange_force: First sensor value of the flange's force; the torque follows.
        tool: Site of the tool point.
        tip: Body of the tip plate.
        hub_speeds: Degrees of freedom of the free hubs and of the middles of joint blocks, shape (3 F,).
    """

    nodes: Index
    near: Index
    far: Index
    force: Index
    torque: Index
    length: Index
    drive_force: Index
    position: Index
    slide: Index
    flange: int
    flange_force: int
    tool: int
    tip: int
    hub_speeds: Index


def find_rows(data: mujoco.MjData, equalities: Index) -> Index:
    """First constraint row of each of some equalities; rows stay where they are while no equality is switched."""
    first = dict(zip(data.efc_id[: data.ne].tolist()[::-1], range(data.ne - 1, -1, -1), strict=True))
    return np.array([first[row] for row in equalities.tolist()], dtype=int)


def find_addresses(model: mujoco.MjModel, truss: Truss) -> Addresses:
    """Look up the addresses of a truss in its compiled model."""

    def sites(labels: list[str]) -> Index:
        return np.array([model.site(label).id for label in labels], dtype=int)

    def sensors(labels: list[str]) -> Index:
        return np.array([model.sensor(label).adr[0] for label in labels], dtype=int)

    members = list(truss.member_names)
    actuators = [members[i] for i in truss.actuated]
    hubs = [truss.nodes[i] for i in truss.free]
    joint = np.array([model.joint(names.slide(name)).id for name in actuators], dtype=int)
    return Addresses(
        nodes=sites(list(truss.nodes)),
        near=sites([names.near(name) for name in members]),
        far=sites([names.far(name) for name in members]),
        force=sensors([names.force(name) for name in members]),
        torque=sensors([names.torque(name) for name in members]),
        length=sensors([names.length(name) for name in actuators]),
        drive_force=sensors([names.drive_force(name) for name in actuators]),
        position=model.jnt_qposadr[joint],
        slide=model.jnt_dofadr[joint],
        flange=model.site(names.FLANGE).id,
        flange_force=int(model.sensor(names.force(names.FLANGE)).adr[0]),
        tool=model.site(names.TOOL).id,
        tip=model.body(names.TIP).id,
        hub_speeds=np.array([model.joint(joint).dofadr[0] for node in hubs for joint in names.slides(node)], dtype=int),
    )
