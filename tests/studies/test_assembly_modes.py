"""Counts of assemblies: 2, 16, 256, and the products of 4.4 and 4.5."""

import numpy as np
import pytest
from scipy.optimize import root

from studies import assembly_modes as modes
from studies import tetrahedron as tetra
from studies.closure_modes import closure_modes, closure_values
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.modules import octahedron as octa
from vgtsim.kinematics.modules import two_cells as double
from vgtsim.kinematics.roll_pitch_yaw import roll_pitch_yaw, rotation

CLOSES = 1e-12  # pure: closure error over the sum of the sizes of its terms
CLOSES_REAL = 1e-9  # m: lengths of a real assembly, whose nodes may sit near a double solution
MATCH = 1e-6  # rad: the same solution found two ways, one of them near a double root at worst
SEEDS = range(12)


def _octahedron(seed):
    rng = np.random.default_rng(seed)
    module = octa.OctahedronGeometry(tuple(rng.uniform(0.7, 1.0, 3)), tuple(rng.uniform(0.6, 1.0, 3)))
    R, P = octa.home(module, np.full(6, 0.9))
    rpy = roll_pitch_yaw(R) + rng.uniform(-0.3, 0.3, 3)
    pose = rotation(rpy), P + rng.uniform(-0.15, 0.15, 3)
    return module, octa.lengths(module, *pose), pose


def _double(seed, offset=0.0):
    rng = np.random.default_rng(seed)
    module = double.TwoCellGeometry(
        tuple(rng.uniform(0.75, 0.9, 3)),
        tuple(rng.uniform(0.65, 0.8, 3)),
        tuple(rng.uniform(0.8, 0.95, 12)),
        offset,
    )
    return module, rng.uniform(0.8, 1.1, 3)


def test_tetrahedron_has_two_assemblies_mirrored_in_the_base():
    found = modes.tetrahedron_assemblies(tetra.HingeModule(0.9, 0.8), 0.7)
    assert found.count == 2
    assert len(found.P) == 2
    assert np.allclose(found.P[0] * [1, 1, -1], found.P[1])
    assert np.allclose(tetra.inverse(tetra.HingeModule(0.9, 0.8), found.inputs[:, 0]), 0.7)


def test_tetrahedron_beyond_its_reach_has_two_complex_ones_and_none_real():
    module = tetra.HingeModule(0.9, 0.8)
    found = modes.tetrahedron_assemblies(module, 2 * module.height + 0.1)
    assert (found.count, len(found.P)) == (2, 0)
    assert modes.tetrahedron_assemblies(module, 2 * module.height).count == 1


@pytest.mark.parametrize("seed", SEEDS)
def test_octahedron_has_sixteen_assemblies_with_generic_lengths(seed):
    module, lengths, pose = _octahedron(seed)
    _, C = octa.closure(module, lengths)
    solutions = closure_modes(C)
    assert len(solutions.residual) == 16
    assert not solutions.flexible
    assert np.max(solutions.residual) < CLOSES
    found = modes.octahedron_assemblies(module, lengths)
    assert np.max(np.abs(octa.lengths(module, found.R, found.P) - lengths)) < CLOSES_REAL
    assert np.min(np.linalg.norm(found.P - pose[1], axis=-1)) < CLOSES_REAL  # the pose the lengths came from


@pytest.mark.parametrize("seed", SEEDS)
def test_complex_assemblies_come_in_conjugate_and_mirrored_pairs(seed):
    module, lengths, _ = _octahedron(seed)
    s = closure_modes(octa.closure(module, lengths)[1])
    z = np.concatenate([s.cosine, s.sine], axis=-1)
    scale = np.maximum(1.0, np.max(np.abs(z), axis=-1))
    for partner in (z.conj(), z * [1, 1, 1, -1, -1, -1]):
        gap = np.min(np.max(np.abs(partner[:, None] - z), axis=-1), axis=1)
        assert np.max(gap / scale) < MATCH
    assert s.real.sum() % 2 == 0
    assert 0 < s.real.sum() <= 16


