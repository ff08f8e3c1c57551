"""A second route to forces: the arm as many mass points, summed one by one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.description.sections import Cylinder
from vgtsim.kinematics import Chain

_GAUSS = ((1 - 1 / np.sqrt(3)) / 2, (1 + 1 / np.sqrt(3)) / 2)  # two points integrate a quadratic exactly


@dataclass(frozen=True)
class Cloud:
    """Mass points of an arm: `points(q)` gives their positions, `masses` and `weighty` belong to them.

    The thickness of a member enters through its direction: û as the position of a mass equal to the
    moment of inertia of the thickness has the right momentum about any point, and no weight.
    """

    chain: Chain
    payload_mass: float
    payload_radius: float

    def points(self, q):
        arm, truss = self.chain.manipulator, self.chain.truss
        n = self.chain.nodes(q)
        balls = np.setdiff1d(np.arange(len(truss.nodes)), truss.rings[:, :, 1])
        parts, masses, weighty = [n[..., balls, :]], [np.full(len(balls), arm.hub_mass)], [np.ones(len(balls))]
        for foot, middle, head in truss.rings.reshape(-1, 3):
            block = arm.block_of(truss.node_module[middle])
            first, second = n[..., foot, :], n[..., head, :]
            height = arm.modules[truss.node_module[middle]].joint_offset
            mass = arm.materials[block.material].density * np.pi / 4 * block.diameter**2 * height
            own = 2 * 0.4 * arm.hub_mass * arm.hub.radius**2
            parts += [(first + share * (second - first))[..., None, :] for share in _GAUSS]
            parts.append(((second - first) / height)[..., None, :])
            masses.append(np.array([mass / 2, mass / 2, mass * block.diameter**2 / 16 + own]))
            weighty.append(np.array([1.0, 1.0, 0.0]))
        straight = self.chain.nodes(self.chain.straight)
        for member in truss.members:
            first, second = n[..., member.ends[0], :], n[..., member.ends[1], :]
            span = second - first
            unit = span / np.linalg.norm(span, axis=-1, keepdims=True)
            fixed = np.linalg.norm(straight[member.ends[1]] - straight[member.ends[0]])
            for hub, sign, start, end, mass, thickness in self._segments(arm, member, fixed):
                origin = first if hub == 0 else second
                places = [start + share * (end - start) for share in _GAUSS]
                parts += [(origin + sign * place * unit)[..., None, :] for place in places]
                parts.append(unit[..., None, :])
                masses.append(np.array([mass / 2, mass / 2, mass * thickness]))
                weighty.append(np.array([1.0, 1.0, 0.0]))
        tip, mass = self._tip(arm, q)
        return (
            np.concatenate([*parts, tip], axis=-2),
            np.concatenate([*masses, mass]),
            np.concatenate([*weighty, np.ones(len(mass))]),
        )

    def _segments(self, arm, member, length):
        if member.role != "actuator":
            tube = arm.tubes[member.section]
            rho = arm.materials[tube.material].density
            outer, inner = tube.outer_diameter / 2, tube.outer_diameter / 2 - tube.wall
            mass = rho * np.pi * (outer**2 - inner**2) * length
            return [(0, 1.0, 0.0, length, mass, (outer**2 + inner**2) / 4)]
        part: Cylinder = arm.cylinders[member.section]
        rho = arm.materials[part.material].density
        outer, inner = part.bore / 2 + part.barrel_wall, part.bore / 2
        barrel = (0, 1.0, part.eye, part.barrel_length, part.barrel_mass(rho), (outer**2 + inner**2) / 4)
        return [barrel, (1, -1.0, 0.0, part.rod_length, part.rod_mass(rho), (part.rod / 2) ** 2 / 4)]

    def _tip(self, arm, q):
        R, P = self.chain.frames(q)
        turn, origin = R[..., -1, :, :], P[..., -1, :]
        corners = arm.face_side * np.array([[0.5, -0.5 / 3**0.5, 0], [0, 1 / 3**0.5, 0], [-0.5, -0.5 / 3**0.5, 0]])
        plate = (corners + np.roll(corners, 1, axis=0)) / 2  # a triangle is three masses at its edges' middles
        spread = self.payload_radius * np.sqrt(0.6)
        ball = np.concatenate([np.eye(3), -np.eye(3)]) * spread + [0, 0, arm.tip_plate.tool_offset]
        local = np.concatenate([plate, ball])
        masses = np.array([arm.tip_plate_mass / 3] * 3 + [self.payload_mass / 6] * 6)
        return origin[..., None, :] + local @ np.swapaxes(turn, -1, -2), masses

    def loads(self, path, time, gravity):
        """Momentum rate less weight of every point on a path q(t), shape (P, 3): what must be held."""
        h = 2e-3
        p = [self.points(path(time + k * h))[0] for k in (-2, -1, 0, 1, 2)]
        acceleration = (-p[0] + 16 * p[1] - 30 * p[2] + 16 * p[3] - p[4]) / (12 * h**2)
        _, masses, weighty = self.points(path(time))
        return masses[:, None] * (acceleration - weighty[:, None] * np.array([0, 0, -gravity]))
