"""What is seen of a plant between two steps: its state, and whether it has diverged or touched something."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isnan

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.errors import DivergenceError
from vgtsim.graphics import mujoco
from vgtsim.log import Contact
from vgtsim.touches import Parts

OPEN_GAP = 0.02  # m; a loop open by this much is no longer the mechanism, whatever MuJoCo says of it


@dataclass(frozen=True, kw_only=True)
class PlantState:
    """A plant at one instant; N nodes, J cylinders. Vectors are in frame G.

    Positions and speeds are those at `time`, the end of the last step. Forces are those that acted during it.

    Attributes:
        time: Time since the reset, s.
        commanded: Lengths asked for at this instant, shape (J,), m.
        lengths, rates: Actual lengths and speeds of the cylinders, shape (J,), m and m/s.
        nodes: Positions of the nodes, shape (N, 3), m.
        tool_position: Tool point, shape (3,), m.
        tool_rotation: Rotation of frame T of the tip plate, shape (3, 3).
        drive_force: Force of each drive on its rod, tension positive, shape (J,), N.
        feed: Height of the mast above its working depth, m; `feed_force` is the force of the hoist on it, upward, N.
        turn: Of the mast about its axis, rad; `turn_torque` is the torque of its drive on it, N·m.
        speed: Greatest speed of a node along an axis, m/s.
        calm: Whether the arm has come to rest: slower than the scene's `settle_speed`, an elastic arm for a whole period
            of its slowest mode, since the command last changed.
        contacts: Contacts during the last call of `Plant.step`.
        stopped: Why the plant has stopped for good, or an empty string.
    """

    time: float
    commanded: Array
    lengths: Array
    rates: Array
    nodes: Array
    tool_position: Array
    tool_rotation: Array
    drive_force: Array
    feed: float
    feed_force: float
    turn: float
    turn_torque: float
    speed: float
    calm: bool
    contacts: tuple[Contact, ...]
    stopped: str

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @property
    def tool_direction(self) -> Array:
        """Direction of the tool, shape (3,), unit."""
        return self.tool_rotation[:, 2]


def check_state(model: mujoco.MjModel, data: mujoco.MjData, gaps: Array) -> None:
    """Stop on a state that is no longer physical; given are the gaps of its equality rows, shape (E,), m.

    MuJoCo raises nothing when a state diverges: it counts a warning. So the counters are read, and the closures too.

    Raises:
        DivergenceError: A warning was counted, a coordinate is not finite, or a loop has opened.
    """
    if is_step_sound(gaps, OPEN_GAP, data.warning.number):
        return
    worst = int(np.argmax(np.where(np.isfinite(gaps), np.abs(gaps), np.inf))) if len(gaps) else -1
    row = model.equality(int(data.efc_id[worst])).name if worst >= 0 else "none"
    raise DivergenceError(float(data.time), row, float(gaps[worst]) if worst >= 0 else float("nan"))


@compiled
def is_step_sound(values: Array, limit: float, warnings: NDArray[np.int32]) -> bool:
    """Whether all magnitudes of values, shape (E,), are below a limit, of no number they are not, and no warning is counted."""
    sound = True
    for value in values:
        sound = sound and abs(value) < limit
    for number in warnings:
        sound = sound and number == 0
    return sound


@compiled
def are_same(values: Array, others: Array) -> bool:
    """Whether two rows of one length are the same."""
    same = True
    for i in range(len(values)):
        same = same and values[i] == others[i]
    return same


@compiled
def find_greatest_among(values: Array, which: Index) -> float:
    """Greatest magnitude of some values, at indices of shape (R,); no number where one is none."""
    greatest = 0.0
    for i in which:
        size = abs(float(values[i]))
        if size > greatest or size != size:
            greatest = size
    return greatest


def list_warnings(data: mujoco.MjData) -> tuple[str, ...]:
    """Name what MuJoCo warned of, one line a kind of warning."""
    kinds = [kind.removeprefix("mjWARN_") for kind in mujoco.mjtWarning.__members__ if kind != "mjNWARNING"]
    return tuple(f"{kind}: {data.warning[i].number}" for i, kind in enumerate(kinds) if data.warning[i].number)


def list_contacts(model: mujoco.MjModel, data: mujoco.MjData, *, forces: bool = False) -> list[Contact]:
    """Name the geoms of each contact whose gap is closed; `forces` of the last step on the second geom are told if asked for."""
    found, wrench = [], np.zeros(6)
    for index, contact in enumerate(data.contact):
        if contact.dist <= 0:
            first, second = (model.geom(int(geom)).name for geom in contact.geom)
            touch = Contact(time=float(data.time), first=first, second=second, gap=float(contact.dist))
            if forces:
                mujoco.mj_contactForce(model, data, index, wrench)
                force = contact.frame.reshape(3, 3).T @ wrench[:3]
                touch = touch._replace(force=tuple(force.tolist()), point=tuple(contact.pos.tolist()))
            found.append(touch)
    return found


def turn_force(contact: Contact, parts: Parts) -> Contact:
    """A contact with the force on the arm in place of MuJoCo's, which is that on the second geom."""
    if parts.find_part(contact.second):
        return contact
    return contact._replace(force=tuple(-value for value in contact.force))


def name_collision(contact: Contact, drive: str) -> str:
    """Say why a contact stops the plant, with the force in its first step where it is known."""
    force = float(np.linalg.norm(contact.force))
    pressed = "" if isnan(force) else f", pressed with {force / 1e3:.3g} kN in the first step"
    what = f"collision of {contact.first} with {contact.second}"
    return f"{what} at t = {contact.time:.3f} s{pressed} under {drive} drives"
