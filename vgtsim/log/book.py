"""The log of a run on disk: one Parquet file a chunk, each of which appears whole or not at all. `docs/log.md` has the format."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vgtsim.arrays import Index
from vgtsim.description import Scene, digest_scene, dump_scene, parse_scene
from vgtsim.errors import DescriptionError
from vgtsim.log.chunks import (
    BEGIN,
    END,
    PERFORMANCE,
    TOUCHES,
    make_table,
    read_arrays,
    read_log_text,
    survey,
    to_arrays,
    write_table,
    write_text,
)
from vgtsim.log.runlog import ARRAYS, CHUNK, MAY_BE_EMPTY, Piece, Revision, RunLog, join_pieces, pack_contacts
from vgtsim.replacing import flush_to_disk

if TYPE_CHECKING:
    import pyarrow as pa


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
        flush_to_disk(self.folder.parent)
        begin = {"scene": json.loads(dump_scene(self.scene)), "versions": dict(self.versions)}
        begin["digests"] = dict(self.digests)
        for left in self.folder.glob(".*.partial.*"):  # of a killed run
            left.unlink()
        if not self.resume or not (self.folder / BEGIN).exists():
            write_text(self.folder / BEGIN, begin)
            return
        there = read_log_text(self.folder / BEGIN)
        for name in begin:
            if there[name] != begin[name]:
                found = f"another {name} than that of the run that was interrupted"
                raise DescriptionError(self.folder / BEGIN, name, found, "the same, or a run without --resume")

    @property
    def ended(self) -> bool:
        """Whether the folder holds the end of the log too."""
        return (self.folder / END).exists()

    def write(self, piece: Piece) -> None:
        """Add a chunk."""
        file = self.folder / f"{self._chunks:06d}.parquet"
        table = make_table(piece)
        if not (self.resume and file.exists() and self._holds(file, table)):
            write_table(table, file)
        self._chunks, self._records = self._chunks + 1, self._records + len(piece["time"])

    def end(self, rest: RunLog) -> None:
        """Add what is left, and how the run ended: the log is whole then."""
        self.write({name: getattr(rest, name) for name in _list_known(rest)})
        end = {"warnings": list(rest.warnings), "performance": rest.performance, "stopped": rest.stopped}
        if rest.revisions:
            end["revisions"] = [asdict(revision) for revision in rest.revisions]
        write_text(self.folder / END, {"records": self._records} | end)

    @staticmethod
    def _holds(file: Path, table: pa.Table) -> bool:
        """Whether a file holds the records of a table; a shorter one is of a run that was ended early."""
        theirs, ours = read_arrays(file), to_arrays(table)
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
    edges: Index = field(repr=False)  # first record of each file, and their count
    contacts: Piece = field(repr=False)
    revisions: tuple[Revision, ...] = ()

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
            arrays = read_arrays(file)  # of which a view would keep all records
            pieces.append({name: value[wanted].copy() for name, value in arrays.items()})
        return RunLog(
            **join_pieces(pieces),
            **self.contacts,
            warnings=self.warnings,
            performance=self.performance,
            versions=self.versions,
            digests=self.digests,
            stopped=self.stopped,
            revisions=self.revisions,
        )


def open_log(folder: str | Path) -> LogBook:
    """Open the log in a folder; no array is read yet, but the sizes that its files declare are.

    Raises:
        DescriptionError: The folder holds no log, or one that is damaged or of another program.
    """
    place = Path(folder)
    begin, end = read_log_text(place / BEGIN), read_log_text(place / END) if (place / END).exists() else None
    files = tuple(sorted(place.glob("[0-9]*.parquet")))
    counts, touches = [], []
    shapes: dict[str, tuple[int, ...]] = {}
    for file in files:
        count, found, touched = survey(file)
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
        raise DescriptionError(place / BEGIN, error.key, error.found, error.allowed) from None
    if made and made != digest_scene(text):
        found = "a copy of the scene that was changed after the run"
        raise DescriptionError(place / BEGIN, "scene", found, f"that of digest {made[:80]}")
    guess = {"simulated_s": records / scene.task.simulation.log_rate}  # all that is known of a run without an end
    return LogBook(
        folder=place,
        scene=scene,
        versions=begin["versions"],
        digests=begin["digests"],
        warnings=tuple(end["warnings"]) if end else (),
        performance=end["performance"] if end else dict.fromkeys(PERFORMANCE, float("nan")) | guess,
        stopped=_say_lacks(scene, records, end),
        revisions=end["revisions"] if end else (),
        files=files,
        edges=np.cumsum([0, *counts]),
        contacts=pack_contacts(touches),
    )


def save_log(folder: Path, scene: Scene, log: RunLog) -> None:
    """Write a whole log into a folder without one."""
    writer = LogWriter(folder=folder, scene=scene, versions=log.versions, digests=log.digests)
    nothing = {name: getattr(log, name)[:0] for name in TOUCHES}
    last = max(log.count - 1, 0) // CHUNK * CHUNK
    for first in range(0, last, CHUNK):
        piece = log.read(first, first + CHUNK)
        writer.write({name: getattr(piece, name) for name in _list_known(log)} | nothing)
    writer.end(log.read(last, log.count))


def _list_known(log: RunLog) -> list[str]:
    """Names of the arrays that a log has."""
    return [name for name in ARRAYS if getattr(log, name).size or name not in MAY_BE_EMPTY]


def _say_lacks(scene: Scene, records: int, end: Mapping[str, Any] | None) -> str:
    until = f"{records} records, to {(records - 1) / scene.task.simulation.log_rate:.6g} s"
    if end is None:
        return f"the run never ended: the log holds {until}"
    if end["records"] != records:
        return f"the log holds {until}; the run made {end['records']}"
    return end["stopped"]
