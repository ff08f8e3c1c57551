"""Configurations to look for a goal from: the arm swung about its mast, and a few ways to spread its bends."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.bending import azimuth, bend_all, swing
from vgtsim.kinematics.chain import Chain
from vgtsim.redundancy.strokes import StrokeBox, bring_inside

Array = NDArray[np.float64]

# Bend of the modules from the mast to the tool, in degrees, at five stations along the arm.
_BENDS = (
    (35.0, 30.0, 15.0, 5.0, 0.0),
    (30.0, 15.0, 0.0, 10.0, 35.0),
    (40.0, 38.0, 25.0, -20.0, -35.0),
    (20.0, 30.0, 30.0, 30.0, 30.0),
)


def seeds(chain: Chain, box: StrokeBox, start: Array, target: Array) -> Iterator[Array]:
    """Configurations from which to look for a goal, best first.

    Args:
        chain: The arm.
        box: Lengths allowed.
        start: Present configuration, shape (A, 3).
        target: Tool position wanted, in frame G, shape (3,), m.

    Yields:
        Inputs inside the box, shape (A, 3): the present ones swung to the target's azimuth, the present ones,
        then bend patterns in the plane of the target.
    """
    there = azimuth(chain, target)
    yield bring_inside(chain, box, swing(chain, start, there - azimuth(chain, chain.tool(start)[0])))
    yield bring_inside(chain, box, start)
    stations = np.linspace(0, 1, len(start))
    for bends in _BENDS:
        angles = np.radians(np.interp(stations, np.linspace(0, 1, 5), bends))
        yield bring_inside(chain, box, bend_all(chain, angles, there))
