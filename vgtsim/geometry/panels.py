"""The tank for contact: boxes that lie against it from outside.

Each box touches the inner surface with the middle of its inner face, in the tangent plane of that point. The tank is
convex, so such a box never comes inside, and neighbours may overlap. Where two boxes meet, they stand back from the
tank by at most the tolerance, once for the angle between sectors and once for the angle between rings. Where the arm passes,
in the riser's bore and on the dome about its rim, they stand back by no more than two millimetres.

About a riser that stands beside the tank's axis the dome rises on one side of the bore and falls on the other, so no box fits
between bore and dome. A wedge does: its inner face is tangent to the bore, its lower face to the dome. Wedges stand around
the bore, and boxes from them out to the dome's. All of them lie outside tank and bore.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import acos, asin, ceil, cos, hypot, pi, sin, sqrt, tan

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Tank
from vgtsim.geometry.clearance import find_mouth
from vgtsim.geometry.profile import Piece, Profile

TOLERANCE = 0.0045  # m, that the boxes stand back for each of the two angles: together less than a centimetre
# m, the same in the bore and about its rim, where angles between sectors or between rings matter, not both
FINE = 0.0015
NEAR = 3.0  # of the bore's radius: how far from the axis the dome counts as being about the rim
DEPTH = 0.4  # m, of the boxes away from the tank
RIM = "rim"  # name of the dome's piece about the bore
_ONE_LINE = 1e-9  # rad between tangent lines: shipped tanks have 0.05 or more, rounding leaves 1e-16
_LAP = 0.1  # m that boxes of neighbouring rings overlap
_WIDE = 0.8  # m across a box of a ring: it then stands back by half the tolerance
_DIRECTIONS = np.linspace(0.0, 2 * pi, 64, endpoint=False)


@dataclass(frozen=True)
class Panel:
    """A box in frame G with a centre and half sizes along its axes, shape (3,), m.

    The columns of `axes` point along the profile, around the tank, and inward. The name is made of piece, ring and
    sector.
    """

    name: str
    centre: Array
    axes: Array
    half: Array


@dataclass(frozen=True)
class _Tangent:
    """A tangent line of the profile: a ring of boxes."""

    name: str
    point: Array
    heading: float

    @property
    def along(self) -> Array:
        """Unit vector along the profile, (r, z), shape (2,)."""
        return np.array([cos(self.heading), sin(self.heading)])

    @property
    def inward(self) -> Array:
        """Unit vector into the tank, (r, z), shape (2,)."""
        return np.array([-sin(self.heading), cos(self.heading)])


def make_panels(tank: Tank, profile: Profile) -> tuple[Panel, ...]:
    """Enclose the tank, open at an arm riser on its axis, and the riser's bore up to its flange, from the floor to the riser.

    With a bore of 0 the tank is closed. The boxes stand back from the surface by at most about twice the tolerance.
    """
    bore = tank.arm_riser.bore / 2
    *below, dome = profile.pieces
    pieces = [(piece, TOLERANCE) for piece in (below if bore else profile.pieces)]
    pieces += [] if not bore else zip(_split_dome(dome, bore), (TOLERANCE, FINE), strict=True)
    tangents = [line for piece, spare in pieces for line in _tangents(piece, spare)]
    corners = [_meet(a, b) for a, b in pairwise(tangents)]
    panels = [_slab(tangents[0], corners[0])]
    count: dict[str, int] = {tangents[0].name: 1}
    for index, line in enumerate(tangents[1:], start=1):
        start = corners[index - 1]
        stop = corners[index] if index < len(corners) else np.array([0.0, line.point[1]])
        if max(start[0], stop[0]) <= bore:
            continue
        number = count.get(line.name, 0)
        count[line.name] = number + 1
        turn = line.heading - tangents[index - 1].heading
        if index < len(corners):
            turn = max(turn, tangents[index + 1].heading - line.heading)
        sectors = count_sectors(max(start[0], stop[0]) * sin(line.heading), TOLERANCE)
        if line.name == RIM:
            sectors = count_sectors(bore, FINE)  # their edges are the rim
        panels += _ring(line, (start, stop), turn, bore, sectors, f"{line.name}/{number}")
    return (*panels, *_bore(tank, profile)) if bore else tuple(panels)


def _split_dome(dome: Piece, bore: float) -> tuple[Piece, Piece]:
    """The dome's arc down to some radii of a bore from the axis, and from there to the bore."""
    ends = [min(NEAR * bore, dome.start[0]), bore]
    out, into = (dome.length - dome.radius * asin(end / dome.radius) for end in ends)
    outer = Piece(dome.name, dome.start, dome.heading, out / dome.radius, out)
    start = dome.at(out)
    heading = dome.heading + outer.turn
    return outer, Piece(RIM, (float(start[0]), float(start[1])), heading, (into - out) / dome.radius, into - out)


