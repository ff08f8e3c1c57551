"""What the cylinders' drives were asked for: force, speed, stroke, and the pressures in their chambers."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Chain
from vgtsim.runlog import RunLog
from vgtsim.verification.findings import Finding, worst_of
from vgtsim.verification.loads import LEAST_FORCE

Array = NDArray[np.float64]

SATURATIONS = {
    "rigid": {},
    "servo": {1: "above its rated speed", 2: "at its force limit", 4: "beyond its stroke"},
    "hydraulic": {
        1: "at its flow limit",
        2: "at its relief pressure",
        4: "at an end of its stroke",
        8: "with a cavity in its oil",
    },
}
_STOPPED = 4  # bit of a piston at an end, where the barrel carries what the oil does not


def check_saturation(log: RunLog, chain: Chain, bit: int) -> Finding:
    """Part of the records since each of which some cylinder had reached one of its limits.

    Args:
        log: The run.
        chain: The arm.
        bit: Which limit, a key of `SATURATIONS`.

    Returns:
        The share, at the cylinder that was there most often.
    """
    if not log.saturation.size:
        return Finding(float("nan"), "none", float("nan"), "the log does not say what saturated")
    hit = (log.saturation & bit) != 0
    share = float(hit.any(axis=1).mean())
    if share == 0:
        return Finding(0.0, "none", float("nan"))
    worst = int(np.argmax(hit.sum(axis=0)))
    first = float(log.time[np.argmax(hit[:, worst])])
    return Finding(share, _names(chain)[worst], first, f"{hit.any(axis=0).sum()} cylinders, {share:.1%} of the records")


def check_actuators(log: RunLog, chain: Chain) -> Finding:
    """Greatest drive force over what the supply pressure holds."""
    pull, push = _collect(chain, "pull"), _collect(chain, "push")
    used = np.where(log.actuator_force > 0, log.actuator_force / pull, -log.actuator_force / push)
    return worst_of(used, log.time, _names(chain))


def check_highest_pressure(log: RunLog, chain: Chain) -> Finding:
    """Greatest pressure in a chamber over the supply's."""
    used = log.pressure.max(axis=2) / _collect(chain, "pressure")
    return worst_of(used, log.time, _names(chain))


def check_lowest_pressure(log: RunLog, chain: Chain) -> Finding:
    """Least pressure in a chamber, above the tank's, Pa."""
    worst = worst_of(-log.pressure.min(axis=2), log.time, _names(chain))
    return Finding(-worst.value, worst.where, worst.when, worst.detail)


def check_pressure_force(log: RunLog, chain: Chain) -> Finding:
    """Greatest difference of pressures times areas from a drive's force, over the largest force of the instant.

    A piston at an end of its stroke is left out: its barrel carries what the oil does not.
    """
    bore, rod = _collect(chain, "bore"), _collect(chain, "rod")
    area = np.pi / 4 * np.stack([-(bore**2), bore**2 - rod**2], axis=-1)
    force = np.sum(log.pressure * area, axis=-1)
    most = np.maximum(np.abs(log.actuator_force).max(axis=1, keepdims=True), LEAST_FORCE)
    free = (log.saturation & _STOPPED) == 0
    return worst_of(np.where(free, np.abs(force - log.actuator_force) / most, 0.0), log.time, _names(chain))


def _names(chain: Chain) -> list[str]:
    return [chain.truss.members[i].name for i in chain.truss.actuated]


def _collect(chain: Chain, field: str) -> Array:
    """One figure of every cylinder, shape (J,)."""
    parts = (chain.manipulator.cylinders[chain.truss.members[i].section] for i in chain.truss.actuated)
    return np.array([getattr(part, field) for part in parts])
