"""The worst of an array over time, with where and when."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.ties import first_greatest


@dataclass(frozen=True)
class Finding:
    """One measured figure.

    Attributes:
        value: The worst; NaN when it could not be measured.
        where: Member or place.
        when: Time, s.
        detail: Why it could not be measured, or more figures.
    """

    value: float
    where: str
    when: float
    detail: str = ""


def worst_of(values: NDArray[np.float64], time: NDArray[np.float64], names: Sequence[str]) -> Finding:
    """Find the greatest value over records and members.

    Args:
        values: Shape (T, M).
        time: Shape (T,), s.
        names: Of the columns.

    Returns:
        The finding; NaN when anything was not measured, which is then named.
    """
    if values.size == 0:
        return Finding(float("nan"), "none", float("nan"), "nothing was measured")
    missing = np.isnan(values)
    record, column = np.unravel_index(first_greatest(missing if missing.any() else values), values.shape)
    if missing.any():
        detail = f"{missing.any(axis=1).sum()} of {len(values)} records were not measured"
        return Finding(float("nan"), names[int(column)], float(time[record]), detail)
    return Finding(float(values[record, column]), names[int(column)], float(time[record]))