def _tangents(piece: Piece, tolerance: float) -> list[_Tangent]:
    """Tangent lines at equal angles; a line shared by two pieces is left to dish, wall or dome.

    Between the pieces of the dome it is left to the outer one.
    """
    steps = 1
    if piece.turn:
        steps = max(1, ceil(piece.turn / (2 * acos(piece.radius / (piece.radius + tolerance)))))
    first, last = (
        (1, steps - 1) if piece.turn and piece.name in ("knuckle", "haunch") else (0, steps if piece.turn else 0)
    )
    first = 1 if piece.name == RIM else first
    parts = [i / steps for i in range(first, last + 1)]
    return [_Tangent(piece.name, piece.at(piece.length * part), piece.heading + piece.turn * part) for part in parts]


def _meet(a: _Tangent, b: _Tangent) -> Array:
    """Intersection of two tangent lines (r, z); between their points where they are one line but for rounding."""
    turn = a.along[0] * b.along[1] - a.along[1] * b.along[0]
    if abs(turn) < _ONE_LINE:
        return (a.point + b.point) / 2
    apart = b.point - a.point
    return a.point + (apart[0] * b.along[1] - apart[1] * b.along[0]) / turn * a.along


def _slab(line: _Tangent, corner: Array) -> Panel:
    """The middle of the floor: one square plate."""
    size = float(corner[0])
    centre, half = np.array([0, 0, line.point[1] - DEPTH / 2]), np.array([size, size, DEPTH / 2])
    return Panel(f"{line.name}/0/0", centre, np.eye(3), half)


def count_sectors(radius: float, tolerance: float) -> int:
    """Number of sides of the polygon about a circle that stands back by the tolerance at its corners."""
    return max(8, ceil(pi / acos(radius / (radius + tolerance)))) if radius > 0 else 8


def _ring(line: _Tangent, ends: tuple[Array, Array], turn: float, bore: float, sectors: int, name: str) -> list[Panel]:
    """Boxes around the tank along a tangent line between its ends; `turn` is the sharper corner there."""
    start, stop = ends
    widest = max(start[0], stop[0])
    # overlap the neighbours by the mitre, and by a corner, as theirs may stand at other azimuths
    lap = DEPTH * tan(turn / 2) + widest * (1 / cos(pi / sectors) - 1) * abs(cos(line.heading))
    low = float((start - line.point) @ line.along) - lap
    high = float((stop - line.point) @ line.along) + lap
    if cos(line.heading) < 0:
        # towards the axis the boxes end at the bore
        high = min(high, float((bore - line.point[0]) / cos(line.heading)))
    outline = [line.point + reach * line.along for reach in (low, high)]
    # wide enough to meet at the far side of the boxes as well
    half_width = (max(point[0] for point in outline) + DEPTH * sin(line.heading)) * tan(pi / sectors)
    middle = line.point + (low + high) / 2 * line.along - DEPTH / 2 * line.inward
    half = np.array([(high - low) / 2, half_width, DEPTH / 2])
    return _place(name, middle, line, half, sectors)


def _bore(tank: Tank, profile: Profile) -> list[Panel]:
    riser = tank.arm_riser
    radius = riser.bore / 2
    rim = float(profile.ceiling_at(radius))
    top = tank.grade + riser.above_grade
    sectors = count_sectors(radius, FINE)
    line = _Tangent(riser.name, np.array([radius, rim]), pi / 2)
    middle = np.array([radius + DEPTH / 2, (rim + top) / 2])
    half = np.array([(top - rim) / 2, (radius + DEPTH) * tan(pi / sectors), DEPTH / 2])
    return _place(riser.name, middle, line, half, sectors)


def _place(name: str, middle: Array, line: _Tangent, half: Array, sectors: int) -> list[Panel]:
    """Turn a box of the meridian plane to the azimuths of all sectors."""
    turns = [2 * pi * (i + 0.5) / sectors for i in range(sectors)]
    c, s, one = np.array([cos(turn) for turn in turns]), np.array([sin(turn) for turn in turns]), np.ones(sectors)
    x, y, z = inward = np.array([line.inward[0] * c, line.inward[0] * s, line.inward[1] * one])
    u, v, w = along = np.array([line.along[0] * c, line.along[0] * s, line.along[1] * one])
    across = np.array([y * w - z * v, z * u - x * w, x * v - y * u])
    centres = np.array([middle[0] * c, middle[0] * s, middle[1] * one]).T.copy()
    axes = np.stack([along, across, inward], axis=-1).swapaxes(0, 1).copy()
    return [Panel(f"{name}/{i}", centres[i], axes[i], half) for i in range(sectors)]


