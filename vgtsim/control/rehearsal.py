"""The controller run again over the lengths that a log measured: what it must have commanded, for verification."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array
from vgtsim.control.controller import Controller
from vgtsim.description import OperatorCommand, digest_commands
from vgtsim.errors import CommandError, DescriptionError, VgtError
from vgtsim.log import LogSource, cut
from vgtsim.planning import check_site
from vgtsim.site import Site

_AT_ONCE = 1e-6  # of a step: a command of that instant counts


@dataclass(frozen=True)
class RehearsedLeg:
    """Lengths of the cylinders at every step of a run, shape (S, J), m; its goal is -1, which is none. The mast is held."""

    lengths: Array
    goal: int = -1
    feed: None = None
    turn: None = None
    leader: None = None
    tool: None = None


@dataclass(frozen=True)
class Rehearsal:
    """What the record of an operator commands, in the form of a tour of one leg; the time step is in s."""

    legs: tuple[RehearsedLeg, ...]
    timestep: float
    digest: str


@dataclass(frozen=True)
class _Seen:
    """What the controller saw at a record."""

    commanded: Array
    lengths: Array
    contacts: tuple[tuple[float, str, str, float], ...]
    stopped: str = ""


def check_operation(site: Site) -> None:
    """Refuse a scene that an operator cannot play headless.

    Raises:
        DescriptionError: The scene cannot work, see `planning.checks.check_site`, names no record of commands, or one with a
            command that the arm cannot be given.
    """
    check_site(site)
    if not site.scene.commands:
        raise site.scene.error("operator.record", "nothing", "a record of commands, for a run without a person")
    # all commands are given to an arm at its start; the postures of Newton's method are not solved for
    record, controller = site.task.operator and site.task.operator.record, Controller(site)
    file = site.scene.file.parent / record if record else site.scene.file
    controller.start(site.chain.lengths(site.start), site.start)
    for command in site.scene.commands:
        key = f"command at {command.time:g} s"
        try:
            apply(controller, command.model_copy(update={"method": "rate"}))
        except CommandError as error:
            raise DescriptionError(file, f"{key}: {error.what}", error.found, error.allowed) from None
        except VgtError as error:
            raise DescriptionError(file, key, "", str(error)) from None


def apply(controller: Controller, command: OperatorCommand) -> None:
    """Give a controller a command of a record; errors are those of `Controller.command`."""
    target = {command.target: getattr(command, command.target)}
    controller.command(**target, method=command.method, objective=command.objective)


def rehearse(site: Site, log: LogSource) -> Rehearsal:
    """Run the controller over the measured lengths of a log with the commands of the site's scene.

    The log must have a record of every step. Where it is that of another run the commands differ from it.

    Raises:
        VgtError: A command is refused.
    """
    controller, step = Controller(site, site.timestep), site.timestep
    waiting = list(site.scene.commands)[::-1]
    found: list[Array] = []
    ended = False
    for stretch in cut(log):
        part = stretch.log
        for k in range(part.count):
            if not found:
                controller.start(part.commanded[0], site.start)
                found.append(np.array(part.commanded[0]))
            now = (stretch.first + k) * step
            while waiting and waiting[-1].time <= now + _AT_ONCE * step:
                apply(controller, waiting.pop())
            ended = ended or bool(part.settled[k])
            touched = np.abs(part.contact_time - now) < step / 2
            pairs = [(now, str(a), str(b), 0.0) for a, b in part.contact_pair[touched]]
            seen = _Seen(commanded=found[-1], lengths=part.actual[k], contacts=tuple(pairs))
            found.append(found[-1] if ended else controller.step(seen))
    return Rehearsal((RehearsedLeg(lengths=np.array(found)),), step, digest_commands(site.scene.commands))
