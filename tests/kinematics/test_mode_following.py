import re

import numpy as np
import pytest

from studies.assembly_modes import octahedron_assemblies
from studies.closure_modes import closure_values, solve_cyclic
from studies.octahedron import angles, damped_newton
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.closure import (
    Circles,
    circle_nodes,
    closure_coefficients,
    closure_slopes,
)
from vgtsim.kinematics.mode_following import worst_direction
from vgtsim.kinematics.modules import octahedron as octa

pytestmark = pytest.mark.long

MODULE = octa.OctahedronGeometry((0.80, 0.85, 0.90), (0.70, 0.75, 0.65))
EQUAL = octa.OctahedronGeometry((0.8,) * 3, (0.8,) * 3)
SAME = 1e-9  # rad: two solutions of one mode agree to rounding, different modes differ by hundredths at least
FINE = 1500  # steps of the reference path: half a millimetre each, small beside the distance of the modes


def _home(module):
    R, P = octa.home(module, np.full(6, 0.9))
    return R, P, octa.lengths(module, R, P), angles(module, R, P)


def _gap(first, second):
    return np.max(np.abs(np.angle(np.exp(1j * (first - second)))), axis=-1)


def _fine_path(module, begin, end, phi):
    """The same straight path of the equivalent mechanism in very many small plain Newton steps."""
    a, b = octa.closure(module, begin)[0], octa.closure(module, end)[0]
    for t in np.linspace(0, 1, FINE + 1)[1:]:
        mid = Circles(a.centre + t * (b.centre - a.centre), a.inward, a.radius + t * (b.radius - a.radius))
        C = closure_coefficients(mid, module.top)
        for _ in range(2):
            cosine, sine = np.cos(phi), np.sin(phi)
            p, q = closure_slopes(C, cosine, sine)
            phi = phi - solve_cyclic(p, q, closure_values(C, cosine, sine), p.prod() + q.prod())
    return phi


def test_solution_is_the_one_a_very_fine_path_reaches():
    rng = np.random.default_rng(3)
    R, P, lengths, phi = _home(MODULE)
    for goal in lengths * (1 + rng.uniform(-0.3, 0.3, (6, 6))):
        found = angles(MODULE, *octa.forward(MODULE, goal, (R, P)))
        assert _gap(found, _fine_path(MODULE, lengths, goal, phi)) < SAME


def test_every_mode_stays_itself_and_comes_back():
    rng = np.random.default_rng(5)
    _, _, lengths, _ = _home(MODULE)
    modes = octahedron_assemblies(MODULE, lengths)
    assert len(modes.P) == 16  # all of them real for this module
    goal = lengths * (1 + rng.uniform(-0.002, 0.002, 6))  # a little more and two of them meet and end
    there = octa.forward(MODULE, np.broadcast_to(goal, (16, 6)), (modes.R, modes.P))
    back = octa.forward(MODULE, np.broadcast_to(lengths, (16, 6)), there)
    assert np.max(np.abs(back[0] - modes.R)) < SAME
    assert np.max(np.abs(back[1] - modes.P)) < SAME
    assert np.min(np.linalg.norm(there[1][:, None] - there[1], axis=-1) + np.eye(16)) > 0.001


def test_plain_newton_jumps_where_following_does_not():
    rng = np.random.default_rng(0)
    R, P, lengths, phi = _home(MODULE)
    goals = lengths * (1 + rng.uniform(-0.4, 0.4, (400, 6)))
    _, C = octa.closure(MODULE, goals)
    with np.errstate(all="ignore"):
        plain, history = damped_newton(C, MODULE.top, np.broadcast_to(phi, (400, 3)), 0.9, 60)
    jumped = 0
    for goal, there, error in zip(goals, plain, history[-1], strict=True):
        if not error < SAME:
            continue
        try:
            jumped += bool(_gap(angles(MODULE, *octa.forward(MODULE, goal, (R, P))), there) > 1e-6)
        except AssemblyError:
            jumped += 1
    assert jumped >= 5


def test_crossing_a_singularity_is_refused_with_singular_value_and_member():
    R, P, _, _ = _home(MODULE)
    goal = [0.5, 0.5, 0.5, 1.2, 1.2, 1.2]
    assert octahedron_assemblies(MODULE, goal).count == 16  # the lengths as such can be solved
    with pytest.raises(AssemblyError, match=r"smallest singular value .*, longeron l[1-6]") as caught:
        octa.forward(MODULE, goal, (R, P))
    found = re.search(r"smallest singular value ([0-9.e-]+)", str(caught.value))
    assert found is not None
    assert float(found.group(1)) < 0.01 * octa.singularity(MODULE, R, P)[0]


def test_one_bad_member_of_a_batch_is_not_passed_over():
    R, P, lengths, _ = _home(MODULE)
    with pytest.raises(AssemblyError, match="the mode of the start ends"):
        octa.forward(MODULE, [lengths, [0.5, 0.5, 0.5, 1.2, 1.2, 1.2]], (R, P))


def test_worst_direction_names_the_row_that_is_lost():
    J = np.diag([1.0, 0.01, 2.0])
    assert worst_direction(J) == (pytest.approx(0.01), 1)
    assert worst_direction(J, [100.0, 0.001, 1.0]) == (pytest.approx(0.01), 0)


@pytest.mark.parametrize("damping", [0.9, 1.0])
def test_four_damped_iterations_leave_a_ten_thousandth(damping):
    """Section 3.4.1, sigma = 0.90: each iteration divides the error by ten; undamped, four leave rounding."""
    rng = np.random.default_rng(0)
    _, _, lengths, phi = _home(EQUAL)
    _, C = octa.closure(EQUAL, lengths * (1 + rng.uniform(-0.01, 0.01, (1000, 6))))
    _, history = damped_newton(C, np.full((1000, 3), 0.8), np.broadcast_to(phi, (1000, 3)), damping, 4)
    if damping == 1.0:
        assert np.max(history[4]) < 1e-15
        return
    assert np.max(history[4]) < 2e-6  # m
    assert np.allclose(history[1:] / history[:-1], 1 - damping, atol=0.02)


def test_closure_coefficients_give_the_distances():
    rng = np.random.default_rng(2)
    circles, C = octa.closure(MODULE, rng.uniform(0.8, 1.0, (20, 6)))
    phi = rng.uniform(-np.pi, np.pi, (20, 3))
    n = circle_nodes(circles, phi)
    square = np.sum((n[:, [1, 2, 0]] - n) ** 2, axis=-1) - np.square(MODULE.top)
    assert np.allclose(closure_values(C, np.cos(phi.T), np.sin(phi.T)).T, square, atol=1e-14)
