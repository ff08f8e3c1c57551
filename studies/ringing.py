"""How an arm rings after a push: frequency and damping of its slowest mode at a step, for each kind of drive and member."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from vgtsim.plant import Plant
from vgtsim.site import Site
from vgtsim.statics import find_modes

_PUSH = 200.0  # N, half a sine of the slowest mode's half period: a swing of millimetres
_WAIT, _WATCHED = 1.0, 4.0  # periods after the push: quicker modes die out, then the ring is fitted


@dataclass(frozen=True)
class Ring:
    """A ring by the fit of one mode.

    Attributes:
        frequency: Hz.
        damping: Ratio to critical damping.
        expected: Frequency of the arm with elastic members by its eigenproblem, Hz.
        misfit: How far the fit is off, over its amplitude.
    """

    frequency: float
    damping: float
    expected: float
    misfit: float


def change_options(site: Site, **settings: object) -> Site:
    """The site with other settings of its simulation, such as members, drive or damping_ratio."""
    simulation = site.task.simulation.model_copy(update=settings)
    return Site(replace(site.scene, task=site.task.model_copy(update={"simulation": simulation})))


def ring(site: Site, step: float) -> Ring:
    """Push the tool of the arm in its start posture along the motion of its slowest mode, and fit what follows."""
    plant = Plant(site, timestep=step, record_rate=0)
    stood = plant.reset()
    held = site.held_model if site.task.simulation.drive == "servo" else site.elastic_model
    modes = find_modes(held, stood.nodes, 1)
    expected = float(modes.frequency[0])
    tip = plant.model.body("tip").id
    shape = modes.nodes[0, site.truss.tip].mean(axis=0)
    along = shape / np.linalg.norm(shape)
    plant.command(stood.commanded)
    count = round(0.5 / expected / step)
    for index in range(count):
        plant.data.xfrc_applied[tip, :3] = _PUSH * np.sin(np.pi * (index + 0.5) / count) * along
        plant.step()
    plant.data.xfrc_applied[tip] = 0
    plant.step(round(_WAIT / expected / step))
    moved = []
    for _ in range(round(_WATCHED / expected / step)):
        plant.step()
        moved.append((plant.state.tool_position - stood.tool_position) @ along)
    return _fit(np.array(moved), step, expected)


def _fit(moved: np.ndarray, step: float, expected: float) -> Ring:
    """One decaying mode and an offset, by least squares in frequency and decay."""
    time = step * np.arange(len(moved))

    def parts(x: np.ndarray) -> np.ndarray:
        swing = np.exp(-x[1] * time)
        return np.stack([swing * np.cos(x[0] * time), swing * np.sin(x[0] * time), np.ones_like(time)], axis=1)

    def left(x: np.ndarray) -> np.ndarray:
        base = parts(x)
        return base @ np.linalg.lstsq(base, moved, rcond=None)[0] - moved

    omega = 2 * np.pi * expected
    found = least_squares(left, [omega, 0.02 * omega], x_scale=[omega, omega], xtol=1e-12, ftol=1e-12).x
    size = float(np.hypot(*np.linalg.lstsq(parts(found), moved, rcond=None)[0][:2]))
    natural = float(np.hypot(*found))
    return Ring(natural / (2 * np.pi), found[1] / natural, expected, float(np.abs(left(found)).max()) / size)
