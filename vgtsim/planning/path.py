"""Clear paths between two configurations of the arm: one, or by successive anchoring one for each stage (section 7.2).

In a stage few modules move, and the others are held.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise, permutations
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index, Mask
from vgtsim.errors import AssemblyError, PathError
from vgtsim.geometry import PILLAR
from vgtsim.kinematics import Chain, State, Subspace, azimuth, bend_all, swing
from vgtsim.planning.carousel import Carousel
from vgtsim.planning.curve import Curve, make_curve
from vgtsim.planning.sampling import Ground, can_search
from vgtsim.planning.trajectory import Corridor, assemblable, smooth
from vgtsim.positioning import ANCHOR_FREE

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_WAYPOINTS = 40  # of a way, ends included
_SAMPLES = 6  # configurations for each way-point at which a smoothed path is judged
_STRIDE, _MOST_WAYPOINTS = 0.4, 120  # m of some point of the arm between way-points of a searched way, and most of them
_SPARSE = 4  # samples of a path that is no good, of which one is measured: the message needs no more
_SUNK, _GLANCES = 0.25, 20  # m inside equipment, two thirds of the way to its axis or more; way-points looked at for it
_TOLD = 10  # steps of smoothing of a guess that serves a message alone
# of anchoring, whose orders are all looked at: 120; of more windows those from the mast and from the tool
_MOST_WINDOWS = 5
_TRIED = 4  # orders that are planned
_SWING = np.radians(5.0)  # below this the swing is the straight line
# Bends of a shape that is clear of floor, wall and dome, degrees; each module bends less where an arm has more modules.
_TUCKED = (20.0, 35.0, 35.0, 20.0, 0.0)


@dataclass(frozen=True)
class Path:
    """A smooth path through input space.

    Attributes:
        curve: Inputs over the parameter 0 to 1, shape (n,) at each; its fourth derivative is continuous.
        clearance: Least clearance over the path, m, from the thing named `place`.
        spare: Least distance of an actuator from the end of its stroke box, m.
    """

    curve: BSpline | Curve
    clearance: float
    place: str
    spare: float


def plan_path(
    corridor: Corridor, first: ArrayLike, last: ArrayLike, leg: str, carousel: Carousel | None = None
) -> Path:
    """Find a clear path between two configurations, shape (n,), the shortest of the candidates; `leg` is named in errors.

    The first candidates are the straight line in inputs, and a swing about the mast while the shape changes. When
    neither is clear, the swing the other way round is tried, then both swings by way of a tucked shape, then ways that a
    sampling planner finds. Each candidate is smoothed and then judged densely, the shortest of a group first. A carousel
    keeps what searches of a corridor learn from one path to the next.

    Raises:
        PathError: No candidate is clear inside the strokes; or an end is not, which no path can mend.
    """
    wanted = corridor.clearance
    first, last = np.asarray(first, float), np.asarray(last, float)
    failed: list[_Rough] = []
    blocked: list[Array] = []
    found = carousel or Carousel(Ground(corridor))
    guesses, searches = _guesses(corridor, first, last, blocked), _searches(corridor, first, last, found)
    for group in itertools.chain(guesses, searches):
        rough = [item for item in (_curve(corridor, way) for way in group) if item is not None]
        for item in sorted(rough, key=_travel):
            if _may_do(corridor, item):
                path = _judge(corridor, item)
                if path.clearance >= wanted and path.spare > 0:
                    return path
            failed.append(item)
    if not failed:  # searches found nothing at all: how near the guesses come tells what is in the way
        tried = (_curve(corridor, smooth(corridor, way, _TOLD)) for way in blocked)
        failed = [item for item in tried if item is not None]
    paths = (_judge(corridor, item, _SPARSE) for item in failed)
    best = max(paths, key=lambda path: min(path.clearance, path.spare), default=None)
    if best is None:
        raise PathError(leg, -np.inf, "a module that does not assemble")
    if best.clearance >= wanted:
        raise PathError(leg, best.clearance, f"{best.place}, but overruns a stroke by {-best.spare:.4f} m")
    raise PathError(leg, best.clearance, best.place)


def _guesses(corridor: Corridor, first: Array, last: Array, blocked: list[Array]) -> Iterator[list[Array]]:
    """First guesses, smoothed; where searches can follow, those that lead right through equipment are put among the blocked."""
    searches = can_search() and corridor.space.whole
    for group in _candidates(corridor.box.chain, first, last):
        ways = [way for item in group if (way := assemblable(corridor, item)) is not None]
        through = [searches and _leads_through(corridor, way) for way in ways]
        blocked += [way for way, shut in zip(ways, through, strict=True) if shut]
        yield [smooth(corridor, way) for way, shut in zip(ways, through, strict=True) if not shut]


def _leads_through(corridor: Corridor, way: Array) -> bool:
    """Whether a member of a way-point is so deep in equipment or mast that smoothing would have to change its side."""
    rows = corridor.surroundings.rows(way[:: max(1, len(way) // _GLANCES)], -_SUNK, slopes=False)
    return bool(np.any(rows.bodies[:, 0] == PILLAR))


def _searches(corridor: Corridor, first: Array, last: Array, carousel: Carousel) -> Iterator[list[Array]]:
    """Ways that a sampling planner finds, smoothed and as they are.

    Where that misses, the way leads through a gap hardly wider than the arm. It is smoothed once more with twice the way-points,
    since the curve strays between them, and with narrower hinges: wide ones on both sides of a gap balance off its middle.
    There are none without OMPL, for arms whose inputs are bound to each other, and where an end is not clear.
    """
    if not can_search() or not corridor.space.whole or not carousel.ground.clear(np.array([first, last])).all():
        return
    firm = replace(corridor, softness=corridor.softness / 2)
    for corners in carousel.ways(first, last):
        way = _fill(corners, carousel.ground.scale)
        smoothed = smooth(corridor, way)
        yield [smoothed, way]
        finer = np.repeat(smoothed, 2, axis=0)[:-1]
        finer[1::2] = (smoothed[:-1] + smoothed[1:]) / 2
        yield [smooth(firm, smooth(corridor, finer))]


def _fill(corners: Array, scale: Array) -> Array:
    """Way-points at equal steps along a way of straight motions, shape (W, n); the scale, (n,), makes inputs lengths."""
    reach = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0) * scale, axis=1))])
    count = int(np.clip(np.ceil(reach[-1] / _STRIDE), _WAYPOINTS, _MOST_WAYPOINTS))
    stations = np.linspace(0.0, reach[-1], count)
    return np.stack([np.interp(stations, reach, column) for column in corners.T], axis=1)


def _candidates(chain: Chain, first: Array, last: Array) -> Iterator[list[Array]]:
    """Groups of ways, shape (W, n) each, the simplest group first."""
    part = np.linspace(0.0, 1.0, _WAYPOINTS)
    at, to = azimuth(chain, chain.tool(first)[0]), azimuth(chain, chain.tool(last)[0])
    near = float(np.mod(to - at + np.pi, 2 * np.pi) - np.pi)
    far = near - np.copysign(2 * np.pi, near)
    shape_first, shape_last = swing(chain, first, -at), swing(chain, last, -to)
    plain = part[:, None]
    direct = (1 - plain) * shape_first + plain * shape_last
    swung = [swing(chain, direct, at + part * angle) for angle in (near, far)]
    straight = (1 - plain) * first + plain * last
    yield [straight, swung[0]] if abs(near) > _SWING else [straight]
    yield [swung[1]]
    count = len(chain.layout.names)
    stations = np.interp(np.linspace(0, 1, count), np.linspace(0, 1, len(_TUCKED)), np.radians(_TUCKED))
    tucked = bend_all(chain, stations * min(1.0, len(_TUCKED) / count), 0.0)
    rise = np.sin(np.pi * plain) ** 2
    ways = [swing(chain, (1 - rise) * direct + rise * tucked, at + part * angle) for angle in (near, far)]
    for way in ways:
        way[0], way[-1] = first, last
    yield ways


@dataclass(frozen=True)
class _Rough:
    """A curve that is not judged yet, and its samples, which assemble."""

    curve: BSpline | Curve
    state: State


def _curve(corridor: Corridor, way: Array) -> _Rough | None:
    """Curve through a way with its samples; None when one does not assemble."""
    try:
        curve = make_curve(corridor.space, way)
        samples = curve(np.linspace(0.0, 1.0, _SAMPLES * len(way) + 1))
    except AssemblyError:
        return None
    state = corridor.box.chain.state(samples)
    return _Rough(curve, state) if np.all(state.assembles) else None


def _travel(rough: _Rough) -> float:
    """Sum along the path of the greatest change of an actuator, m: its time at a fixed rate."""
    return float(np.sum(np.max(np.abs(np.diff(rough.state.lengths, axis=0)), axis=1)))


def _may_do(corridor: Corridor, rough: _Rough) -> bool:
    """Whether a quick look finds no fault; it measures less than `_judge`, and as far as the first fault only."""
    if np.min(corridor.box.spare(rough.state.lengths)) <= 0:
        return False
    return bool(corridor.surroundings.clear(rough.state, corridor.clearance, True).all())


def _judge(corridor: Corridor, rough: _Rough, stride: int = 1) -> Path:
    """Least clearance and spare stroke of a sampled path; a stride leaves samples out."""
    clearance, place = corridor.surroundings.least(rough.state.q[::stride])
    return Path(rough.curve, clearance, place, float(np.min(corridor.box.spare(rough.state.lengths))))


def plan_stages(corridor: Corridor, first: Array, last: Array, leg: str, owner: Index | None = None) -> list[Path]:
    """Find clear paths, one after the other, between two configurations, shape (n,), on each of which few modules move.

    A window of modules goes to its place at the end while all others are held. The order of the windows whose corners
    keep farthest from everything is tried first. `owner` is the module of each input, shape (n,), or its group of coupled
    modules, which move as one; the layout's where absent.

    Raises:
        PathError: No order is clear.
    """
    owner = corridor.box.chain.layout.owner if owner is None else owner
    count = int(owner.max()) + 1
    windows = [np.arange(k, min(k + ANCHOR_FREE, count)) for k in range(0, count, ANCHOR_FREE)]
    moving = [window for window in windows if np.any((first != last)[np.isin(owner, window)])] or windows[:1]
    orders = [moving, moving[::-1]] if len(moving) > _MOST_WINDOWS else list(permutations(moving))
    ranked = []
    for order in orders:
        corners = [first]
        for window in order:
            corners.append(np.where(np.isin(owner, window), last, corners[-1]))
        ranked.append((*corridor.surroundings.least(np.array(corners)), order, corners))
    ranked.sort(key=lambda item: -item[0])
    failed = PathError(leg, *ranked[0][:2])
    for clearance, _, order, corners in ranked[:_TRIED]:
        if clearance < corridor.clearance:
            break
        try:
            return [
                plan_path(_anchor(corridor, begin, np.isin(owner, window)), begin, end, leg)
                for window, (begin, end) in zip(order, pairwise(corners), strict=True)
            ]
        except PathError as error:
            failed = error
    raise failed


def _anchor(corridor: Corridor, q: Array, free: Mask) -> Corridor:
    """The corridor in which only some inputs move and the others stay as in inputs of shape (n,)."""
    space = corridor.space
    rows = np.concatenate([space.rows.reshape(-1, len(q)), np.eye(len(q))[~free]])
    return replace(corridor, subspace=Subspace(space.chain, rows, np.concatenate([space.values, q[~free]])))
