"""The rows of a study on disk: Parquet parts as they come, and the table at the end."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from vgtsim.replacing import lock_folder, replacing
from vgtsim.study.cases import Case, Order
from vgtsim.study.dispatch import Row

if TYPE_CHECKING:
    import pyarrow as pa

_EVERY_S = 1.0  # between parts: what a killed study does again at most
_MOST_PARTS = 200  # small ones, which are then packed in one: a folder of a million files serves nobody


class Records:
    """Rows in the folder `parts`, one file for those of a second, by the digest of their case; one study at a time.

    A row is finished once it is in a part. Figures of other cases may stand there too: those of the study before it was changed.
    """

    def __init__(self, folder: Path) -> None:
        from pyarrow import parquet  # a tenth of a second, which help does without

        self._parquet = parquet
        self._folder = folder / "parts"
        self._folder.mkdir(exist_ok=True)
        self._lock = ExitStack()
        self._lock.enter_context(lock_folder(folder, "study"))
        self._rows: list[Row] = []
        self._written = time.monotonic()
        for left in self._folder.glob(".*.partial.parquet"):  # of a killed study
            left.unlink()
        self.done: set[str] = set(self._read(["digest"])["digest"].to_pylist()) if self._files() else set()

    def add(self, rows: Sequence[Row]) -> None:
        """Take finished rows and, once a second, write them."""
        self._rows.extend(rows)
        if time.monotonic() - self._written >= _EVERY_S:
            self.flush()

    def flush(self) -> None:
        """Write the rows that wait, and pack parts when they are many."""
        import pyarrow as pa

        if self._rows:
            columns = {name: [row[name] for row in self._rows] for name in self._rows[0]}
            texts = {name: pa.array(columns[name], pa.string()) for name in ("digest", "error")}
            self._write(pa.table({**columns, **texts}), "part")
            self.done |= {row["digest"] for row in self._rows}
            self._rows.clear()
            small = sorted(self._folder.glob("part-*.parquet"))
            if len(small) >= _MOST_PARTS:
                self._write(self._read(None, small), "pack")
                for file in small:
                    file.unlink()
        self._written = time.monotonic()

    def close(self) -> None:
        """Write the rows that wait and let another study in."""
        self.flush()
        self._lock.close()

    def tabulate(self, order: Order, cases: Sequence[Case]) -> tuple[pa.Table, float]:
        """The table of finished cases, in the order of the study, and seconds of processor time that they took.

        Columns are the number of the case, its keys, what is kept, and the error.
        """
        import pyarrow as pa
        import pyarrow.compute

        pc: Any = pyarrow.compute  # makes its functions on import
        rows = self._read(None)
        at = pc.index_in(pa.array([case.digest for case in cases]), value_set=rows["digest"].combine_chunks())
        table = rows.take(at.drop_null())
        numbers = pc.indices_nonzero(at.is_valid())
        spent = pc.sum(table["processor_s"]).as_py() or 0.0
        chosen = table.select([*order.keys, *order.columns, "error"])
        return chosen.add_column(0, "case", numbers).combine_chunks(), spent

    def _files(self) -> list[Path]:
        return sorted(self._folder.glob("pa*-*.parquet"))

    def _read(self, columns: list[str] | None, files: Sequence[Path] = ()) -> pa.Table:
        import pyarrow as pa

        tables = [self._parquet.read_table(file, columns=columns) for file in files or self._files()]
        return pa.concat_tables(tables, promote_options="permissive")

    def _write(self, table: pa.Table, kind: str) -> None:
        with replacing(self._folder / f"{kind}-{uuid4().hex}.parquet") as partial:
            self._parquet.write_table(table, partial)
