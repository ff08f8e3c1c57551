"""The inner surface of a tank: a curve turned about the tank axis.

The curve lies in the half-plane (r, z) of frame G and runs from the lowest point on the axis to the crown. Each piece
has constant curvature and each joint is tangent, so the tank is convex and has a normal everywhere. A flat floor and
the wall are pieces of no curvature and need no case of their own.

A profile may be a table of heights and radii: straight lines with rounded corners, and a dome cap. The corners are rounded
from inside, so the tank is never wider than its table, and at a right angle 0.41 of the arc's radius narrower. A tangent at
every joint is needed by the distances.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import acos, asin, atan, atan2, ceil, cos, inf, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Shell, Tank
from vgtsim.errors import DescriptionError

_RINGS, _MOST_RINGS = (1.0, 2.0, 5.0), 6  # m between rings, and how many are not too many
_UPRIGHT = 1e-9  # rad: nearer to upright than this a line is upright
_FLOOR, _WALL = pi / 4, 3 * pi / 4  # headings up to which a line is floor, and up to which it is wall
_FLAT = 1e-12  # rad


@dataclass(frozen=True)
class Profile:
    """The whole curve: dish, knuckle, wall, haunch, dome, from the lowest point to the crown."""

    pieces: tuple[Piece, ...]
    _rims: dict[tuple[float, float], float] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def inner_radius(self) -> float:
        """Radius of the wall, m."""
        return max(piece.start[0] for piece in self.pieces)

    @property
    def crown(self) -> float:
        """Height of the top point on the axis, m."""
        return self.pieces[-1].end[1]

    def rim(self, bore: float, aside: float = 0.0) -> float:
        """Lowest height, m, at which a bore of that radius meets the dome, its axis `aside` of the tank's; worked out once."""
        if (bore, aside) not in self._rims:
            self._rims[bore, aside] = float(self.ceiling_at(aside + bore))
        return self._rims[bore, aside]

    @cached_property
    def figures(self) -> Array:
        """First point, direction there, last point, direction there, m, and curvature, 1/m, of the P pieces, (P, 9)."""
        rows = []
        for piece in self.pieces:
            last = piece.heading + piece.turn
            along, leaving = (cos(piece.heading), sin(piece.heading)), (cos(last), sin(last))
            rows.append([*piece.start, *along, *piece.end, *leaving, piece.curvature])
        return np.array(rows)

    def points(self, spacing: float) -> Array:
        """Points (r, z) on the curve, shape (n, 2), m, `spacing` apart at most, tangent points included.

        They run from the lowest point to the crown; r is exactly zero at both.
        """
        parts = []
        for piece in self.pieces:
            count = max(1, ceil(piece.length / spacing - 1e-9))
            parts.append(piece.at(np.linspace(0.0, piece.length, count + 1)[:-1]))
        points = np.concatenate([*parts, [self.pieces[-1].end]])
        points[[0, -1], 0] = 0.0
        return points

    def radius_at(self, height: ArrayLike) -> Array:
        """Inner radius, m, at heights z, shape (...), m, clipped to the tank."""
        z = np.clip(np.asarray(height, float), 0.0, self.crown)
        radius = np.full(z.shape, self.inner_radius)
        for piece in self.pieces:
            low, high = piece.start[1], piece.end[1]
            if not piece.turn:
                if abs(cos(piece.heading)) > _UPRIGHT and high > low:
                    slant = piece.start[0] + (z - low) / tan(piece.heading)
                    radius = np.where((z >= low) & (z <= high), slant, radius)
                continue
            chord = np.sqrt(np.clip(piece.radius**2 - (z - piece.centre[1]) ** 2, 0.0, None))
            radius = np.where((z >= low) & (z <= high), piece.centre[0] + chord, radius)
        return radius

    def ceiling_at(self, radius: ArrayLike) -> Array:
        """Height z, m, of dome or haunch at distances from the axis, shape (...), m, at most the inner radius."""
        r = np.asarray(radius, float)
        found = np.full(r.shape, self.pieces[-1].start[1])
        for piece in self.pieces:
            if piece.heading + piece.turn > pi / 2 + _UPRIGHT:
                found = np.where((r <= piece.start[0]), _height_of(piece, r, 1.0), found)
        return found

    def floor_at(self, radius: ArrayLike) -> Array:
        """Height z, m, of the floor at distances from the axis, shape (...), m; the wall's foot beyond it."""
        r = np.minimum(np.asarray(radius, float), self.inner_radius)
        found = np.zeros(r.shape)
        for piece in self.pieces:
            if piece.heading < pi / 2 - _UPRIGHT:
                found = np.where(r >= piece.start[0], _height_of(piece, r, -1.0), found)
        return found

    def volume(self, level: float = inf) -> float:
        """Volume below a level z, m, in m³, by Gauss-Legendre quadrature of pi r² dz along each piece."""
        nodes, weights = np.polynomial.legendre.leggauss(24)
        total = 0.0
        for piece in self.pieces:
            reach = _reach(piece, level)
            s = reach * (nodes + 1) / 2
            climb = np.sin(piece.heading + piece.curvature * s)
            total += pi * reach / 2 * float(weights @ (piece.at(s)[:, 0] ** 2 * climb))
        return total


