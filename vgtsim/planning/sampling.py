"""Ways through narrow places, found by a sampling planner where smoothing from a first guess is stuck.

OMPL's RRT-Connect grows two trees through the inputs, one from either end, until they meet; its simplifier takes corners out.
Inputs are scaled so that a step of one moves some point of the straight arm by a metre. A motion counts as clear when poses
along it assemble inside the strokes and keep the clearance; the poses are checked as one compiled batch.

OMPL draws from one generator for the whole process: a search sets its seed and is bounded by a number of motions and not by a
time, so the same request has the same answer.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, partial
from importlib.util import find_spec
from typing import Any

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.kinematics import sample_inputs
from vgtsim.planning.trajectory import Corridor

_RANGE = 1.5  # m; longest motion that a tree grows by
_PACE = 0.12  # m between poses that are checked, about the clearance that plans keep
_LEAST = 4  # poses of a motion, at the least
_BOUNDS = 512  # configurations whose inputs tell the bounds of the inputs
SEED = 1993  # any would do; what is drawn with it is the same in every run


@dataclass
class Ground:
    """The inputs that a corridor leaves; `checked` counts the motions that were looked at."""

    corridor: Corridor
    checked: int = field(default=0, init=False)

    @cached_property
    def scale(self) -> Array:
        """Greatest velocity of a point of the straight arm by each input, shape (n,): scaled inputs are metres."""
        chain = self.corridor.box.chain
        state = chain.state(chain.straight[None])
        return np.linalg.norm(state.node_jacobian[0], axis=1).max(axis=0)

    @cached_property
    def bounds(self) -> Array:
        """Least and greatest inputs that strokes allow, shape (2, n), from a seeded sample."""
        q = sample_inputs(self.corridor.box.chain, _BOUNDS, SEED)
        return np.array([q.min(axis=0), q.max(axis=0)])

    def clear(self, q: Array, all_of_them: bool = False) -> Mask:
        """Which configurations, shape (W, n), assemble inside the strokes and keep the clearance, see `Surroundings.clear`."""
        box = self.corridor.box
        state = box.chain.state(q)
        sound = state.assembles & (box.spare(state.lengths).min(axis=1) > 0)
        if all_of_them and not sound.all():
            return np.zeros(len(q), bool)
        if not sound.all():
            found = np.zeros(len(q), bool)
            found[sound] = self.corridor.surroundings.clear(box.chain.state(q[sound]), self.corridor.clearance)
            return found
        return self.corridor.surroundings.clear(state, self.corridor.clearance, all_of_them)

    def joins(self, first: Array, last: Array) -> bool:
        """Whether the straight motion between configurations, shape (n,), is clear, the first left out."""
        self.checked += 1
        count = max(_LEAST, int(np.ceil(np.linalg.norm((last - first) * self.scale) / _PACE)))
        part = np.linspace(1.0, 0.0, count, endpoint=False)[:, None]
        return bool(self.clear(first + part * (last - first), True).all())


def _read(scale: Array, state: Any) -> Array:
    """Inputs of a state, shape (n,)."""
    return np.array([state[k] for k in range(len(scale))]) / scale


class _Space:
    """The scaled inputs as OMPL sees them, with a generator that starts anew."""

    def __init__(self, ground: Ground, around: Array, seed: int = SEED) -> None:
        """The bounds of the ground, widened to hold configurations, shape (W, n)."""
        from ompl import base, util  # a search alone needs it

        util.setLogLevel(util.LOG_NONE)  # that the seed is set more than once is meant
        util.RNG.setSeed(seed)
        self.scale, size = ground.scale, around.shape[1]
        self.space = base.RealVectorStateSpace(size)
        limits = base.RealVectorBounds(size)
        inputs = np.concatenate([ground.bounds, around]) * self.scale
        for k in range(size):
            limits.setLow(k, float(inputs[:, k].min()))
            limits.setHigh(k, float(inputs[:, k].max()))
        self.space.setBounds(limits)
        self.information = base.SpaceInformation(self.space)

        # what OMPL calls must not hold what OMPL made: it would never be freed
        read = self.read = partial(_read, self.scale)

        class Motions(base.MotionValidator):
            def checkMotion(self, first: Any, last: Any) -> bool:  # noqa: N802 - as OMPL calls it
                return ground.joins(read(first), read(last))

        self.information.setStateValidityChecker(lambda state: bool(ground.clear(read(state)[None])[0]))
        self.information.setMotionValidator(Motions(self.information))
        self.information.setup()

    def write(self, q: Array) -> Any:
        """State of inputs, shape (n,)."""
        state: Any = self.space.allocState()
        for k, value in enumerate(q * self.scale):
            state[k] = float(value)
        return state

    def simplify(self, path: Any) -> Array:
        """Configurations of a path with corners taken out, shape (W, n)."""
        from ompl import geometric

        simplifier = geometric.PathSimplifier(self.information)
        simplifier.reduceVertices(path)
        simplifier.partialShortcutPath(path)
        simplifier.reduceVertices(path)
        return np.array([self.read(state) for state in path.getStates()])


def can_search() -> bool:
    """Whether OMPL is installed; it has no wheels for some systems."""
    return find_spec("ompl") is not None


def search(ground: Ground, starts: Array, goals: Array, most: int, seed: int = SEED) -> Array | None:
    """Corners of a clear way from one of clear starts, shape (S, n), to one of clear goals, shape (G, n), or none.

    It gives up after `most` motions. The corners have shape (W, n), the ends included.
    """
    from ompl import base, geometric

    space = _Space(ground, np.concatenate([starts, goals]), seed)
    problem = base.ProblemDefinition(space.information)
    for start in starts:
        problem.addStartState(space.write(start))
    wanted = base.GoalStates(space.information)
    for goal in goals:
        wanted.addState(space.write(goal))
    problem.setGoal(wanted)
    planner = geometric.RRTConnect(space.information)
    planner.setRange(_RANGE)
    planner.setProblemDefinition(problem)
    planner.setup()
    limit = ground.checked + most
    planner.solve(base.PlannerTerminationCondition(lambda: ground.checked >= limit))
    return space.simplify(problem.getSolutionPath()) if problem.hasExactSolution() else None


def shorten_way(ground: Ground, corners: Array) -> Array:
    """A clear way with corners of shape (W, n) made shorter."""
    from ompl import geometric

    space = _Space(ground, corners)
    path = geometric.PathGeometric(space.information)
    for q in corners:
        path.append(space.write(q))
    return space.simplify(path)
