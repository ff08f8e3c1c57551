import numpy as np
import pytest

from studies import double_octahedron as symmetric
from studies import double_octahedron_goals as goals
from vgtsim.errors import AssemblyError
from vgtsim.kinematics.modules import two_cells as general
from vgtsim.kinematics.modules.octahedron import LEGS
from vgtsim.kinematics.roll_pitch_yaw import roll_pitch_yaw, rotation

ROUNDING = 1e-12  # m or rad: rounding of two closures in a row
STEP, DIFFERENCE = 1e-6, 1e-7  # central differences of smooth functions of order one
EXACT = 1e-10  # m: error of a goal that can be met, after the iteration
SIDE, LONGERON = 0.8, 0.85


def _module(seed, offset=0.05):
    rng = np.random.default_rng(seed)
    return general.TwoCellGeometry((0.80, 0.85, 0.90), (0.75, 0.70, 0.65), tuple(rng.uniform(0.8, 0.95, 12)), offset)


def _states(module, count, seed=0):
    return general.forward_lengths(module, np.random.default_rng(seed).uniform(0.85, 1.05, (count, 3)))


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_all_members_of_a_conventional_solution_have_their_lengths(offset):
    """3.28 to 3.46."""
    module = _module(1, offset)
    actuators = np.random.default_rng(1).uniform(0.85, 1.05, (200, 3))
    n = general.nodes(module, general.forward_lengths(module, actuators))
    lower = np.linalg.norm(n[:, LEGS[:, 1]] - module.base_nodes[LEGS[:, 0]], axis=-1)
    upper = np.linalg.norm(n[:, 6 + general.UPPER_LEGS[:, 1]] - n[:, 3 + general.UPPER_LEGS[:, 0]], axis=-1)
    assert np.allclose(np.concatenate([lower, upper], axis=-1), module.longerons, atol=ROUNDING, rtol=0)
    for triangle, sides in ((n[:, :3], actuators), (n[:, 3:6], actuators), (n[:, 6:], module.top)):
        assert np.allclose(np.linalg.norm(triangle[:, [1, 2, 0]] - triangle, axis=-1), sides, atol=ROUNDING)


def test_conventional_and_canonical_solutions_agree():
    module = _module(2)
    states = _states(module, 100)
    assert np.allclose(general.forward(module, states[:, :3]), states, atol=ROUNDING)
    lengths = general.actuator_lengths(module, states)
    assert np.allclose(
        general.forward_lengths(module, lengths, general.home(module, [0.95] * 3)), states, atol=ROUNDING
    )


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_symmetric_dimensions_give_the_symmetric_module(offset):
    """3.41 with primed nodes gives 3.54 with P_sym on the lower nodes n4 to n6."""
    rng = np.random.default_rng(0)
    plain = symmetric.MirrorModule(SIDE, LONGERON, offset)
    module = general.TwoCellGeometry((SIDE,) * 3, (SIDE,) * 3, (LONGERON,) * 12, offset)
    midplane = np.c_[rng.uniform(-0.2, 0.2, (200, 2)), rng.uniform(0.4, 0.6, 200)]
    state = general.forward_lengths(module, symmetric.lengths(plain, midplane))
    R, P = goals.transform(module, state)
    assert np.allclose(state[:, :3], symmetric.angles(plain, midplane), atol=ROUNDING)
    assert np.allclose(R, symmetric.transform(plain, midplane)[0], atol=ROUNDING)
    assert np.allclose(P, symmetric.transform(plain, midplane)[1], atol=ROUNDING)
    angular, linear = symmetric.twist(plain, midplane)
    lengths, block = symmetric.length_jacobian(plain, midplane)
    assert np.allclose(goals.length_jacobian(module, state)[0], lengths, atol=ROUNDING)
    chain = np.concatenate([linear, angular], axis=-2) @ np.linalg.inv(block)
    assert np.allclose(goals.length_jacobian(module, state)[1], chain, atol=1e-10)


def test_mirroring_in_the_plane_of_the_midpoints_must_not_add_the_offset_again():
    """3.54 read with P_sym at the midpoints of n4 n4' (as the text before 3.52 offers) is wrong by Ljo."""
    offset = 0.05
    module = general.TwoCellGeometry((SIDE,) * 3, (SIDE,) * 3, (LONGERON,) * 12, offset)
    n = general.nodes(module, general.forward_lengths(module, [1.0, 0.95, 1.05]))
    U = np.cross(n[1] - n[0], n[2] - n[0])
    U /= np.linalg.norm(U)
    below, between = n[0], (n[0] + n[3]) / 2
    base = module.base_nodes[0]
    from_lower = base + (2 * ((below - base) @ U) + offset) * U
    from_middle = base + 2 * ((between - base) @ U) * U
    wrong = base + (2 * ((between - base) @ U) + offset) * U
    assert np.allclose(from_lower, n[6], atol=ROUNDING)
    assert np.allclose(from_middle, n[6], atol=ROUNDING)
    assert np.linalg.norm(wrong - n[6]) == pytest.approx(offset)