def _height_of(piece: Piece, r: Array, side: float) -> Array:
    """Height of a piece at distances from the axis, m: of an arc, on the side above (1) or below (-1) its centre."""
    if not piece.turn:
        return piece.start[1] + (r - piece.start[0]) * tan(piece.heading)
    return piece.centre[1] + side * np.sqrt(np.clip(piece.radius**2 - (r - piece.centre[0]) ** 2, 0.0, None))


def _reach(piece: Piece, level: float) -> float:
    """Arc length of the part of a piece below a level, m."""
    if level >= piece.end[1]:
        return piece.length
    if level <= piece.start[1]:
        return 0.0
    if not piece.turn:
        return (level - piece.start[1]) / sin(piece.heading)
    cosine = cos(piece.heading) - piece.curvature * (level - piece.start[1])
    return (acos(min(1.0, max(-1.0, cosine))) - piece.heading) * piece.radius


def make_profile(shell: Shell) -> Profile:
    """Lay out the inner surface of a tank in frame G.

    The dish half-angle theta solves tan(theta/2) (R - rk + rk sin theta) = dish_depth: the dish is tangent to the
    knuckle at that height. The dome cap, tangent to the haunch, has radius Rc = (R² - 2 R r + f²) / (2 (f - r)) with
    the rise f = crown - wall_top and the haunch radius r.

    Raises:
        DescriptionError: The arcs that round the corners of a table are longer than its rows are apart.
    """
    if shell.profile is not None:
        return Profile(lay_table(shell))
    R, rk, r = shell.inner_diameter / 2, shell.knuckle_radius, shell.haunch_radius
    theta = _dish_angle(R, rk, shell.dish_depth)
    dish_radius = (R - rk) / sin(theta) + rk if theta else inf
    dish_length = dish_radius * theta if theta else R - rk
    wall_foot = shell.dish_depth + rk * cos(theta)
    rise = shell.crown - shell.wall_top
    cap = (R**2 - 2 * R * r + rise**2) / (2 * (rise - r))
    alpha = acos((cap - rise) / (cap - r))
    springing = (R - r + r * sin(alpha), shell.wall_top + r * cos(alpha))
    dish = Piece("dish", (0.0, 0.0), 0.0, theta, dish_length)
    tangent = (R - rk + rk * sin(theta), shell.dish_depth)
    knuckle = Piece("knuckle", tangent, theta, pi / 2 - theta, rk * (pi / 2 - theta))
    wall = Piece("wall", (R, wall_foot), pi / 2, 0.0, shell.wall_top - wall_foot)
    haunch = Piece("haunch", (R, shell.wall_top), pi / 2, pi / 2 - alpha, r * (pi / 2 - alpha))
    dome = Piece("dome", springing, pi - alpha, alpha, cap * alpha)
    return Profile((dish, knuckle, wall, haunch, dome))


def ring_radii(tank: Tank) -> list[float]:
    """Radii of the rings that pictures of a tank have, m."""
    inner = tank.shell.inner_diameter / 2
    step = next((step for step in _RINGS if inner / step <= _MOST_RINGS), _RINGS[-1])
    return [float(radius) for radius in np.arange(step, inner - step / 4, step)] or [inner / 2]


def _dish_angle(R: float, rk: float, depth: float) -> float:
    """Half-angle of the dish, rad; zero for a flat floor."""
    if not depth:
        return 0.0
    # tan(theta / 2) (R - rk + rk sin theta) = depth, a cubic in t = tan(theta / 2) that rises from 0 to 1
    roots = np.roots([R - rk, 2 * rk - depth, R - rk, -depth])
    return 2 * atan(next(float(root.real) for root in roots if not root.imag and 0 < root.real < 1))