@dataclass(frozen=True)
class Wedge:
    """A convex solid with eight corners in frame G, shape (8, 3), m."""

    name: str
    corners: Array


def enclose_tank(tank: Tank, profile: Profile) -> tuple[tuple[Panel, ...], tuple[Wedge, ...]]:
    """Boxes and wedges about a tank, open at the arm's riser, and about the riser's bore up to its flange.

    Raises:
        DescriptionError: The arm's riser does not stand on the dome.
    """
    riser = tank.arm_riser
    if not riser.radius:
        return make_panels(tank, profile), ()
    mouth = find_mouth(tank, profile)
    closed = tank.model_copy(update={"arm_riser": riser.model_copy(update={"radius": 0.0, "bore": 0.0})})
    whole = make_panels(closed, profile)
    bore, x, y = mouth[0], mouth[3], mouth[4]
    out = {panel.name for panel in whole if panel.name.startswith("dome/") and _meets(panel, x, y, bore)}
    far = [np.hypot(*(_face(panel)[:, :2] - [x, y]).T).max() for panel in whole if panel.name in out]
    sectors, width = count_sectors(bore, FINE), 2 * sqrt(2 * mouth[5] * FINE)
    kept = [panel for panel in whole if panel.name not in out]
    rings = _lay_rings(mouth, bore + width, float(max(far, default=0.0)))
    top = tank.grade + riser.above_grade
    turns = 2 * pi * (np.arange(sectors) + 0.5) / sectors
    wedges = [Wedge(f"{riser.name}/{k}", _cut(mouth, float(turn), sectors, width, top)) for k, turn in enumerate(turns)]
    return (*kept, *rings), tuple(wedges)


def _face(panel: Panel) -> Array:
    """Corners of a box's inner face, shape (4, 3)."""
    signs = np.array([[1, 1, 1], [1, -1, 1], [-1, -1, 1], [-1, 1, 1]])
    return panel.centre + (signs * panel.half) @ panel.axes.T


def _meets(panel: Panel, x: float, y: float, bore: float) -> bool:
    """Whether a box may come into an upright bore: no vertical plane beside the bore keeps it away."""
    level = np.stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)], axis=-1)
    reach = np.abs(level @ (panel.axes[:2] * panel.half)).sum(axis=1)
    return bool(np.max(level @ ([x, y] - panel.centre[:2]) - reach) < bore)


def _on_dome(mouth: Array, away: float, turn: float) -> Array:
    """Point of the dome's sphere at a distance and azimuth from the bore's axis, from the dome's centre, shape (3,)."""
    x, y = mouth[3] + away * cos(turn), mouth[4] + away * sin(turn)
    return np.array([x, y, sqrt(mouth[5] ** 2 - x * x - y * y)])


def _cut(mouth: Array, turn: float, sectors: int, width: float, top: float) -> Array:
    """Corners of a wedge between the bore and a plane `width` behind its wall, from the dome up to a height, m."""
    normal, corners = _on_dome(mouth, mouth[0] + width / 2, turn) / mouth[5], []
    for away in (mouth[0], mouth[0] + width):
        for side in (-1, 1):
            reach, azimuth = away / cos(pi / sectors), turn + side * pi / sectors
            x, y = mouth[3] + reach * cos(azimuth), mouth[4] + reach * sin(azimuth)
            low = mouth[2] + (mouth[5] - normal[0] * x - normal[1] * y) / normal[2]
            corners += [[x, y, low], [x, y, top]]
    return np.array(corners)


def _lay_rings(mouth: Array, begin: float, end: float) -> list[Panel]:
    """Boxes against the dome between two distances from the bore's axis, m."""
    panels: list[Panel] = []
    count = max(ceil((end - begin) / (2 * sqrt(2 * mouth[5] * TOLERANCE))), 0)
    for ring in range(count):
        near, far = (begin + (end - begin) * k / count for k in (ring, ring + 1))
        sectors = max(8, ceil(2 * pi * far / _WIDE))
        for k in range(sectors):
            turn = 2 * pi * (k + 0.5) / sectors
            point = _on_dome(mouth, (near + far) / 2, turn)
            inward = -point / mouth[5]
            along = np.array([cos(turn), sin(turn), -(point[0] * cos(turn) + point[1] * sin(turn)) / point[2]])
            slope = hypot(*along.tolist())
            along /= slope
            across = np.cross(inward, along)
            half = np.array([(far - near) / 2 * slope + _LAP, far * tan(pi / sectors) * slope + _LAP, DEPTH / 2])
            centre = point + [0.0, 0.0, mouth[2]] - DEPTH / 2 * inward
            panels.append(Panel(f"{RIM}/{ring}/{k}", centre, np.stack([along, across, inward], axis=-1), half))
    return panels
