"""The profile of a tank that is given by a table of heights and radii: straight lines with rounded corners, and a dome cap.

The corners are rounded from inside, so the tank is never wider than its table, and at a right angle 0.41 of the arc's radius
narrower. A tangent at every joint is needed by the distances.
"""

from __future__ import annotations

from itertools import pairwise
from math import asin, atan2, cos, pi, sin, sqrt, tan

from vgtsim.description import Shell
from vgtsim.errors import DescriptionError
from vgtsim.geometry.piece import Piece

_FLOOR, _WALL = pi / 4, 3 * pi / 4  # headings up to which a line is floor, and up to which it is wall
_FLAT = 1e-12  # rad


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
