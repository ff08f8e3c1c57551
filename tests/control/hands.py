"""Stands in for a plant that does at once what it is told, and for hands that command it."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vgtsim.control import Controller, ControlReport
from vgtsim.site import Site

STEP = 0.02  # s


@dataclass
class Echo:
    """What a plant with perfect drives shows a controller."""

    commanded: np.ndarray
    lengths: np.ndarray
    contacts: tuple = ()
    stopped: str = ""


@dataclass
class Ride:
    """A controller on a perfect plant; every step is kept."""

    site: Site
    controller: Controller = field(init=False)
    lengths: list[np.ndarray] = field(default_factory=list)
    inputs: list[np.ndarray] = field(default_factory=list)
    reports: list[ControlReport] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.controller = Controller(self.site, STEP)
        now = self.site.chain.lengths(self.site.start)
        self.controller.start(now, self.site.start)
        self.lengths.append(now)
        self.inputs.append(self.site.start)

    def go(self, seconds: float, **command) -> ControlReport:
        if command:
            self.controller.command(**command)
        for _ in range(round(seconds / STEP)):
            now = self.lengths[-1]
            self.lengths.append(self.controller.step(Echo(now, now)))
            near = self.site.chain.state(self.inputs[-1][None])
            self.inputs.append(self.site.chain.follow(self.lengths[-1], near).q[0])
            self.reports.append(self.controller.report)
        return self.reports[-1]

    @property
    def nodes(self) -> np.ndarray:
        return self.site.chain.nodes(np.array(self.inputs))

    @property
    def rates(self) -> np.ndarray:
        return np.diff(np.array(self.lengths), axis=0) / STEP

    @property
    def accelerations(self) -> np.ndarray:
        return np.diff(self.rates, axis=0) / STEP


class Hand:
    """A hand that knows no rest: seeded commands of one kind, at irregular times."""

    def __init__(self, kind: str, seed: int) -> None:
        self.kind, self.rng = kind, np.random.default_rng(seed)

    def command(self, site: Site) -> dict:
        rng, kind = self.rng, self.kind
        if kind == "mixed":
            kind = ("twist", "goal", "lengths", "hold")[rng.integers(4)]
        if kind == "hold":
            return {"hold": True}
        if kind == "twist":
            return {"twist": np.sign(rng.normal(size=6)) * rng.uniform(0, 0.3)}
        if kind == "lengths":
            return {"lengths": rng.uniform(site.box.least, site.box.greatest)}
        position, direction = site.chain.tool(site.start)
        away = direction + 0.5 * rng.normal(size=3)
        return {"goal": np.concatenate([position + rng.normal(size=3), away])}

    def drive(self, ride: Ride, seconds: float) -> None:
        left = seconds
        while left > 0:
            wait = STEP * int(self.rng.integers(3, 40))
            ride.go(wait, **self.command(ride.site))
            left -= wait