def test_complex_solutions_satisfy_the_trigonometric_closure_at_complex_angles():
    module, lengths, _ = _octahedron(0)
    _, C = octa.closure(module, lengths)
    s = closure_modes(C)
    assert (~s.real).any()
    phi = -1j * np.log(s.cosine + 1j * s.sine)
    assert np.max(np.abs(closure_values(C[..., None], np.cos(phi.T), np.sin(phi.T)))) < 1e-10


def test_all_real_solutions_that_random_starts_reach_are_in_the_list():
    """A second route: a general root finder from 300 random starts finds all of them and nothing new."""
    module, lengths, _ = _octahedron(1)
    _, C = octa.closure(module, lengths)
    known = closure_modes(C).phi
    rng = np.random.default_rng(0)
    reached = set()
    for start in rng.uniform(-np.pi, np.pi, (300, 3)):
        found = root(lambda p: closure_values(C, np.cos(p), np.sin(p)), start, tol=1e-13)
        if np.max(np.abs(found.fun)) < 1e-10:
            gap = np.max(np.abs(np.angle(np.exp(1j * (known - found.x)))), axis=-1)
            assert gap.min() < MATCH
            reached.add(int(np.argmin(gap)))
    assert len(reached) == len(known)


def test_sixteen_real_assemblies_exist():
    module = octa.OctahedronGeometry((1.0,) * 3, (1.25,) * 3)
    assert len(modes.octahedron_assemblies(module, np.full(6, 1.2)).P) == 16


@pytest.mark.parametrize("seed", range(6))
def test_double_octahedron_has_256_assemblies_with_generic_lengths(seed):
    """Refutes the 32 of section 4.3.2 and 4.5: every lower assembly goes with every upper one."""
    module, actuators = _double(seed, offset=0.05 * (seed % 2))
    lower, upper = modes.double_octahedron_cells(module, actuators)
    assert len(lower.residual) == len(upper.residual) == 16
    assert max(lower.residual.max(), upper.residual.max()) < CLOSES
    found = modes.double_octahedron_assemblies(module, actuators)
    assert found.count == 256
    assert len(found.P) == lower.real.sum() * upper.real.sum()
    _check_double(module, actuators, found)


def _check_double(module, actuators, found):
    """Every member of every real assembly has its length, and no two assemblies are the same."""
    n = double.nodes(module, found.inputs)
    legs = np.linalg.norm(n[:, 6 + double.UPPER_LEGS[:, 1]] - n[:, 3 + double.UPPER_LEGS[:, 0]], axis=-1)
    lower = np.linalg.norm(n[:, octa.LEGS[:, 1]] - module.base_nodes[octa.LEGS[:, 0]], axis=-1)
    assert np.max(np.abs(legs - module.longerons[6:])) < CLOSES_REAL
    assert np.max(np.abs(lower - module.longerons[:6])) < CLOSES_REAL
    for triangle, sides in ((n[:, :3], actuators), (n[:, 6:], module.top)):
        edges = np.linalg.norm(triangle[:, [1, 2, 0]] - triangle, axis=-1)
        assert np.max(np.abs(edges - sides)) < CLOSES_REAL
    flat = n.reshape(len(n), -1)
    assert np.min(np.linalg.norm(flat[:, None] - flat, axis=-1) + 1e3 * np.eye(len(n))) > 1e-3


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_symmetric_module_has_sixteen_mirrored_assemblies_among_its_256(offset):
    module = double.TwoCellGeometry((1.0,) * 3, (1.0,) * 3, (1.05,) * 12, offset)
    actuators = [0.95, 1.08, 1.13]
    every, mirrored = (
        modes.double_octahedron_assemblies(module, actuators),
        modes.mirrored_assemblies(module, actuators),
    )
    assert (every.count, mirrored.count) == (256, 16)
    for P, R in zip(mirrored.P, mirrored.R, strict=True):
        gap = np.linalg.norm(every.P - P, axis=-1) + np.linalg.norm(every.R - R, axis=(-2, -1))
        assert gap.min() < 1e-8


