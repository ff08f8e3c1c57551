"""The environment: actions bounded as cylinders are, observations scaled to one, rewards by what is left to do."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from vgtsim.arrays import Array
from vgtsim.description import Feed
from vgtsim.envs.picture import Picture
from vgtsim.envs.tasks import SEEN, Entrance, Raster, Reach, Task, ToolAim
from vgtsim.envs.tiers import ExactTier, FastTier, Tier
from vgtsim.errors import CommandError
from vgtsim.graphics import mujoco
from vgtsim.mjcf import withdrawn_poses
from vgtsim.site import Site, load_site

Row = NDArray[np.float32]

PERIOD = 0.5  # of an action, s: a cylinder comes to full speed in five
# rewards: of the mean square of an action, taken; of the end of a task; of a fault
EFFORT, DONE, FAULT = 0.01, 5.0, -5.0
# Of a mast without a described feed: rate, m/s, acceleration, m/s², and force, N, enough for any shipped arm and mast.
_RATE, _ACCELERATION, _FORCE = 0.1, 0.05, 1e6
_BOUND = 2.0  # of observations, which are within one but for what acceleration or a start beyond a box leaves
_TASKS: dict[str, type[Task]] = {"reach": Reach, "raster": Raster, "insertion": Entrance}


class ArmEnv(gymnasium.Env[Row, Row]):
    """An arm in its tank, moved by the rates or lengths of its cylinders, and by its feed where the task has one.

    Actions are from -1 to 1: parts of the rated speeds (`rates`), or places in the strokes (`lengths`) that are gone to at
    no more than these; accelerations are bounded by the scene's, and strokes are kept. An observation has, in this order:
    lengths within strokes and rates over rated rates, the feed's last where it moves; tool position (over the tank's radius)
    and direction; position of the goal from the tool (likewise) and its direction; clearance over half a metre.

    A reward is what less is left to do, m, less a cost of the action; 5 for the end of the task, -5 for a fault: a touch, or a
    posture that cannot be. Both end the episode.
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyright: ignore[reportIncompatibleVariableOverride]
        "render_modes": ["human", "rgb_array", "depth_array", "rgbd_tuple"],
        "render_fps": round(1 / PERIOD),
    }

    def __init__(
        self,
        task: Literal["reach", "raster", "insertion"] = "reach",
        scene: str | Path = "arm9_nullspace",
        *,
        action: Literal["rates", "lengths"] = "rates",
        tier: Literal["fast", "exact"] = "fast",
        members: Literal["sections", "rigid"] | None = None,
        render_mode: str | None = None,
        **settings: Any,
    ) -> None:
        """Make an environment of a scene; further settings are those of the task's class.

        The fast tier is kinematics, the exact one the plant, whose static modules are bodies (`sections`) or trusses (`rigid`).
        By default they are bodies, but trusses in an insertion: only these have cylinders of their real shape in the riser.

        Raises:
            CommandError: A choice is unknown.
        """
        for what, found, allowed in (
            ("task", task, tuple(_TASKS)),
            ("action", action, ("rates", "lengths")),
            ("tier", tier, ("fast", "exact")),
            ("members", members, (None, "sections", "rigid")),
            ("render_mode", render_mode, (None, *self.metadata["render_modes"])),
        ):
            if found not in allowed:
                raise CommandError(what, repr(found), " or ".join(map(repr, allowed)))
        members = members or ("rigid" if task == "insertion" else "sections")
        self.site = load_for(str(scene), members, feed=task == "insertion")
        self.task: Task = _TASKS[task](self.site, **settings)
        self._steps = int(np.ceil(PERIOD / self.site.timestep - 1e-9))  # rounding apart
        self.tier: Tier = FastTier(self.site) if tier == "fast" else ExactTier(self.site, PERIOD / self._steps)
        self.action, self.render_mode = action, render_mode
        truss, arm = self.site.truss, self.site.arm
        rates = [arm.cylinders[truss.members[i].section].rate for i in truss.actuated]
        low, high, most = self.site.box.least, self.site.box.greatest, [self.site.task.motion.acceleration] * len(rates)
        if self.task.feed and (hoist := self.site.task.mast.feed):
            stowed = self.site.chain.lengths(self.site.chain.stowed)
            low, high = np.minimum(low, stowed), np.maximum(high, stowed)
            low, high = np.append(low, 0.0), np.append(high, hoist.stroke)
            rates, most = [*rates, hoist.rate], [*most, hoist.acceleration]
        self.low, self.high, self.rated, self._most = low, high, np.array(rates), np.array(most)
        self._scale = self.site.tank.shell.inner_diameter / 2
        count = len(self.rated)
        self.action_space = spaces.Box(-1.0, 1.0, (count,), np.float32)
        self.observation_space = spaces.Box(-_BOUND, _BOUND, (2 * count + 13,), np.float32)
        self._picture: Picture | None = None

    @property
    def model(self) -> mujoco.MjModel:
        """The model of the plant, or of the picture where there is no plant."""
        return self.tier.plant.model if isinstance(self.tier, ExactTier) else self._draw().model

    @property
    def data(self) -> mujoco.MjData:
        """The data of the plant, to be read only, or of the picture."""
        return self.tier.plant.data if isinstance(self.tier, ExactTier) else self._draw().data

    @property
    def place(self) -> Array:
        """Lengths of the cylinders, m, and the feed where it moves, shape (J,) or (J + 1,)."""
        return np.append(self.tier.lengths, self.tier.feed) if self.task.feed else np.array(self.tier.lengths)

    @property
    def goal(self) -> ToolAim:
        """Where the tool is to come to now."""
        return self.task.goal

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Row, dict[str, Any]]:
        """Stand at rest where the task begins; the seed draws the task.

        Raises:
            CommandError: There are options: an environment's settings are given when it is made.
        """
        if options:
            raise CommandError("options", repr(options), "none; settings are given when the environment is made")
        super().reset(seed=seed)
        self.tier.reset(*self.task.begin(self.np_random))
        self.rates = np.zeros(len(self.rated))
        self._commanded = self.place
        self._left, self._clearance = self.task.measure(self.tier), self.task.clearance(self.tier)
        self._show()
        return self._observe(), self._tell()

    def step(self, action: Row) -> tuple[Row, float, bool, bool, dict[str, Any]]:
        """Go on by half a second."""
        wish = np.clip(np.asarray(action, dtype=float), -1.0, 1.0)
        way = self._plan(self._bound(wish))
        feed = way[:, -1] if self.task.feed else np.full(len(way), self.tier.feed)
        fault = self.tier.move(way[:, : len(self.site.truss.actuated)], feed)
        self._clearance = self.task.clearance(self.tier)
        if not fault and self._clearance <= 0:
            fault = "the arm touches something"
        done = not fault and self.task.advance(self.tier)
        left = self.task.measure(self.tier)
        reward = (
            self._left - left - EFFORT * float(np.mean(wish**2)) + (DONE if done else 0.0) + (FAULT if fault else 0.0)
        )
        self._left = left
        self._show()
        return self._observe(), reward, bool(done or fault), False, self._tell(fault, done=done)

    def render(self) -> Any:
        """A picture in the render mode; nothing in `human`, whose window is drawn anew by every step."""
        return None if self.render_mode is None else self._draw().render(self.render_mode)

    def close(self) -> None:
        """Close the windows."""
        if self._picture is not None:
            self._picture.close()
            self._picture = None

    def _bound(self, wish: Array) -> Array:
        """Rates at the end of the period, m/s, from which every drive can still stop within its stroke."""
        wanted = wish * self.rated
        if self.action == "lengths":
            aim = (self.low + self.high) / 2 + wish * (self.high - self.low) / 2
            wanted = (aim - self._commanded) / PERIOD
        up, down = self.high - self._commanded, self._commanded - self.low
        fastest = np.minimum(self.rated, self._stop_within(up, self.rates))
        slowest = -np.minimum(self.rated, self._stop_within(down, -self.rates))
        change = self._most * PERIOD
        return np.clip(np.clip(wanted, slowest, fastest), self.rates - change, self.rates + change)

    def _stop_within(self, room: Array, rates: Array) -> Array:
        """Greatest rates at the end of the period: what is then gone at the mean of both, and braking, fit into the room."""
        left = room - rates * PERIOD / 2
        root = np.sqrt(np.maximum(PERIOD**2 / 4 + 2 * left / self._most, 0.0))
        return self._most * (root - PERIOD / 2)

    def _plan(self, rates: Array) -> Array:
        """Places at the end of each step, shape (S, J), at a constant acceleration to rates, m/s."""
        t = PERIOD * np.arange(1, self._steps + 1)[:, None] / self._steps
        way = self._commanded + self.rates * t + (rates - self.rates) * t**2 / (2 * PERIOD)
        way = np.clip(way, np.minimum(self.low, self._commanded), np.maximum(self.high, self._commanded))
        self.rates, self._commanded = rates, way[-1]
        return way

    def _observe(self) -> Row:
        goal, (position, direction) = self.goal, (item[0] for item in self.tier.state.tool)
        lift = np.array([0.0, 0.0, self.tier.feed])
        within = (2 * self.place - self.low - self.high) / (self.high - self.low)
        parts = within, self.rates / self.rated, (position + lift) / self._scale, direction
        away = (goal.position - position - lift) / self._scale, goal.direction
        seen = np.concatenate([*parts, *away, [self._clearance / SEEN]])
        return np.clip(seen, -_BOUND, _BOUND).astype(np.float32)

    def _tell(self, fault: str = "", *, done: bool = False) -> dict[str, Any]:
        return {"left": self._left, "clearance": self._clearance, "fault": fault, "is_success": done}

    def _draw(self) -> Picture:
        if self._picture is None:
            self._picture = Picture(self.site)
            if hasattr(self.tier, "state"):
                self._picture.show(self.tier.state.q[0], self.tier.feed, self.goal)
        return self._picture

    def _show(self) -> None:
        if self._picture is not None or self.render_mode == "human":
            self._draw().show(self.tier.state.q[0], self.tier.feed, self.goal)
            if self.render_mode == "human":
                self._draw().render("human")


@lru_cache(maxsize=8)
def load_for(scene: str, members: str, *, feed: bool) -> Site:
    """A scene's site with other members, and with a feed to above the tank if asked for and none is described."""
    site = load_site(scene)
    simulation = site.task.simulation.model_copy(update={"members": members, "drive": "rigid"})
    task = site.task.model_copy(update={"simulation": simulation})
    if feed and task.mast.feed is None:
        stroke = withdrawn_poses(site)["stowed"][1]
        hoist = Feed(stroke=stroke, rate=_RATE, acceleration=_ACCELERATION, force=_FORCE)
        task = task.model_copy(update={"mast": task.mast.model_copy(update={"feed": hoist})})
    return Site(replace(site.scene, task=task))
