"""Runs: a planned tour or an operator's commands as clients of the plant, with the log in memory or on disk."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from vgtsim.description import OperatorCommand, digest_commands
from vgtsim.errors import DivergenceError, StoppedError
from vgtsim.graphics import mujoco
from vgtsim.log import LogWriter, Piece, RunLog
from vgtsim.planning import STEP_BOUND, Tour, revise_tour
from vgtsim.plant.hydraulics import require_pressure
from vgtsim.plant.operating import Operation, Tick, play_commands
from vgtsim.plant.plant import Plant
from vgtsim.plant.recorder import list_digests, list_versions
from vgtsim.site import Site

Programme = Tour | Sequence[OperatorCommand]

_EVERY = 50  # steps between redraws of the progress bar: some tens of milliseconds
_PRESSURE_POSES = 0.25  # s of motion between poses in which the supply pressure must hold the dead load


def run(site: Site, tour: Tour, model: mujoco.MjModel | None = None) -> RunLog:
    """Play a tour.

    A goal is held until the arm has settled, then for the scene's hold time; an arm that does not settle within the scene's
    patience goes on to the next goal. A contact that stops the plant ends the tour.

    A model in place of the one of `build_model` is changed by the run.

    Raises:
        DescriptionError: The arm is so deep in something in its start posture that its state diverges, or the supply
            pressure cannot hold the dead load somewhere on the tour.
        DivergenceError: The state stopped being physical; the error carries the log until then.
    """
    log = _play(site, tour, model=model)
    return replace(log, digests=log.digests | _digest(tour))


def operate(site: Site) -> RunLog:
    """Play the record of commands of a site's scene, and give the log; the same record gives the same log.

    After the last command the arm comes to rest and is held as at a goal. A contact that stops the plant ends the run.

    Raises:
        VgtError: A command is refused; `control.Controller.command` says why.
        DivergenceError: The state stopped being physical; the error carries the log until then.
    """
    log = _play(site, site.scene.commands)
    return replace(log, digests=log.digests | _digest(site.scene.commands))


def begin_log(site: Site, programme: Programme, folder: Path, *, resume: bool = False) -> LogWriter:
    """Begin the log of a tour or of commands in a folder, or go on with the one there; see `LogWriter` for errors."""
    digests = list_digests(site) | _digest(programme)
    return LogWriter(folder=folder, scene=site.scene, versions=list_versions(), digests=digests, resume=resume)


def record(site: Site, programme: Programme, writer: LogWriter) -> None:
    """Play a tour or commands as `run` and `operate` do; the log goes to disk as it is made: memory does not grow with the run.

    Errors are those of `run` and `operate`. The log is ended after a divergence too, and by nothing else that stops the program.
    """
    try:
        rest = _play(site, programme, store=writer.write)
    except DivergenceError as error:
        if isinstance(error.log, RunLog):
            writer.end(error.log)
        raise
    writer.end(rest)


def _digest(programme: Programme) -> dict[str, str]:
    return {"programme": programme.digest if isinstance(programme, Tour) else digest_commands(programme)}


def _play(
    site: Site,
    programme: Programme,
    *,
    model: mujoco.MjModel | None = None,
    store: Callable[[Piece], None] | None = None,
) -> RunLog:
    """The log of a programme; with a store, what that was not given of it."""
    bounds = {}
    if isinstance(programme, Tour):
        plant = Plant(site, timestep=programme.timestep, model=model, store=store)
        _start_tour(plant, programme)
        play, duration = partial(_play_tour, plant, programme), programme.duration
        bounds = {STEP_BOUND + name: float(bound) for name, bound in programme.bounds.items() if np.isfinite(bound)}
    else:
        operation = Operation(site, store)
        plant, play = operation.plant, partial(play_commands, operation, programme)
        duration = programme[-1].time if programme else 0.0
    try:
        with _show_progress(round(duration / plant.timestep)) as tick, suppress(StoppedError):  # after a collision
            play(tick)
    finally:
        plant.wait()  # whatever stops the program, no chunk is half written
    log = plant.log
    return replace(log, performance=log.performance | bounds)


def _start_tour(plant: Plant, tour: Tour) -> None:
    site = plant.site
    if site.task.simulation.drive == "hydraulic":  # at poses all along the tour
        lengths = np.concatenate([leg.lengths for leg in tour.legs])
        every = max(round(_PRESSURE_POSES / tour.timestep), 1)
        require_pressure(site, np.arange(0.0, len(lengths), every) * tour.timestep, lengths[::every])
    first = tour.legs[0]
    feed, turn = (0.0 if places is None else float(places[0]) for places in (first.feed, first.turn))
    plant.reset(first.lengths[0], tour.start, feed=feed, turn=turn)


def _play_tour(plant: Plant, tour: Tour, tick: Tick) -> None:
    """Leg after leg, each goal held once the arm has settled there."""
    motion = plant.site.task.motion
    hold, patience = (round(seconds / plant.timestep) for seconds in (motion.hold, motion.patience))

    def step(count: int) -> None:
        for _ in range(count):
            plant.step()
            tick(plant.time)

    step(hold)
    known = 0
    for index in range(len(tour.legs)):
        plant.mark(tour.legs[index].goal)
        row = 0
        while True:
            if plant.appeared > known:
                known = plant.appeared
                tour = revise_tour(plant.site, tour, plant.note_revision(index, row))
            leg = tour.legs[index]
            row += 1
            if row == len(leg.lengths):
                break
            beside = (leg.feed, leg.turn, leg.tool)
            feed, turn, share = (None if way is None else float(way[row]) for way in beside)
            plant.command(leg.lengths[row], feed=feed, turn=turn, tool=share)
            step(1)
        if tour.blocked and leg is tour.legs[-1]:
            plant.end(tour.blocked)
            return
        for _ in range(patience):
            if plant.calm:
                plant.mark(leg.goal, settled=True)
                step(hold)
                break
            step(1)


@contextmanager
def _show_progress(total: int) -> Iterator[Tick]:
    """Show a progress bar on a terminal; gives a function to be called with the simulated time, s, after each step.

    The steps of holds come on top of the total, at which the bar then stays.
    """
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    columns = (TextColumn("simulating"), BarColumn(), TextColumn("{task.fields[simulated]:.1f} s simulated,"))
    with Progress(*columns, TimeElapsedColumn(), TextColumn("wall"), console=Console(stderr=True)) as bar:
        task = bar.add_task("simulating", total=total, simulated=0.0)
        done = 0

        def tick(simulated: float) -> None:
            nonlocal done
            done += 1
            if done % _EVERY == 0:
                bar.update(task, completed=min(done, total), simulated=simulated)

        yield tick
