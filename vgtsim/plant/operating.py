"""An operator as a client of the plant: commands at their times go through the controller, step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from vgtsim.control import Controller, apply
from vgtsim.description import OperatorCommand, digest_commands
from vgtsim.errors import DivergenceError, StoppedError
from vgtsim.logbook import LogWriter
from vgtsim.plant.plant import Plant
from vgtsim.plant.recorder import list_digests, list_versions
from vgtsim.plant.tour import show_progress
from vgtsim.runlog import Piece, RunLog
from vgtsim.site import Site

_AT_ONCE = 1e-6  # of a step: a command of that instant counts


def operate(site: Site, commands: Sequence[OperatorCommand] | None = None) -> RunLog:
    """Play a record of commands, by default that of the site's scene, and give the log; the same record gives the same log.

    After the last command the arm comes to rest and is held as at a goal. A contact that stops the plant ends the run.

    Raises:
        VgtError: A command is refused; `control.Controller.command` says why.
        DivergenceError: The state stopped being physical; the error carries the log until then.
    """
    record = site.scene.commands if commands is None else tuple(commands)
    log = _ride(site, record).log
    return replace(log, digests=log.digests | {"programme": digest_commands(record)})


def begin_operation(site: Site, folder: Path, *, resume: bool = False) -> LogWriter:
    """Begin the log of a scene's operator in a folder, or go on with the one there; see `LogWriter` for errors."""
    digests = list_digests(site) | {"programme": digest_commands(site.scene.commands)}
    return LogWriter(folder=folder, scene=site.scene, versions=list_versions(), digests=digests, resume=resume)


def record_operation(site: Site, writer: LogWriter) -> None:
    """Play the record of a site's scene as `operate` does; the log goes to disk as it is made."""
    try:
        rest = _ride(site, site.scene.commands, writer.write).log
    except DivergenceError as error:
        if isinstance(error.log, RunLog):
            writer.end(error.log)
        raise
    writer.end(rest)


def _ride(site: Site, commands: Sequence[OperatorCommand], store: Callable[[Piece], None] | None = None) -> Plant:
    plant, motion = Plant(site, store=store), site.task.motion
    state, controller = plant.reset(), Controller(site, plant.timestep)
    controller.start(state.commanded, site.start)
    waiting, step = list(commands)[::-1], plant.timestep
    hold, patience = (round(seconds / step) for seconds in (motion.hold, motion.patience))

    def advance() -> None:
        while waiting and waiting[-1].time <= plant.time + _AT_ONCE * step:
            apply(controller, waiting.pop())
        plant.mark(-1, settled=settled, target=controller.target)
        plant.command(controller.step(plant.state))
        plant.step()
        tick(plant.time)

    settled = False
    total = round(commands[-1].time / step) if commands else 0
    with show_progress(total) as tick, suppress(StoppedError):  # stepping on after a collision
        while waiting:
            advance()
        advance()  # the last command has been given
        for _ in range(patience):
            if plant.calm:
                settled, held = True, np.array(plant.state.commanded)
                for _ in range(hold):
                    plant.mark(-1, settled=True, target=controller.target)
                    plant.command(held)
                    plant.step()
                    tick(plant.time)
                break
            advance()
    return plant
