"""The drives of the mast, which impose the height of its feed and its turn, or hold them as servos do."""

from __future__ import annotations

from typing import Literal

import numpy as np

from vgtsim.arrays import Array
from vgtsim.errors import CommandError
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.plant.addresses import find_rows
from vgtsim.site import Site

Motion = Literal["feed", "turn"]
MastPlace = tuple[float, float]  # feed, m, and turn, rad

_ROUNDING = 1e-9  # m or rad by which a command may be beyond the range
_JOINTS: dict[Motion, str] = {"feed": names.FEED, "turn": names.TURN}
_UNITS: dict[Motion, str] = {"feed": "m", "turn": "rad"}


class MastDrive:
    """Takes the place wanted at the end of the coming step, and tells the effort of the step that was made.

    Places are heights of the mast above its working depth, m, or its turns, rad. A mast that does not turn has no drive `there`.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: Site, motion: Motion) -> None:
        """Look the drive up; the mast stays where the scene does not move it."""
        self._model, self._data = model, data
        self._motion: Motion = motion
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


class MastDrives:
    """Both drives of a mast, whose place is a feed, m, and a turn, rad."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, site: Site) -> None:
        self.feed, self.turn = MastDrive(model, data, site, "feed"), MastDrive(model, data, site, "turn")

    def read_command(self, feed: float | None, turn: float | None, last: MastPlace = (0.0, 0.0)) -> MastPlace:
        """The place that the mast is sent to from a last one; raises `CommandError` where it is out of reach."""
        there = last[0] if feed is None else self.feed.read_command(feed)
        return there, last[1] if turn is None else self.turn.read_command(turn)

    def command(self, place: MastPlace) -> None:
        """See `MastDrive.command`."""
        self.feed.command(place[0])
        self.turn.command(place[1])

    def discount(self, gaps: Array, place: MastPlace, before: MastPlace) -> None:
        """See `MastDrive.discount`; the way is that from the place asked for before."""
        self.feed.discount(gaps, place[0] - before[0])
        self.turn.discount(gaps, place[1] - before[1])

    @property
    def reached(self) -> dict[str, float]:
        """Where the mast is, by the names of the log."""
        return {"feed": self.feed.place} | ({"turn": self.turn.place} if self.turn.there else {})

    def tell(self, commanded: MastPlace) -> dict[str, float]:
        """What was asked for, and the efforts of the last step, by the names of the log."""
        told = {"feed_commanded": commanded[0], "feed_force": self.feed.effort()}
        more = {"turn_commanded": commanded[1], "turn_torque": self.turn.effort()} if self.turn.there else {}
        return told | more
