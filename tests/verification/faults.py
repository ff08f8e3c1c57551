"""Faults that are put into a model, a run or a log, one a line, each with the row of the report that must catch it.

A fault that no row catches has the reason in its place: it must leave a report that passes. `docs/faults.md` is made of
this list and of those in `other_faults.py`, `turn_faults.py` and `cutting_faults.py`:
`python tests/verification/fault_page.py` writes it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from vgtsim.log import RunLog
from vgtsim.log.runlog import FEED as FEED_ARRAYS
from vgtsim.mjcf import names
from vgtsim.plant import Plant
from vgtsim.plant.loads import Hose

MEMBER, CYLINDER = "m1/longeron/1", "m1/actuator/1"
HOSE_PART = 0.1  # kg, a fiftieth of what a hub carries of the hose
RECORD = 25  # one in motion


@dataclass(frozen=True)
class Fault:
    """What is spoilt, by `spoil`; `caught` is the row's quantity, or `reason` says why the fault is below the limits."""

    what: str
    spoil: Callable[..., object]
    caught: str = ""
    reason: str = ""


# into the compiled model


def gravity(factor: float = 1.0, tilt: float = 0.0) -> Callable[[mujoco.MjModel], None]:
    def spoil(model: mujoco.MjModel) -> None:
        model.opt.gravity[:] = factor * model.opt.gravity[2] * np.array([np.sin(tilt), 0.0, np.cos(tilt)])

    return spoil


def body(name: str, field: str, factor: float = 1.0, more: object = 0.0) -> Callable[[mujoco.MjModel], None]:
    def spoil(model: mujoco.MjModel) -> None:
        values = getattr(model, f"body_{field}")
        values[model.body(name).id] = factor * values[model.body(name).id] + np.asarray(more)

    return spoil


def shorten(name: str, by: float) -> Callable[[mujoco.MjModel], None]:
    """Draw the far end of a member, which the hub is tied to, towards the near end."""

    def spoil(model: mujoco.MjModel) -> None:
        model.site_pos[model.site(names.far(name)).id, 2] -= by

    return spoil


def cut(row: str) -> Callable[[mujoco.MjModel], None]:
    def spoil(model: mujoco.MjModel) -> None:
        model.eq_active0[model.equality(row).id] = False

    return spoil


def soften(row: str) -> Callable[[mujoco.MjModel], None]:
    """Give a row a spring of a second's period in place of one as short as a step."""

    def spoil(model: mujoco.MjModel) -> None:
        model.eq_solref[model.equality(row).id] = [1.0, 1.0]

    return spoil


def joint(name: str, field: str, value: float) -> Callable[[mujoco.MjModel], None]:
    """Spoil the joint of that name, or all its degrees of freedom."""

    def spoil(model: mujoco.MjModel) -> None:
        if field.startswith("jnt_"):
            getattr(model, field)[model.joint(name).id] = value
        else:
            first = model.joint(name).dofadr[0]
            getattr(model, field)[first : first + len(model.joint(name).damping)] = value

    return spoil


def option(**values: object) -> Callable[[mujoco.MjModel], None]:
    def spoil(model: mujoco.MjModel) -> None:
        for name, value in values.items():
            setattr(model.opt, name, value)

    return spoil


def move_site(name: str, by: float) -> Callable[[mujoco.MjModel], None]:
    def spoil(model: mujoco.MjModel) -> None:
        model.site_pos[model.site(name).id, 0] += by

    return spoil


def move_zero(name: str, by: float) -> Callable[[mujoco.MjModel], None]:
    def spoil(model: mujoco.MjModel) -> None:
        model.qpos0[model.joint(names.slide(name)).qposadr[0]] += by

    return spoil


def switch_contacts_off(model: mujoco.MjModel) -> None:
    model.geom_contype[:] = model.geom_conaffinity[:] = 0


# into the run


def lose_hose(plant: Plant) -> None:
    plant._correction._loads = [load for load in plant._correction._loads if not isinstance(load, Hose)]


def push(name: str, *force: float) -> Callable[[Plant], None]:
    """Force at the middle of a body, N, all the time."""

    def spoil(plant: Plant) -> None:
        plant.data.xfrc_applied[plant.model.body(name).id, :3] = force

    return spoil


# into the log


