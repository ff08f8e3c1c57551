"""Contact about a riser that stands beside the tank's axis: wedges around its bore, and boxes from them out to the dome's.

The dome rises on one side of such a bore and falls on the other, so no box fits between bore and dome. A wedge does: its inner
face is tangent to the bore, its lower face to the dome. All of them lie outside tank and bore, and stand back by what
`panels` allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, hypot, pi, sin, sqrt, tan

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import Tank
from vgtsim.geometry.distance import find_mouth
from vgtsim.geometry.panels import DEPTH, FINE, RIM, TOLERANCE, Panel, count_sectors, make_panels
from vgtsim.geometry.profile import Profile

Array = NDArray[np.float64]

_LAP = 0.1  # m that boxes of neighbouring rings overlap
_WIDE = 0.8  # m across a box of a ring: it then stands back by half the tolerance
_DIRECTIONS = np.linspace(0.0, 2 * pi, 64, endpoint=False)


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
