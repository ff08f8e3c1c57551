"""Shapes over feed that follow a directrix: a damped Gauss-Newton iteration over the coefficients of their splines.

Most rows of the sum depend on the shape at one feed alone, so the matrix is gathered feed by feed from small ones.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array, Index, Mask
from vgtsim.compilation import by_rows, compiled
from vgtsim.geometry import enclosure_distance
from vgtsim.kinematics import State
from vgtsim.planning.postures import Postures
from vgtsim.planning.unfolding import Follower, Shapes, tabulate_feed
from vgtsim.positioning import Surroundings

_LOOKS = 0.12 / 0.35  # feed between the places at which shapes are looked at, over that between knots: three in a knot
_POWER = 4  # of a deviation over its aim, whose square is summed: above the aim it grows fast
_STROKE = 5e-4  # m by which an actuator in the hinge at the end of its stroke counts one
_GAP = 5e-3  # m by which a node that is too near counts one
_RATE = 0.2  # m of an actuator per m of feed that counts one, and is summed in its fourth power
# weight of second derivatives, m² and m: it costs under 1 % of deviation and makes accelerations half as great
_CALM = 0.3
_STEPS = 60  # of one search: a bound on time, the relative fall ends most
_SETTLED = 1e-3  # relative fall of the sum below which a step is not worth its price


@dataclass(frozen=True, eq=False)
class Track:
    """What shapes are held to.

    Attributes:
        aim: Deviation from the curve that counts one, m.
        around: Tank and waste that open modules keep clear of; absent for the curve and the strokes alone.
        clearance: Distance from them, m.
        kept: Distance from the ends of strokes at which their hinges begin, m.
        mouth: Height above which nodes are in the riser's mouth, m; they are not looked at.
    """

    guide: Follower
    aim: float
    around: Surroundings | None = None
    clearance: float = 0.0
    kept: float = 1.5e-3
    mouth: float = np.inf

    @cached_property
    def feed(self) -> Array:
        """Feeds that are looked at, shape (W,), m."""
        first = float(self.guide.opening.max())
        count = max(2, int(np.ceil(first / (_LOOKS * self.guide.knot))))
        return np.linspace(first, 0.0, count + 1)[1:]

    @cached_property
    def basis(self) -> tuple[Array, Array, Array]:
        """Values, rates and second derivatives, each shape (W, A, N)."""
        return tuple(tabulate_feed(self.guide, self.feed, order) for order in range(3))  # type: ignore[return-value]

    @cached_property
    def begun(self) -> Index:
        """Columns of the basis from the first to before the last that are not zero, shape (W, A, 2)."""
        some = (self.basis[0] != 0) | (self.basis[1] != 0)
        first, count = some.argmax(axis=2), some.shape[2]
        last = np.where(some.any(axis=2), count - some[..., ::-1].argmax(axis=2), first)
        return np.stack([first, last], axis=-1)

    @cached_property
    def free(self) -> Mask:
        """Which actuators may move, shape (W, J)."""
        return (self.feed[:, None] < self.guide.opening)[:, self.guide.owner]

    @cached_property
    def calm(self) -> Array:
        """Matrix of the second derivatives' sum of squares, shape (N, N)."""
        bent = _CALM * self.basis[2].reshape(-1, self.basis[2].shape[2])
        return bent.T @ bent