@dataclass(frozen=True)
class Piece:
    """An arc, or a straight line, of the profile, from its first point (r, z), m, the tangent point with the piece before.

    The heading there is from the r axis towards z, rad; the turn is to the left, rad; the length is in m.
    """

    name: str
    start: tuple[float, float]
    heading: float
    turn: float
    length: float

    @property
    def curvature(self) -> float:
        """1/m; the interior lies to the left."""
        return self.turn / self.length

    @property
    def radius(self) -> float:
        """m; infinite for a straight piece."""
        return self.length / self.turn if self.turn else inf

    @property
    def centre(self) -> tuple[float, float]:
        """Centre (r, z) of the arc, m; at infinity for a straight piece."""
        if not self.turn:
            upright = sin(self.heading) > 0.5
            return (-inf if upright else self.start[0], inf if cos(self.heading) > 0.5 else self.start[1])
        return (self.start[0] - self.radius * sin(self.heading), self.start[1] + self.radius * cos(self.heading))

    @property
    def end(self) -> tuple[float, float]:
        """Its last point (r, z), m; the tangent point with the piece after."""
        r, z = self.at(self.length)
        return (float(r), float(z))

    def at(self, distance: ArrayLike) -> Array:
        """Points (r, z), shape (..., 2), m, at arc lengths from the start of the piece, shape (...), m."""
        s = np.asarray(distance, float)
        half = self.curvature * s / 2
        chord = s * np.sinc(half / pi)
        r, z = self.start[0] + chord * np.cos(self.heading + half), self.start[1] + chord * np.sin(self.heading + half)
        return np.stack([r, z], -1)


def lay_table(shell: Shell) -> tuple[Piece, ...]:
    """Pieces from the lowest point to the crown.

    Raises:
        DescriptionError: The arcs of two corners meet, or that of the last one does not fit the cap.
    """
    assert shell.profile is not None
    rows = [(radius, height) for height, radius in shell.profile]
    sizes = [shell.knuckle_radius if height < shell.wall_top else shell.haunch_radius for height, _ in shell.profile]
    sizes[-1] = shell.haunch_radius
    headings = [atan2(z - low, r - near) for (near, low), (r, z) in pairwise(rows)]
    lengths = [sqrt((r - near) ** 2 + (z - low) ** 2) for (near, low), (r, z) in pairwise(rows)]
    pieces: list[Piece] = []
    used = 0.0  # of the line that comes next, by the corner before it
    if headings[0] > _FLAT:  # the tip of a cone
        turn, size = headings[0], sizes[0]
        used = size * tan(turn)
        tip = rows[0][1] + size * (1 / cos(turn) - 1)
        pieces.append(Piece("dish", (0.0, tip), 0.0, turn, size * turn))
    for k, (heading, length) in enumerate(zip(headings, lengths, strict=True)):
        (r, z), last = rows[k], k == len(headings) - 1
        if last:
            cut, turn, corner = _round_cap(shell, (r, z), heading)
        else:
            turn, size = headings[k + 1] - heading, sizes[k + 1]
            cut, corner = length - size * tan(turn / 2), size * turn
        if cut <= used:
            found = f"{length:.4g} m between rows {k} and {k + 1}, less than the arcs at its ends take"
            raise DescriptionError(
                None, "shell.profile", found, "rows farther apart, or a smaller knuckle_radius or haunch_radius"
            )
        start = (r + used * cos(heading), z + used * sin(heading))
        pieces.append(Piece(_name(heading), start, heading, 0.0, cut - used))
        end = (r + cut * cos(heading), z + cut * sin(heading))
        after = "haunch" if last or rows[k + 1][1] >= shell.wall_top else "knuckle"
        after = "dish" if not last and _name(headings[k + 1]) == "dish" else after
        pieces.append(Piece(after, end, heading, turn, corner))
        used = length - cut
    edge = pieces[-1].end
    radius, _ = _cap(shell)
    turn = asin(edge[0] / radius)
    pieces.append(Piece("dome", edge, pi - turn, turn, radius * turn))
    return tuple(pieces)


def _name(heading: float) -> str:
    return "dish" if heading < _FLOOR else "wall" if heading < _WALL else "haunch"


def _cap(shell: Shell) -> tuple[float, float]:
    """Radius of the cap through the last row and the crown, and height of its centre, m."""
    assert shell.profile is not None
    high, wide = shell.profile[-1]
    rise = shell.crown - high
    radius = (wide**2 + rise**2) / (2 * rise)
    return radius, shell.crown - radius


def _round_cap(shell: Shell, start: tuple[float, float], heading: float) -> tuple[float, float, float]:
    """Where on the last line the arc to the cap begins, m, its turn, rad, and its length, m."""
    (radius, middle), size = _cap(shell), shell.haunch_radius
    along, inward = (cos(heading), sin(heading)), (-sin(heading), cos(heading))
    # its centre is at its size from the line, and at radius - size from the cap's centre
    x, y = start[0] + size * inward[0], start[1] + size * inward[1] - middle
    half, rest = x * along[0] + y * along[1], x * x + y * y - (radius - size) ** 2
    if half * half < rest or size >= radius:
        found = f"{size:.4g} m, which does not fit between the last line and the dome"
        raise DescriptionError(None, "shell.haunch_radius", found, "a smaller radius")
    cut = -half + sqrt(half * half - rest)
    centre = (x + cut * along[0], y + cut * along[1])
    turn = pi - atan2(centre[0], centre[1]) - heading  # up to the cap's heading where it meets it
    return cut, turn, size * turn
