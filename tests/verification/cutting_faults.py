"""Faults of a run whose tool cuts waste, and of its log. See `faults.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
from faults import MOVING, Fault, field, late, one
from numpy.typing import NDArray

from vgtsim.log.runlog import CUTTING
from vgtsim.plant import Plant


def weaken(rate: float = 1.0, push: float = 1.0) -> Callable[[Plant], None]:
    """A tool that removes less or presses less than the log of it says."""

    def spoil(plant: Plant) -> None:
        digger = plant._digger
        assert digger is not None
        if not hasattr(digger, "spoilt"):
            digger.spoilt = True
            digger._diggings = replace(digger._diggings, rate=rate * digger._diggings.rate)
            press = digger.press

            def press_less(data: mujoco.MjData, wrenches: NDArray[np.float64]) -> None:
                mine = np.zeros_like(wrenches)
                press(data, mine)
                wrenches += push * mine

            digger.press = press_less

    return spoil


RATE, BALANCE = "waste removed a second over the tool's rate", "removed waste against the bed"
WAY, REACH = "removed waste against path and rate of the tool", "waste removed beyond the tool's reach"
WORKING = 60  # a record while the tool works

CUT_RUN_FAULTS = (
    Fault("a tool that removes a tenth less", weaken(rate=0.9), WAY),
    Fault("a tool that presses a hundredth less", weaken(push=0.99), MOVING),
    Fault("a tool that does not press", weaken(push=0.0), MOVING),
)
CUT_LOG_FAULTS = (
    Fault(
        "a hundredth more waste gone than the tool removes",
        lambda log: replace(log, bed=log.bed[0] + 1.01 * (log.bed - log.bed[0]), removed=1.01 * log.removed),
        RATE,
    ),
    Fault(
        "a hundredth less waste gone than the tool removes",
        lambda log: replace(log, bed=log.bed[0] + 0.99 * (log.bed - log.bed[0]), removed=0.99 * log.removed),
        WAY,
    ),
    Fault("removed volume wrong by 1 %", field("removed", lambda v, _: 1.01 * v), BALANCE),
    Fault("removed volume a record late", field("removed", lambda v, _: late(v)), BALANCE),
    Fault("waste gone 0.1 m beside the tool", field("bed", lambda b, _: np.roll(b, 1, axis=1)), REACH),
    Fault(
        "a height 1 mm below the tool's reach",
        field("bed", one((slice(WORKING, None), 0), lambda h: h - 1e-3)),
        REACH,
    ),
    Fault(
        "waste that comes back",
        field("bed", lambda b, _: np.where(np.arange(len(b))[:, None] < WORKING, b, b[0])),
        BALANCE,
    ),
    Fault("no push of the tool in the log", field("tool_force", lambda f, _: 0 * f), MOVING),
    Fault(
        "push of the tool wrong by 1e-5",
        field("tool_force", lambda f, _: (1 + 1e-5) * f),
        "tool force error over its rating",
    ),
    Fault("accelerations ten times too high", field("acceleration", lambda a, _: 10 * a), MOVING),
    Fault("power of the tool a record late", field("tool_share", lambda s, _: late(s)), "commanded tool to the plan"),
    Fault(
        "no waste in the log",
        lambda log: replace(log, **{name: np.zeros((0,) * getattr(log, name).ndim) for name in CUTTING}),
        RATE,
    ),
)
