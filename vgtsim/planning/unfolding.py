"""An arm that follows its leader along a directrix while it is fed: bends and extensions over feed.

Feed h is the height of the mast above its working depth, m; it falls as the arm goes in. A module stays stowed until its
upper face is below the riser's rim; its bend and extension begin there with zero rate and zero second derivative, so shapes
over feed have two continuous derivatives. A damped Gauss-Newton iteration makes a sum small: a high power of the axis'
distance from the curve, which stands for the greatest one, hinges of strokes and clearances, rates and second derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import by_rows, compiled
from vgtsim.kinematics import Chain, PlanarArm, State
from vgtsim.planning.directrix import LeadCurve

_KNOT = 0.35  # m of feed between knots: about an eighth of the distance of two modules
_DEGREE = 5  # so that jerk has no jumps at knots
_CORNERS = 3  # coefficients at the opening that are zero: value, rate and second derivative
# places on each piece of the axis, besides its ends, that are kept to the curve
_ALONG = np.linspace(0.0, 1.0, 7)[1:-1]


@dataclass(frozen=True, eq=False)
class Follower:
    """An arm, the curve it follows, and when its modules may open.

    Attributes:
        pivot: Height of the mast flange at the working depth, m.
        opening: Feed at which each active module may open, shape (A,), m.
        least: Least actuator lengths, shape (J,), m; `greatest` are the greatest.
        knot: Feed between the knots of the shapes, m. A module that opens unfolds within two or three of them.
    """

    planar: PlanarArm
    directrix: LeadCurve
    pivot: float
    opening: Array
    least: Array
    greatest: Array
    knot: float = _KNOT

    @property
    def chain(self) -> Chain:
        """The arm's kinematics."""
        return self.planar.chain

    @cached_property
    def owner(self) -> Index:
        """Active module of each actuator, shape (J,)."""
        layout = self.chain.layout
        owner = np.empty(layout.actuators, dtype=np.intp)
        for place in layout.places:
            owner[place.moving] = np.repeat(place.active, place.modules.actuated.sum(axis=1))
        return owner

    def axis(self, bend: Array, extension: Array, feed: Array, *, slopes: bool = False) -> tuple[Array, Array]:
        """Signed distances from the curve of points along the axis, shape (W, P), m, and slopes, shape (W, P, 2 A)."""
        points, J = self.planar.line(bend, extension, self.pivot + feed, slopes=slopes)
        points, J = points[:, 1:], J[:, 1:]  # the mast flange is on the curve
        parts = [points, *((1 - t) * points[:, :-1] + t * points[:, 1:] for t in _ALONG)]
        off, lead = self.directrix.offsets(np.concatenate(parts, axis=1))
        if not slopes:
            return off, J[..., 0, :]
        found = np.empty((*off.shape, J.shape[3]))
        lead_along(lead, by_rows(J), _ALONG, found)
        return off, found

    def state(self, bend: Array, extension: Array) -> tuple[State, Array]:
        """Kinematics, and actuator lengths' slopes by the shape parameters, shape (W, J, 2 A)."""
        state = self.chain.state(self.planar.inputs(bend, extension))
        return state, state.leg_slopes[:, : len(self.least)] @ self.planar.input_slopes(bend, extension)


@compiled
def lead_along(lead: Array, J: Array, shares: Array, slopes: Array) -> None:
    """Write slopes along leads, shape (W, P, 2), of C corners and of places at shares between them, all of a share in a row.

    Derivatives of the corners have shape (W, C, 2, n), the slopes (W, P, n).
    """
    corners = J.shape[1]
    for w in range(len(J)):
        for p in range(lead.shape[1]):
            piece, place = (
                (0, p) if p < corners else ((p - corners) // (corners - 1) + 1, (p - corners) % (corners - 1))
            )
            t = shares[piece - 1] if piece else 0.0
            for n in range(J.shape[3]):
                slopes[w, p, n] = 0.0
                for k in range(2):
                    slope = J[w, place, k, n]
                    if piece:
                        slope = (1 - t) * slope + t * J[w, place + 1, k, n]
                    slopes[w, p, n] += lead[w, p, k] * slope


def make_opening(planar: PlanarArm, pivot: float, below: float) -> Array:
    """Feed at which the upper face of each active module is at a height `below`, shape (A,), m; those above are stowed."""
    return below - pivot + planar.tops


@dataclass(frozen=True, eq=False)
class Shapes:
    """Bends, rad, and extensions, m, of all active modules over feed, as splines.

    Weights are coefficients of the bends and then of the extensions beyond the stowed ones, shape (2 N,).
    """

    guide: Follower
    weights: Array

    def __call__(self, feed: Array, order: int = 0) -> tuple[Array, Array]:
        """Bends and extensions at feeds, shape (W, A) each, or their derivatives of some order by feed."""
        table = tabulate_feed(self.guide, feed, order)
        half = len(self.weights) // 2
        reach = np.zeros((1, table.shape[1])) if order else self.guide.planar.stowed[None]
        return table @ self.weights[:half], reach + table @ self.weights[half:]


def tabulate_feed(guide: Follower, feed: Array, order: int = 0) -> Array:
    """Basis of the shapes at feeds, or a derivative of it by feed, shape (W, A, N)."""
    from scipy.interpolate import BSpline  # slow to load, and only a way in needs it

    tables = []
    for opening in guide.opening:
        if opening <= 0:
            tables.append(np.zeros((len(feed), 0)))
            continue
        pieces = max(2, int(np.ceil(opening / guide.knot)))
        knots = np.concatenate([np.zeros(_DEGREE), np.linspace(0.0, opening, pieces + 1), np.full(_DEGREE, opening)])
        count = pieces + _DEGREE
        basis = BSpline(knots, np.eye(count)[:, _CORNERS:], _DEGREE)
        went = np.clip(opening - feed, 0.0, opening)
        table = (-1.0) ** order * basis(went, nu=order)
        table[feed >= opening] = 0.0
        tables.append(table)
    widths = [table.shape[1] for table in tables]
    whole = np.zeros((len(feed), len(tables), sum(widths)))
    for a, (table, begin) in enumerate(zip(tables, np.cumsum([0, *widths]), strict=False)):
        whole[:, a, begin : begin + table.shape[1]] = table
    return whole
