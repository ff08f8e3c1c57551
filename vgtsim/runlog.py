"""The run log: what the step loop saw, as whole arrays, and the file it lives in.

It stands apart from the simulation so that verification can read it without MuJoCo.
"""

from __future__ import annotations

import dataclasses
import json
import zlib
from collections.abc import Mapping
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
_META: dict[str, type] = {"warnings": list, "performance": dict, "versions": dict, "stopped": str}
_PERFORMANCE = ("simulated_s", "wall_s", "real_time_factor", "steps", "nv")
_KINDS = {"f": "floats", "i": "integers", "b": "truth values", "U": "text"}
_ARRAYS = {  # kind and shape, in the letters of `RunLog`
    "time": ("f", "T"),
    "nodes": ("f", "TN3"),
    "ends": ("f", "TM23"),
    "commanded": ("f", "TJ"),
    "actual": ("f", "TJ"),
    "rates": ("f", "TJ"),
    "member_force": ("f", "TM3"),
    "member_moment": ("f", "TM3"),
    "actuator_force": ("f", "TJ"),
    "mast_reaction": ("f", "T6"),
    "tool_position": ("f", "T3"),
    "tool_direction": ("f", "T3"),
    "goal": ("i", "T"),
    "settled": ("b", "T"),
    "contact_time": ("f", "C"),
    "contact_pair": ("U", "C2"),
    "contact_distance": ("f", "C"),
    "saturation": ("i", "TJ"),
    "pressure": ("f", "TJ2"),
}
_MAY_BE_EMPTY = ("saturation", "pressure")


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
        """Say which quantity is not finite or has another number of records, or that records are too few or not evenly spaced.

        Empty when nothing is wrong.
        """
        count = len(self.time)
        for item in dataclasses.fields(self):
            value = getattr(self, item.name)
            if not isinstance(value, np.ndarray) or item.name.startswith("contact"):
                continue
            if item.name in _MAY_BE_EMPTY and not value.size:
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

    def find_misfit(self, nodes: int, members: int, actuators: int, goals: int) -> str:
        """Say which array does not fit the counts of an arm, or that a goal is none of the scene's; empty when all fits."""
        counts = {"T": len(self.time), "N": nodes, "M": members, "J": actuators, "C": len(self.contact_time)}
        for name, (_, sizes) in _ARRAYS.items():
            value = getattr(self, name)
            wanted = tuple(counts[size] if size in counts else int(size) for size in sizes)
            if value.shape != wanted and not (name in _MAY_BE_EMPTY and not value.size):
                return f"{name} has shape {value.shape}, that of the scene's arm is {wanted}"
        low, high = (self.goal.min(), self.goal.max()) if len(self.goal) else (-1, -1)
        if low < -1 or high >= goals:
            return f"goals {low} to {high} are in the log; allowed: -1 to {goals - 1}, as the scene has {goals}"
        return ""

    def directions(self, ends: NDArray[np.intp]) -> Array:
        """Unit vectors along members, from near to far hub, shape (T, M, 3); `ends` are their nodes, shape (M, 2)."""
        span = self.nodes[:, ends[:, 1]] - self.nodes[:, ends[:, 0]]
        return span / np.linalg.norm(span, axis=-1, keepdims=True)

    def axial(self, ends: NDArray[np.intp]) -> Array:
        """Axial member forces at the near ends, tension positive, shape (T, M), N; `ends` as in `directions`."""
        return np.einsum("tmk,tmk->tm", self.member_force, self.directions(ends))

    def shear(self) -> Array:
        """Forces across the members at the near ends, shape (T, M, 3), N, in frame G.

        They are across the axes of the members themselves. Across the line between its hubs a member whose far end is a
        micrometre off would shear by a millionth of its axial force.
        """
        axis = self.ends[:, :, 1] - self.ends[:, :, 0]
        axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
        return self.member_force - np.sum(self.member_force * axis, axis=-1, keepdims=True) * axis


def empty_records(nodes: int, members: int, actuators: int) -> dict[str, NDArray[Any]]:
    """Arrays of a log without any record, by name, contacts apart."""
    counts = {"T": 0, "N": nodes, "M": members, "J": actuators}
    types = {"f": float, "i": np.int64, "b": bool}
    return {
        name: np.zeros([counts[size] if size in counts else int(size) for size in sizes], dtype=types[kind])
        for name, (kind, sizes) in _ARRAYS.items()
        if not name.startswith("contact")
    }


def save_run(path: str | Path, scene: Scene, log: RunLog) -> None:
    """Write a log as compressed npz, with its scene, arm and tank: the file can be verified and filmed alone."""
    fields: dict[str, Any] = {f.name: getattr(log, f.name) for f in dataclasses.fields(log) if f.name not in _META}
    meta = json.dumps({name: getattr(log, name) for name in _META})
    np.savez_compressed(path, scene=np.array(dump_scene(scene)), meta=np.array(meta), **fields)


def load_run(path: str | Path) -> tuple[Scene, RunLog]:
    """Read a log and its scene from a file written by `save_run`.

    Raises:
        DescriptionError: The file is missing, is damaged or is not a run log of this version.
    """
    file = Path(path)
    try:
        with np.load(file) as data:
            fields = {name: data[name] for name in data.files if name not in ("meta", "scene")}
            meta, text = json.loads(str(data["meta"])), str(data["scene"])
    except (OSError, EOFError, KeyError, TypeError, ValueError, BadZipFile, zlib.error) as error:
        raise DescriptionError(file, "", str(error) or "an empty file", "a run log written by `vgtsim run`") from None
    if fault := _find_foreign(fields) or _find_wrong_meta(meta):
        raise DescriptionError(file, *fault)
    meta["warnings"] = tuple(meta["warnings"])
    try:
        return parse_scene(text), RunLog(**fields, **meta)
    except DescriptionError as error:
        raise DescriptionError(file, error.key, error.found, error.allowed) from None


def _find_foreign(fields: Mapping[str, NDArray[Any]]) -> tuple[str, str, str] | None:
    """Key, what is found and what is allowed of the first array that is not a log's."""
    for name, (kind, sizes) in _ARRAYS.items():
        if name not in fields:
            if name in _MAY_BE_EMPTY:
                continue
            return name, "nothing", "a run log of this version of vgtsim has it"
        value, wanted = fields[name], f"{_KINDS[kind]} in {len(sizes)} dimensions"
        if value.dtype.kind != kind or value.ndim != len(sizes):
            return name, f"{value.dtype} in {value.ndim} dimensions", wanted
    unknown = [name for name in fields if name not in _ARRAYS]
    return (unknown[0], "an unknown array", f"one of {', '.join(_ARRAYS)}") if unknown else None


def _find_wrong_meta(meta: object) -> tuple[str, str, str] | None:
    """The same of what stands beside the arrays."""
    if not isinstance(meta, dict):
        return "meta", type(meta).__name__, f"a table of {', '.join(_META)}"
    for name, kind in _META.items():
        if name not in meta:
            return f"meta.{name}", "nothing", "a run log of this version of vgtsim has it"
        if not isinstance(meta[name], kind):
            return f"meta.{name}", type(meta[name]).__name__, kind.__name__
    unknown = [name for name in meta if name not in _META]
    if unknown:
        return f"meta.{unknown[0]}", "an unknown entry", f"one of {', '.join(_META)}"
    for name in _PERFORMANCE:
        found = meta["performance"].get(name, "nothing")
        if not isinstance(found, (int, float)):
            return f"meta.performance.{name}", str(found), "a number"
    return None
