"""The arm in MJCF with rigid sections: each static section one body, each member of an active module one length row.

The members' mass sits in their hubs, and no geom meets another: forces of members follow from statics, contact from the
distances between the arm's capsules. A model has a sixth of the unknowns and of the rows of the model of `arm`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, find_rigid_sections
from vgtsim.mjcf import names
from vgtsim.mjcf.defaults import ROLE_COLOURS, add_defaults
from vgtsim.mjcf.fittings import set_point_masses
from vgtsim.mjcf.hubs import add_ball, add_fixed_hubs, add_free_hub, add_tip
from vgtsim.mjcf.pose import MastPose, make_mast_pose
from vgtsim.mjcf.rigging import Rigging

_DRAWN = 0.02  # half the width of a drawn length row, m


def add_sections(spec: mujoco.MjSpec, rigging: Rigging) -> None:
    """Add mast, feed, hubs, rigid sections, the last with the tip plate, and length rows commanded from the reference pose."""
    truss, sections = rigging.chain.truss, find_rigid_sections(rigging.chain)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    add_defaults(spec, rigging)
    add_tip(spec, rigging, sections.nodes(sections.count - 1))
    hubs, groups = sections.nodes(-1), [sections.nodes(number) for number in range(1, sections.count - 1)]
    for nodes in sorted([*([hub] for hub in hubs), *groups], reverse=True):  # from the tip to the mast, see `add_arm`
        if nodes[0] in hubs:
            add_free_hub(spec, rigging, nodes[0])
        else:
            _add_section(spec, rigging, nodes)
    add_fixed_hubs(spec, rigging, sections.nodes(0))
    for index in sections.rows.tolist():
        member = truss.members[index]
        name = names.row(member.name)
        tendon = spec.add_tendon(name=name, rgba=ROLE_COLOURS[member.role], width=_DRAWN)
        for node in member.ends:
            tendon.wrap_site(truss.nodes[node])
        spec.add_equality(
            name=name,
            type=mujoco.mjtEq.mjEQ_TENDON,
            objtype=mujoco.mjtObj.mjOBJ_TENDON,
            name1=name,
            data=[0.0] * 12,
            info=member.name,
        )


def _add_section(spec: mujoco.MjSpec, rigging: Rigging, nodes: list[int]) -> None:
    """Add a free section: its nodes' masses about their middle."""
    arm, truss = rigging.chain.manipulator, rigging.chain.truss
    middle, name = rigging.nodes[nodes].mean(axis=0), names.section(truss.nodes[nodes[-1]])
    body = spec.worldbody.add_body(name=name, pos=middle, info=name)
    body.add_freejoint(name=name)
    places = rigging.nodes[nodes] - middle
    for node, place in zip(nodes, places, strict=True):
        body.add_site(name=truss.nodes[node], pos=place)
        add_ball(spec, body, rigging, node, tuple(place))
    balls = 0.4 * len(nodes) * arm.hub_mass * arm.hub.radius**2 * np.eye(3)
    set_point_masses(body, rigging.hub_masses[nodes], places, balls)


@dataclass(frozen=True)
class SectionPose:
    """Where the parts of an arm with rigid sections stand in the arrays of its model; F free hubs, S moving sections.

    Attributes:
        hubs: Nodes of the free hubs, shape (F,); `reference` are their places at zero slides, shape (F, 3), m.
        nodes: Nodes of each section, shape (S, K), the first one repeated where a section has fewer than K.
        places: Their places in the section's frame, shape (S, K, 3), m, and `weight` 1 or 0, shape (S, K).
        bodies: Body of each section, shape (S,).
        slides, moves: Coordinates of the hubs' slides and first one of the sections', shapes (F, 3) and (S,).
        slide_speeds, move_speeds: The same of the degrees of freedom.
        mast: Where the motions of the mast stand.
    """

    hubs: Index
    reference: Array
    nodes: Index
    places: Array
    weight: Array
    bodies: Index
    slides: Index
    moves: Index
    slide_speeds: Index
    move_speeds: Index
    mast: MastPose

    def find_frames(self, nodes: Array) -> tuple[Array, Array]:
        """Origins, shape (S, 3), m, and rotations, shape (S, 3, 3), of the sections, for nodes of shape (N, 3), m.

        Source: W. Kabsch, Acta Crystallographica A 32 (1976), 922-923.
        """
        here, weight = nodes[self.nodes], self.weight[..., None] / self.weight.sum(axis=1)[:, None, None]
        middle, seat = (here * weight).sum(axis=1), (self.places * weight).sum(axis=1)
        spread = np.swapaxes((here - middle[:, None]) * weight, 1, 2) @ (self.places - seat[:, None])
        U, _, V = np.linalg.svd(spread)
        U[:, :, 2] *= np.linalg.det(U @ V)[:, None]
        R = U @ V
        return middle - (R @ seat[:, :, None])[..., 0], R

    def fill(self, nodes: Array, qpos: Array) -> None:
        """Write the coordinates at which the hubs stand at nodes, shape (N, 3), m, into qpos, shape (nq,)."""
        qpos[self.slides] = nodes[self.hubs] - self.reference
        P, R = self.find_frames(nodes)
        qpos[self.moves[:, None] + np.arange(3)] = P
        for place, rotation in zip(self.moves, R, strict=True):
            mujoco.mju_mat2Quat(qpos[place + 3 : place + 7], rotation.ravel())
        self.mast.fill(nodes, qpos)


def make_section_pose(model: mujoco.MjModel, chain: Chain) -> SectionPose:
    """Look up the parts of an arm with rigid sections in its compiled model."""
    truss, sections = chain.truss, find_rigid_sections(chain)
    hubs = np.array(sections.nodes(-1), dtype=int)
    groups = [sections.nodes(number) for number in range(1, sections.count)]
    bodies = [names.section(truss.nodes[group[-1]]) for group in groups[:-1]] + [names.TIP]
    most = max(len(group) for group in groups)
    nodes = np.array([group + group[:1] * (most - len(group)) for group in groups])
    slides = [[model.joint(joint).id for joint in names.slides(truss.nodes[hub])] for hub in hubs]
    joints, moves = np.array(slides, dtype=int).reshape(-1, 3), np.array([model.joint(body).id for body in bodies])
    sites = np.array([[model.site(truss.nodes[node]).id for node in row] for row in nodes])
    return SectionPose(
        hubs=hubs,
        reference=np.array([model.body(truss.nodes[hub]).pos for hub in hubs]).reshape(-1, 3),
        nodes=nodes,
        places=model.site_pos[sites],
        weight=np.array([np.arange(most) < len(group) for group in groups], dtype=float),
        bodies=np.array([model.body(body).id for body in bodies]),
        slides=model.jnt_qposadr[joints],
        moves=model.jnt_qposadr[moves],
        slide_speeds=model.jnt_dofadr[joints],
        move_speeds=model.jnt_dofadr[moves],
        mast=make_mast_pose(model, truss),
    )
