"""All rows of the report in its order: file by file, and within a file as they stand there."""

from __future__ import annotations

from vgtsim.verification import drives, members, record, shape, space, strength, tracking
from vgtsim.verification.measures import measures_in

_FILES = (record, shape, tracking, members, drives, strength, space)
MEASURES = tuple(measure for file in _FILES for measure in measures_in(file))
CHECK_NAMES = tuple(dict.fromkeys(measure.check for measure in MEASURES))
