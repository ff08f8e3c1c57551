"""Pictures of an environment: the full arm in its cut-open tank, with the goal marked."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco, require_display
from vgtsim.mjcf import build_model, fill_qpos, make_pose_map
from vgtsim.site import Site

if TYPE_CHECKING:
    from vgtsim.envs.tasks import ToolAim


_WIDTH, _HEIGHT, _CAMERA = 640, 480, "cutaway"
_AWAY = 1e3  # m: where the marks of the scene's other goals go


class Picture:
    """A model of its own that is set to postures of the kinematics and drawn."""

    def __init__(self, site: Site) -> None:
        """Compile the model, which takes seconds once for a scene."""
        simulation = site.task.simulation.model_copy(update={"members": "rigid"})
        full = Site(replace(site.scene, task=site.task.model_copy(update={"simulation": simulation})))
        self.model = build_model(full)
        self.data = mujoco.MjData(self.model)
        self._site, self._pose = site, make_pose_map(self.model, site.truss)
        self._marks = [i for i in range(self.model.nsite) if self.model.site(i).name.startswith("goal/")][:2]
        self._renderer: Any = None

    def show(self, inputs: Array, feed: float, goal: ToolAim) -> None:
        """Stand the arm in a posture of inputs, shape (n,), at a feed, m, and move the mark to a goal."""
        nodes = self._site.chain.nodes(inputs) + np.array([0.0, 0.0, feed])
        fill_qpos(self._pose, self._site.truss, nodes, self.data.qpos)
        model = self.model
        for site in range(model.nsite):
            if model.site(site).name.startswith("goal/"):
                model.site_pos[site] = _AWAY
        for site, way in zip(self._marks, (0.0, 0.35), strict=False):  # the ball, and the middle of the rod
            model.site_pos[site] = goal.position + way * goal.direction
            mujoco.mju_quatZ2Vec(model.site_quat[site], goal.direction)  # it turns z into the direction
        mujoco.mj_forward(model, self.data)

    def render(self, mode: str) -> Any:
        """Draw in one of Gymnasium's modes.

        Raises:
            MissingLibraryError: A window is wanted where there is no display.
        """
        if self._renderer is None:
            if mode == "human":
                require_display()
            from gymnasium.envs.mujoco.mujoco_rendering import MujocoRenderer

            self._renderer = MujocoRenderer(self.model, self.data, None, _WIDTH, _HEIGHT, 4000, camera_name=_CAMERA)
        return self._renderer.render(mode)

    def close(self) -> None:
        """Free what draws."""
        if self._renderer is not None:
            self._renderer.close()
