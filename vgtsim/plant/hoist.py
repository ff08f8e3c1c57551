"""The hoist: the drive of the mast's feed, which imposes its height, or holds it as a servo does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import CommandError
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.plant.addresses import find_rows
from vgtsim.site import Site

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # m by which a command may be beyond the stroke


class Hoist:
    """Takes the height wanted at the end of the coming step, and tells the pull of the step that was made.

    Heights are those of the mast above its working depth, m.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: Site) -> None:
        """Look the hoist up; without a feed in the scene it holds the mast at its working depth."""
        self._model, self._data = model, data
        feed = site.task.mast.feed
        self._stroke = feed.stroke if feed else 0.0
        joint = model.joint(names.FEED)
        self._position, self._speed = int(joint.qposadr[0]), int(joint.dofadr[0])
        self._servo = model.actuator(names.servo(names.FEED)).id if site.task.simulation.drive == "servo" else None
        self._row = model.equality(names.drive(names.FEED)).id
        self._force: int | None = None

    def read_command(self, height: float) -> float:
        """A height that the scene's feed can be sent to, m.

        Raises:
            CommandError: It is no finite number, or beyond the stroke.
        """
        found = float(height)
        if not -_ROUNDING <= found <= self._stroke + _ROUNDING:
            allowed = (
                f"0 to {self._stroke:g} m, the stroke of mast.feed" if self._stroke else "0: no mast.feed is given"
            )
            raise CommandError("feed", f"{found:g} m", allowed)
        return found

    def command(self, height: float) -> None:
        """Impose the height wanted at the end of the step, m."""
        if self._servo is None:
            self._model.eq_data[self._row, 0] = height
        else:
            self._data.ctrl[self._servo] = height  # its bias carries the weight, see `mjcf.keyframes`

    def discount(self, gaps: Array, way: float) -> None:
        """Take the way asked for in the last step, m, out of the gaps at its begin, shape (E,), m: it was still to be gone."""
        if self._servo is None:
            gaps[self._find_row()] += way

    @property
    def height(self) -> float:
        """Height now, m."""
        return float(self._data.qpos[self._position])

    def pull(self) -> float:
        """Force of the last step on the mast, upward, N."""
        model, data = self._model, self._data
        if self._servo is None:
            return float(data.efc_force[self._find_row()])
        gain, bias = model.actuator_gainprm[self._servo, 0], model.actuator_biasprm[self._servo]
        held = gain * data.ctrl[self._servo] + bias[0] + bias[1] * data.qpos[self._position]
        return float(held + bias[2] * data.qvel[self._speed])

    def _find_row(self) -> int:
        if self._force is None:
            self._force = int(find_rows(self._data, np.array([self._row]))[0])
        return self._force
