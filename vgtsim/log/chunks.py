"""The files of a log: chunks in Parquet and texts in JSON; nothing is taken from them before its size is known."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import nan, prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import DescriptionError
from vgtsim.log.runlog import ARRAYS, CHUNK, MAY_BE_EMPTY, TYPES, Contact, Piece, Revision
from vgtsim.replacing import replacing

if TYPE_CHECKING:
    import pyarrow as pa

BEGIN, END = "_begin.json", "_end.json"  # readers of Parquet folders pass over names that begin with a line
_MOST_TEXT = 1 << 24  # bytes of a text beside the chunks; that of the largest shipped arm has a hundredth of it
_LONGEST = 1e9  # s of simulated time: thirty years
_MOST_RECORDS = 100 * CHUNK  # of one chunk that is read
_MOST_BYTES = 1 << 28  # of one chunk that is read; a chunk of the largest shipped arm has a tenth of it
_ENTRIES: dict[str, dict[str, type]] = {
    BEGIN: {"scene": dict, "versions": dict, "digests": dict},
    END: {"records": int, "warnings": list, "performance": dict, "stopped": str},
}
_MAY_LACK = {END: {"revisions"}}  # entries of logs in which a tour was planned anew
PERFORMANCE = ("simulated_s", "wall_s", "real_time_factor", "steps", "nv")
_RECORDED = {name: form for name, form in ARRAYS.items() if form[1][0] == "T"}
TOUCHES = "contact_time", "contact_pair", "contact_distance", "contact_force", "contact_point"
# figures and names of a contact, in logs that tell its force and in those that do not
_WITHOUT_FORCE, _WITH_FORCE = 4, 10


def make_table(piece: Piece) -> pa.Table:
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
    time, pair, gap, *more = (piece[name].tolist() if name in piece else [] for name in TOUCHES)
    touches = [[t, *names, d] for t, names, d in zip(time, pair, gap, strict=True)]
    if len(more[0]) == len(touches):
        touches = [[*touch, *force, *point] for touch, force, point in zip(touches, *more, strict=True)]
    return pa.table(columns).replace_schema_metadata({"contacts": json.dumps(touches)})


def write_table(table: pa.Table, file: Path) -> None:
    """Write a chunk, whole or not at all."""
    from pyarrow import parquet

    with replacing(file) as partial:
        parquet.write_table(
            table, partial, compression="snappy", use_dictionary=False, write_statistics=False, write_page_checksum=True
        )


def read_arrays(file: Path) -> dict[str, NDArray[Any]]:
    """Arrays of a chunk by quantity; its sizes are looked at first."""
    from pyarrow import ArrowException, parquet

    survey(file)
    try:
        with parquet.ParquetFile(file, page_checksum_verification=True) as opened:
            return to_arrays(opened.read())
    except (ArrowException, OSError, ValueError) as error:
        raise DescriptionError(file, "", str(error), "a chunk of a run's log") from None


def to_arrays(table: pa.Table) -> dict[str, NDArray[Any]]:
    """Arrays of a chunk by quantity."""
    arrays = {}
    for name in table.column_names:
        column = table[name].combine_chunks()
        rank = len(_RECORDED[name][1])
        arrays[name] = column.to_numpy_ndarray() if rank > 1 else column.to_numpy(zero_copy_only=False)
    return arrays


def survey(file: Path) -> tuple[int, dict[str, tuple[int, ...]], list[Contact]]:
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
    twice = [name for name in schema.names if schema.names.count(name) > 1]
    if twice:
        raise DescriptionError(file, twice[0][:80], f"{schema.names.count(twice[0])} columns of that name", "one")
    shapes = {name: _read_shape(file, name, schema.field(name).type) for name in schema.names}
    lacking = [name for name in _RECORDED if name not in shapes and name not in MAY_BE_EMPTY]
    if lacking:
        raise DescriptionError(file, lacking[0], "nothing", "a chunk of this version of vgtsim has it")
    groups = [footer.row_group(i) for i in range(footer.num_row_groups)]
    stored = sum(group.column(i).total_uncompressed_size for group in groups for i in range(group.num_columns))
    size = count * sum(prod(shape) * TYPES[_RECORDED[name][0]].itemsize for name, shape in shapes.items())
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
    if value != pa.from_numpy_dtype(TYPES[letter]) or len(shape) != len(sizes) - 1 or not plain:
        raise DescriptionError(file, name, str(kind)[:200], f"{TYPES[letter]} in {len(sizes)} dimensions")
    return shape


def _read_touches(file: Path, metadata: Mapping[bytes, bytes]) -> list[Contact]:
    """The contacts of a chunk."""
    try:
        found = json.loads(metadata.get(b"contacts", b"[]"))
        return [_read_touch(*entry) for entry in found]
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        allowed = "time, two names, gap, and three figures each of force and point"
        raise DescriptionError(file, "contacts", str(error)[:200], allowed) from None


def _read_touch(time: float, first: str, second: str, gap: float, *more: float) -> Contact:
    if len(more) not in (0, _WITH_FORCE - _WITHOUT_FORCE):
        raise ValueError(f"{len(more)} figures after the gap")
    force, point = (tuple(float(value) for value in more[k : k + 3]) or (nan,) * 3 for k in (0, 3))
    return Contact(time=float(time), first=str(first), second=str(second), gap=float(gap), force=force, point=point)


def write_text(file: Path, data: Mapping[str, Any]) -> None:
    """Write the text for begin or end of a log, whole or not at all."""
    with replacing(file) as partial:
        partial.write_text(json.dumps(data, indent=1) + "\n", encoding="utf-8")


def read_log_text(file: Path) -> dict[str, Any]:
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
    for name in set(data) - set(wanted) - _MAY_LACK.get(file.name, set()):
        raise DescriptionError(file, name[:80], "an unknown entry", f"one of {', '.join(wanted)}")
    texts = [*enumerate(data.get("warnings", [])), *data.get("versions", {}).items(), *data.get("digests", {}).items()]
    for name, value in texts:
        if not isinstance(value, str):
            raise DescriptionError(file, str(name), str(value)[:80], "a text")
    if "performance" in wanted:
        data["performance"] = _read_performance(file, data["performance"])
    if file.name == END:
        data["revisions"] = _read_revisions(file, data.get("revisions", []))
    return data


def _read_revisions(file: Path, found: Any) -> tuple[Revision, ...]:
    """When a tour was planned anew."""
    try:
        rows = [Revision(float(item["time"]), int(item["leg"]), int(item["row"])) for item in found]
    except (TypeError, ValueError, KeyError, OverflowError):
        raise DescriptionError(file, "revisions", str(found)[:80], "rows of `time`, `leg` and `row`") from None
    if not all(0 <= item.time <= _LONGEST and item.leg >= 0 and item.row >= 0 for item in rows):
        raise DescriptionError(file, "revisions", str(found)[:80], "instants and rows of a tour")
    return tuple(rows)


def _read_performance(file: Path, found: Mapping[str, Any]) -> dict[str, float]:
    """Figures of a run, each a number; the simulated time is one that a run can last."""
    figures = {}
    for name in (*PERFORMANCE, *found):
        try:
            figures[name] = float(found.get(name, "nothing"))
        except (TypeError, ValueError, OverflowError):
            raise DescriptionError(
                file, f"performance.{name}"[:80], str(found.get(name, "nothing"))[:80], "a number"
            ) from None
    if not 0 <= figures["simulated_s"] <= _LONGEST:
        said = f"{figures['simulated_s']:g}"
        raise DescriptionError(file, "performance.simulated_s", said, f"0 to {_LONGEST:g} s")
    return figures
