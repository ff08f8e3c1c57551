"""How much of their strength members use: the one place where forces are held against ratings.

Members are judged for strength; what the oil pressure can hold is judged apart, as drive capacity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.compilation import compiled
from vgtsim.statics.equilibrium import MemberForces, solve_members
from vgtsim.statics.loads import LoadModel
from vgtsim.statics.rating import LIMITS, ROD_FACTOR, MemberSections, Ratings, find_column, rate

ALPHA = 1.6  # AISC 360-22 C2.1: allowable loads are taken times this for second-order effects
MODES = ("yield", "column", "rod buckling", "pin shear", "axial force with bending")
_POWER = 12  # of the mean that stands for a greatest value: smooth, and above a tenth of 132 equal ones


@dataclass(frozen=True)
class Utilisation:
    """Demand over capacity, each shape (..., M); the first five are by `LIMITS` of axial force.

    Attributes:
        tension: Greatest tension along the member over its allowable.
        compression: Greatest compression along the member over its column strength.
        rod: Greatest compression over the allowable of the rod; zero for tubes.
        pressure: Drive force over what the supply pressure holds; zero for tubes.
        pin: Greatest force, pulled or pushed, over the pins' shear strength; zero where none is given.
        bent: Axial force with bending, of the rod or the barrel, whichever is used more; zero for members not bent.
    """

    tension: Array
    compression: Array
    rod: Array
    pressure: Array
    pin: Array
    bent: Array

    @property
    def by_mode(self) -> Array:
        """Utilisation in each of `MODES`, shape (5, ..., M): everything but the oil."""
        return np.stack([self.tension, self.compression, self.rod, self.pin, self.bent])

    @property
    def strength(self) -> Array:
        """Worst of `MODES`, shape (..., M)."""
        return self.by_mode.max(axis=0)

    @property
    def worst(self) -> Array:
        """Worst of strength and oil pressure, shape (..., M)."""
        return np.maximum(self.strength, self.pressure)


def find_use(model: LoadModel, sections: MemberSections, nodes: ArrayLike, safety_factor: float) -> Utilisation:
    """Utilisation at rest in poses of shape (..., N, 3), m, frame G; errors as `solve_members`."""
    n = np.asarray(nodes, float)
    forces, length = solve_members(model, n), model.truss.lengths(n)
    if len(model.truss.rings):  # members between joint blocks are bent
        return utilise(rate(sections, length, safety_factor), forces)
    flat = (-1, length.shape[-1])
    near, bar, far = (item.reshape(flat) for item in (forces.near_axial, forces.bar, forces.far_axial))
    used = np.empty((len(LIMITS), *bar.shape))
    _fill_use(sections.figures, safety_factor, near, bar, far, length.reshape(flat), used)
    return Utilisation(*used.reshape(-1, *length.shape), bent=np.zeros(length.shape))


@compiled
def _fill_use(
    figures: Array, safety_factor: float, near: Array, bar: Array, far: Array, length: Array, used: Array
) -> None:
    """The first five of `Utilisation`, shape (5, T, M), of axial forces, N, and lengths, m, shape (T, M)."""
    for t in range(len(bar)):
        for m in range(bar.shape[1]):
            column = find_column(figures[0, m], length[t, m] / figures[1, m], figures[2, m], figures[3, m])
            tension, column, pin = figures[4, m] / safety_factor, column / safety_factor, figures[5, m] / safety_factor
            limits = (tension, column, figures[6, m] / length[t, m] ** 2, pin)
            pull = _greater(_greater(near[t, m], bar[t, m]), far[t, m])
            push = _greater(_greater(-near[t, m], -bar[t, m]), -far[t, m])
            found = _hold(limits, (figures[7, m], figures[8, m]), (pull, push, bar[t, m], -bar[t, m]))
            for k in range(5):
                used[k, t, m] = found[k]


@compiled
def _fill_axial_use(limits: Array, forces: Array, used: Array) -> None:
    """The same, shape (5, T), of limits, shape (6, T), and of forces, shape (4, T), N, see `_hold`."""
    for t in range(limits.shape[1]):
        found = _hold(
            (limits[0, t], limits[1, t], limits[2, t], limits[5, t]),
            (limits[3, t], limits[4, t]),
            (forces[0, t], forces[1, t], forces[2, t], forces[3, t]),
        )
        for k in range(5):
            used[k, t] = found[k]


@compiled
def _hold(
    limits: tuple[float, float, float, float], drive: tuple[float, float], forces: tuple[float, float, float, float]
) -> tuple[float, float, float, float, float]:
    """Use by `LIMITS`: of tension, column, rod and pins; of pressure pushed and pulled; of pull and push, then the drive's."""
    (tension, column, rod, pin), (most_push, most_pull) = limits, drive
    pull, push, drive_pull, drive_push = forces
    return (
        _greater(pull / tension, 0.0),
        _greater(push / column, 0.0),
        _greater(push / rod, 0.0),
        _greater(_greater(drive_pull / most_pull, drive_push / most_push), 0.0),
        _greater(_greater(pull / pin, push / pin), 0.0),
    )


