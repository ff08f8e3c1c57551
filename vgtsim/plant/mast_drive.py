"""The drives of the mast, which impose the height of its feed and its turn, or hold them as servos do."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import CommandError
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.plant.addresses import find_rows
from vgtsim.site import Site

Array = NDArray[np.float64]
Motion = Literal["feed", "turn"]

_ROUNDING = 1e-9  # m or rad by which a command may be beyond the range
_JOINTS: dict[Motion, str] = {"feed": names.FEED, "turn": names.TURN}
_UNITS: dict[Motion, str] = {"feed": "m", "turn": "rad"}


class MastDrive:
    """Takes the place wanted at the end of the coming step, and tells the effort of the step that was made.

    Places are heights of the mast above its working depth, m, or its turns, rad. A mast that does not turn has no drive `there`.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: Site, motion: Motion) -> None:
        """Look the drive up; the mast stays where the scene does not move it."""
        self._model, self._data, self._motion = model, data, motion
        drive = getattr(site.task.mast, motion)
        self._reach: tuple[float, float] = (0.0, 0.0) if drive is None else drive.range
        self.there = motion == "feed" or drive is not None
        self._row: int | None = None
        if self.there:
            name = _JOINTS[motion]
            joint = model.joint(name)
            self._position, self._speed = int(joint.qposadr[0]), int(joint.dofadr[0])
            self._servo = model.actuator(names.servo(name)).id if site.task.simulation.drive == "servo" else None
            self._equality = model.equality(names.drive(name)).id

    def read_command(self, place: float) -> float:
        """A place that the scene's mast can be sent to, m or rad.

        Raises:
            CommandError: It is no finite number, or out of reach.
        """
        found, motion = float(place), self._motion
        low, high = self._reach
        if not low - _ROUNDING <= found <= high + _ROUNDING:
            word = "stroke" if motion == "feed" else "range"
            allowed = f"{low:g} to {high:g} {_UNITS[motion]}, the {word} of mast.{motion}"
            raise CommandError(
                motion, f"{found:g} {_UNITS[motion]}", allowed if high > low else f"0: no mast.{motion} is given"
            )
        return found

    def command(self, place: float) -> None:
        """Impose the place wanted at the end of the step, m or rad."""
        if not self.there:
            return
        if self._servo is None:
            self._model.eq_data[self._equality, 0] = place
        else:
            self._data.ctrl[self._servo] = place  # the feed's bias carries the weight, see `mjcf.keyframes`

    def discount(self, gaps: Array, way: float) -> None:
        """Take the way asked for in the last step out of the gaps at its begin, shape (E,): it was still to be gone."""
        if self.there and self._servo is None:
            gaps[self._find_row()] += way

    @property
    def place(self) -> float:
        """Place now, m or rad."""
        return float(self._data.qpos[self._position]) if self.there else 0.0

    def effort(self) -> float:
        """Force of the last step on the mast, upward, N, or torque, N·m."""
        model, data = self._model, self._data
        if not self.there:
            return 0.0
        if self._servo is None:
            return float(data.efc_force[self._find_row()])
        gain, bias = model.actuator_gainprm[self._servo, 0], model.actuator_biasprm[self._servo]
        held = gain * data.ctrl[self._servo] + bias[0] + bias[1] * data.qpos[self._position]
        return float(held + bias[2] * data.qvel[self._speed])

    def _find_row(self) -> int:
        if self._row is None:
            self._row = int(find_rows(self._data, np.array([self._equality]))[0])
        return self._row
