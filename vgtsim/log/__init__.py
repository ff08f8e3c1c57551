"""The log of a run: its record, its chunks on disk, and long logs in stretches."""

from vgtsim.log.book import LogBook, LogWriter, open_log, save_log
from vgtsim.log.runlog import (
    ARRAYS,
    BESIDE,
    CHUNK,
    TYPES,
    Contact,
    Piece,
    Revision,
    RunLog,
    empty_records,
    join_pieces,
    pack_contacts,
)
from vgtsim.log.stretches import Hold, LogSource, LogStretch, Outline, cut, outline, thin, thinning

__all__ = [
    "ARRAYS",
    "BESIDE",
    "CHUNK",
    "TYPES",
    "Contact",
    "Hold",
    "LogBook",
    "LogSource",
    "LogStretch",
    "LogWriter",
    "Outline",
    "Piece",
    "Revision",
    "RunLog",
    "cut",
    "empty_records",
    "join_pieces",
    "open_log",
    "outline",
    "pack_contacts",
    "save_log",
    "thin",
    "thinning",
]
