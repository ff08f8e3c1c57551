"""The passage that an open truss leaves for a hose or conveyor along its axis (section 1.2.2 and figure 1.6).

The line runs through the middles of the faces and leaves each at right angles: in a module that bends it is an arc.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.geometry import segment_distance
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import member_radii
from vgtsim.site import Site

Array = NDArray[np.float64]

_STRAIGHT = 1e-9  # rad between faces that count as parallel


@dataclass(frozen=True)
class Passage:
    """Narrowest place of the passage over some postures.

    Attributes:
        bore: Diameter of the widest line about the axis, m, and the member `member` that it would touch.
        radius: Least radius of a bend of the axis, m, in the module `module`; infinite where none bends.
    """

    bore: float
    member: str
    radius: float
    module: str


def measure_passage(chain: Chain, q: Array) -> Passage:
    """The passage at inputs of shape (T, n)."""
    R, P = chain.frames(q)
    normal, chord = R[..., 2], np.diff(P, axis=1)
    turn = normal[:, 1:] - normal[:, :-1]
    half = np.arcsin(np.clip(np.linalg.norm(turn, axis=-1) / 2, 0, 1))  # of the angle between faces
    span = np.linalg.norm(chord, axis=-1)
    bent = half > _STRAIGHT
    radius = np.where(bent, span / (2 * np.sin(np.where(bent, half, 1.0))), np.inf)
    # the arc's middle lies beyond the chord's, away from its centre, towards which its direction turns
    rise = span / 2 * np.tan(half / 2)
    out = -turn / np.maximum(np.linalg.norm(turn, axis=-1), _STRAIGHT)[..., None]
    middle = P[:, :-1] + chord / 2 + rise[..., None] * out
    first, last = np.concatenate([P[:, :-1], middle], axis=1), np.concatenate([middle, P[:, 1:]], axis=1)
    nodes, truss = chain.nodes(q), chain.truss
    ends = nodes[:, truss.ends]
    away = segment_distance(ends[:, :, None, 0], ends[:, :, None, 1], first[:, None], last[:, None])[0]
    free = 2 * (away.min(axis=2) - member_radii(chain.manipulator, truss)).min(axis=0)
    narrow, tight = int(np.argmin(free)), int(np.argmin(radius.min(axis=0)))
    names = [module.name for module in chain.manipulator.modules]
    return Passage(float(free[narrow]), truss.members[narrow].name, float(radius.min()), names[tight])


def check_passage(site: Site, q: Array) -> None:
    """Refuse a line that the arm does not pass in some posture, inputs of shape (T, n).

    Raises:
        DescriptionError: It is too thick, or too stiff for a bend: by how much, and where.
    """
    line = site.task.conveyance
    if line is None:
        return
    found = measure_passage(site.chain, q)
    if line.diameter > found.bore:
        over = f"{line.diameter:.4g} m, {line.diameter - found.bore:.4g} m too thick to pass {found.member}"
        raise site.scene.error(
            "conveyance.diameter", over, f"at most {found.bore:.4g} m, the passage of {site.arm.name}"
        )
    if line.bend_radius > found.radius:
        over = f"{line.bend_radius:.4g} m, while {found.module} bends its axis to {found.radius:.4g} m"
        raise site.scene.error("conveyance.bend_radius", over, f"at most {found.radius:.4g} m")