def records(order: Callable[[RunLog], np.ndarray], *, close: bool = False) -> Callable[[RunLog], RunLog]:
    """Other records, or in another order; times stay with their records, or are closed up as if nothing was missing."""

    def spoil(log: RunLog) -> RunLog:
        index, count = order(log), len(log.time)
        whole = {name: value for name, value in vars(log).items() if isinstance(value, np.ndarray)}
        taken = {
            name: value[index]
            for name, value in whole.items()
            if not name.startswith("contact") and len(value) == count
        }
        if not close:
            return replace(log, **taken)
        step = log.time[1] - log.time[0]
        simulated = log.performance["simulated_s"] + step * (len(index) - count)
        taken["time"] = step * np.arange(len(index))
        return replace(log, **taken, performance=log.performance | {"simulated_s": simulated})

    return spoil


def field(name: str, change: Callable[[np.ndarray, RunLog], object]) -> Callable[[RunLog], RunLog]:
    return lambda log: replace(log, **{name: change(np.array(getattr(log, name)), log)})


def one(index: tuple[int, ...], change: Callable[[np.ndarray], object]) -> Callable[[np.ndarray, RunLog], np.ndarray]:
    """Change some entries."""

    def spoil(values: np.ndarray, _: RunLog) -> np.ndarray:
        values[index] = change(values[index])
        return values

    return spoil


def turn_around(count: int, first: int, second: int) -> np.ndarray:
    order = np.arange(count)
    order[[first, second]] = order[[second, first]]
    return order


def late(values: np.ndarray) -> np.ndarray:
    """What stood a record earlier."""
    return np.concatenate([values[:1], values[:-1]])


def be_late(log: RunLog) -> RunLog:
    """The whole arm a record late, and commands that are overwritten by what it did."""
    moved = {name: late(getattr(log, name)) for name in ("nodes", "ends", "actual", "rates", "tool_position")}
    return replace(log, **moved, tool_direction=late(log.tool_direction), commanded=moved["actual"])


AT_REST = "error at rest over largest force"
MOVING = "error in motion over largest force"
DRIVE, DRIVE_AT_REST = "drive force error over largest force", "drive force error at rest over largest force"
MAST_AT_REST = "mast reaction error at rest over the reaction"
SHEAR, MOMENT = "shear beyond own weight and inertia", "moment at a member's end"
NODES, GAP = "node to forward kinematics", "gap between member end and hub"
PLAN, COMMAND = "commanded length to the plan", "cylinder length to its command"
INSTANT, COUNT, STAGES = (
    "record from its instant",
    "records missing or too many",
    "stages of the tour missing or out of place",
)
FEED, FEED_PLAN = "feed to its command", "commanded feed to the plan"
HOIST, HOIST_AT_REST = "hoist force error over the force", "hoist force error at rest over the force"
SPEED, LOGGED = "speed over rated speed", "logged speed to differenced lengths"