@compiled
def _greater(a: float, b: float) -> float:
    return b if a < b else a  # what is no number stays so


def utilise(ratings: Ratings, forces: MemberForces) -> Utilisation:
    """Hold forces against ratings, both of shape (..., M); NaN where the forces are NaN.

    The axial force of a member runs between its values at the near hub, where its segments meet, and at the far hub; the
    greatest of the three counts in tension and in compression.
    """
    along = forces.along
    pull, push = along.max(axis=0), -along.min(axis=0)
    use = use_axial(ratings, pull, push, forces.bar, -forces.bar)
    if not (forces.near_moment.any() or forces.far_moment.any()):  # an arm without joint blocks
        return use
    # the barrel's axial part counts as the rod's, on the safe side
    barrel, rod = greatest_moments(forces.near_moment, forces.far_moment, ratings.mouth)
    moment = np.maximum(barrel / ratings.barrel_moment, rod / ratings.rod_moment)
    carried = np.where(moment > 0, amplify(np.maximum(push, 0.0), ROD_FACTOR * ratings.rod), 1.0) * moment
    bent = np.where(moment > 0, interact(np.maximum(use.tension, use.compression), carried), 0.0)
    return replace(use, bent=bent)


def use_axial(ratings: Ratings, pull: Array, push: Array, drive_pull: Array, drive_push: Array) -> Utilisation:
    """Hold axial forces alone against ratings; shapes (..., M), N.

    Pull and push are the greatest tension and compression along each member, below zero when there is none; those of the
    drive are the same where the member's segments meet.
    """
    axial, drive = (ratings.tension, ratings.compression, ratings.rod), (ratings.push, ratings.pull)
    each = np.broadcast_arrays(*axial, *drive, ratings.pin, pull, push, drive_pull, drive_push)
    shape, flat = each[0].shape, np.stack(each).reshape(len(each), -1)
    used = np.empty((len(LIMITS), flat.shape[1]))
    _fill_axial_use(flat[:6], flat[6:], used)
    return Utilisation(*used.reshape(-1, *shape), bent=np.zeros(shape))


def smooth_peak(values: Array) -> Array:
    """Smooth stand-in for the greatest of some positive values, shape (...), for values of shape (..., M)."""
    return np.sum(values**_POWER, axis=-1) ** (1 / _POWER)


def interact(axial: ArrayLike, bending: ArrayLike) -> Array:
    """Use of a member in axial force (Pr/Pc) and bending (Mr/Mc) together, shape (...); at most 1 is strong enough.

    Source: AISC 360-22 equations H1-1a and H1-1b.
    """
    p, m = np.asarray(axial, float), np.asarray(bending, float)
    return np.where(p >= 0.2, p + 8 / 9 * m, p / 2 + m)


def amplify(push: ArrayLike, euler: ArrayLike) -> Array:
    """Factor B1, with Cm = 1, by which compression raises the moment of a member whose ends do not move apart sideways.

    Of compression under allowable loads and Euler load, shape (...), N; infinite where the member buckles.
    Source: AISC 360-22 equation A-8-3.
    """
    ratio = ALPHA * np.asarray(push, float) / np.asarray(euler, float)
    return np.where(ratio < 1, 1 / np.maximum(1 - ratio, 1e-12), np.inf)


def greatest_moments(near: Array, far: Array, mouth: Array) -> tuple[Array, Array]:
    """Greatest bending moments in barrels and in rods, shapes (..., M), N·m.

    The moment runs straight from one block to the other; bending by the own weight is left out, as for every member.
    `near` and `far` are the actuators' moments on their blocks, shape (..., M, 3), N·m; `mouth` is the place of the barrel's
    mouth in parts of the length from the near end, shape (..., M).
    """
    there = near + mouth[..., None] * (-far - near)
    begin, middle, end = (np.linalg.norm(item, axis=-1) for item in (near, there, far))
    return np.maximum(begin, middle), np.maximum(middle, end)
