"""One motion of one arm that every engine plays, and the measure of an engine: places and forces against statics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

from vgtsim.site import Site
from vgtsim.statics import NodeMotion, solve_members, tool_point

Array = NDArray[np.float64]

_SPACING = 1e-3  # s between places that accelerations are made of: truncation 1e-6 of them, rounding 1e-8 m/s²


@dataclass(frozen=True, eq=False)
class Task:
    """A motion from rest to rest; the site has its members' mass in the hubs.

    `inputs` gives those at a time from 0 to `duration`, s; engines stand still for `hold` seconds before and after, and
    record places and forces at a `rate`, Hz.
    """

    site: Site
    inputs: BSpline
    duration: float
    hold: float = 0.2
    rate: float = 25.0

    @property
    def total(self) -> float:
        """Time that an engine plays, s."""
        return self.duration + 2 * self.hold

    def instants(self, step: float) -> Array:
        """Times at the begin of each step and at the end of the last one, s."""
        return np.arange(round(self.total / step) + 1, dtype=np.float64) * step

    def pose(self, time: Array) -> Array:
        """Inputs at times since the start of a run, shape (T, n)."""
        return np.array(self.inputs(np.clip(time - self.hold, 0.0, self.duration)), np.float64)

    def lengths(self, time: Array) -> Array:
        """Lengths of the cylinders, shape (T, J), m."""
        return self.site.chain.lengths(self.pose(time))


@dataclass(frozen=True, eq=False)
class Played:
    """What an engine made of the task; T records.

    Attributes:
        time: Shape (T,), s.
        nodes: Shape (T, N, 3), m.
        axial: Forces of the members, tension positive, shape (T, M), N; NaN where the engine has none.
        spent: Processor time, s.
        steps: Number of steps.
        gap: Greatest distance of a member's end from its hub, m, where members are bodies.
    """

    time: Array
    nodes: Array
    axial: Array
    spent: float
    steps: int
    gap: float = 0.0


@dataclass(frozen=True)
class Errors:
    """Greatest errors of a run: lengths of members and closure, nodes and tool, m; forces over the largest of the instant.

    `start` is the error of forces in the first tenth of the motion, `moving` afterwards, `resting` at the end.
    """

    length: float
    node: float
    tool: float
    start: float
    moving: float
    resting: float


def make_task(site: Site, times: Array, inputs: Array) -> Task:
    """The task of inputs, shape (T, n), at times from 0, shape (T,), s."""
    return Task(site, make_interp_spline(times, inputs, k=5), float(times[-1]))


def measure(task: Task, played: Played) -> Errors:
    """Hold places against kinematics and forces against the method of joints, both of the commanded motion."""
    site, chain = task.site, task.site.chain
    beside = [chain.nodes(task.pose(played.time + shift)) for shift in (-_SPACING, 0.0, _SPACING)]
    exact = beside[1]
    motion = NodeMotion((beside[2] - beside[0]) / (2 * _SPACING), (beside[2] - 2 * exact + beside[0]) / _SPACING**2)
    model, truss = site.load_model, site.truss
    expected = solve_members(model, exact, motion).bar
    off = np.abs(played.axial - expected) / np.abs(expected).max(axis=1, keepdims=True)
    off = np.nanmax(off, axis=1)
    early = played.time < task.hold + 0.1 * task.duration
    late = played.time > task.hold + task.duration + 0.5 * task.hold
    return Errors(
        length=max(float(np.abs(truss.lengths(played.nodes) - truss.lengths(exact)).max()), played.gap),
        node=float(np.linalg.norm(played.nodes - exact, axis=-1).max()),
        tool=float(np.linalg.norm(tool_point(model, played.nodes) - tool_point(model, exact), axis=-1).max()),
        start=float(off[early].max()),
        moving=float(off[~early].max()),
        resting=float(off[late].max()),
    )
