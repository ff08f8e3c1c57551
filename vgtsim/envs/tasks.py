"""What an arm is to do: goals, how far it is from them, and when it is done."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vgtsim.arrays import Array
from vgtsim.envs.tiers import Tier
from vgtsim.errors import AssemblyError, SingularityError, VgtError
from vgtsim.kinematics import State
from vgtsim.mjcf import withdrawn_poses
from vgtsim.planning import Entry
from vgtsim.site import Site

SEEN = 0.5  # m: what is farther away than this is as good as far
_TURN = 0.3  # m of distance that a radian of direction counts as
_TRIES = 500  # goals that are drawn before none is clear
_PATIENCE, _NEARER = 20, 0.8  # after so many the next ones are drawn nearer to the start, which is clear


@dataclass
class ToolAim:
    """A tool position, m, and direction, a unit vector, in frame G, and the feed of the mast, m."""

    position: Array
    direction: Array
    feed: float = 0.0


def _reach(state: State, goal: ToolAim) -> tuple[float, float]:
    """Distance, m, and angle, rad, of the tool from a goal at the working depth."""
    position, direction = (item[0] for item in state.tool)
    turned = np.arctan2(np.linalg.norm(np.cross(direction, goal.direction)), direction @ goal.direction)
    return float(np.linalg.norm(position - goal.position)), float(turned)


def _near(site: Site, state: State) -> float:
    """Distance from everything at the working depth, by the compiled kernel of the planner."""
    gaps = site.surroundings.unloaded.rows(state, SEEN, slopes=False).gap
    return float(gaps.min(initial=SEEN))


@dataclass
class Reach:
    """Come to a tool position and direction that a seeded posture has.

    Its lengths are a part of the way (`spread`) from those of the scene's start to some that are drawn evenly from the strokes,
    and it is as clear of everything as the scene asks. Where few are, the part becomes smaller.

    `goal` is what the arm is to come to now; `feed` tells whether the mast moves too.
    """

    site: Site
    spread: float = 0.4
    close: float = 0.1  # m
    aligned: float = 0.1  # rad
    feed: bool = False
    goal: ToolAim = field(init=False)

    def begin(self, rng: np.random.Generator) -> tuple[Array, float]:
        """Draw what is to be done; inputs, shape (n,), and feed, m, to start from."""
        chain, start, box = self.site.chain, self.site.start, self.site.box
        begin = chain.lengths(start)
        for tried in range(_TRIES):
            spread = self.spread * _NEARER ** (tried // _PATIENCE)
            lengths = begin + spread * (rng.uniform(box.least, box.greatest) - begin)
            try:
                q = chain.inputs_from_lengths(lengths, start)
            except (AssemblyError, SingularityError):
                continue
            if _near(self.site, chain.state(q[None])) > self.site.clearance:
                self.goal = ToolAim(*chain.tool(q))
                return start, 0.0
        raise VgtError(f"{_TRIES} goals were drawn and none is clear; spread: found {self.spread:g}; allowed: less")

    def measure(self, arm: Tier) -> float:
        """How much is left to do, m, less is better: distance, and 0.3 m for a radian."""
        distance, angle = _reach(arm.state, self.goal)
        return distance + _TURN * angle

    def advance(self, arm: Tier) -> bool:
        """Whether all is done; a goal that is reached gives way to the next."""
        distance, angle = _reach(arm.state, self.goal)
        return distance < self.close and angle < self.aligned

    def clearance(self, arm: Tier) -> float:
        """Distance from everything, m, at most `SEEN`."""
        return _near(self.site, arm.state)


@dataclass
class Raster:
    """Rake level lines with the tool: forth and back over a patch at the height of the start's tool.

    The patch is turned and moved by the seed. Each line is cut into points half a metre apart; the direction is the start's.
    """

    site: Site
    lines: int = 3
    width: float = 1.0  # of a line, m
    pitch: float = 0.3  # between lines, m
    close: float = 0.1  # m
    feed: bool = False
    done: int = field(init=False, default=0)

    def begin(self, rng: np.random.Generator) -> tuple[Array, float]:
        """See `Reach.begin`."""
        position, direction = self.site.chain.tool(self.site.start)
        turn, shift = rng.uniform(-np.pi, np.pi), rng.uniform(-0.2, 0.2, 2)
        count = max(round(self.width / 0.5), 1) + 1
        along = np.linspace(-self.width / 2, self.width / 2, count)
        across = self.pitch * (np.arange(self.lines) - (self.lines - 1) / 2)
        flat = np.array([(x, y) for k, y in enumerate(across) for x in (along if k % 2 == 0 else along[::-1])])
        flat = flat @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + shift
        self._points = position + np.column_stack([flat, np.zeros(len(flat))])
        self._direction, self.done = direction, 0
        ways = np.linalg.norm(np.diff(self._points, axis=0), axis=1)
        self._after = np.append(np.cumsum(ways[::-1])[::-1], 0.0)
        return self.site.start, 0.0

    @property
    def goal(self) -> ToolAim:
        """See `Reach.goal`: the next point."""
        return ToolAim(self._points[min(self.done, len(self._points) - 1)], self._direction)

    def measure(self, arm: Tier) -> float:
        """See `Reach.measure`: the way that is left, and 0.3 m for a radian."""
        distance, angle = _reach(arm.state, self.goal)
        return distance + _TURN * angle + float(self._after[min(self.done, len(self._points) - 1)])

    def advance(self, arm: Tier) -> bool:
        """See `Reach.advance`."""
        distance, _ = _reach(arm.state, self.goal)
        if self.done < len(self._points) and distance < self.close:
            self.done += 1
        return self.done == len(self._points)

    def clearance(self, arm: Tier) -> float:
        """See `Reach.clearance`."""
        return _near(self.site, arm.state)


@dataclass
class Entrance:
    """Bring the arm down through the riser to its working depth, bending on the way: straight it is longer than the tank is high.

    It begins stowed, at a seeded feed above the tank, and is done within `close` of the working depth, in any posture that
    touches nothing.
    """

    site: Site
    close: float = 0.05  # m
    feed: bool = True

    @cached_property
    def stowed(self) -> tuple[Array, float]:
        """Inputs, shape (n,), and feed, m, of the arm above the tank."""
        return withdrawn_poses(self.site)["stowed"]

    @cached_property
    def _entry(self) -> Entry:
        return Entry(self.site)

    def begin(self, rng: np.random.Generator) -> tuple[Array, float]:
        """See `Reach.begin`."""
        inputs, feed = self.stowed
        return inputs, feed * rng.uniform(0.98, 1.0)

    @property
    def goal(self) -> ToolAim:
        """See `Reach.goal`: where the tool would be in the posture of the scene's start, as a hint."""
        return ToolAim(*self.site.chain.tool(self.site.start))

    def measure(self, arm: Tier) -> float:
        """See `Reach.measure`: the feed that is left."""
        return arm.feed

    def advance(self, arm: Tier) -> bool:
        """See `Reach.advance`."""
        return arm.feed < self.close

    def clearance(self, arm: Tier) -> float:
        """See `Reach.clearance`: with cylinders by their real shape, the riser's bore and rim included."""
        gaps = self._entry.gaps(arm.state.q, np.array([arm.feed]))
        return min(*gaps.least().values(), SEEN)


Task = Reach | Raster | Entrance
