"""The parts of a leg put one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vgtsim.arrays import Array


class ProgrammeRows(NamedTuple):
    """Actuator lengths, shape (T, J), m, and what else changes, shape (T,): feed, m, turn, rad, share of the tool's power."""

    lengths: Array
    feed: Array | None = None
    turn: Array | None = None
    share: Array | None = None


def join_rows(parts: Sequence[tuple[ProgrammeRows, float]]) -> ProgrammeRows:
    """Rows of the parts of a leg one after the other, each with the turn of the mast, rad, where it does not change.

    In a part without a feed the mast stands at its working depth, and in one without a share the tool rests.
    """

    def join(name: str, still: Sequence[float]) -> Array | None:
        found = [getattr(rows, name) for rows, _ in parts]
        if all(item is None for item in found):
            return None
        each = zip(found, still, parts, strict=True)
        return _chain([np.full(len(rows.lengths), rest) if item is None else item for item, rest, (rows, _) in each])

    rest = [0.0] * len(parts)
    return ProgrammeRows(
        lengths=_chain([rows.lengths for rows, _ in parts]),
        feed=join("feed", rest),
        turn=join("turn", [turn for _, turn in parts]),
        share=join("share", rest),
    )


def _chain(parts: Sequence[Array]) -> Array:
    """Parts one after the other, each of which begins where the one before ends."""
    return np.concatenate([parts[0], *(part[1:] for part in parts[1:])])
