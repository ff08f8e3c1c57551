"""Clear paths between two configurations of the arm."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.errors import AssemblyError, PathError
from vgtsim.kinematics import Chain, azimuth, bend_all, swing
from vgtsim.planning.carousel import Carousel
from vgtsim.planning.curve import Curve, make_curve
from vgtsim.planning.sampling import Ground, can_search
from vgtsim.planning.trajectory import Corridor, assemblable, smooth

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Array = NDArray[np.float64]

_WAYPOINTS = 40  # of a way, ends included
_SAMPLES = 6  # configurations for each way-point at which a smoothed path is judged
_STRIDE, _MOST_WAYPOINTS = 0.4, 120  # m of some point of the arm between way-points of a searched way, and most of them
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
        travel: Sum along the path of the greatest change of an actuator, m: its time at a fixed rate.
    """

    curve: BSpline | Curve
    clearance: float
    place: str
    spare: float
    travel: float


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
    failed: list[Path] = []
    found = carousel or Carousel(Ground(corridor))
    for group in itertools.chain(_guesses(corridor, first, last), _searches(corridor, first, last, found)):
        rough = [item for item in (_curve(corridor, way) for way in group) if item is not None]
        for curve, samples, length in sorted(rough, key=lambda item: _travel(item[2])):
            path = _judge(corridor, curve, samples, length)
            if path.clearance >= wanted and path.spare > 0:
                return path
            failed.append(path)
    best = max(failed, key=lambda path: min(path.clearance, path.spare), default=None)
    if best is None:
        raise PathError(leg, -np.inf, "a module that does not assemble")
    if best.clearance >= wanted:
        raise PathError(leg, best.clearance, f"{best.place}, but overruns a stroke by {-best.spare:.4f} m")
    raise PathError(leg, best.clearance, best.place)


def _guesses(corridor: Corridor, first: Array, last: Array) -> Iterator[list[Array]]:
    """First guesses, smoothed."""
    for group in _candidates(corridor.box.chain, first, last):
        yield [smooth(corridor, way) for item in group if (way := assemblable(corridor, item)) is not None]


def _searches(corridor: Corridor, first: Array, last: Array, carousel: Carousel) -> Iterator[list[Array]]:
    """Ways that a sampling planner finds, smoothed and as they are.

    There are none without OMPL, for arms whose inputs are bound to each other, and where an end is not clear.
    """
    if not can_search() or not corridor.space.whole or not carousel.ground.clear(np.array([first, last])).all():
        return
    for corners in carousel.ways(first, last):
        way = _fill(corners, carousel.ground.scale)
        yield [smooth(corridor, way), way]


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


def _curve(corridor: Corridor, way: Array) -> tuple[BSpline | Curve, Array, Array] | None:
    """Curve through a way, its samples and their actuator lengths; None when one does not assemble."""
    try:
        curve = make_curve(corridor.space, way)
        samples = curve(np.linspace(0.0, 1.0, _SAMPLES * len(way) + 1))
    except AssemblyError:
        return None
    state = corridor.box.chain.state(samples)
    return (curve, samples, state.lengths) if np.all(state.assembles) else None


def _travel(length: Array) -> float:
    return float(np.sum(np.max(np.abs(np.diff(length, axis=0)), axis=1)))


def _judge(corridor: Corridor, curve: BSpline | Curve, samples: Array, length: Array) -> Path:
    """Least clearance and spare stroke of a sampled path."""
    clearance, places = corridor.surroundings.clearance(samples)
    worst = int(np.argmin(clearance))
    spare = float(np.min(corridor.box.spare(length)))
    return Path(curve, float(clearance[worst]), places[worst], spare, _travel(length))
