"""The tetrahedral module, a hinge between two static triangles (section 3.3), as a kind of module, see `sets`.

Nodes n1 and n4 are the apexes of two isosceles triangles on the common hinge line n2 n3 of length L2; their
sides are L1, and the actuator l joins n1 and n4. Frame B sits at the centroid of n1 n2 n3 and frame T at that
of n4 n2 n3, X along n2 - n3, Y towards the apex, Z by the right-hand rule. In the order of `triangle` the
corners of the base are n2, n1, n3 and those of the top n2, n4, n3.

The input theta turns the top about X. With 0 < theta < pi the module lies on +Z of B and on -Z of T, so faces mate with
their neighbours'; this is the working branch. At theta = 0 the top lies on the base and n4 on n1; at pi it
lies flat beside it, the length l = 2 h is the longest, and dtheta/dl is infinite: the two branches +theta and
-theta meet at these two flat poses.
Differs: the text attaches T to n1 n2 n4, a face that contains the actuator; equation 3.4 is right for n2 n3
n4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.compilation import compiled
from vgtsim.description import Tetrahedral
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.modules.sets import TRIANGLE, Groups, Kind, ModuleSet, PlannedMember

_FOLDED = 1e-9  # sine of half an angle at which n4 lies on n1 but for rounding: the length has no derivative there


@compiled
def fill_hinges(
    x: Array,
    figures: Array,
    straight: Array,
    marks: Mask,
    frame: Array,
    motion: Array,
    length: Array,
    slope: Array,
    inner: Array,  # noqa: ARG001  # there are none
    inner_slope: Array,  # noqa: ARG001
) -> None:
    """See `Fill`: equations 3.3 and 3.4; the figure is the altitude."""
    for i in range(x.shape[0]):
        for m in range(x.shape[1]):
            h, theta = figures[m, 0], x[i, m, 0]
            placed = np.isfinite(theta)
            if not placed:
                theta = straight[m, 0]
            half, third = np.sin(theta / 2), h / 3
            pull = h * np.cos(theta / 2) * np.sign(half)
            marks[i, m, 0] = marks[i, m, 1] = placed
            marks[i, m, 2] = placed and abs(half) >= _FOLDED
            marks[i, m, 3] = placed and 0 < theta < np.pi and pull > 0
            cosine, sine = np.cos(theta), np.sin(theta)
            if frame.size:
                frame[i, m] = 0.0
                frame[i, m, 0, 0] = 1.0
                frame[i, m, 1, 1], frame[i, m, 1, 2], frame[i, m, 1, 3] = cosine, -sine, third * (cosine - 1)
                frame[i, m, 2, 1], frame[i, m, 2, 2], frame[i, m, 2, 3] = sine, cosine, third * sine
            if motion.size:  # a turn about X through the hinge line
                motion[i, m] = 0.0
                motion[i, m, 0, 0], motion[i, m, 0, 4], motion[i, m, 0, 5] = 1.0, -third * sine, third * cosine
            if length.size:  # as a sine of the half angle, which is exact near theta = 0
                length[i, m, 0], slope[i, m, 0, 0] = 2 * h * abs(half), pull


@dataclass(frozen=True, eq=False)
class Hinges(ModuleSet):
    """Tetrahedral modules of sides L1 and L2 each, shape (M, 2), m."""

    sides: Array
    fill = staticmethod(fill_hinges)
    inputs = 1
    units = ("rad",)
    turns_alike = True  # hinges open alike wherever they stand

    def __post_init__(self) -> None:
        """Refuse sides that do not make a triangle."""
        side, hinge = self.sides.T
        if not np.all((hinge > 0) & (hinge < 2 * side)):
            detail = f"static triangles with sides {side} m on a hinge of {hinge} m are flat"
            raise AssemblyError("tetrahedron", float(np.max(hinge - 2 * side)), detail)

    @cached_property
    def height(self) -> Array:
        """Altitude h of the static triangles, shape (M,), m (3.1)."""
        side, hinge = self.sides.T
        return np.sqrt(side**2 - hinge**2 / 4)

    @cached_property
    def figures(self) -> Array:
        """Altitude of each, shape (M, 1), m."""
        return self.height[:, None].copy()

    def refuse(self, x: Array) -> Exception:
        """A hinge that is folded flat."""
        if not np.all(np.isfinite(x)):
            return ValueError(f"a hinge angle of {', '.join(self.names)} is no number")
        folded = np.any(np.abs(np.sin(x[..., 0] / 2)) < _FOLDED, axis=0)
        return AssemblyError(self.names[int(np.argmax(folded))], 0.0, "folded flat: n4 lies on n1")

    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """Hinge angles, shape (..., M, 1), rad, in closed form, on the side of the flat pose on which the start is.

        The second result, shape (..., M), is one where the length is below the flat pose's. A start that is absent
        means the working branch. Source: equation 3.2. Differs: as twice an arcsine, which is exact near theta = 0.
        """
        ratio = lengths / (2 * self.height[:, None])
        theta = 2 * np.arcsin(np.clip(ratio, 0.0, 1.0))
        if start is not None:
            theta = np.where(start > np.pi, 2 * np.pi - theta, np.where(start < 0, -theta, theta))
        return theta, np.where((ratio > 0) & (ratio < 1), 1.0, 0.0)[..., 0]

    def tell_end(self, lengths: Array, start: Array | None, part: float) -> SingularityError:
        """A length at or beyond the flat pose, or none."""
        del start, part
        name, longest, wanted = self.names[0], 2 * float(self.height[0]), float(lengths[0, 0])
        return SingularityError(name, 0.0, f"{name}/actuator/1", abs(wanted - longest), min(1.0, longest / wanted))

    def conditioned(self, x: Array) -> Array:
        """dl/dtheta over the altitude: the cosine of half the hinge angle."""
        return (np.cos(x / 2) * np.sign(np.sin(x / 2)))[..., None]

    def bend(self, angle: Array, half: Array) -> Array:  # noqa: ARG002
        """The hinge opens by the angle; it has no other direction."""
        return self.straight + angle[..., None]


def make_hinges(modules: Sequence[Tetrahedral], side: float) -> Hinges:
    """The set of described modules; sides that are not given are the arm's, m."""
    faces = np.array([module.faces(side)[0] for module in modules])
    straight = np.array([[module.straight] for module in modules])
    return Hinges(tuple(module.name for module in modules), straight, faces[:, [0, 2]])


def plan_members(module: Tetrahedral, groups: Groups) -> list[PlannedMember]:
    """The actuator between the apexes: the triangles' other members are battens."""
    return [PlannedMember("actuator", module.cylinder, groups["base"][1], groups["top"][1], 1)]


KIND = Kind(plan=plan_members, top=(1,), battens=TRIANGLE[:2], make_set=make_hinges)
