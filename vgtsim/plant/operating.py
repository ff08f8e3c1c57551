"""An operator as a client of the plant: commands at their times go through the controller, step by step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

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


def operate(site: Site) -> RunLog:
    """Play the record of commands of a site's scene, and give the log; the same record gives the same log.

    After the last command the arm comes to rest and is held as at a goal. A contact that stops the plant ends the run.

    Raises:
        VgtError: A command is refused; `control.Controller.command` says why.
        DivergenceError: The state stopped being physical; the error carries the log until then.
    """
    log = _ride(site, site.scene.commands).log
    return replace(log, digests=log.digests | {"programme": digest_commands(site.scene.commands)})


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


class Operation:
    """A plant with its controller, from the scene's start: `give` it commands and `advance` it, step by step.

    Played from a record or by a live hand, the same commands at the same steps give the same log. A `store` is given the log
    piece by piece, see `Plant`.
    """

    def __init__(self, site: Site, store: Callable[[Piece], None] | None = None) -> None:
        """Stand at the scene's start."""
        self.plant = Plant(site, store=store)
        self.controller = Controller(site, self.plant.timestep)
        self.controller.start(self.plant.reset().commanded, site.start)

    def give(self, command: OperatorCommand) -> None:
        """Give the controller a command; errors are those of `Controller.command`."""
        apply(self.controller, command)

    def advance(self) -> None:
        """One step of controller and plant; errors are those of `Plant.step`."""
        self.plant.mark(-1, target=self.controller.target)
        self.plant.command(self.controller.step(self.plant.state))
        self.plant.step()

    def hold(self) -> None:
        """One step in which the arm, come to rest, is held as at a goal."""
        self.plant.mark(-1, settled=True, target=self.controller.target)
        self.plant.command(self.plant.state.commanded)
        self.plant.step()


def _ride(site: Site, commands: Sequence[OperatorCommand], store: Callable[[Piece], None] | None = None) -> Plant:
    operation, motion = Operation(site, store), site.task.motion
    plant = operation.plant
    waiting, step = list(commands)[::-1], plant.timestep
    hold, patience = (round(seconds / step) for seconds in (motion.hold, motion.patience))

    def advance() -> None:
        while waiting and waiting[-1].time <= plant.time + _AT_ONCE * step:
            operation.give(waiting.pop())
        operation.advance()
        tick(plant.time)

    total = round(commands[-1].time / step) if commands else 0
    try:
        with show_progress(total) as tick, suppress(StoppedError):  # stepping on after a collision
            while waiting:
                advance()
            advance()  # the last command has been given
            for _ in range(patience):
                if plant.calm:
                    for _ in range(hold):
                        operation.hold()
                        tick(plant.time)
                    break
                advance()
    finally:
        plant.wait()  # whatever stops the program, no chunk is half written
    return plant