class Sum:
    """Half of a sum of squares, its slope and matrix by the coefficients."""

    def __init__(self, track: Track, *, sloped: bool) -> None:
        rows, count, half = track.basis[0].shape
        self.value, self.slope, self.matrix = 0.0, np.zeros(2 * half), np.zeros((2 * half, 2 * half))
        # slope and matrix by the shape parameters, and by their rates, at each feed
        self._pulls = np.zeros((2, rows, 2 * count)) if sloped else None
        self._grams = np.zeros((2, rows, 2 * count, 2 * count))

    def add(self, rows: Array, slopes: Array, order: int = 0) -> None:
        """Rows of shape (W, K) with slopes by the shape parameters, or by their rates, shape (W, K, 2 A)."""
        self.value += 0.5 * float(np.sum(rows * rows))
        if self._pulls is not None:
            across = np.swapaxes(slopes, 1, 2)
            self._pulls[order] += (across @ rows[..., None])[..., 0]
            self._grams[order] += across @ slopes

    def gather(self, track: Track) -> None:
        """Slope and matrix by the coefficients."""
        if self._pulls is not None:
            for table, pulls, grams in zip(track.basis, self._pulls, self._grams, strict=False):
                gather(table, track.begun, pulls, grams, self.slope, self.matrix)


@compiled
def gather(table: Array, begun: Index, pulls: Array, grams: Array, slope: Array, matrix: Array) -> None:
    """Add slopes, shape (W, 2 A), and matrices, (W, 2 A, 2 A), by what a table of a basis, (W, A, N), makes of coefficients.

    Each of the W A rows of the table has numbers between two of its columns alone, shape (W, A, 2).
    """
    count, half = table.shape[1], table.shape[2]
    for w in range(len(table)):
        for a in range(2 * count):
            for i in range(begun[w, a % count, 0], begun[w, a % count, 1]):
                one, row = table[w, a % count, i], i + half * (a // count)
                slope[row] += one * pulls[w, a]
                for b in range(2 * count):
                    both = one * grams[w, a, b]
                    for j in range(begun[w, b % count, 0], begun[w, b % count, 1]):
                        matrix[row, j + half * (b // count)] += both * table[w, b % count, j]


def fit_shapes(track: Track, postures: Postures) -> Shapes:
    """Make shapes that follow the curve, from the postures of least deviation."""
    weights = _start(track, postures)
    now, damping = sum_up(track, weights, sloped=True), 1e-3
    for _ in range(_STEPS):
        diagonal = np.diagonal(now.matrix)
        scale = diagonal + 1e-6 * diagonal.max()
        for _ in range(10):
            step = -np.linalg.solve(now.matrix + damping * np.diag(scale), now.slope)
            after = sum_up(track, weights + step, sloped=False).value
            if after < now.value:
                break
            damping *= 6
        else:
            break
        done = now.value - after < _SETTLED * now.value
        weights = weights + step
        now, damping = sum_up(track, weights, sloped=True), max(damping / 5, 1e-9)
        if done:
            break
    return Shapes(track.guide, weights)


def _start(track: Track, postures: Postures) -> Array:
    """Coefficients nearest to the postures, second derivatives weighed in, drawn to the straight arm until it assembles."""
    guide, table = track.guide, tabulate_feed(track.guide, postures.feed)
    flat = table.reshape(-1, table.shape[2])
    matrix = flat.T @ flat + track.calm
    matrix += 1e-9 * np.trace(matrix) / len(matrix) * np.eye(len(matrix))
    wanted = postures.bend, postures.extension - guide.planar.stowed
    weights = np.concatenate([np.linalg.solve(matrix, flat.T @ item.ravel()) for item in wanted])
    for share in (1.0, 0.8, 0.6, 0.4, 0.2, 0.0):
        if np.isfinite(sum_up(track, share * weights, sloped=False).value):
            return share * weights
    return 0.0 * weights


def sum_up(track: Track, weights: Array, *, sloped: bool) -> Sum:
    """The sum at coefficients, shape (2 N,), its slope and matrix if asked for; infinite where a shape has no posture."""
    guide, (table, rates, _) = track.guide, track.basis
    half, total = len(weights) // 2, Sum(track, sloped=sloped)
    bend, reach = table @ weights[:half], guide.planar.stowed + table @ weights[half:]
    state = guide.chain.state(guide.planar.inputs(bend, reach))
    if not np.all(state.assembles):
        total.value = np.inf
        return total
    Q = guide.planar.input_slopes(bend, reach)
    S = state.leg_slopes[:, : len(guide.least)] @ Q
    off, J = guide.axis(bend, reach, track.feed, slopes=sloped)
    near = off / track.aim
    slope = (_POWER / track.aim * np.abs(near) ** (_POWER - 1))[..., None] * J if sloped else J
    total.add(np.sign(near) * np.abs(near) ** _POWER, slope)
    _hold_strokes(track, total, state.lengths, S)
    speed = np.concatenate([rates @ weights[:half], rates @ weights[half:]], axis=1)
    rate = np.einsum("wjn,wn->wj", S, speed) / _RATE
    total.add(rate * np.abs(rate), (2 * np.abs(rate) / _RATE)[..., None] * S, order=1)
    for part in (slice(0, half), slice(half, None)):
        pull = track.calm @ weights[part]
        total.value += 0.5 * float(weights[part] @ pull)
        total.slope[part] += pull
        total.matrix[part, part] += track.calm
    if track.around is not None:
        _hold_clear(track, track.around, total, state, Q if sloped else None)
    total.gather(track)
    return total


def _hold_strokes(track: Track, total: Sum, length: Array, S: Array) -> None:
    guide = track.guide
    low = np.where(track.free, np.maximum(guide.least + track.kept - length, 0.0), 0.0) / _STROKE
    high = np.where(track.free, np.maximum(length - guide.greatest + track.kept, 0.0), 0.0) / _STROKE
    over = high - low  # one of them is zero
    total.add(over, np.where(over != 0, 1 / _STROKE, 0.0)[..., None] * S)


def _hold_clear(track: Track, around: Surroundings, total: Sum, state: State, Q: Array | None) -> None:
    """Hinges of nodes and tool against the tank's shell and the waste."""
    points = np.concatenate([state.nodes, state.tool[0][:, None]], axis=1)
    points = points + np.stack([0.0 * track.feed, 0.0 * track.feed, track.feed], axis=-1)[:, None]
    radii, level, rise = around.capsules.point_radii, around.obstacles.waste_level, np.array([0.0, 0.0, 1.0])
    shell, inward = enclosure_distance(around.tank, around.profile, points)
    # Room that is cut is used; mounds that stand are left to the judge, who measures members as well.
    waste, away = around.bed.distance(points) if around.bed is not None else (points[..., 2] - level, rise)
    gaps = np.stack([shell, waste], axis=-1) - radii[:, None]
    short = np.maximum(track.clearance - gaps, 0.0) / _GAP
    short[points[..., 2] > track.mouth] = 0.0
    if not short.any():
        return
    slopes = np.zeros((len(short), short[0].size, 0 if Q is None else Q.shape[2]))
    if Q is not None:
        J = np.concatenate([state.node_jacobian, state.tool_jacobian[:, None, :3]], axis=1)
        away = by_rows(np.broadcast_to(away, points.shape))
        near_slopes(short, inward, away, J, Q, slopes.reshape(*short.shape, -1))
    total.add(short.reshape(len(short), -1), slopes)


@compiled
def near_slopes(short: Array, inward: Array, away: Array, J: Array, Q: Array, slopes: Array) -> None:
    """Write slopes, shape (W, P, 2, 2 A), of hinges, shape (W, P, 2), that are not zero, from gradients of both distances.

    Derivatives of the points by the inputs have shape (W, P, 3, n), those of the inputs by the shape (W, n, 2 A).
    """
    pull = np.empty(J.shape[3])
    for w in range(len(short)):
        for p in range(short.shape[1]):
            for c in range(2):
                if short[w, p, c] <= 0:
                    continue
                lead = away[w, p] if c else inward[w, p]
                for n in range(len(pull)):
                    pull[n] = -(lead[0] * J[w, p, 0, n] + lead[1] * J[w, p, 1, n] + lead[2] * J[w, p, 2, n]) / _GAP
                for n in range(len(pull)):
                    for a in range(Q.shape[2]):
                        slopes[w, p, c, a] += pull[n] * Q[w, n, a]