def _rate(module, plus, minus, middle):
    (Ra, Pa), (Rb, Pb) = goals.transform(module, plus), goals.transform(module, minus)
    W = (Ra - Rb) / (2 * STEP) @ np.swapaxes(goals.transform(module, middle)[0], -1, -2)
    turn = np.stack([W[..., 2, 1], W[..., 0, 2], W[..., 1, 0]], axis=-1)
    return np.concatenate([(Pa - Pb) / (2 * STEP), turn], axis=-1)


@pytest.mark.parametrize("offset", [0.0, 0.08])
def test_canonical_jacobian_matches_central_differences(offset):
    module = _module(3, offset)
    states = _states(module, 50)
    J, dl = general.jacobian(module, states), general.angle_jacobian(module, states)
    for k in range(3):
        step = STEP * np.eye(3)[k]
        plus, minus = (general.forward(module, states[:, :3] + s * step, states) for s in (1, -1))
        assert np.allclose(_rate(module, plus, minus, states), J[..., k], atol=DIFFERENCE)
        change = general.actuator_lengths(module, plus) - general.actuator_lengths(module, minus)
        assert np.allclose(change / (2 * STEP), dl[..., k], atol=DIFFERENCE)


@pytest.mark.parametrize("offset", [0.0, 0.08])
def test_conventional_jacobian_matches_central_differences(offset):
    module = _module(4, offset)
    states = _states(module, 50)
    lengths, J = goals.length_jacobian(module, states)
    for k in range(3):
        step = STEP * np.eye(3)[k]
        plus, minus = (general.forward_lengths(module, lengths + s * step, states) for s in (1, -1))
        assert np.allclose(_rate(module, plus, minus, states), J[..., k], atol=DIFFERENCE * np.max(np.abs(J)))


def _wanted(module, states):
    R, P = goals.transform(module, states)
    rpy = roll_pitch_yaw(R)
    extension = np.linalg.norm(P, axis=-1)
    return {
        "position": goals.Position(P),
        "angles and z": goals.AnglesAndCoordinate(rpy[:, 0], rpy[:, 1], 2, P[:, 2]),
        "normal": goals.NormalAndExtension(R[:, :, 2], extension),
        "pose": goals.Pose(R, P),
        "position and normal": [goals.Position(P), goals.NormalAndExtension(R[:, :, 2], extension)],
    }


@pytest.mark.parametrize("kind", ["position", "angles and z", "normal", "pose", "position and normal"])
def test_inverse_after_forward_is_identity(kind):
    module = _module(5)
    states = _states(module, 60)
    found = goals.inverse(module, _wanted(module, states)[kind], general.home(module, [0.95] * 3))
    assert np.max(found.residual) < EXACT
    assert np.max(np.abs(found.state - states)) < 1e-8


@pytest.mark.parametrize("axis", [0, 1])
def test_two_angles_and_a_lateral_coordinate_can_be_met(axis):
    """The third parameter may be X or Y too, away from the straight pose."""
    module = _module(5)
    states = general.forward_lengths(module, np.array([0.85, 1.05, 0.9]) + np.linspace(0, 0.05, 5)[:, None])
    R, P = goals.transform(module, states)
    rpy = roll_pitch_yaw(R)
    goal = goals.AnglesAndCoordinate(rpy[:, 0], rpy[:, 1], axis, P[:, axis])
    start = general.forward(module, states[:, :3] + [0.01, -0.01, 0.01], states)
    found = goals.inverse(module, goal, start)
    assert np.max(found.residual) < EXACT


def test_symmetric_module_agrees_with_its_closed_form_inverses():
    plain = symmetric.MirrorModule(SIDE, LONGERON, 0.05)
    module = general.TwoCellGeometry((SIDE,) * 3, (SIDE,) * 3, (LONGERON,) * 12, 0.05)
    start = general.home(module, [0.95] * 3)
    point = np.array([0.15, -0.1, 0.95])
    state = goals.inverse(module, goals.Position(point), start).state
    wanted = symmetric.lengths(plain, symmetric.inverse_position(plain, point))
    assert np.allclose(general.actuator_lengths(module, state), wanted, atol=EXACT)
    Q = np.array([0.3, 0.2, np.sqrt(1 - 0.13)])
    state = goals.inverse(module, goals.NormalAndExtension(Q, np.array(1.0)), start).state
    wanted = symmetric.lengths(plain, symmetric.inverse_gimbal(plain, Q, np.array(1.0)))
    assert np.allclose(general.actuator_lengths(module, state), wanted, atol=EXACT)


