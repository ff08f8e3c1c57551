"""All rows of the report in its order: check by check as their files bring them, and within a check as they stand there."""

from __future__ import annotations

from vgtsim.verification import clamp, cutting, drives, hoist, members, record, shape, space, strength, tracking
from vgtsim.verification.measures import measures_in

_FILES = (record, shape, tracking, members, drives, strength, space, hoist, clamp, cutting)
_EACH = [measure for file in _FILES for measure in measures_in(file)]
CHECK_NAMES = tuple(dict.fromkeys(measure.check for measure in _EACH))
MEASURES = tuple(sorted(_EACH, key=lambda measure: CHECK_NAMES.index(measure.check)))  # rows of one name together
