"""The tour as a client of the plant: leg after leg, each goal held once the arm has settled there."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from vgtsim.errors import StoppedError
from vgtsim.graphics import mujoco
from vgtsim.planning import Tour
from vgtsim.plant.hydraulics import require_pressure
from vgtsim.plant.plant import Plant
from vgtsim.plant.progress import show_progress
from vgtsim.runlog import RunLog
from vgtsim.site import Site

_PRESSURE_POSES = 0.25  # s of motion between poses in which the supply pressure must hold the dead load


def run(site: Site, tour: Tour, model: mujoco.MjModel | None = None) -> RunLog:
    """Play a tour.

    A goal is held until the arm has settled, then for the scene's hold time; an arm that does not settle within the scene's
    patience goes on to the next goal. A contact that stops the plant ends the tour.

    Args:
        site: The scene with its arm and tank.
        tour: Lengths of every actuator at every step of every leg.
        model: In place of the one of `build_model`; it is changed.

    Raises:
        DescriptionError: The arm is so deep in something in its start posture that its state diverges, or the supply
            pressure cannot hold the dead load somewhere on the tour.
        DivergenceError: The state stopped being physical; the error carries the log until then.
    """
    if site.task.simulation.drive == "hydraulic":
        _require_pressure(site, tour)
    plant = Plant(site, timestep=tour.timestep, model=model)
    plant.reset(tour.legs[0].lengths[0], tour.start)
    total = sum(len(leg.lengths) - 1 for leg in tour.legs)
    with show_progress(total) as tick, suppress(StoppedError):  # stepping on after a collision
        _play(plant, tour, tick)
    return plant.log


def _play(plant: Plant, tour: Tour, tick: Callable[[float], None]) -> None:
    motion = plant.site.task.motion
    hold, patience = (round(seconds / plant.timestep) for seconds in (motion.hold, motion.patience))

    def step(count: int) -> None:
        for _ in range(count):
            plant.step()
            tick(plant.time)

    step(hold)
    for leg in tour.legs:
        plant.mark(leg.goal)
        for lengths in leg.lengths[1:]:
            plant.command(lengths)
            step(1)
        for _ in range(patience):
            if plant.calm:
                plant.mark(leg.goal, settled=True)
                step(hold)
                break
            step(1)


def _require_pressure(site: Site, tour: Tour) -> None:
    """Hold the dead load against the supply pressure at poses all along the tour."""
    lengths = np.concatenate([leg.lengths for leg in tour.legs])
    every = max(round(_PRESSURE_POSES / tour.timestep), 1)
    time = np.arange(0.0, len(lengths), every) * tour.timestep
    require_pressure(site, time, lengths[::every])
