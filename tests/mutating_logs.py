"""Ways to spoil the folder of a run: figures, types, shapes and files of its log, its texts, its model."""

from __future__ import annotations

import json
import random
from pathlib import Path

import numpy as np
from mutating import HOSTILE, cut, mutate, mutate_bytes, replace_file

from vgtsim.description.files import digest_scene

FIGURES = (0.0, -0.0, -1.0, 1e-9, 5e-324, 1e300, 1e160, 1e17, float("nan"), float("inf"), float("-inf"))
INTEGERS = (0, -1, 7, 2**31, 2**62, -(2**63))
CONTACTS = (
    "nothing",
    "{}",
    "[[]]",
    "[" * 5000,
    '[["a", "b", "c", "d"]]',
    '[[1.0, "[/]", "<script>", NaN]]',
    '[[0.1, "nowhere", "waste", -0.001, 1e300, 0.0, NaN, 0.0, 0.0, 0.0]]',
    '[[1e300, "tool", "tool", -1e300]]',
    json.dumps([[0.1, "x" * 100_000, "waste", -1.0]] * 20),
)
_FIRST_FILES = ("_begin.json", "_end.json")


def mutate_run(folder: Path, rng: random.Random) -> str:
    """Change something in the folder of a run, and say how."""
    log = folder / "log"
    choice = rng.random()
    chunks = sorted(file for file in log.glob("[0-9]*.parquet") if file.is_file())
    if choice < 0.5 and chunks:
        return _mutate_chunk(rng.choice(chunks), rng)
    if choice < 0.75 and log.is_dir():
        return _mutate_text(log / rng.choice(_FIRST_FILES), rng)
    if choice < 0.85 and log.is_dir():
        return _mutate_files(log, chunks, rng)
    files = [file for file in (*log.glob("*"), *folder.glob("*")) if file.is_file() and not file.is_symlink()]
    file = rng.choice(files or [folder / "log"])
    done = replace_file(file, rng) if rng.random() < 0.3 or not file.is_file() else mutate_bytes(file, rng)
    return f"{file.name}: {done}"


def _mutate_text(file: Path, rng: random.Random) -> str:
    """Spoil a text of the log; now and then its digest is made to fit, as one who means to deceive would do."""
    done = mutate(file, rng)
    if rng.random() < 0.7 and file.is_file() and not file.is_symlink():
        try:
            data = json.loads(file.read_text())
            data["digests"]["description"] = digest_scene(json.dumps(data["scene"]))
            file.write_text(json.dumps(data, indent=1))
        except (ValueError, KeyError, TypeError, RecursionError):
            pass
    return f"{file.name}: {done}"


def _mutate_files(log: Path, chunks: list[Path], rng: random.Random) -> str:
    """Take away, double or swap chunks, or put something beside them."""
    kind = rng.choice(("gone", "double", "swap", "beside", "all gone", "no end", "many"))
    if kind == "gone" and chunks:
        rng.choice(chunks).unlink()
    elif kind == "double" and chunks:
        content = rng.choice(chunks).read_bytes()
        (log / f"{rng.choice((1, 2, 7, 999_999)):06d}.parquet").write_bytes(content)
    elif kind == "swap" and len(chunks) > 1:
        chunks[0].rename(log / "x")
        chunks[1].rename(chunks[0])
        (log / "x").rename(chunks[1])
    elif kind == "beside":
        place = log / rng.choice(("00.parquet", "1\n.parquet", "000009.parquet", "[b].parquet"))
        if not place.exists():
            place.mkdir()
    elif kind == "all gone":
        for file in chunks:
            file.unlink()
    elif kind == "no end":
        (log / "_end.json").unlink(missing_ok=True)
    elif kind == "many" and chunks and not (log / "000100.parquet").exists():
        for k in range(100, 400):
            (log / f"{k:06d}.parquet").hardlink_to(chunks[0])
    return f"chunks: {kind}"


def _mutate_chunk(file: Path, rng: random.Random) -> str:
    """Spoil figures, type, shape or names of the arrays of a chunk, or its bytes."""
    import pyarrow as pa
    from pyarrow import parquet

    try:
        table = parquet.read_table(file)
    except (pa.ArrowException, OSError, ValueError):
        table = None
    if not table:  # spoilt before, or without a record
        return f"{file.name}: {mutate_bytes(file, rng)}"
    kind = rng.choice(("figures",) * 6 + ("type", "shape", "lost", "renamed", "rows", "contacts", "bytes", "large"))
    name = rng.choice([*table.column_names])
    index = table.column_names.index(name)
    told = kind
    if kind == "figures":
        value, told = _mutate_figures(table, name, rng)
        table = table.set_column(index, name, value)
    elif kind == "type":
        table = table.set_column(index, name, pa.array([str(i) for i in range(len(table))]))
    elif kind == "shape":
        row = pa.FixedSizeListArray.from_arrays(pa.array(np.zeros(2 * len(table))), 2)
        table = table.set_column(
            index, name, pa.ExtensionArray.from_storage(pa.fixed_shape_tensor(pa.float64(), (2,)), row)
        )
    elif kind == "lost":
        table = table.drop_columns([name])
    elif kind == "renamed":
        table = table.rename_columns(
            [rng.choice(("x", "[/]", "", "time")) if n == name else n for n in table.column_names]
        )
    elif kind == "rows":
        table = table.slice(0, rng.choice((0, 1, 2, 3, 5, len(table) // 2)))
    elif kind == "contacts":
        told = rng.choice((*CONTACTS, *(text for text in HOSTILE if len(text) < 1000)))
        table = table.replace_schema_metadata({"contacts": told})
    elif kind == "large":
        table = pa.concat_tables([table] * rng.choice((2, 50, 300)))
    else:
        return f"{file.name}: {mutate_bytes(file, rng)}"
    parquet.write_table(table, file)
    return f"{file.name}, {name}: {cut(told)}"


def _mutate_figures(table, name: str, rng: random.Random):
    """A column with another figure in one entry, in one record, or in all; a sign, a factor or a shift in all."""
    import pyarrow as pa

    column = table[name].combine_chunks()
    tensor = isinstance(column.type, pa.FixedShapeTensorType)
    value = np.array(column.to_numpy_ndarray() if tensor else column.to_numpy(zero_copy_only=False))
    flat = value.reshape(len(value), -1)
    part = rng.choice(("entry", "record", "column", "all"))
    where = {
        "entry": np.s_[rng.randrange(flat.shape[0]), rng.randrange(flat.shape[1])],
        "record": np.s_[rng.randrange(flat.shape[0])],
        "column": np.s_[:, rng.randrange(flat.shape[1])],
        "all": np.s_[:],
    }[part]
    if value.dtype == bool:
        flat[where] = rng.random() < 0.5
        told = f"{part} set"
    elif value.dtype.kind == "i":
        flat[where] = (number := rng.choice(INTEGERS))
        told = f"{part} is {number}"
    elif rng.random() < 0.5:
        flat[where] = (figure := rng.choice(FIGURES))
        told = f"{part} is {figure}"
    else:
        factor = rng.choice((-1.0, 0.0, 0.5, 2.0, 1 + 1e-9, 10 ** rng.uniform(-14, 14)))
        flat[where] *= factor
        told = f"{part} times {factor:g}"
    array = pa.array(value.reshape(-1))
    if tensor:
        storage = pa.FixedSizeListArray.from_arrays(array, flat.shape[1])
        array = pa.ExtensionArray.from_storage(column.type, storage)
    return array, told
