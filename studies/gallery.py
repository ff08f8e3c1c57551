"""Problems of others with printed answers, beside what this project computes: the table of docs/benchmarks.md.

`scripts/bench_multibody table` prints it; a test holds the document against it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from studies.closure_modes import closure_modes
from studies.double_octahedron import MirrorModule, transform
from studies.frameworks import deflect_framework, make_framework
from studies.marching import march
from studies.multibody import PUBLISHED
from studies.sizing_problems import (
    LIGHTEST_OF_SECTIONS,
    find_least_weight,
    seventy_two_bar,
    ten_bar,
    twenty_five_bar,
)
from vgtsim.description import load_manipulator
from vgtsim.description.catalogue import INCH
from vgtsim.kinematics.modules import octahedron

POUND = 4.4482216152605  # lbf in N
_STEP = 0.002  # of the mechanisms, s
_MILLIONTH = "{:.6f}"


@dataclass(frozen=True)
class Row:
    """A printed figure and the computed one; `form` shows both, `off` is the difference that is allowed."""

    problem: str
    quantity: str
    printed: float
    computed: float
    form: str
    off: float

    @property
    def line(self) -> str:
        """The row as a line of the document's table."""
        cells = self.problem, self.quantity, self.form.format(self.printed), self.form.format(self.computed)
        return f"| {' | '.join(cells)} |"


def make_table() -> str:
    """The table in Markdown."""
    head = ["| problem | quantity | printed | computed |", "|---|---|---|---|"]
    return "\n".join([*head, *(row.line for row in make_rows())])


def make_rows() -> list[Row]:
    """All rows; some seconds of processor time."""
    return [*_mechanisms(), *_trusses(), *_platform(), *_gimbal(), *_textbook(), *_parts()]


def _mechanisms() -> Iterator[Row]:
    """Ends at the published time, by Runge and Kutta with 2 ms."""
    for case in PUBLISHED:
        if "40" in case.name or "10 s" in case.name:  # tens of seconds: `scripts/bench_multibody` has them
            continue
        found = march(case.build(_STEP), "rk4", _STEP, case.duration).point
        for axis, printed, computed in zip("xyz", case.point, found, strict=True):
            if printed:
                quantity = f"{axis} at {case.duration:g} s, m"
                yield Row(case.name, quantity, printed, float(computed), _MILLIONTH, 1e-5)


def _trusses() -> Iterator[Row]:
    """Least weights of the sizing literature."""
    wanted = "least weight, lb"
    stiff, strong = ten_bar(), ten_bar(np.inf)
    yield Row("ten-bar truss, 25 ksi and 2 in", wanted, 5060.85, find_least_weight(stiff, 10)[0], "{:.2f}", 0.005)
    yield Row("ten-bar truss, 25 ksi alone", wanted, 1593.18, find_least_weight(strong, 10)[0], "{:.2f}", 0.005)
    weight = float(stiff.weights @ LIGHTEST_OF_SECTIONS)
    yield Row("ten-bar truss of 42 sections", "weight of the best design known, lb", 5490.74, weight, "{:.2f}", 0.005)
    share = float(stiff.use(LIGHTEST_OF_SECTIONS).max())
    yield Row("ten-bar truss of 42 sections", "its greatest use of a limit, at most 1", 1.0, share, "{:.3f}", 1e-3)
    yield Row("25-bar truss", wanted, 545.2, find_least_weight(twenty_five_bar(), 1)[0], "{:.1f}", 0.05)
    yield Row("72-bar truss", wanted, 379.6, find_least_weight(seventy_two_bar(), 1)[0], "{:.1f}", 0.05)


def _platform() -> Iterator[Row]:
    """Rusin's platform: base (0, 0), (10, 0), (5, 8), platform 10, 11, 9, legs 13, 12, 11, 9, 6, 7; heights of one corner."""
    side = float(np.hypot(5, 8))
    geometry = octahedron.OctahedronGeometry((10.0, side, side), (10.0, 11.0, 9.0))
    circles, closure = octahedron.closure(geometry, [13, 12, 11, 9, 6, 7])
    modes = closure_modes(closure)
    polynomial = np.real(np.poly(circles.radius[0] * modes.sine[:, 0]))
    name = "Stewart platform 3-3 (Rusin)"
    yield Row(name, "solutions", 16, len(modes.residual), "{:.0f}", 0)
    yield Row(name, "real solutions", 4, int(modes.real.sum()), "{:.0f}", 0)
    yield Row(name, "coefficient of z^14", 964.2509711, float(polynomial[2]), "{:.7f}", 5e-8)
    yield Row(name, "coefficient of z^12", 208296.717, float(polynomial[4]), "{:.3f}", 5e-4)


