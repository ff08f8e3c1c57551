"""What presses on a plant's arm in each step: the tool, below which the waste goes away, and the couples of a bent hose."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.errors import CommandError
from vgtsim.geometry import Diggings
from vgtsim.graphics import mujoco
from vgtsim.log import LogSource
from vgtsim.mjcf import lower_waste, names
from vgtsim.site import Site
from vgtsim.statics import hose_forces


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

    def press(self, data: mujoco.MjData, wrenches: Array) -> None:
        """Add forces and moments about the bodies' centres of mass, shape (bodies, 6), N and N·m, in frame G.

        The bodies are where they stand at the begin of a step.
        """
        up = self.share * self._diggings.tool.push
        (x, y, _), (u, v, _) = data.site_xpos[self._tool].tolist(), data.xipos[self._tip].tolist()
        wrenches[self._tip] += [0.0, 0.0, up, (y - v) * up, -(x - u) * up, 0.0]

    @property
    def record(self) -> dict[str, float | Array]:
        """Quantities of a record at the begin of a step, by name."""
        force = np.array([0.0, 0.0, self.share * self._diggings.tool.push])
        own = {"tool_share": self.share, "tool_force": force, "removed": self.removed}
        return own | {"bed": self.heights.copy()}

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
    return site.lower_waste(last.bed[0] if last.bed.size else None)


def command_tool(digger: Digger | None, share: float) -> None:
    """Say which share of its power a plant's tool has at the end of the next step.

    Raises:
        CommandError: It is no share, or the tool removes no waste.
    """
    if digger is None:
        raise CommandError("tool", f"{share:g}", "nothing: no step of the scene's mission cuts waste")
    if not 0 <= share <= 1:
        raise CommandError("tool", f"{share:g}", "0 to 1, a share of its full power")
    digger.wanted = float(share)


class Hose:
    """Presses on the bodies that carry the faces' nodes, in each step as the arm is bent at its begin."""

    def __init__(self, model: mujoco.MjModel, site: Site, nodes: Index) -> None:
        """Look up the bodies; `nodes` are the sites of the nodes, shape (N,)."""
        truss = site.truss
        self._loads, self._nodes = site.load_model, nodes
        self._moved = np.unique(truss.faces)
        self._bodies = np.array(model.site_bodyid)[nodes[self._moved]]

    def press(self, data: mujoco.MjData, wrenches: Array) -> None:
        """See `Digger.press`."""
        nodes = data.site_xpos[self._nodes]
        force = hose_forces(self._loads, nodes)[self._moved]
        lever = nodes[self._moved] - data.xipos[self._bodies]
        np.add.at(wrenches, self._bodies, np.concatenate([force, np.cross(lever, force)], axis=1))


Load = Digger | Hose