def test_solutions_at_infinity_are_not_counted():
    """Base 1, longerons 1.1, actuators 1.2: six of sixteen lie at infinity; a hair beside they come back."""
    module = octa.OctahedronGeometry((1.0,) * 3, (1.2,) * 3)
    assert modes.octahedron_assemblies(module, np.full(6, 1.1)).count == 10
    assert modes.octahedron_assemblies(octa.OctahedronGeometry((1.0,) * 3, (1.201,) * 3), np.full(6, 1.1)).count == 16


@pytest.mark.parametrize("longeron", [0.9, 1.0, 1.2])
def test_equal_triangles_and_equal_longerons_leave_a_flexible_octahedron(longeron):
    """Bricard's line-symmetric octahedron, opposite edges equal: isolated ones beside a curve."""
    module = octa.OctahedronGeometry((1.0,) * 3, (1.0,) * 3)
    found = modes.octahedron_assemblies(module, np.full(6, longeron))
    assert found.flexible
    assert np.max(np.abs(octa.lengths(module, found.R, found.P) - longeron)) < CLOSES_REAL
    _, P = octa.forward(module, np.full(6, longeron))
    assert np.min(np.linalg.norm(found.P - P, axis=-1)) < CLOSES_REAL
    _, C = octa.closure(module, np.full(6, longeron))
    free = [_closes_with(C, phi) for phi in np.linspace(0.3, 0.6, 7)]
    assert max(free) < 1e-12  # any angle of the first circle closes, with two others to match
    _, other = octa.closure(octa.OctahedronGeometry((1.0,) * 3, (1.01,) * 3), np.full(6, longeron))
    assert max(_closes_with(other, phi) for phi in np.linspace(0.3, 0.6, 7)) > 1e-3


def _closes_with(C, phi):
    """Least closure error of the other two circles, at (complex) angles that meet the first's closures."""
    c, s = np.cos(phi), np.sin(phi)
    a, b, g, e, f = C
    # p cos + q sin + r = 0 for the second circle from the first closure, for the third from the third
    second = _trigonometric(g[0] + e[0] * c, f[0] * s, a[0] + b[0] * c)
    third = _trigonometric(b[2] + e[2] * c, f[2] * s, a[2] + g[2] * c)
    pairs = [(c2, s2, c3, s3) for c2, s2 in second for c3, s3 in third]
    third_edge = [a[1] + b[1] * c2 + c3 * (g[1] + e[1] * c2) + f[1] * s2 * s3 for c2, s2, c3, s3 in pairs]
    return min(abs(error) for error in third_edge)


def _trigonometric(p, q, r):
    x = np.roots([r - p, 2 * q, r + p]).astype(complex)
    return [((1 - t**2) / (1 + t**2), 2 * t / (1 + t**2)) for t in x]


def test_counts_multiply_along_the_chain():
    """4.4 holds; 4.5 gives 32,768 for three double octahedra only with its 32 for each."""
    assert modes.count_assemblies([2, 16, 256]) == 2 * 16 * 256
    assert modes.count_assemblies([32] * 3) == 32_768
    counts = [modes.double_octahedron_assemblies(*_double(seed)).count for seed in range(3)]
    assert modes.count_assemblies(counts) == 16_777_216
    assert modes.count_assemblies([16] * 3) == 4096  # with the mirror imposed on all three


def test_impossible_lengths_are_refused():
    module, _ = _double(0)
    with pytest.raises(AssemblyError, match="face triangle"):
        modes.double_octahedron_assemblies(module, [0.5, 0.5, 1.2])
