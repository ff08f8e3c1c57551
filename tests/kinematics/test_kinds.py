"""Chains of any mix of modules: Jacobians, lengths, no silent change of assembly, statics, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError

from studies.assembly_modes import octahedron_assemblies
from vgtsim.description import Manipulator, load_manipulator
from vgtsim.errors import AssemblyError, DescriptionError, SingularityError, TrussError
from vgtsim.kinematics import Chain, check_strokes, hanging_mount, sample_inputs
from vgtsim.kinematics.modules.octahedral import octahedron_geometry
from vgtsim.kinematics.roll_pitch_yaw import pose_parameters
from vgtsim.kinematics.workspace import singular_values
from vgtsim.statics import diagnose

ROOT = Path(__file__).parents[2] / "models"
NAMES = sorted(path.stem for path in ROOT.glob("*/*.toml"))
EXACT = 1e-10  # m: rounding over a chain of twenty modules
DIFFERENCE = 1e-7  # central differences with a step of 1e-6
STEP = 1e-6


def load(name: str) -> Manipulator:
    return load_manipulator(ROOT / name / f"{name}.toml")


@pytest.fixture(scope="module", params=NAMES)
def chain(request):
    return Chain(load(request.param), hanging_mount(9.0))


@pytest.fixture(scope="module")
def q(chain):
    return sample_inputs(chain, 3, seed=4)


def test_every_shipped_kind_is_here():
    kinds = {"tetra4", "stewart", "octahedron_double", "octahedron_offset", "octahedron_general", "mixed"}
    kinds |= {"arm9", "arm15", "arm30", "arm60"}
    assert kinds <= set(NAMES)


def test_truss_is_isostatic(chain, q):
    assert len(chain.truss.bars) == 3 * np.sum(chain.truss.group > 0)
    for row in q:
        assert diagnose(chain.truss, chain.nodes(row)) > 1e-4


def test_every_passive_member_keeps_its_length(chain, q):
    truss, nodes = chain.truss, chain.nodes(np.stack([chain.straight, *q]))
    length = np.linalg.norm(nodes[:, truss.ends[:, 1]] - nodes[:, truss.ends[:, 0]], axis=-1)
    passive = np.setdiff1d(np.arange(len(truss.members)), truss.actuated)
    assert np.ptp(length[:, passive], axis=0).max(initial=0.0) < EXACT
    lengths = chain.lengths(np.stack([chain.straight, *q]))
    assert np.allclose(length[:, truss.actuated], lengths, atol=EXACT)


def test_conventional_forward_undoes_lengths(chain, q):
    again = chain.inputs_from_lengths(chain.lengths(q))
    assert np.allclose(again, q, atol=EXACT)
    assert np.allclose(chain.inputs_from_lengths(chain.lengths(q), q[::-1]), q, atol=EXACT)


def test_canonical_jacobians_agree_with_differences(chain, q):
    position, direction, J = chain.tool_jacobian(q[0])
    nodes, dn = chain.node_jacobian(q[0])
    assert np.allclose(nodes, chain.nodes(q[0]), atol=EXACT)
    steps = STEP * np.eye(q[0].size)
    (p1, d1), (p0, d0) = chain.tool(q[0] + steps), chain.tool(q[0] - steps)
    assert np.allclose((p1 - p0).T / (2 * STEP), J[:3], atol=DIFFERENCE)
    assert np.allclose((d1 - d0) / (2 * STEP), np.cross(J[3:].T, direction), atol=DIFFERENCE)
    difference = (chain.nodes(q[0] + steps) - chain.nodes(q[0] - steps)) / (2 * STEP)
    assert np.allclose(np.moveaxis(difference, 0, -1), dn, atol=DIFFERENCE)
    assert np.allclose(position, chain.tool(q[0])[0])


def test_conventional_jacobian_agrees_with_differences_in_length(chain, q):
    lengths = chain.lengths(q[0])
    steps = STEP * np.eye(lengths.size)
    moved = lengths + steps * np.array([1, -1])[:, None, None]
    ends = chain.tool(chain.inputs_from_lengths(moved, q[0]))[0]
    assert np.allclose((ends[0] - ends[1]).T / (2 * STEP), chain.conventional_jacobian(q[0])[:3], atol=1e-6)


def test_lengths_follow_the_inputs_at_their_jacobian(chain, q):
    rates = chain.input_rates(q[0])
    dense = chain.length_jacobian(q[0])[1]
    assert np.allclose(dense @ rates, np.eye(rates.shape[1]), atol=1e-9)


def test_batches_agree_with_single_configurations(chain, q):
    pairs = (chain.nodes, chain.jacobian, chain.lengths, chain.input_rates, lambda x: chain.frames(x)[0])
    for method in pairs:
        assert np.allclose(method(q), [method(row) for row in q], atol=EXACT)


def test_wrong_number_of_inputs_is_refused(chain):
    with pytest.raises(ValueError, match="inputs of shape"):
        chain.nodes(np.zeros((2, 7)))


def test_a_pose_outside_the_subspace_of_static_longerons_names_the_module():
    chain = Chain(load("mixed"), hanging_mount(9.0))
    off = np.array(chain.straight)
    off[-4] += 0.01
    with pytest.raises(AssemblyError, match=r"w .*3-dimensional subspace: static longeron") as caught:
        chain.lengths(off)
    assert caught.value.residual > 1e-4


def test_every_assembly_stays_itself():
    """From each real assembly of the same lengths the forward solver moves within that assembly, never to another."""
    chain = Chain(load("stewart"), hanging_mount(9.0))
    q = sample_inputs(chain, 1, seed=2)[0]
    (module,) = chain.manipulator.modules
    found = octahedron_assemblies(octahedron_geometry(module, chain.manipulator.face_side), chain.lengths(q))
    modes = pose_parameters(found.R, found.P)
    assert np.sum(np.linalg.norm(modes - q, axis=-1) < 1e-6) == 1
    assert len(modes) > 1
    moved = chain.inputs_from_lengths(np.tile(chain.lengths(q) + 1e-4, (len(modes), 1)), modes)
    assert np.abs(moved - modes).max() < 0.05
    assert np.allclose(chain.lengths(moved), chain.lengths(q) + 1e-4, atol=EXACT)


@pytest.mark.parametrize(
    ("name", "lengths", "member"),
    [
        ("tetra4", [0.6, 1.4, 0.6, 0.6], "h2/actuator/1"),
        ("stewart", [0.6, 1.5, 0.6, 1.5, 0.6, 1.5], "p/"),
        ("octahedron_double", [[1.0, 1.0, 1.9]], "m/actuator"),
        ("octahedron_general", [1.5, 1.5, 0.8], "m/longeron/7"),
    ],
)
def test_lengths_beyond_a_singularity_are_refused_with_value_and_member(name, lengths, member):
    chain = Chain(load(name), hanging_mount(9.0))
    with pytest.raises(SingularityError) as caught:
        chain.inputs_from_lengths(lengths)
    assert caught.value.member.startswith(member)
    assert caught.value.value < 0.05
    assert 0 <= caught.value.reached < 1


def changed(name: str, *edits: tuple[int, dict]) -> Manipulator:
    data = load(name).model_dump()
    modules = list(data["modules"])
    for index, updates in edits:
        modules[index] = modules[index] | updates
    data["modules"] = modules
    return Manipulator.model_validate(data)


@pytest.mark.parametrize(
    ("name", "edits", "words"),
    [
        ("mixed", (6, {"top": [0.7, 0.7, 0.7]}), "faces do not match: the base of w has sides .* the top of s4"),
        ("stewart", (0, {"top": [0.7, 0.7, 0.7]}), "faces do not match: the tip plate"),
        ("tetra4", (1, {"hinge": 2.0}), "module h1: a face with sides 0.7919, 0.7919, 2.*does not close"),
        ("tetra4", (1, {"straight": 2.4}), "module h1: straight pose needs"),
        ("stewart", (0, {"straight": 2.0}), "module p: straight length 2 m outside the stroke of l400"),
        ("stewart", (0, {"longerons": [{"tube": "t200x188", "length": 1.0}] * 6}), "one to six longerons"),
        ("stewart", (0, {"longerons": [{"tube": "t200x188"}] * 6}), "a tube and its length"),
        ("tetra4", (0, {"transform": np.eye(4).tolist()}), "either a length or a measured transform"),
        (
            "octahedron_general",
            (0, {"top": [0.7, 0.8, 0.75]}),
            "faces do not match: the tip plate .* top of m 0.7, 0.8",
        ),
        ("octahedron_general", (0, {"base": [0.7, 0.8, 1.6]}), "module m: a face with sides 0.7, 0.8, 1.6 m does not"),
        ("octahedron_general", (0, {"longerons": [0.8] * 11}), "at least 12"),
        ("octahedron_general", (0, {"longerons": [0.8] * 11 + [0.0]}), "module m: longeron L12 of 0 m"),
        ("octahedron_general", (0, {"straight": 0.5}), "module m: straight length 0.5 m outside the stroke of c400"),
        ("octahedron_offset", (0, {"block": None}), "module m: joint_offset of 0.127 m with no block; .* go together"),
        ("octahedron_double", (0, {"block": "b250"}), "module m: joint_offset of 0 m with block 'b250'"),
        ("octahedron_offset", (0, {"block": "b25"}), "modules.0.block = 'b25': no such name; did you mean 'b250'"),
        ("octahedron_offset", (0, {"joint_offset": 0.07}), "joint offset of 0.07 m .* above their diameter, 0.0762 m"),
    ],
)
def test_descriptions_of_impossible_modules_are_named(name, edits, words):
    with pytest.raises(ValidationError, match=words):
        changed(name, edits)


def test_a_hinge_that_passes_its_flat_pose_is_refused():
    data = load("tetra4").model_dump()
    data["cylinders"]["h500"] |= {"retracted": 0.9, "stroke": 0.6}
    with pytest.raises(ValidationError, match=r"h500 ends at 1\.5 m and crosses the singular flat pose .* 1\.372 m"):
        Manipulator.model_validate(data)


def test_a_tip_plate_on_a_hinge_is_refused():
    data = load("tetra4").model_dump()
    data["modules"] = data["modules"][:2]
    with pytest.raises(ValidationError, match="h1, must not be tetrahedral"):
        Manipulator.model_validate(data)


@pytest.mark.long
def test_strokes_of_shipped_octahedra_are_clear_and_longer_ones_are_not():
    arm = load("arm30")
    check_strokes(Chain(arm, np.eye(4)))
    longer = {key: item.model_copy(update={"stroke": item.stroke + 0.05}) for key, item in arm.cylinders.items()}
    with pytest.raises(SingularityError, match=r"p1 .*smallest singular value .* p1/actuator/\d"):
        check_strokes(Chain(arm.model_copy(update={"cylinders": longer}), np.eye(4)))


def test_a_section_that_is_a_mechanism_is_named():
    with pytest.raises(TrussError, match="s1: a static section whose members do not hold it"):
        Chain(changed("tetra4", (0, {"tilt": (0.0, 0.0), "twist": np.radians(30)})), np.eye(4)).nodes([1.0] * 4)


def test_measured_transform_is_the_section_s():
    arm = load("tetra4")
    chain = Chain(arm, np.eye(4))
    R, P = chain.frames(chain.straight)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R[1], P[1]
    measured = changed("tetra4", (0, {"length": None, "tilt": (0.0, 0.0), "twist": 0.0, "transform": T.tolist()}))
    again = Chain(measured, np.eye(4))
    assert np.allclose(again.nodes(again.straight), chain.nodes(chain.straight), atol=EXACT)


def test_a_bad_module_names_file_and_key(tmp_path):
    text = (ROOT / "mixed/mixed.toml").read_text().replace('{ cylinder = "l325" },', '{ cylinder = "l352" },', 1)
    (tmp_path / "bad.toml").write_text(text)
    with pytest.raises(DescriptionError, match=r"modules\.7\.longerons\.0\.cylinder = 'l352'.*did you mean 'l325'"):
        load_manipulator(tmp_path / "bad.toml")
    (tmp_path / "bad.toml").write_text(text.replace('kind = "octahedral"', 'kind = "octahedron"'))
    with pytest.raises(DescriptionError, match="octahedral") as caught:
        load_manipulator(tmp_path / "bad.toml")
    assert caught.value.key == "modules.7.kind"


def test_chains_of_one_kind_and_of_two_agree():
    """The same arm with a hinge added at the root and held."""
    arm = load("arm9")
    plain = Chain(arm, hanging_mount(9.0))
    q = sample_inputs(plain, 1, seed=6)[0]
    hinge = load("tetra4").modules[1].model_copy(update={"name": "root"})
    cylinders = arm.cylinders | {"h500": load("tetra4").cylinders["h500"]}
    tubes = arm.tubes | {"t300x250": load("tetra4").tubes["t300x250"]}
    data = {"modules": (hinge, *arm.modules), "cylinders": cylinders, "tubes": tubes}
    mixed = Chain(arm.model_copy(update=data), hanging_mount(9.0))
    theta = 1.0
    row = np.concatenate([[theta], q])
    R, P = mixed.frames(row)
    mount = np.eye(4)
    mount[:3, :3], mount[:3, 3] = R[1], P[1]
    moved = Chain(arm, mount)
    assert np.allclose(mixed.nodes(row)[4:], moved.nodes(q)[3:], atol=EXACT)
    assert np.allclose(mixed.jacobian(row)[:, 1:], moved.jacobian(q), atol=EXACT)
    assert np.allclose(mixed.lengths(row)[1:], moved.lengths(q), atol=EXACT)


def test_least_singular_value_of_a_hinge_is_the_cosine_of_half_its_angle():
    chain = Chain(load("tetra4"), hanging_mount(9.0))
    q = sample_inputs(chain, 5, seed=9)
    value, leg = singular_values(chain, q)
    assert np.allclose(value, np.cos(q / 2))
    assert not leg.any()


def test_a_general_module_of_symmetric_dimensions_is_the_symmetric_one():
    """In a chain: every node, the tool's Jacobian by lengths, and the truss itself."""
    plain = load("octahedron_offset")
    data = plain.model_dump()
    module, side = data["modules"][0], plain.face_side
    kept = {
        name: module[name] for name in ("name", "joint_offset", "block", "longeron_tube", "batten_tube", "cylinder")
    }
    kept |= {"kind": "double_octahedral_general", "longerons": [module["longeron"]] * 12, "straight": 1.08}
    general = Manipulator.model_validate(data | {"modules": [kept | {"base": [side] * 3}]})
    one, other = (Chain(arm, hanging_mount(9.0)) for arm in (plain, general))
    assert one.truss.members == other.truss.members
    q = sample_inputs(one, 20, seed=11)
    lengths = one.lengths(q)
    phi = other.inputs_from_lengths(lengths)
    assert np.allclose(other.nodes(phi), one.nodes(q), rtol=0, atol=1e-9)
    assert np.allclose(other.conventional_jacobian(phi), one.conventional_jacobian(q), rtol=0, atol=1e-8)


def test_longerons_that_do_not_meet_are_named():
    arm = changed("octahedron_general", (0, {"longerons": [0.3] * 6 + [0.8] * 6}))
    with pytest.raises(AssemblyError, match=r"m does not assemble.*longerons 2 and 5.*over an edge of 0.8382"):
        _ = Chain(arm, hanging_mount(9.0)).layout
    with pytest.raises(AssemblyError, match=r"^m does not assemble.*face triangle"):
        Chain(load("octahedron_general"), hanging_mount(9.0)).inputs_from_lengths([0.8, 0.8, 1.7])
