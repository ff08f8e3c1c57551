"""Every place where an arm in a posture touches something or comes too near to it.

Members are looked at in points along their axes, twice: first all over, then about the worst point of each member that is near.
What stands around is asked for distances only, so every kind of it is found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.geometry import arm_clearance, segment_distance
from vgtsim.kinematics import member_radii
from vgtsim.site import Site

_POINTS = 25  # along a member, in both passes: the second is exact to 1/600 of its length
_MAST, _PAYLOAD = "mast", "payload"


@dataclass(frozen=True)
class Collision:
    """A part of the arm that is too near to something.

    Attributes:
        module: Module of the part.
        part: A member, a node, or the payload.
        obstacle: A place of the tank, the mast, or another part of the arm.
        point: Point of the part's axis in frame G that is nearest to it, m.
        gap: Distance between the surfaces, m; negative is the depth.
    """

    module: str
    part: str
    obstacle: str
    point: tuple[float, float, float]
    gap: float

    def __str__(self) -> str:
        """One line for people."""
        x, y, z = self.point
        what = f"{-self.gap:.3f} m inside" if self.gap < 0 else f"{self.gap:.3f} m from"
        return f"{self.part} at ({x:.2f}, {y:.2f}, {z:.2f}) m, {what} {self.obstacle}"


def list_collisions(site: Site, q: Array, wanted: float) -> tuple[Collision, ...]:
    """All parts of the arm at inputs of shape (n,) that keep less than `wanted`, m, from something, the deepest first."""
    points = site.surroundings.points(q[None])[0]
    found = [*_with_tank(site, points, wanted), *_with_mast(site, points, wanted), *_with_itself(site, points, wanted)]
    return tuple(sorted(found, key=lambda item: (item.gap, item.part)))


def tell_collisions(collisions: tuple[Collision, ...]) -> list[str]:
    """One line for each module with each thing that it is too near to: its deepest part, and the number of others."""
    groups: dict[tuple[str, str], list[Collision]] = {}
    for item in collisions:
        groups.setdefault((item.module, item.obstacle.split("/")[0]), []).append(item)
    lines = []
    for worst, *others in groups.values():
        more = f", and {len(others)} other part{'s' * (len(others) > 1)} of {worst.module} there" if others else ""
        lines.append(f"{worst}{more}")
    return lines


def _parts(site: Site) -> tuple[list[str], list[str], Array, Index]:
    """Names of members, nodes and payload, their modules, radii, m, and the points at their ends, shape (P, 2)."""
    truss, arm = site.truss, site.arm
    count = len(truss.nodes)
    module = [*truss.module, *truss.node_module, len(arm.modules) - 1]
    radii = np.concatenate([member_radii(site.chain), np.full(count, arm.hub.radius), [site.task.payload.radius]])
    ends = np.concatenate([truss.ends, np.repeat(np.arange(count + 1), 2).reshape(-1, 2)])
    owners = [arm.modules[max(int(m), 0)].name for m in module]
    return [*truss.member_names, *truss.nodes, _PAYLOAD], owners, radii, ends


def _with_tank(site: Site, points: Array, wanted: float) -> list[Collision]:
    names, owners, radii, ends = _parts(site)
    part = np.linspace(0.0, 1.0, _POINTS)
    first, last = points[ends[:, 0]], points[ends[:, 1]]
    places, coarse = _measure(site, first[:, None] + part[:, None] * (last - first)[:, None], radii)
    step = np.linalg.norm(last - first, axis=1) / (_POINTS - 1)
    rows, columns = np.nonzero(coarse.min(axis=1) < wanted + step[:, None])
    found = []
    if not len(rows):
        return found
    worst = coarse.argmin(axis=1)[rows, columns]
    fine = np.clip(part[worst][:, None] + (2 * part - 1) * part[1], 0.0, 1.0)
    line = first[rows, None] + fine[..., None] * (last - first)[rows, None]
    gaps = _measure(site, line, radii[rows])[1][np.arange(len(rows)), :, columns]
    for row, column, line_, gap in zip(rows.tolist(), columns.tolist(), line, gaps, strict=True):
        k = int(np.argmin(gap))
        if gap[k] < wanted:
            found.append(_collision(owners[row], names[row], places[column], line_[k], gap[k]))
    return found


def _measure(site: Site, points: Array, radii: Array) -> tuple[tuple[str, ...], Array]:
    """Places of the tank, and distances of balls from them, shape (R, K, L), m: points of shape (R, K, 3), radii of (R,)."""
    around, none = site.surroundings, np.empty((0, 2), np.intp)
    found = arm_clearance(points[..., None, :], none, [], 0.0, site.tank, around.profile, around.obstacles)
    return found.places, found.distance - radii[:, None, None]


def _with_mast(site: Site, points: Array, wanted: float) -> list[Collision]:
    """All but the first module, which hangs from it."""
    names, owners, radii, ends = _parts(site)
    axis, thick = site.surroundings.mast_axis, site.task.mast.outer_diameter / 2
    first, last = points[ends[:, 0]], points[ends[:, 1]]
    distance, s, _ = segment_distance(first, last, axis[0], axis[1])
    gap, at = distance - radii - thick, first + s[:, None] * (last - first)
    hung = site.arm.modules[0].name
    near = [i for i in np.flatnonzero(gap < wanted).tolist() if owners[i] != hung]
    return [_collision(owners[i], names[i], _MAST, at[i], gap[i]) for i in near]


def _with_itself(site: Site, points: Array, wanted: float) -> list[Collision]:
    pairs = site.surroundings.capsules.judged_pairs
    shown = [*site.truss.member_names, *["the tip plate"] * 3, _PAYLOAD]
    owners = [site.arm.modules[int(m)].name for m in site.surroundings.capsules.module]
    (i, j), ends = pairs.members, pairs.ends
    a, b, c, d = (points[ends[part, k]] for part in (i, j) for k in (0, 1))
    distance, s, _ = segment_distance(a, b, c, d)
    gap, at = distance - pairs.radii[i] - pairs.radii[j], a + s[:, None] * (b - a)
    near = np.flatnonzero(gap < wanted).tolist()
    return [_collision(owners[i[k]], shown[i[k]], shown[j[k]], at[k], gap[k]) for k in near]


def _collision(module: str, part: str, obstacle: str, point: Array, gap: float) -> Collision:
    x, y, z = (float(value) for value in point)
    return Collision(module, part, obstacle, (x, y, z), float(gap))
