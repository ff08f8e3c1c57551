"""The tool of a plant: it pushes on the arm, and the waste below it goes away."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.errors import CommandError
from vgtsim.geometry import Diggings
from vgtsim.graphics import mujoco
from vgtsim.mjcf import lower_waste, names
from vgtsim.site import Site
from vgtsim.stretch import LogSource

_UP = np.array([0.0, 0.0, 1.0])


class Digger:
    """A tool at a share of its full power, 0 to 1, and the heights of the waste that it leaves.

    Attributes:
        share: At the begin of the coming step; the `wanted` one is that at its end.
        heights: Of the waste in the diggings, shape (P,), m.
        removed: Volume removed so far, m³.
    """

    def __init__(self, model: mujoco.MjModel, diggings: Diggings, begun: Array) -> None:
        """Begin with waste of some heights, shape (P,), m; volume is counted from the described ones."""
        self._model, self._diggings = model, diggings
        self._tool, self._tip = model.site(names.TOOL).id, model.body(names.TIP).id
        self.share = self.wanted = 0.0
        self.heights, self.removed = begun.copy(), float(diggings.removed(begun))
        lower_waste(model, diggings, self.heights)

    @property
    def force(self) -> Array:
        """On the tool point in frame G, shape (3,), N."""
        return self.share * self._diggings.tool.push * _UP

    def press(self, data: mujoco.MjData, wrenches: Array) -> None:
        """See `correction.Load`."""
        lever = data.site_xpos[self._tool] - data.xipos[self._tip]
        wrenches[self._tip] += [*self.force, *np.cross(lever, self.force)]

    @property
    def record(self) -> dict[str, float | Array]:
        """Quantities of a record at the begin of a step, by name."""
        own = {"tool_share": self.share, "tool_force": self.force, "removed": self.removed}
        return own | {"bed": self.heights.copy()}

    def command(self, share: float) -> None:
        """Say which share of its power the tool has at the end of the next step.

        Raises:
            CommandError: It is no share.
        """
        if not 0 <= share <= 1:
            raise CommandError("tool", f"{share:g}", "0 to 1, a share of its full power")
        self.wanted = float(share)

    def dig(self, point: Array, timestep: float) -> None:
        """Remove what a step of some s at a tool point, shape (3,), m, removes."""
        volume = self._diggings.rate * timestep * (self.share + self.wanted) / 2
        self.share = self.wanted
        if volume > 0 and (taken := self._diggings.dig(self.heights, point, volume)):
            self.removed += taken
            lower_waste(self._model, self._diggings, self.heights)


def find_digger(model: mujoco.MjModel, site: Site) -> Digger | None:
    """The digger of a site whose mission cuts waste."""
    if site.diggings is None or site.begun is None:
        return None
    return Digger(model, site.diggings, site.begun)


def carry_waste(site: Site, log: LogSource) -> Site:
    """The site of a mission's next phase, over the waste as the log of the phase before left it."""
    last = log.read(log.count - 1, log.count)
    return site.lower_waste(last.bed[0]) if last.bed.size else site


def command_tool(digger: Digger | None, share: float) -> None:
    """Say which share of its power a plant's tool has at the end of the next step.

    Raises:
        CommandError: It is no share, or the tool removes no waste.
    """
    if digger is None:
        raise CommandError("tool", f"{share:g}", "nothing: no step of the scene's mission cuts waste")
    digger.command(share)