def _gimbal() -> Iterator[Row]:
    """Williams: a double octahedron moves its face as two hinges, a slide and the same hinges in reverse."""
    module = MirrorModule(0.8, 0.9, 0.1)
    worst_turn = worst_place = 0.0
    for bend, lean, half in ((0.3, -0.2, 0.5), (-0.4, 0.35, 0.6), (0.1, 0.5, 0.55)):
        hinges = Rotation.from_euler("XY", [bend, lean])
        normal = hinges.apply([0, 0, 1])
        R, P = transform(module, np.array([normal[0], normal[1], half]))
        back = Rotation.from_euler("YX", [lean, bend])
        worst_turn = max(worst_turn, float(np.abs((hinges * back).as_matrix() - R).max()))
        worst_place = max(worst_place, float(np.abs((2 * half + module.joint_offset) * normal - P).max()))
    name = "extensible gimbal (Williams)"
    yield Row(name, "greatest difference of a rotation", 0.0, worst_turn, "{:.12f}", 1e-12)
    yield Row(name, "greatest difference of a place, m", 0.0, worst_place, "{:.12f}", 1e-12)


def _textbook() -> Iterator[Row]:
    """Logan's trusses of three bars in a plane and in space, in inches and pounds."""
    places = {"1": (0, 0, 0), "2": (0, 120, 0), "3": (120, 120, 0), "4": (120, 0, 0)}
    supports = {"1": "z", "2": "xyz", "3": "xyz", "4": "xyz"}
    moved, stress = _solve_three(places, supports, [2.0] * 3, 30e6, (0, -10_000, 0))
    name = "plane truss of three bars (Logan)"
    yield Row(name, "displacement in x, in", 0.00414, moved[0], "{:.5f}", 2e-5)
    yield Row(name, "displacement in y, in", -0.0159, moved[1], "{:.4f}", 8e-5)
    for bar, (printed, computed) in enumerate(zip((3965, 1471, -1035), stress, strict=True), 1):
        yield Row(name, f"stress in bar {bar}, psi", printed, computed, "{:.0f}", 7.5)
    places = {"1": (72, 0, 0), "2": (0, 36, 0), "3": (0, 36, 72), "4": (0, 0, -48)}
    supports |= {"1": "y"}
    moved, _ = _solve_three(places, supports, [0.302, 0.729, 0.187], 1.2e6, (0, 0, -1000))
    name = "space truss of three bars (Logan)"
    yield Row(name, "displacement in x, in", -0.072, moved[0], "{:.3f}", 1.1e-3)
    yield Row(name, "displacement in z, in", -0.264, moved[2], "{:.3f}", 4e-3)


def _parts() -> Iterator[Row]:
    """A pipe column and a cylinder of the manuals, as parts of an arm."""
    arm = load_manipulator("arm15")
    tube, cylinder = next(iter(arm.tubes.values())), next(iter(arm.cylinders.values()))
    pipe = tube.model_copy(update={"outer_diameter": 10.75 * INCH, "wall": 0.34 * INCH})  # design wall
    slender = 30 * 12 * INCH / pipe.gyration_radius
    yield Row("Pipe 10 Std of 30 ft, pinned (AISC 360, example E.11)", "KL/r", 98, slender, "{:.0f}", 0.5)
    size = {"bore": 5 * INCH, "rod": 2.5 * INCH, "pressure": 3000 * POUND / INCH**2}
    part = cylinder.model_copy(update=size)
    yield Row("cylinder, 5 in bore, 2.5 in rod, 3000 psi", "push, lbf", 58905, part.push / POUND, "{:.0f}", 0.5)
    yield Row("cylinder, 5 in bore, 2.5 in rod, 3000 psi", "pull, lbf", 44179, part.pull / POUND, "{:.0f}", 0.5)


def _solve_three(
    places: Mapping[str, tuple[float, float, float]],
    supports: Mapping[str, str],
    areas: list[float],
    modulus: float,
    load: tuple[float, float, float],
) -> tuple[list[float], list[float]]:
    """Displacement of the first node and stresses of the bars from it to the three others."""
    nodes = np.array(list(places.values()), float)
    frame = make_framework(list(places), [("1", other) for other in "234"], supports)
    length = np.linalg.norm(nodes[1:] - nodes[0], axis=1)
    moved, bar = deflect_framework(
        frame, nodes, np.array(areas) * modulus / length, np.vstack([load, np.zeros((3, 3))])
    )
    return moved[0].tolist(), (bar / areas).tolist()
