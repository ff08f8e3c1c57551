"""How much of their strength members use: the one place where forces are held against ratings.

Members are judged for strength; what the oil pressure can hold is judged apart, as drive capacity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.statics.bending import amplify, greatest_moments, interact
from vgtsim.statics.equilibrium import MemberForces, solve_members
from vgtsim.statics.loads import LoadModel
from vgtsim.statics.rating import ROD_FACTOR, MemberSections, Ratings, rate

Array = NDArray[np.float64]

MODES = ("yield", "column", "rod buckling", "pin shear", "axial force with bending")
_POWER = 12  # of the mean that stands for a greatest value: smooth, and above a tenth of 132 equal ones


@dataclass(frozen=True)
class Utilisation:
    """Demand over capacity, each shape (..., M).

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
    def strength(self) -> Array:
        """Worst of tension, column, rod, pin and bending: everything but the oil, shape (..., M)."""
        return self.by_mode.max(axis=0)

    @property
    def worst(self) -> Array:
        """Worst of strength and oil pressure, shape (..., M)."""
        return np.maximum(self.strength, self.pressure)

    @property
    def by_mode(self) -> Array:
        """Utilisation in each of `MODES`, shape (5, ..., M)."""
        return np.stack([self.tension, self.compression, self.rod, self.pin, self.bent])


def find_use(model: LoadModel, sections: MemberSections, nodes: ArrayLike, safety_factor: float) -> Utilisation:
    """Utilisation at rest in poses of shape (..., N, 3), m, frame G.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    return utilise(rate(sections, model.truss.lengths(n), safety_factor), solve_members(model, n))


def utilise(ratings: Ratings, forces: MemberForces) -> Utilisation:
    """Hold forces against ratings, both of shape (..., M); NaN where the forces are NaN.

    The axial force of a member runs between its values at the near hub, where its segments meet, and at the far hub; the
    greatest of the three counts in tension and in compression.
    """
    along = forces.along
    use = use_axial(ratings, along.max(axis=0), -along.min(axis=0), forces.bar, -forces.bar)
    push = np.maximum(-along.min(axis=0), 0.0)
    return replace(use, bent=_use_bent(ratings, forces, np.maximum(use.tension, use.compression), push))


def use_axial(ratings: Ratings, pull: Array, push: Array, drive_pull: Array, drive_push: Array) -> Utilisation:
    """Hold axial forces alone against ratings; shapes (..., M), N.

    Pull and push are the greatest tension and compression along each member, below zero when there is none; those of the
    drive are the same where the member's segments meet.
    """
    used = {}
    for name, (most_pull, most_push) in ratings.limits.items():
        pulled, pushed = (drive_pull, drive_push) if name == "oil pressure" else (pull, push)
        used[name] = np.maximum(np.maximum(pulled / most_pull, pushed / most_push), 0.0)
    return Utilisation(
        tension=used["yield"],
        compression=used["column"],
        rod=used["rod buckling"],
        pressure=used["oil pressure"],
        pin=used["pin shear"],
        bent=np.zeros(np.shape(pull)),
    )


def smooth_peak(values: Array) -> Array:
    """Smooth stand-in for the greatest of some positive values, shape (...), for values of shape (..., M)."""
    return np.sum(values**_POWER, axis=-1) ** (1 / _POWER)


def _use_bent(ratings: Ratings, forces: MemberForces, axial: Array, push: Array) -> Array:
    """Axial force and bending together, shape (..., M); the barrel's axial part counts as the rod's, on the safe side."""
    if not (forces.near_moment.any() or forces.far_moment.any()):  # an arm without joint blocks
        return np.zeros(np.shape(push))
    barrel, rod = greatest_moments(forces.near_moment, forces.far_moment, ratings.mouth)
    moment = np.maximum(barrel / ratings.barrel_moment, rod / ratings.rod_moment)
    carried = np.where(moment > 0, amplify(push, ROD_FACTOR * ratings.rod), 1.0) * moment
    return np.where(moment > 0, interact(axial, carried), 0.0)
