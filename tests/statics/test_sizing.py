"""Sizing: nothing overloaded, nothing heavier than need be, and the file it leaves is the arm it found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from offset_arms import with_offset

from vgtsim.description import load_manipulator
from vgtsim.description.catalogue import INCH, load_catalogue, write_sized_arm
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.statics import make_load_model, make_sections, rate
from vgtsim.statics.cases import find_envelope
from vgtsim.statics.equilibrium import solve_members
from vgtsim.statics.loads import weigh
from vgtsim.statics.motion import NodeMotion
from vgtsim.statics.rating import SLENDERNESS_ADVICE, pin_shear
from vgtsim.statics.sizing import Demand, size_arm
from vgtsim.statics.utilisation import utilise

ARM = Path(__file__).parents[2] / "models" / "arm15" / "arm15.toml"
CASES = (LoadCase(name="run"), LoadCase(name="quake", shaking=0.15), LoadCase(name="tool", reaction=300.0))
GRAVITY, OMEGA, TARGET = 9.80665, 1.67, 0.9


@pytest.fixture(scope="module")
def poses(hanging_arm):
    rng = np.random.default_rng(51)
    q = np.repeat(hanging_arm.straight[None], 60, axis=0)
    q.reshape(60, 5, 3)[..., :2] += 0.2 * rng.uniform(-1, 1, (60, 5, 2))
    return hanging_arm.nodes(q)


@pytest.fixture(scope="module")
def payload():
    return Payload(mass=300.0, radius=0.15)


@pytest.fixture(scope="module")
def demand(poses, payload):
    return Demand(poses, None, payload, CASES, GRAVITY, OMEGA)


@pytest.fixture(scope="module")
def sized(hanging_arm, demand):
    return size_arm(hanging_arm, load_catalogue(), demand, TARGET)


def test_sized_arm_stands_every_case_with_its_own_weight(hanging_arm, poses, payload, sized):
    """And is used as the sizing says: the envelope reads sections from the arm, not from the catalogue."""
    chain = Chain(sized.manipulator, hanging_arm.mount)
    model, section = make_load_model(chain, payload, GRAVITY), make_sections(sized.manipulator, chain.truss)
    worst = find_envelope(model, section, poses, CASES, OMEGA)
    used = np.maximum(worst.strength, worst.pressure).max(axis=(0, 1))
    assert used.max() <= TARGET + 1e-9
    fields = {"longeron": "longeron_tube", "cross_longeron": "cross_longeron_tube", "batten": "batten_tube"}
    for place, said in sized.utilisation.items():
        rows = [
            index
            for index, member in enumerate(chain.truss.members)
            if (sized.manipulator.modules[member.module].name, fields.get(member.role, "cylinder")) == place
        ]
        assert used[rows].max() == pytest.approx(said, rel=1e-9)


def test_sized_arm_has_no_member_too_slender(hanging_arm, poses, sized):
    chain = Chain(sized.manipulator, hanging_arm.mount)
    ends = chain.truss.ends
    length = np.linalg.norm(poses[:, ends[:, 1]] - poses[:, ends[:, 0]], axis=-1)
    slender = rate(make_sections(sized.manipulator, chain.truss), length, OMEGA).slenderness
    tubes = np.setdiff1d(np.arange(len(ends)), chain.truss.actuated)
    assert slender[:, tubes].max() <= SLENDERNESS_ADVICE


def test_next_lighter_size_would_be_overloaded(hanging_arm, poses, payload, sized):
    """Wherever a tube lighter than the chosen one is in the catalogue, the demand uses it beyond the target."""
    sizes = sorted(load_catalogue().tubes, key=lambda size: size.wall * (size.outer_diameter - size.wall))
    arm, tried = sized.manipulator, 0
    for index, module in enumerate(arm.modules):
        tube = arm.tubes[module.longeron_tube]
        lighter = [size for size in sizes if size.wall * (size.outer_diameter - size.wall) < tube.area / np.pi - 1e-9]
        if not lighter:
            continue
        thin = tube.model_copy(update=lighter[-1].model_dump())
        modules = list(arm.modules)
        modules[index] = module.model_copy(update={"longeron_tube": "thin"})
        changed = arm.model_copy(update={"tubes": arm.tubes | {"thin": thin}, "modules": tuple(modules)})
        chain = Chain(changed, hanging_arm.mount)
        model, section = make_load_model(chain, payload, GRAVITY), make_sections(changed, chain.truss)
        worst = find_envelope(model, section, poses, CASES, OMEGA).strength.max(axis=(0, 1))
        rows = [i for i, m in enumerate(chain.truss.members) if m.module == index and m.role == "longeron"]
        assert worst[rows].max() > TARGET
        tried += 1
    assert tried >= 3


def test_sizing_the_sized_arm_changes_nothing(hanging_arm, demand, sized):
    again = size_arm(Chain(sized.manipulator, hanging_arm.mount), load_catalogue(), demand, TARGET)
    assert again.chosen == sized.chosen
    assert again.mass == pytest.approx((sized.mass[1], sized.mass[1]))


def test_sized_arm_is_lighter_than_one_for_more_and_its_mass_is_said(hanging_arm, demand, sized):
    more = size_arm(hanging_arm, load_catalogue(), demand, 0.6)
    assert sized.mass[1] < more.mass[1]
    assert weigh(Chain(sized.manipulator, hanging_arm.mount)) == pytest.approx(sized.mass[1])


def test_inertia_of_the_tour_is_part_of_the_demand(hanging_arm, poses, payload):
    """Poses passed while the whole arm is thrown upward by 0.4 g."""
    motion = NodeMotion(np.zeros(poses.shape), np.broadcast_to([0.0, 0.0, 0.4 * GRAVITY], poses.shape))
    run = (LoadCase(name="run"),)
    still, shaken = (Demand(poses, moving, payload, run, GRAVITY, OMEGA) for moving in (None, motion))
    found = size_arm(hanging_arm, load_catalogue(), shaken, TARGET)
    chain = Chain(found.manipulator, hanging_arm.mount)
    forces = solve_members(make_load_model(chain, payload, GRAVITY), poses, motion)
    ends = chain.truss.ends
    length = np.linalg.norm(poses[:, ends[:, 1]] - poses[:, ends[:, 0]], axis=-1)
    used = utilise(rate(make_sections(found.manipulator, chain.truss), length, OMEGA), forces)
    assert max(used.strength.max(), used.pressure.max()) == pytest.approx(max(found.utilisation.values()), rel=1e-9)
    assert found.mass[1] > size_arm(hanging_arm, load_catalogue(), still, TARGET).mass[1]


def test_pins_that_the_arm_gives_are_held_against_the_load(hanging_arm, demand):
    """No tube makes up for a pin that is too thin."""
    arm = hanging_arm.manipulator
    weak = {name: tube.model_copy(update={"pin": 0.004}) for name, tube in arm.tubes.items()}
    chain = Chain(arm.model_copy(update={"tubes": weak}), hanging_arm.mount)
    with pytest.raises(DescriptionError, match=r"modules\.\w+\.\w+_tube: found"):
        size_arm(chain, load_catalogue(), demand, TARGET)


def test_written_file_is_the_sized_arm_with_derived_labels(sized, tmp_path):
    file, again = tmp_path / "sized.toml", tmp_path / "again.toml"
    write_sized_arm(ARM, file, sized.manipulator, load_catalogue(), "sized")
    back = load_manipulator(file)
    assert back.modules == sized.manipulator.modules
    for name, tube in sized.manipulator.tubes.items():
        assert back.tubes[name].area == pytest.approx(tube.area, rel=1e-5)
    for name, part in sized.manipulator.cylinders.items():
        assert back.cylinders[name].push == pytest.approx(part.push, rel=1e-5)
        assert back.cylinders[name].stroke == part.stroke
        assert back.cylinders[name].pin == pytest.approx(part.pin, rel=1e-5)
    assert back.provenance["modules.0.longeron_tube"].label == "derived"
    assert back.provenance["face_side"] == load_manipulator(ARM).provenance["face_side"]
    assert back.materials["a500c"].yield_strength == pytest.approx(315e6)
    write_sized_arm(file, again, back, load_catalogue(), "sized")
    assert again.read_text() == file.read_text()


def test_load_beyond_the_catalogue_is_named_with_its_forces(hanging_arm, demand):
    heavy = Demand(demand.nodes, None, Payload(mass=20000.0, radius=0.15), CASES, GRAVITY, OMEGA)
    with pytest.raises(DescriptionError, match=r"modules\.\w+\.\w+: found [0-9.]+ kN of pull and [0-9.]+ kN of push"):
        size_arm(hanging_arm, load_catalogue(), heavy, TARGET)


def test_joint_offset_is_refused(demand):
    chain = Chain(with_offset(load_manipulator(ARM)), np.eye(4))
    with pytest.raises(DescriptionError, match=r"joint_offset: found 0\.127 m on .*; allowed: 0 where an arm is sized"):
        size_arm(chain, load_catalogue(), demand, TARGET)


def test_catalogue_whose_cylinders_are_all_too_long_is_refused(hanging_arm, demand):
    catalogue = load_catalogue()
    long = tuple(size.model_copy(update={"eye": 0.2}) for size in catalogue.cylinders)
    with pytest.raises(DescriptionError, match=r"cylinders: found \d+ in the catalogue, of 0\.4\d+ m or more"):
        size_arm(hanging_arm, catalogue.model_copy(update={"cylinders": long}), demand, TARGET)


def test_catalogue_that_is_no_text_is_named(tmp_path):
    (tmp_path / "sizes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(DescriptionError, match=r"sizes\.toml: file: found text in UTF-16"):
        load_catalogue(tmp_path / "sizes.toml")


def test_titles_of_any_letters_are_written_as_toml(sized, tmp_path):
    title = 'more "quotes", \\, \\n, ø and 節'
    text = ARM.read_text()
    begin = text.index("title = ")
    escaped = "".join(f"\\u{ord(letter):04x}" for letter in title)
    source, target = tmp_path / "source.toml", tmp_path / "target.toml"
    source.write_text(text[:begin] + f'title = "{escaped}"' + text[text.index("\n", begin) :], encoding="utf-8")
    write_sized_arm(source, target, sized.manipulator, load_catalogue(), "sized")
    assert load_manipulator(target).title == title


def test_catalogue_walls_and_pins_hold_their_pressure():
    """Hoop stress p D / (2 t) of every cylinder below 180 MPa and its pins good for its push, as its file says."""
    catalogue = load_catalogue()
    steel = catalogue.materials[catalogue.cylinder_material]
    for size in catalogue.cylinders:
        assert size.pressure * size.bore / (2 * size.barrel_wall) < 180e6
        assert size.rod < size.bore
        push = size.pressure * np.pi / 4 * size.bore**2
        assert push < pin_shear(size.pin, steel.yield_strength) / OMEGA
    assert min(size.outer_diameter for size in catalogue.tubes) >= 1.5 * INCH - 1e-12
