"""Questions about an arm in one posture or in many: tool, Jacobian, goals and member forces.

Each function takes an arm, or a site: then the arm hangs from the site's mast and carries the site's payload. Inputs q are
canonical and have shape (..., n), from the mast to the tool; see `kinematics.chain`. Leading dimensions are batches.
Positions are in frame G, whose z axis points up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.constants import PAYLOAD_RADIUS
from vgtsim.description import Method, Payload
from vgtsim.kinematics import Chain
from vgtsim.planning import make_problem
from vgtsim.positioning import solve_by_method, tool_goal
from vgtsim.site import ArmAlone, Place, Site
from vgtsim.statics import MemberForces, make_load_model, solve_members


@dataclass(frozen=True)
class Posture:
    """An arm in one posture, or in a batch of them.

    Attributes:
        q: Inputs, shape (..., n).
        lengths: Actuator lengths, shape (..., J), m.
        nodes: Positions of the nodes, shape (..., N, 3), m, in the order of `arm.truss.nodes`.
        tool: Tool point, shape (..., 3), m.
        direction: Outward unit normal of the tip plate, shape (..., 3).
    """

    q: Array
    lengths: Array
    nodes: Array
    tool: Array
    direction: Array


def forward_kinematics(arm: Chain | Site, q: ArrayLike | None = None, *, lengths: ArrayLike | None = None) -> Posture:
    """Find the posture of inputs, shape (..., n), or of actuator lengths, shape (..., J), m; by default the straight one.

    With lengths given, every module stays on the assembly mode of the straight posture.

    Raises:
        AssemblyError: A module does not assemble; the error names it.
        SingularityError: The lengths lie behind a singularity.
    """
    chain = _place(arm).chain
    if lengths is not None:
        q = chain.inputs_from_lengths(lengths)
    at = np.asarray(chain.straight if q is None else q, float)
    tool, direction = chain.tool(at)
    return Posture(q=at, lengths=chain.lengths(at), nodes=chain.nodes(at), tool=tool, direction=direction)


def jacobian(arm: Chain | Site, q: ArrayLike) -> Array:
    """Jacobian of the tool in closed form at inputs of shape (..., n).

    It has shape (..., 6, n): velocity of the tool point, m, over angular velocity of the tip plate, rad, per unit rate of
    each input, in frame G.

    Source: section 6.1.2.
    """
    return _place(arm).chain.jacobian(q)


def solve_goal(
    arm: Chain | Site,
    position: ArrayLike,
    direction: ArrayLike,
    *,
    method: str = "nullspace",
    objective: str | Sequence[str] = "mid_stroke",
) -> Posture:
    """Find a posture with the tool at a goal, inside the strokes; in a site also clear of everything.

    Args:
        arm: An arm, which starts straight, or a site, whose arm starts in the posture of its scene.
        position: Tool point, shape (3,), m.
        direction: Outward normal of the tip plate, shape (3,).
        method: Use of the redundancy: "nullspace", "coupled", "anchored" or "shape".
        objective: Terms of the objective, each "NAME" or "NAME:WEIGHT"; see `description.motion.OBJECTIVES`.

    Raises:
        ReachError: No posture meets the goal, or none clear of everything. The error holds the shortfall.
        DescriptionError: An objective is not known, or needs a site.
    """
    x, y, z = np.asarray(position, float)
    u, v, w = np.asarray(direction, float)
    terms, place = (objective,) if isinstance(objective, str) else tuple(objective), _place(arm)
    problem = make_problem(place, tool_goal((x, y, z), (u, v, w)), Method(method), terms)
    return forward_kinematics(arm, solve_by_method("ik", problem, place.start).q)


def member_forces(arm: Chain | Site, q: ArrayLike, *, payload: float | None = None) -> MemberForces:
    """Find the forces in all members at rest, by the method of joints, at inputs of shape (..., n).

    The payload is the mass at the tool point, kg; by default that of the site, or none. The axial forces are `bar`, shape
    (..., M), N, tension positive, in the order of `arm.truss.member_names`; see `MemberForces`.

    Raises:
        TrussError: The truss is a mechanism in this posture.
    """
    place, model = _place(arm), None
    if payload is not None:
        model = make_load_model(place.chain, Payload(mass=payload, radius=PAYLOAD_RADIUS), place.gravity)
    return solve_members(model or place.load_model, place.chain.nodes(q))


def _place(arm: Chain | Site) -> Place:
    return arm if isinstance(arm, Site) else ArmAlone(arm)
