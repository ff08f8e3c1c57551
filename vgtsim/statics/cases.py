"""Load cases: weight, payload, tool wrench, static seismic coefficients and dynamic factors, and their envelope."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.description.scene import LoadCase
from vgtsim.statics.equilibrium import MemberForces, solve
from vgtsim.statics.loads import LoadModel, tool_forces
from vgtsim.statics.rating import Section, Utilisation, rate, utilise

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Envelope:
    """Worst over cases; C cases, ... poses, M members.

    Attributes:
        cases: Names of the cases.
        tension: Greatest tension of each member over cases and poses, shape (M,), N; 0 when never pulled.
        compression: Greatest compression, positive, shape (M,), N; 0 when never pushed.
        strength: Utilisation of each member in each case, shape (C, ..., M).
        pressure: Drive force over capacity of each member in each case, shape (C, ..., M).
    """

    cases: tuple[str, ...]
    tension: Array
    compression: Array
    strength: Array
    pressure: Array


def apply_case(model: LoadModel, case: LoadCase) -> LoadModel:
    """Load model of a case, without its wrench.

    Args:
        model: Masses under plain gravity.
        case: The case.

    Returns:
        With gravity turned and scaled; the payload's mass carries what its factor differs from that of the arm.
    """
    size = float(np.linalg.norm(model.gravity))
    gravity = case.dead * (case.dynamic * model.gravity + size * np.array(case.seismic))
    mass = model.payload.mass * case.payload / case.dead
    return replace(model, gravity=gravity, payload=model.payload.model_copy(update={"mass": mass}))


def solve_case(model: LoadModel, nodes: ArrayLike, case: LoadCase) -> MemberForces:
    """Find the member forces of a case.

    Args:
        model: Masses under plain gravity.
        nodes: Shape (..., N, 3), m, in frame G.
        case: The case.

    Returns:
        The forces.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    wrench = np.array([*case.force, *case.moment])
    return solve(apply_case(model, case), n, nodal_forces=tool_forces(model, n, wrench))


def find_envelope(
    model: LoadModel, section: Section, nodes: ArrayLike, cases: Sequence[LoadCase], safety_factor: float
) -> Envelope:
    """Hold every case against the ratings in every pose.

    Args:
        model: Masses under plain gravity.
        section: Section properties.
        nodes: Poses, shape (..., N, 3), m, in frame G.
        cases: At least one.
        safety_factor: Omega of AISC 360.

    Returns:
        The envelope.

    Raises:
        TrussError: The truss is a mechanism or carries a self-stress.
    """
    n = np.asarray(nodes, float)
    ends = model.truss.ends
    ratings = rate(section, np.linalg.norm(n[..., ends[:, 1], :] - n[..., ends[:, 0], :], axis=-1), safety_factor)
    used: list[Utilisation] = []
    pull, push = np.zeros(len(ends)), np.zeros(len(ends))
    for case in cases:
        forces = solve_case(model, n, case)
        along = np.stack([forces.near_axial, forces.bar, forces.far_axial]).reshape(-1, len(ends))
        pull, push = np.maximum(pull, along.max(axis=0)), np.maximum(push, -along.min(axis=0))
        used.append(utilise(ratings, forces))
    return Envelope(
        tuple(case.name for case in cases),
        pull,
        push,
        np.stack([use.strength for use in used]),
        np.stack([use.pressure for use in used]),
    )