def test_over_specified_goal_gives_the_nearest_state_and_its_residual():
    module = _module(6)
    state = _states(module, 1)[0]
    R, P = goals.transform(module, state)
    goal = goals.Pose(R @ rotation([0.0, 0.0, 0.05]), P + np.array([0.02, -0.01, 0.01]))
    found = goals.inverse(module, goal, state)
    assert found.residual > 0.005
    assert np.max(np.abs(found.slope)) < 1e-8
    rng = np.random.default_rng(0)
    for step in 0.02 * rng.standard_normal((40, 3)):  # no neighbour is nearer
        other = general.forward(module, found.state[:3] + step, found.state)
        R2, P2 = goals.transform(module, other)
        square = np.sum((P2 - goal.P) ** 2) + module.twist_units[3] ** 2 / 2 * np.sum((R2 - goal.R) ** 2)
        assert square > found.residual**2


def test_unreachable_position_keeps_its_residual_and_its_mode():
    module = _module(6)
    start = general.home(module, [0.95] * 3)
    found = goals.inverse(module, goals.Position([0.0, 0.0, 3.0]), start)
    assert found.residual > 1.0
    assert np.all((found.state[3:] > 0) & (found.state[3:] < np.pi))


@pytest.mark.parametrize(
    ("lengths", "pattern"),
    [
        ([0.8, 0.8, 1.8], "face triangle"),
        ([1.75, 0.61, 1.52], "longerons 7 and 10, 0.9242 m and 0.8041 m"),
        ([1.27, 0.48, 0.81], "lower cell .* ends 0.9.* smallest singular value .*, actuator l[123]"),
        ([1.71, 1.40, 1.43], "upper cell .* ends 0.9.* smallest singular value .*, longeron L10"),
    ],
)
def test_lengths_beyond_a_triangle_or_a_singularity_are_refused_by_member(lengths, pattern):
    module = _module(1)
    with pytest.raises(AssemblyError, match=pattern):
        general.forward_lengths(module, lengths, general.home(module, [0.95] * 3))


@pytest.mark.long
def test_one_long_step_ends_where_many_short_ones_do():
    """The upper cell's certificate is exact to third order only; this is its check."""
    module = _module(1)
    start = general.home(module, [0.95] * 3)
    begin = general.actuator_lengths(module, start)
    for end in np.random.default_rng(4).uniform(0.6, 1.3, (10, 3)):
        try:
            once = general.forward_lengths(module, end, start)
        except AssemblyError:
            continue
        state = start
        for t in np.linspace(0, 1, 61)[1:]:
            state = general.forward_lengths(module, begin + t * (end - begin), state)
        assert np.allclose(once, state, atol=1e-10)


@pytest.mark.long
def test_singular_value_falls_to_nothing_at_the_refusal():
    module = _module(1)
    start = general.home(module, [0.95] * 3)
    begin, end = general.actuator_lengths(module, start), np.array([1.27, 0.48, 0.81])
    far, _ = general.singularity(module, start)
    reached, state = 0.0, start
    for t in np.linspace(0, 1, 401)[1:]:
        try:
            state = general.forward_lengths(module, begin + t * (end - begin), state)
        except AssemblyError:
            break
        reached = t
    near, member = general.singularity(module, state)
    assert 0.9 < reached < 1.0
    assert near < 0.1 * far
    assert member == "actuator l3"


def test_only_the_symmetric_module_keeps_from_turning_about_z():
    """Section 3.5.2 says so of the geometry in general; with different longerons it turns."""
    actuators = np.random.default_rng(0).uniform(0.85, 1.05, (100, 3))

    def turn(longerons):
        module = general.TwoCellGeometry((SIDE,) * 3, (SIDE,) * 3, longerons)
        R = goals.transform(module, general.forward_lengths(module, actuators))[0]
        return np.abs(R[:, 1, 0] - R[:, 0, 1]) / 2

    mirrored = (0.9, 0.9, 0.9, 0.8, 0.8, 0.8, 0.8, 0.8, 0.8, 0.9, 0.9, 0.9)
    repeated = (0.9, 0.9, 0.9, 0.8, 0.8, 0.8, 0.9, 0.9, 0.9, 0.8, 0.8, 0.8)
    assert np.max(turn(mirrored)) < ROUNDING
    assert np.min(turn(repeated)) > 0.3
