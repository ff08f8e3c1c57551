"""The run log: what the step loop saw, as whole arrays, and the file it lives in.

It stands apart from the simulation so that verification can read it without MuJoCo.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.files import dump_scene, parse_scene
from vgtsim.description.scene import Scene
from vgtsim.errors import DescriptionError

Array = NDArray[np.float64]

_LEAST_RECORDS = 5  # for accelerations from positions


@dataclass(frozen=True)
class RunLog:
    """Records of one run; T records, N nodes, M members, J actuators, C contacts. Vectors are in frame G.

    Attributes:
        time: Shape (T,), s.
        nodes: Hub positions, shape (T, N, 3), m.
        ends: Positions of the members' own ends, near end first, shape (T, M, 2, 3), m.
        commanded: Actuator lengths asked for, shape (T, J), m.
        actual: Actuator lengths reached, shape (T, J), m.
        rates: Actuator speeds, shape (T, J), m/s.
        member_force: Force of each member on the hub at its near end, shape (T, M, 3), N.
        member_moment: Moment of each member on the hub at its near end, shape (T, M, 3), N·m.
        actuator_force: Force of each drive on its rod, tension positive, shape (T, J), N.
        mast_reaction: Force and moment of the mast on the arm at the pivot, shape (T, 6), N and N·m.
        tool_position: Shape (T, 3), m.
        tool_direction: Shape (T, 3), unit.
        goal: Goal being approached or held, shape (T,); -1 before the first.
        settled: True while a goal is held after settling, shape (T,).
        contact_time: Shape (C,), s.
        contact_pair: Names of the two geoms, shape (C, 2).
        contact_distance: Gap, negative in penetration, shape (C,), m.
        warnings: What MuJoCo warned of.
        performance: `simulated_s`, `wall_s`, `real_time_factor`, `steps`, `nv`.
        versions: Version of each package that took part.
        pressure: Above the tank's on the bore's and the rod's side of each hydraulic cylinder, shape (T, J, 2), Pa; empty
            under other drives.
        stopped: Why the run ended early, or an empty string.
        saturation: What each cylinder had reached since the record before, bits of 1 flow or speed, 2 force or
            pressure, 4 stroke and 8 cavity, shape (T, J); empty in logs of versions that did not look.
    """

    time: Array
    nodes: Array
    ends: Array
    commanded: Array
    actual: Array
    rates: Array
    member_force: Array
    member_moment: Array
    actuator_force: Array
    mast_reaction: Array
    tool_position: Array
    tool_direction: Array
    goal: NDArray[np.int64]
    settled: NDArray[np.bool_]
    contact_time: Array
    contact_pair: NDArray[np.str_]
    contact_distance: Array
    warnings: tuple[str, ...]
    performance: dict[str, float]
    versions: dict[str, str]
    stopped: str = ""
    saturation: NDArray[np.int64] = dataclasses.field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    pressure: Array = dataclasses.field(default_factory=lambda: np.zeros((0, 0, 2)))

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def find_fault(self) -> str:
        """Say what is wrong with the log itself.

        Returns:
            Which quantity is not finite or has another number of records, or that the records are too few or not evenly
            spaced; empty when nothing is wrong.
        """
        count = len(self.time)
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, np.ndarray) or item.name.startswith("contact") or not value.size:
                continue
            if len(value) != count:
                return f"{item.name} has {len(value)} records, time has {count}"
            if not np.isfinite(value).all():
                return (
                    f"{item.name} is not finite in {np.sum(~np.isfinite(value.reshape(count, -1)).all(axis=1))} records"
                )
        step = np.diff(self.time)
        if count < _LEAST_RECORDS:
            return f"{count} records; at least {_LEAST_RECORDS}"
        if step.min() <= 0 or np.ptp(step) > 1e-6 * step.max():
            return f"records are {step.min():.6g} to {step.max():.6g} s apart; evenly spaced ones can be differenced"
        return ""

    def directions(self, ends: NDArray[np.intp]) -> Array:
        """Unit vectors along the members, from near to far hub.

        Args:
            ends: Node indices of each member, shape (M, 2).

        Returns:
            Shape (T, M, 3).
        """
        span = self.nodes[:, ends[:, 1]] - self.nodes[:, ends[:, 0]]
        return span / np.linalg.norm(span, axis=-1, keepdims=True)

    def axial(self, ends: NDArray[np.intp]) -> Array:
        """Axial member forces at the near ends, tension positive.

        Args:
            ends: Node indices of each member, shape (M, 2).

        Returns:
            Shape (T, M), N.
        """
        return np.einsum("tmk,tmk->tm", self.member_force, self.directions(ends))

    def shear(self) -> Array:
        """Forces across the members at the near ends.

        Across the members' own axes: seen from the line between its hubs, a member whose far end is a micrometre off
        would shear by a millionth of its axial force.

        Returns:
            Shape (T, M, 3), N, in frame G.
        """
        axis = self.ends[:, :, 1] - self.ends[:, :, 0]
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        return self.member_force - np.sum(self.member_force * axis, axis=-1, keepdims=True) * axis


_META = ("warnings", "performance", "versions", "stopped")


def save_run(path: str | Path, scene: Scene, log: RunLog) -> None:
    """Write a log together with the scene it is of, as compressed npz.

    Args:
        path: File to write.
        scene: The scene, arm and tank included: the file can be verified and filmed on its own.
        log: The log.
    """
    fields: dict[str, Any] = {f.name: getattr(log, f.name) for f in dataclasses.fields(log) if f.name not in _META}
    meta = json.dumps({name: getattr(log, name) for name in _META})
    np.savez_compressed(path, scene=np.array(dump_scene(scene)), meta=np.array(meta), **fields)


def load_run(path: str | Path) -> tuple[Scene, RunLog]:
    """Read a log and its scene.

    Args:
        path: File written by `save_run`.

    Returns:
        The scene and the log.

    Raises:
        DescriptionError: The file is missing or is not a run log.
    """
    file = Path(path)
    try:
        with np.load(file) as data:
            fields = {name: data[name] for name in data.files if name not in ("meta", "scene")}
            meta, text = json.loads(str(data["meta"])), str(data["scene"])
    except (OSError, EOFError, KeyError, ValueError, BadZipFile) as error:
        raise DescriptionError(file, "", str(error) or "an empty file", "a run log written by `vgtsim run`") from None
    meta["warnings"] = tuple(meta["warnings"])
    try:
        return parse_scene(text), RunLog(**fields, **meta)
    except TypeError as error:
        raise DescriptionError(file, "", str(error), "a run log of this version of vgtsim") from None
