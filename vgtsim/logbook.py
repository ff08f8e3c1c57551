"""The log of a run on disk: one Parquet file a chunk, each of which appears whole or not at all. `docs/log.md` has the format."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.files import digest_scene, dump_scene, parse_scene
from vgtsim.description.scene import Scene
from vgtsim.errors import DescriptionError
from vgtsim.replacing import replacing
from vgtsim.runlog import ARRAYS, CHUNK, MAY_BE_EMPTY, Piece, RunLog, join_pieces

if TYPE_CHECKING:
    import pyarrow as pa

_BEGIN, _END = "_begin.json", "_end.json"  # readers of Parquet folders pass over names that begin with a line
_MOST_TEXT = 1 << 24  # bytes of a text beside the chunks; that of the largest shipped arm has a hundredth of it
_MOST_RECORDS = 100 * CHUNK  # of one chunk that is read
_MOST_BYTES = 1 << 28  # of one chunk that is read; a chunk of the largest shipped arm has a tenth of it
_TYPES = {"f": np.dtype(np.float64), "i": np.dtype(np.int64), "b": np.dtype(np.bool_)}
_ENTRIES: dict[str, dict[str, type]] = {
    _BEGIN: {"scene": dict, "versions": dict, "digests": dict},
    _END: {"records": int, "warnings": list, "performance": dict, "stopped": str},
}
_PERFORMANCE = ("simulated_s", "wall_s", "real_time_factor", "steps", "nv")
_RECORDED = {name: form for name, form in ARRAYS.items() if form[1][0] == "T"}
_TOUCHES = "contact_time", "contact_pair", "contact_distance"


@dataclass
class LogWriter:
    """Writes the log of one run into a folder, chunk after chunk, with texts for its begin and its end.

    In a folder that holds chunks of the same run they are held against those that the run makes again.

    Raises:
        DescriptionError: A chunk that is there is not that of this run, or the log there was begun by another one.
        OSError: The disk is full, or the folder cannot be written.
    """

    folder: Path
    scene: Scene
    versions: Mapping[str, str]
    digests: Mapping[str, str]
    resume: bool = False
    _chunks: int = 0
    _records: int = 0

    def __post_init__(self) -> None:
        """Begin the log, or read how it was begun."""
        self.folder.mkdir(parents=True, exist_ok=True)
        begin = {"scene": json.loads(dump_scene(self.scene)), "versions": dict(self.versions)}
        begin["digests"] = dict(self.digests)
        for left in self.folder.glob(".*.partial.*"):  # of a killed run
            left.unlink()
        if not self.resume or not (self.folder / _BEGIN).exists():
            _write_text(self.folder / _BEGIN, begin)
            return
        there = _read_text(self.folder / _BEGIN)
        for name in begin:
            if there[name] != begin[name]:
                found = f"another {name} than that of the run that was interrupted"
                raise DescriptionError(self.folder / _BEGIN, name, found, "the same, or a run without --resume")

    @property
    def ended(self) -> bool:
        """Whether the folder holds the end of the log too."""
        return (self.folder / _END).exists()

    def write(self, piece: Piece) -> None:
        """Add a chunk."""
        file = self.folder / f"{self._chunks:06d}.parquet"
        table = _make_table(piece)
        if not (self.resume and file.exists() and self._holds(file, table)):
            with replacing(file) as partial:
                _write_table(table, partial)
        self._chunks, self._records = self._chunks + 1, self._records + len(piece["time"])

    def end(self, rest: RunLog) -> None:
        """Add what is left, and how the run ended: the log is whole then."""
        self.write({name: getattr(rest, name) for name in _list_known(rest)})
        end = {"warnings": list(rest.warnings), "performance": rest.performance, "stopped": rest.stopped}
        _write_text(self.folder / _END, {"records": self._records} | end)

    @staticmethod
    def _holds(file: Path, table: pa.Table) -> bool:
        """Whether a file holds the records of a table; a shorter one is of a run that was ended early."""
        theirs, ours = _read_arrays(file), _to_arrays(table)
        if len(theirs["time"]) < len(ours["time"]):
            return False
        for name, value in ours.items():
            if name not in theirs or value.tobytes() != theirs[name].tobytes():
                allowed = "what this run makes: the same machine and packages, or a run without --resume"
                raise DescriptionError(file, name, "other figures", allowed)
        return True


@dataclass(frozen=True)
class LogBook:
    """The log of a run in a folder, of which pieces are read as they are asked for; see `RunLog` for the quantities.

    `stopped` also says that the run never ended, or what the log lacks.
    """

    folder: Path
    scene: Scene
    versions: dict[str, str]
    digests: dict[str, str]
    warnings: tuple[str, ...]
    performance: dict[str, float]
    stopped: str
    files: tuple[Path, ...] = field(repr=False)
    edges: NDArray[np.intp] = field(repr=False)  # first record of each file, and their count
    contacts: Piece = field(repr=False)

    @property
    def count(self) -> int:
        """Number of records."""
        return int(self.edges[-1])

    def read(self, first: int, stop: int, every: int = 1) -> RunLog:
        """The records from one to before another, or every so many of them, with all contacts."""
        low, high = (int(i) for i in np.searchsorted(self.edges, [first, stop - 1], side="right") - [1, 0])
        pieces = []
        for begin, file in zip(self.edges[low:high].tolist(), self.files[low:high], strict=True):
            wanted = slice(first - begin if first > begin else (first - begin) % every, stop - begin, every)
            pieces.append({name: value[wanted] for name, value in _read_arrays(file).items()})
        return RunLog(
            **join_pieces(pieces),
            **self.contacts,
            warnings=self.warnings,
            performance=self.performance,
            versions=self.versions,
            digests=self.digests,
            stopped=self.stopped,
        )


def open_log(folder: str | Path) -> LogBook:
    """Open the log in a folder; no array is read yet, but the sizes that its files declare are.

    Raises:
        DescriptionError: The folder holds no log, or one that is damaged or of another program.
    """
    place = Path(folder)
    begin, end = _read_text(place / _BEGIN), _read_text(place / _END) if (place / _END).exists() else None
    files = tuple(sorted(place.glob("*.parquet")))
    counts, touches = [], []
    shapes: dict[str, tuple[int, ...]] = {}
    for file in files:
        count, found, touched = _survey(file)
        counts.append(count)
        touches += touched
        shapes = shapes or found
        if found != shapes:
            raise DescriptionError(file, "", f"arrays of shapes {found}", f"those of the chunks before, {shapes}")
    records = sum(counts)
    if not records:
        raise DescriptionError(place, "", "no record", "the log of a run that lived for a chunk of records")
    text, made = json.dumps(begin["scene"]), begin["digests"].get("description")
    try:
        scene = parse_scene(text)
    except DescriptionError as error:
        raise DescriptionError(place / _BEGIN, error.key, error.found, error.allowed) from None
    if made and made != digest_scene(text):
        found = "a copy of the scene that was changed after the run"
        raise DescriptionError(place / _BEGIN, "scene", found, f"that of digest {made[:80]}")
    return LogBook(
        folder=place,
        scene=scene,
        versions=begin["versions"],
        digests=begin["digests"],
        warnings=tuple(end["warnings"]) if end else (),
        performance=end["performance"] if end else _guess_performance(scene, records),
        stopped=_say_lacks(scene, records, end),
        files=files,
        edges=np.cumsum([0, *counts]),
        contacts={
            "contact_time": np.array([touch[0] for touch in touches], dtype=float),
            "contact_pair": np.array([touch[1:3] for touch in touches], dtype=str).reshape(-1, 2),
            "contact_distance": np.array([touch[3] for touch in touches], dtype=float),
        },
    )


def save_log(folder: Path, scene: Scene, log: RunLog) -> None:
    """Write a whole log into a folder without one."""
    writer = LogWriter(folder, scene, log.versions, log.digests)
    nothing = {name: getattr(log, name)[:0] for name in _TOUCHES}
    last = max(log.count - 1, 0) // CHUNK * CHUNK
    for first in range(0, last, CHUNK):
        piece = log.read(first, first + CHUNK)
        writer.write({name: getattr(piece, name) for name in _list_known(log)} | nothing)
    writer.end(log.read(last, log.count))


def _list_known(log: RunLog) -> list[str]:
    """Names of the arrays that a log has."""
    return [name for name in ARRAYS if getattr(log, name).size or name not in MAY_BE_EMPTY]


def _guess_performance(scene: Scene, records: int) -> dict[str, float]:
    """What is known of a run without an end."""
    return dict.fromkeys(_PERFORMANCE, float("nan")) | {"simulated_s": records / scene.task.simulation.log_rate}


def _say_lacks(scene: Scene, records: int, end: Mapping[str, Any] | None) -> str:
    until = f"{records} records, to {(records - 1) / scene.task.simulation.log_rate:.6g} s"
    if end is None:
        return f"the run never ended: the log holds {until}"
    if end["records"] != records:
        return f"the log holds {until}; the run made {end['records']}"
    return end["stopped"]


def _make_table(piece: Piece) -> pa.Table:
    """Columns of tensors; the contacts stand beside them, as there are few or none."""
    import pyarrow as pa

    columns = {}
    for name in _RECORDED:
        if name not in piece:
            continue
        value = np.ascontiguousarray(piece[name])
        row, kind = value.shape[1:], pa.from_numpy_dtype(value.dtype)
        column = pa.array(value.reshape(-1), kind)
        if row:
            fixed = pa.FixedSizeListArray.from_arrays(column, prod(row))
            column = pa.ExtensionArray.from_storage(pa.fixed_shape_tensor(kind, row), fixed)
        columns[name] = column
    time, pair, gap = (piece[name].tolist() for name in _TOUCHES)
    touches = [[t, *names, d] for t, names, d in zip(time, pair, gap, strict=True)]
    return pa.table(columns).replace_schema_metadata({"contacts": json.dumps(touches)})


def _write_table(table: pa.Table, path: Path) -> None:
    from pyarrow import parquet

    parquet.write_table(table, path, compression="zstd", use_dictionary=False, write_page_checksum=True)


def _read_arrays(file: Path) -> dict[str, NDArray[Any]]:
    """Arrays of a chunk by quantity; its sizes are looked at first."""
    from pyarrow import ArrowException, parquet

    _survey(file)
    try:
        with parquet.ParquetFile(file, page_checksum_verification=True) as opened:
            return _to_arrays(opened.read())
    except (ArrowException, OSError, ValueError) as error:
        raise DescriptionError(file, "", str(error), "a chunk of a run's log") from None


def _to_arrays(table: pa.Table) -> dict[str, NDArray[Any]]:
    """Arrays of a chunk by quantity."""
    arrays = {}
    for name in table.column_names:
        column = table[name].combine_chunks()
        rank = len(_RECORDED[name][1])
        arrays[name] = column.to_numpy_ndarray() if rank > 1 else column.to_numpy(zero_copy_only=False)
    return arrays


def _survey(file: Path) -> tuple[int, dict[str, tuple[int, ...]], list[Any]]:
    """Number of records of a chunk, shape of a record of each quantity, and contacts, from its footer; no array is read."""
    from pyarrow import ArrowException, parquet

    if file.is_symlink() or not file.is_file():
        raise DescriptionError(file, "", "a link or no plain file", "a chunk of a run's log")
    if file.stat().st_size > _MOST_BYTES:
        raise DescriptionError(file, "", f"{file.stat().st_size} bytes", f"at most {_MOST_BYTES} in a chunk")
    try:
        with parquet.ParquetFile(file) as opened:
            footer, schema = opened.metadata, opened.schema_arrow
    except (ArrowException, OSError, ValueError) as error:
        raise DescriptionError(file, "", str(error), "a chunk of a run's log") from None
    count = footer.num_rows
    shapes = {name: _read_shape(file, name, schema.field(name).type) for name in schema.names}
    lacking = [name for name in _RECORDED if name not in shapes and name not in MAY_BE_EMPTY]
    if lacking:
        raise DescriptionError(file, lacking[0], "nothing", "a chunk of this version of vgtsim has it")
    groups = [footer.row_group(i) for i in range(footer.num_row_groups)]
    stored = sum(group.column(i).total_uncompressed_size for group in groups for i in range(group.num_columns))
    size = count * sum(prod(shape) * _TYPES[_RECORDED[name][0]].itemsize for name, shape in shapes.items())
    if not 0 <= count <= _MOST_RECORDS or max(size, stored) > _MOST_BYTES:
        allowed = f"at most {_MOST_RECORDS} records and {_MOST_BYTES} bytes in a chunk"
        raise DescriptionError(file, "", f"{count} records, {max(size, stored)} bytes", allowed)
    return count, shapes, _read_touches(file, schema.metadata or {})


def _read_shape(file: Path, name: str, kind: Any) -> tuple[int, ...]:
    """Shape of a record of a quantity, from the type of its column."""
    import pyarrow as pa

    if name not in _RECORDED:
        raise DescriptionError(file, name[:80], "an unknown quantity", f"one of {', '.join(_RECORDED)}")
    letter, sizes = _RECORDED[name]
    tensor = isinstance(kind, pa.FixedShapeTensorType)
    shape, value = (tuple(kind.shape), kind.value_type) if tensor else ((), kind)
    plain = not tensor or kind.permutation is None
    if value != pa.from_numpy_dtype(_TYPES[letter]) or len(shape) != len(sizes) - 1 or not plain:
        raise DescriptionError(file, name, str(kind)[:200], f"{_TYPES[letter]} in {len(sizes)} dimensions")
    return shape


def _read_touches(file: Path, metadata: Mapping[bytes, bytes]) -> list[tuple[float, str, str, float]]:
    """Time, s, names of two geoms and gap, m, of each contact of a chunk."""
    try:
        found = json.loads(metadata.get(b"contacts", b"[]"))
        return [(float(time), str(first), str(second), float(gap)) for time, first, second, gap in found]
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise DescriptionError(file, "contacts", str(error)[:200], "time, two names and gap of each") from None


def _write_text(file: Path, data: Mapping[str, Any]) -> None:
    with replacing(file) as partial:
        partial.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def _read_text(file: Path) -> dict[str, Any]:
    """The text for begin or end of a log."""
    if not file.is_file() or file.is_symlink():
        raise DescriptionError(file, "", "no such file", "the log that `vgtsim run` leaves")
    if file.stat().st_size > _MOST_TEXT:
        raise DescriptionError(file, "", f"{file.stat().st_size} bytes", f"at most {_MOST_TEXT}")
    try:
        data = json.loads(file.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise DescriptionError(file, "", str(error)[:200] or "no text", "the JSON text of a log") from None
    wanted = _ENTRIES[file.name]
    if not isinstance(data, dict):
        raise DescriptionError(file, "", type(data).__name__, f"a table of {', '.join(wanted)}")
    for name, kind in wanted.items():
        if not isinstance(data.get(name), kind):
            found = type(data[name]).__name__ if name in data else "nothing"
            raise DescriptionError(file, name, found, f"{kind.__name__}, as a log of this version of vgtsim has it")
    for name in set(data) - set(wanted):
        raise DescriptionError(file, name[:80], "an unknown entry", f"one of {', '.join(wanted)}")
    texts = [*enumerate(data.get("warnings", [])), *data.get("versions", {}).items(), *data.get("digests", {}).items()]
    for name, value in texts:
        if not isinstance(value, str):
            raise DescriptionError(file, str(name), str(value)[:80], "a text")
    for name in _PERFORMANCE if "performance" in wanted else ():
        value = data["performance"].get(name, "nothing")
        if not isinstance(value, (int, float)):
            raise DescriptionError(file, f"performance.{name}", str(value)[:80], "a number")
    return data
