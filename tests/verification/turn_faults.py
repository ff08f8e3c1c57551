"""Faults of a mast that turns, and of the log of its turn. See `faults.py`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from faults import NODES, Fault, body, field, joint, late, soften

from vgtsim.log.runlog import TURN as TURN_ARRAYS
from vgtsim.mjcf import names

TURN, TURN_PLAN = "turn to its command", "commanded turn to the plan"
TORQUE, TORQUE_AT_REST = (
    "turning drive's torque error over the mast's moment",
    "turning drive's torque error at rest over the mast's moment",
)

TURN_MODEL_FAULTS = (
    Fault("friction of 100 N m on the turn", joint(names.TURN, "dof_frictionloss", 100.0), TORQUE),
    Fault("a spring of 100 N m/rad on the turn", joint(names.TURN, "jnt_stiffness", 100.0), TORQUE_AT_REST),
    Fault("the mast with ten times its inertia", body(names.MAST, "inertia", 10.0), TORQUE),
    Fault("the turn's drive loose", soften(names.drive(names.TURN)), reason="as with the drive of a cylinder"),
)
TURN_LOG_FAULTS = (
    Fault("turn sensor scaled by 1.0001", field("turn", lambda a, _: 1.0001 * a), NODES),
    Fault("the turn 40 ms late", field("turn", lambda a, _: late(a)), NODES),
    Fault("commands of the turn 40 ms early", field("turn_commanded", lambda a, _: np.roll(a, -1)), TURN),
    Fault("commands of the turn off by 2 µrad", field("turn_commanded", lambda a, _: a + 2e-6), TURN_PLAN),
    Fault("the turn's torque wrong by 10 %", field("turn_torque", lambda m, _: 1.1 * m), TORQUE),
    Fault(
        "the turn's torque at rest wrong by 1 N m",
        field("turn_torque", lambda m, log: m + log.settled),
        TORQUE_AT_REST,
    ),
    Fault("no turn in the log", lambda log: replace(log, **{name: np.zeros(0) for name in TURN_ARRAYS}), TURN),
)
