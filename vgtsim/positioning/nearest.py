"""The tool pose nearest to a goal that cannot be met."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vgtsim.positioning.newton import NewtonSettings, minimise
from vgtsim.positioning.objectives import StrokeBarrier
from vgtsim.positioning.problem import Problem
from vgtsim.positioning.quadratic import Quadratic

Array = NDArray[np.float64]
Index = NDArray[np.intp]

_KAPPAS = (1e-2, 1e-4, 1e-6)  # m²: at the last one the barrier holds the arm a millimetre off the ends of its strokes
_SETTLED = 1e-5  # fall of the objective that is not worth another step


def come_nearest(problem: Problem, start: Array, most: int = 80) -> tuple[Array, Array]:
    """Come as near to one goal as the strokes let the arm, from inputs inside the strokes, shape (b, n).

    The sum |e|² / (2 kappa) plus the stroke barrier is made least, with e the goal's error and kappa falling; the
    problem's objective plays no part. Returns inputs, shape (b, n), and errors of the rows, shape (b, m), m and rad: a
    metre counts like a radian.
    """
    plain = replace(problem, objective=StrokeBarrier())
    z, every, rows = problem.variables(start), np.zeros(len(start), int), len(problem.goal.names)
    for kappa in _KAPPAS:

        def pulled(z: Array, which: Index, kappa: float = kappa) -> Quadratic:
            at = plain.model(z, every[which])
            e, J = at.error[:, :rows], at.J[:, :rows]  # static legs keep their length all the same
            Jt = np.swapaxes(J, 1, 2) / kappa
            value = at.value + np.sum(e**2, axis=1) / (2 * kappa)
            slope = at.slope + (Jt @ e[..., None])[..., 0]
            return Quadratic(at.inside, at.error[:, rows:], at.J[:, rows:], value, slope, at.curve + Jt @ J)

        z = minimise(pulled, z, NewtonSettings(optimality=_SETTLED, most=most)).q
    return problem.inputs(z), plain.model(z, every).error[:, :rows]