MODEL_FAULTS = (
    Fault("gravity stronger by 0.1 %", gravity(1.001), AT_REST),
    Fault("gravity tilted by 0.1 degree", gravity(tilt=np.deg2rad(0.1)), AT_REST),
    Fault("payload and plate heavier by 0.1 %", body(names.TIP, "mass", 1.001), AT_REST),
    Fault("payload and plate with ten times their inertia", body(names.TIP, "inertia", 10.0), MOVING),
    Fault(
        "payload and plate with twice their inertia",
        body(names.TIP, "inertia", 2.0),
        reason="a seventh of the limit in motion: the tool hardly turns",
    ),
    Fault("payload 1 mm beside the tool's axis", body(names.TIP, "ipos", more=[1e-3, 0, 0]), AT_REST),
    Fault("a member heavier by 1 %", body(MEMBER, "mass", 1.01), AT_REST),
    Fault("a member with five times its inertia", body(MEMBER, "inertia", 5.0), SHEAR),
    Fault("a hub 10 g heavier", body("m1/mid/1", "mass", more=0.01), AT_REST),
    Fault("the hose lighter by 0.1 kg at a hub", body("m1/top/1", "mass", more=-HOSE_PART), AT_REST),
    Fault("the mast 0.1 mm aside", body(names.MAST, "pos", more=[1e-4, 0, 0]), NODES),
    Fault("a member short by 10 µm", shorten(MEMBER, 1e-5), NODES),
    Fault("a ball 10 µm off its hub", body(MEMBER, "pos", more=[1e-5, 0, 0]), GAP),
    Fault("a closure missing", cut(names.closure(MEMBER)), GAP),
    Fault(
        "a closure loose",
        soften(names.closure(MEMBER)),
        NODES,
    ),
    Fault(
        "a drive loose", soften(names.drive(CYLINDER)), reason="the closure correction takes up what a soft row lets go"
    ),
    Fault("spring of 0.1 N m/rad at a ball", joint(MEMBER, "jnt_stiffness", 0.1), MOMENT),
    Fault("friction of 0.01 N m at a ball", joint(MEMBER, "dof_frictionloss", 0.01), MOMENT),
    Fault("a ball all but welded", joint(MEMBER, "dof_damping", 1e6), MOMENT),
    Fault(
        "friction of 100 N in a cylinder",
        joint(names.slide(CYLINDER), "dof_frictionloss", 100.0),
        reason="oil and friction act between the same two parts, and their sum is what is measured",
    ),
    Fault("wind of 10 m/s", option(density=1.2, viscosity=1.8e-5, wind=np.array([10.0, 0, 0])), MOVING),
    Fault("still air", option(density=1.2, viscosity=1.8e-5), MOMENT),
    Fault("the tool's point 20 µm aside", move_site(names.TOOL, 2e-5), "logged tool to its nodes"),
    Fault("zero of a cylinder's length sensor off by 20 µm", move_zero(CYLINDER, 2e-5), NODES),
    Fault("the mast heavier by 1 %", body(names.MAST, "mass", 1.01), HOIST_AT_REST),
    Fault("friction of 100 N on the feed", joint(names.FEED, "dof_frictionloss", 100.0), HOIST),
    Fault(
        "friction of 1 N on the feed",
        joint(names.FEED, "dof_frictionloss", 1.0),
        reason="a tenth of the limit in motion",
    ),
    Fault("the feed's drive loose", soften(names.drive(names.FEED)), reason="as with the drive of a cylinder"),
    Fault("contacts off", switch_contacts_off, reason="nothing touches; `clearance` finds what would, from the nodes"),
)
RUN_FAULTS = (
    Fault("40 N sideways on the tool", push(names.TIP, 40.0, 0, 0), AT_REST),
    Fault("0.1 N sideways on the middle of a member", push(MEMBER, 0.1, 0, 0), SHEAR),
    Fault("1 mN sideways on the middle of a member", push(MEMBER, 1e-3, 0, 0), reason="a tenth of the limit of shear"),
    Fault("1 N up on a hub", push("m1/mid/1", 0, 0, 1.0), AT_REST),
    Fault("a hose without stiffness in bending", lose_hose, AT_REST),
)
LOG_FAULTS = (
    Fault("time shifted by 1 s", field("time", lambda t, _: t + 1.0), INSTANT),
    Fault("time longer by 1 %", field("time", lambda t, _: 1.01 * t), INSTANT),
    Fault("records in reverse order", records(lambda log: np.arange(len(log.time))[::-1], close=True), STAGES),
    Fault("first half alone", records(lambda log: np.arange(len(log.time) // 2)), COUNT),
    Fault(
        "first half alone, its duration made to fit",
        records(lambda log: np.arange(len(log.time) // 2), close=True),
        STAGES,
    ),
    Fault("second half alone", records(lambda log: np.arange(len(log.time) // 2, len(log.time)), close=True), STAGES),
    Fault("all motion cut out", records(lambda log: np.flatnonzero(log.settled | (log.goal < 0)), close=True), SPEED),
    Fault("a record left out", records(lambda log: np.delete(np.arange(len(log.time)), RECORD), close=True), PLAN),
    Fault(
        "a record doubled", records(lambda log: np.sort(np.append(np.arange(len(log.time)), RECORD)), close=True), PLAN
    ),
    Fault(
        "two neighbours swapped", records(lambda log: turn_around(len(log.time), RECORD, RECORD + 1), close=True), PLAN
    ),
    Fault(
        "records shuffled", records(lambda log: np.random.default_rng(1).permutation(len(log.time)), close=True), STAGES
    ),
    Fault("cylinders 40 ms late", field("commanded", lambda x, _: np.roll(x, -1, axis=0)), COMMAND),
    Fault("the arm 40 ms late, commands overwritten by its lengths", be_late, PLAN),
    Fault(
        "commands overwritten by lengths",
        field("commanded", lambda _, log: log.actual),
        reason="they differ by less than `command`; a late arm is seen by the plan",
    ),
    Fault("commands off by 20 µm", field("commanded", lambda x, _: x + 2e-5), PLAN),
    Fault("logged speeds ten times too high", field("rates", lambda x, _: 10 * x), LOGGED),
    Fault("logged speeds zero", field("rates", lambda x, _: 0 * x), LOGGED),
    Fault("length sensor scaled by 1.0001", field("actual", lambda x, _: 1.0001 * x), NODES),
    Fault("feed sensor scaled by 1.0001", field("feed", lambda h, _: 1.0001 * h), NODES),
    Fault("the feed 40 ms late", field("feed", lambda h, _: late(h)), NODES),
    Fault("commands of the feed 40 ms early", field("feed_commanded", lambda h, _: np.roll(h, -1)), FEED),
    Fault("commands of the feed off by 20 µm", field("feed_commanded", lambda h, _: h + 2e-5), FEED_PLAN),
    Fault("hoist force wrong by 0.9 %", field("feed_force", lambda f, _: 1.009 * f), HOIST),
    Fault(
        "hoist force at rest wrong by 1e-5",
        field("feed_force", lambda f, log: np.where(log.settled, 1 + 1e-5, 1) * f),
        HOIST_AT_REST,
    ),
    Fault("no feed in the log", lambda log: replace(log, **{name: np.zeros(0) for name in FEED_ARRAYS}), FEED),
    Fault("drive forces wrong by 0.9 %", field("actuator_force", lambda x, _: 1.009 * x), DRIVE),
    Fault(
        "drive forces at rest wrong by 1e-5",
        field("actuator_force", lambda x, log: np.where(log.settled[:, None], 1 + 1e-5, 1) * x),
        DRIVE_AT_REST,
    ),
    Fault(
        "mast reaction wrong by 0.9 %",
        field("mast_reaction", lambda x, _: 1.009 * x),
        "mast reaction error over the reaction",
    ),
    Fault(
        "mast reaction at rest wrong by 1e-5",
        field("mast_reaction", lambda x, log: np.where(log.settled[:, None], 1 + 1e-5, 1) * x),
        MAST_AT_REST,
    ),
    Fault(
        "a member wrong by 0.9 % of the largest force, in motion",
        field(
            "member_force",
            lambda x, log: (
                x
                + 0.009 * np.abs(x[RECORD]).max() * (np.arange(x.shape[1]) == 0)[:, None] * ~log.settled[:, None, None]
            ),
        ),
        MOVING,
    ),
    Fault(
        "forces of two members swapped",
        field("member_force", lambda x, _: x[:, turn_around(x.shape[1], 0, 1)]),
        AT_REST,
    ),
    Fault("member forces with the wrong sign", field("member_force", lambda x, _: -x), AT_REST),
    Fault(
        "moment of 10 µN m at a ball in one record",
        field("member_moment", one((RECORD, 0, 0), lambda m: m + 1e-5)),
        MOMENT,
    ),
    Fault("an end 10 µm off in one record", field("ends", one((RECORD, 0, 0, 0), lambda x: x + 1e-5)), GAP),
    Fault("a node 0.1 mm off in one record", field("nodes", one((RECORD, 5, 0), lambda x: x + 1e-4)), NODES),
    Fault(
        "lengths and places scaled by 1.0001",
        lambda log: replace(log, **{name: 1.0001 * getattr(log, name) for name in ("nodes", "ends")}),
        NODES,
    ),
    Fault("every record called settled", field("settled", lambda x, _: np.ones_like(x)), STAGES),
    Fault("goals swapped", field("goal", lambda x, _: np.where(x < 0, x, 1 - x)), STAGES),
    Fault(
        "an early end hidden", lambda log: records(lambda log: np.arange(len(log.time) - 5), close=True)(log), STAGES
    ),
    Fault("an early end", field("stopped", lambda *_: "stopped by hand"), "warnings and early ends"),
    Fault("a warning of MuJoCo", field("warnings", lambda *_: ("BADQACC: 1",)), "warnings and early ends"),
    Fault("a figure that is not a number", field("nodes", one((RECORD, 0, 0), lambda _: np.nan)), GAP),
    Fault(
        "single precision of the forces",
        field("member_force", lambda x, _: x.astype(np.float32).astype(float)),
        reason="6e-8 of a force is below the limit at rest",
    ),
)
