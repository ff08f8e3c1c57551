"""Trusses of the sizing literature: their data, their least weights, and what no catalogue design can weigh less than.

Forces come from the same stiffness solver as an arm's (`studies.frameworks.deflect_framework`). Weights are of bars alone.
Data are the literature's in its own units: inches, kips, ksi, lb.

Source: R. T. Haftka and Z. Gurdal, Elements of Structural Optimization, 3rd ed. (1992), ten-bar truss; L. A. Schmit and
B. Farshi, Some approximation concepts for structural synthesis, AIAA Journal 12 (1974), 692-699, 25-bar and 72-bar trusses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog, minimize

from studies.frameworks import deflect_framework, make_framework
from vgtsim.statics import grow_sizes
from vgtsim.statics.framework import Framework, equilibrium_matrix

Array = NDArray[np.float64]

# Areas of the American sections, in², of which the ten-bar truss is made in the literature of discrete sizing, and the lightest
# design of them that the literature has for limits of 2 in: 5490.74 lb (S. Rajeev and C. S. Krishnamoorthy, Journal of
# Structural Engineering 118 (1992), 1233-1250, and many after them).
SECTIONS = np.array(
    [
        1.62,
        1.80,
        1.99,
        2.13,
        2.38,
        2.62,
        2.63,
        2.88,
        2.93,
        3.09,
        3.13,
        3.38,
        3.47,
        3.55,
        3.63,
        3.84,
        3.87,
        3.88,
        4.18,
        4.22,
    ]
    + [4.49, 4.59, 4.80, 4.97, 5.12, 5.74, 7.22, 7.97, 11.5, 13.5, 13.9, 14.2, 15.5, 16.0, 16.9, 18.8, 19.9, 22.0, 22.9]
    + [26.5, 30.0, 33.5]
)
LIGHTEST_OF_SECTIONS = np.array([33.5, 1.62, 22.9, 14.2, 1.62, 1.62, 7.97, 22.9, 22.0, 1.62])
MODULUS, DENSITY = 1e4, 0.1  # ksi and lb/in³, aluminium, in all three problems


@dataclass(frozen=True, kw_only=True, eq=False)
class SizingProblem:
    """A truss whose bars' areas, equal within a group, are to weigh as little as they can.

    Attributes:
        nodes: Shape (N, 3), in.
        loads: One row a case, shape (C, N, 3), kip.
        group: Number of each bar's group, shape (B,).
        pull, push: Greatest stresses, shape (B,), ksi.
        limited: Whether a displacement is limited, shape (N, 3); `most` is the limit, in.
        least: Least area, in².
    """

    frame: Framework
    nodes: Array
    loads: Array
    group: NDArray[np.intp]
    pull: Array
    push: Array
    limited: NDArray[np.bool_]
    most: float
    least: float

    @cached_property
    def lengths(self) -> Array:
        """Of the bars, shape (B,), in."""
        span = self.nodes[self.frame.ends[:, 1]] - self.nodes[self.frame.ends[:, 0]]
        return np.asarray(np.sqrt(np.sum(span**2, axis=1)), dtype=np.float64)

    @cached_property
    def weights(self) -> Array:
        """Of each group for an area of 1 in², lb."""
        return np.asarray(DENSITY * np.bincount(self.group, self.lengths), dtype=np.float64)

    def solve(self, areas: Array) -> tuple[Array, Array]:
        """Displacements, shape (C, N, 3), in, and bar forces, shape (C, B), kip, for areas of the groups, in²."""
        spring = MODULUS * areas[self.group] / self.lengths
        found = [deflect_framework(self.frame, self.nodes, spring, load) for load in self.loads]
        return np.array([moved for moved, _ in found]), np.array([bar for _, bar in found])

    def use(self, areas: Array) -> Array:
        """Stresses and limited displacements over their limits, shape (n,): 1 where all of a limit is used."""
        moved, bar = self.solve(areas)
        stress = bar / areas[self.group]
        shift = np.abs(moved[:, self.limited]) / self.most if np.isfinite(self.most) else np.zeros(0)
        return np.concatenate([(stress / self.pull).ravel(), (-stress / self.push).ravel(), shift.ravel()])


def make_problem(
    places: Sequence[tuple[float, float, float]],
    bars: Sequence[tuple[int, int]],
    supports: dict[str, str],
    **data: object,
) -> SizingProblem:
    """A problem of nodes named from 1 on."""
    names = [str(index + 1) for index in range(len(places))]
    frame = make_framework(names, [(str(first), str(second)) for first, second in bars], supports)
    return SizingProblem(frame=frame, nodes=np.array(places, float), **data)  # pyright: ignore[reportArgumentType]


def ten_bar(most: float = 2.0) -> SizingProblem:
    """A cantilever of two square bays of 360 in with 100 kip on each lower joint; `most` is the limit of displacements, in."""
    places = [(720, 0, 360), (720, 0, 0), (360, 0, 360), (360, 0, 0), (0, 0, 360), (0, 0, 0)]
    bars = [(5, 3), (3, 1), (6, 4), (4, 2), (3, 4), (1, 2), (5, 4), (6, 3), (3, 2), (4, 1)]
    loads = np.zeros((1, 6, 3))
    loads[0, [1, 3], 2] = -100
    limited = np.zeros((6, 3), bool)
    limited[:4, [0, 2]] = True
    return make_problem(
        places,
        bars,
        dict.fromkeys("1234", "y") | dict.fromkeys("56", "xyz"),
        loads=loads,
        group=np.arange(10),
        pull=np.full(10, 25.0),
        push=np.full(10, 25.0),
        limited=limited,
        most=most,
        least=0.1,
    )


def twenty_five_bar() -> SizingProblem:
    """A transmission tower of eight groups in two load cases; each group has its own limit of compression."""
    places = [(-37.5, 0, 200), (37.5, 0, 200), (-37.5, 37.5, 100), (37.5, 37.5, 100), (37.5, -37.5, 100)]
    places += [(-37.5, -37.5, 100), (-100, 100, 0), (100, 100, 0), (100, -100, 0), (-100, -100, 0)]
    groups = [[(1, 2)], [(1, 4), (2, 3), (1, 5), (2, 6)], [(2, 4), (2, 5), (1, 3), (1, 6)], [(3, 6), (4, 5)]]
    groups += [[(3, 4), (5, 6)], [(3, 10), (6, 7), (4, 9), (5, 8)], [(4, 7), (3, 8), (5, 10), (6, 9)]]
    groups += [[(6, 10), (3, 7), (4, 8), (5, 9)]]
    group = np.repeat(np.arange(8), [len(bars) for bars in groups])
    loads = np.zeros((2, 10, 3))
    loads[0, :2] = (0, 20, -5), (0, -20, -5)
    loads[1, [0, 1, 2, 5]] = (1, 10, -5), (0, 10, -5), (0.5, 0, 0), (0.5, 0, 0)
    limited = np.zeros((10, 3), bool)
    limited[:2] = True
    return make_problem(
        places,
        [bar for bars in groups for bar in bars],
        dict.fromkeys(["7", "8", "9", "10"], "xyz"),
        loads=loads,
        group=group,
        pull=np.full(25, 40.0),
        push=np.array([35.092, 11.590, 17.305, 35.092, 35.092, 6.759, 6.959, 11.082])[group],
        limited=limited,
        most=0.35,
        least=0.01,
    )


def seventy_two_bar() -> SizingProblem:
    """A tower of four storeys of 60 in on a square of 120 in, sixteen groups, two load cases on its top."""
    corners = [(0, 0), (120, 0), (120, 120), (0, 120)]
    places = [(x, y, 60 * level) for level in range(5) for x, y in corners]
    bars: list[tuple[int, int]] = []
    group: list[int] = []
    for storey in range(4):
        low, high = [[4 * (storey + up) + corner + 1 for corner in range(4)] for up in (0, 1)]
        turned = range(1, 5)
        parts = [
            [(low[i], high[i]) for i in range(4)],
            [pair for i in range(4) for pair in ((low[i], high[turned[i] % 4]), (low[turned[i] % 4], high[i]))],
            [(high[i], high[turned[i] % 4]) for i in range(4)],
            [(high[0], high[2]), (high[1], high[3])],
        ]
        for index, part in enumerate(parts):
            bars += part
            group += [4 * storey + index] * len(part)
    loads = np.zeros((2, 20, 3))
    loads[0, 16] = 5, 5, -5
    loads[1, 16:, 2] = -5
    limited = np.zeros((20, 3), bool)
    limited[16:, :2] = True
    return make_problem(
        places,
        bars,
        dict.fromkeys("1234", "xyz"),
        loads=loads,
        group=np.array(group),
        pull=np.full(72, 25.0),
        push=np.full(72, 25.0),
        limited=limited,
        most=0.25,
        least=0.1,
    )


def find_least_weight(problem: SizingProblem, start: float) -> tuple[float, Array]:
    """Least weight, lb, and areas, in², that keep all limits; a local search from equal areas, in²."""
    scale = problem.weights.sum() * start

    def margin(x: Array) -> Array:
        return 1 - problem.use(x * start)

    found = minimize(
        lambda x: problem.weights @ (x * start) / scale,
        np.ones(len(problem.weights)),
        jac=lambda _: problem.weights * start / scale,
        bounds=[(problem.least / start, None)] * len(problem.weights),
        constraints={"type": "ineq", "fun": margin},
        method="SLSQP",
        options={"ftol": 1e-12, "maxiter": 500},
    )
    areas = found.x * start
    return float(problem.weights @ areas), areas


def size_from_catalogue(problem: SizingProblem, sizes: Array) -> tuple[float, Array]:
    """Weight, lb, and areas, in², by the rule of `size`: every group grows through the catalogue until it carries its force.

    The rule looks at stresses alone, as it does for an arm.
    """
    count = len(problem.weights)

    def choose(ranks: Mapping[int, int]) -> dict[int, int]:
        _, bar = problem.solve(sizes[[ranks[place] for place in range(count)]])
        need = np.maximum(bar / problem.pull, -bar / problem.push).max(axis=0)
        return {k: max(ranks[k], int(np.searchsorted(sizes, need[problem.group == k].max()))) for k in range(count)}

    ranks, _ = grow_sizes(range(count), choose)
    areas = sizes[[ranks[place] for place in range(count)]]
    return float(problem.weights @ areas), areas


def bound_weight(problem: SizingProblem, sizes: Array | None = None) -> float:
    """A weight, lb, that no design within the limits of stress can go below.

    Only equilibrium is asked for, in every case, and not that the bars fit together under their strains, so every elastic
    design is among those that are looked at: the plastic design of least weight. With a catalogue of areas, in², each group
    takes one of them, by branch and bound; without one areas are continuous.
    """
    cases, bars, count = len(problem.loads), len(problem.lengths), len(problem.weights)
    equations = equilibrium_matrix(problem.frame, problem.nodes)
    free = problem.loads[:, problem.frame.free]
    choices = 1 if sizes is None else len(sizes)
    per_group = np.eye(count) if sizes is None else np.kron(np.eye(count), sizes)  # areas of the unknowns
    own = per_group[problem.group]
    balance = np.kron(np.eye(cases), -equations)
    holds = np.hstack([np.zeros((len(balance), count * choices)), balance])
    stressed = np.vstack(
        [
            np.hstack([np.tile(-limit[:, None] * own, (cases, 1)), sign * np.eye(cases * bars)])
            for sign, limit in ((1, problem.pull), (-1, problem.push))
        ]
    )
    cost = np.concatenate([problem.weights @ per_group, np.zeros(cases * bars)])
    limits = [(problem.least, None) if sizes is None else (0, 1)] * (count * choices) + [(None, None)] * (cases * bars)
    whole = np.repeat([0 if sizes is None else 1, 0], [count * choices, cases * bars])
    if sizes is not None:  # one size for each group
        pick = np.hstack([np.kron(np.eye(count), np.ones(choices)), np.zeros((count, cases * bars))])
        holds, wanted = np.vstack([holds, pick]), np.concatenate([free.ravel(), np.ones(count)])
    else:
        wanted = free.ravel()
    found = linprog(cost, stressed, np.zeros(len(stressed)), holds, wanted, limits, integrality=whole)
    return float(found.fun if sizes is None else found.mip_dual_bound)
