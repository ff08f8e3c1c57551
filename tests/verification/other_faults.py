"""Faults of runs of other kinds: rigid sections, elastic members, an operator, a tool on uneven waste. See `faults.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from faults import AT_REST, MOVING, NODES, PLAN, Fault, body, field, gravity, one, option

from vgtsim.log import RunLog
from vgtsim.mjcf import names
from vgtsim.site import Site

AIM, AIM_WAY = "tool position to the operator's target", "tool direction to the operator's target"
OPERATED = "stages of the operation missing or out of place"
STIFF = "settled node to stiffness solution"
TOUCHED, PRESSED = "logged contacts", "allowed contact force over its limit"

SECTION_FAULTS = (
    Fault("gravity stronger by 0.1 %", gravity(1.001), AT_REST),
    Fault("payload heavier by 0.1 %", body(names.TIP, "mass", 1.001), AT_REST),
    Fault("a hub 10 g heavier", body("m1/mid/1", "mass", more=0.01), AT_REST),
    Fault("the mast 0.1 mm aside", body(names.MAST, "pos", more=[1e-4, 0, 0]), NODES),
    Fault("wind of 10 m/s", option(density=1.2, viscosity=1.8e-5, wind=np.array([10.0, 0, 0])), MOVING),
)

# into the description that the plant is made of; the report is that of the description without the fault


def soften(kind: str, figure: str) -> Callable[[Site], Site]:
    """One per cent less of a figure of all materials or cylinders."""

    def spoil(site: Site) -> Site:
        parts = {
            name: part.model_copy(update={figure: 0.99 * getattr(part, figure)})
            for name, part in getattr(site.arm, kind).items()
        }
        return Site(replace(site.scene, manipulator=site.arm.model_copy(update={kind: parts})))

    return spoil


def damp(site: Site) -> Site:
    simulation = site.task.simulation
    simulation = simulation.model_copy(update={"damping_ratio": 2 * simulation.damping_ratio})
    return Site(replace(site.scene, task=site.task.model_copy(update={"simulation": simulation})))


ELASTIC_FAULTS = (
    Fault("steel 1 % softer", soften("materials", "youngs_modulus"), STIFF),
    Fault("oil 1 % softer", soften("cylinders", "bulk_modulus"), STIFF),
    Fault(
        "twice the damping",
        damp,
        reason="a damper acts along its member as the spring does; `tests/plant/test_elastic.py` holds how swings decay",
    ),
)

# into the controller, of which the plant makes the run; the report is that of the scene without the fault


def operator(**factors: float) -> Callable[[Site], Site]:
    def spoil(site: Site) -> Site:
        old = site.task.operator
        assert old is not None  # the site is of a run of an operator
        new = old.model_copy(update={name: factor * getattr(old, name) for name, factor in factors.items()})
        task = site.task.model_copy(update={"operator": new})
        return Site(replace(site.scene, task=task))

    return spoil


def commands(change: Callable[[tuple], tuple]) -> Callable[[Site], Site]:
    return lambda site: Site(replace(site.scene, commands=change(site.scene.commands)))


def delay(by: float) -> Callable[[tuple], tuple]:
    return lambda given: (given[0].model_copy(update={"time": given[0].time + by}), *given[1:])


CONTROLLER_FAULTS = (
    Fault("the filter of the controller 1 % slower", operator(filter=1.01), PLAN),
    Fault("the acceleration of the controller 1 % less", operator(acceleration=0.99), PLAN),
    Fault("a command one step late", commands(delay(0.02)), PLAN),
    Fault("a command left out", commands(lambda given: (given[0], given[2])), PLAN),
    Fault(
        "the greatest speed of the controller 1 % less",
        operator(speed=0.99),
        reason="no command asks for as much, so it is the same programme",
    ),
)

OPERATION_FAULTS = (
    Fault("a command off by 10 µm in one record", field("commanded", one((20,), lambda x: x + 1e-5)), PLAN),
    Fault("the operator's target 10 mm aside", field("target", lambda x, _: x + [0.01, 0, 0, 0, 0, 0]), AIM),
    Fault("the operator's target turned", field("target", lambda x, _: x[:, [0, 1, 2, 4, 5, 3]]), AIM_WAY),
    Fault("no target of the operator in the log", field("target", lambda x, _: np.zeros((0, 6))), AIM),
    Fault("no record called settled", field("settled", lambda x, _: np.zeros_like(x)), OPERATED),
)


def contact(name: str, change: Callable[[np.ndarray], np.ndarray]) -> Callable[[RunLog], RunLog]:
    return field(name, lambda x, _: change(x))


def forget_one(log: RunLog) -> RunLog:
    """Leave out the contact with the greatest force."""
    left = np.arange(len(log.contact_time)) != np.argmax(np.linalg.norm(log.contact_force, axis=1))
    fields = ("contact_time", "contact_pair", "contact_distance", "contact_force", "contact_point")
    return replace(log, **{name: getattr(log, name)[left] for name in fields})


CONTACT_FAULTS = (
    Fault("contact forces 1 % too high", contact("contact_force", lambda x: 1.01 * x), MOVING),
    Fault("contact forces turned", contact("contact_force", lambda x: x[:, [2, 1, 0]]), MOVING),
    Fault("contact forces of the wrong sign", contact("contact_force", lambda x: -x), MOVING),
    Fault("no contact force in the log", contact("contact_force", lambda x: 0 * x), MOVING),
    Fault("contact points 0.1 m aside", contact("contact_point", lambda x: x + [0, 0.1, 0]), MOVING),
    Fault("a contact left out", forget_one, MOVING),
    Fault(
        "contacts with the shell in the place of the waste",
        contact("contact_pair", lambda x: np.char.replace(x, "tank/waste", "tank/liner")),
        TOUCHED,
    ),
    Fault("contact forces a hundred times too high", contact("contact_force", lambda x: 100 * x), PRESSED),
)
