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
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
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


def place_rows(chain):
    """Module and field that name a member's section in the arm's file, by hand for each kind; members of each."""
    fields = {"longeron": "longeron_tube", "cross_longeron": "cross_longeron_tube", "batten": "batten_tube"}
    rows = {}
    for index, member in enumerate(chain.truss.members):
        module, field = chain.manipulator.modules[member.module], fields.get(member.role, "cylinder")
        if module.kind == "octahedral" and member.role != "batten":
            named = [item.cylinder or item.tube for item in module.longerons]
            first = named.index(named[int(member.name[-1]) - 1])
            field = f"longerons.{first}.{'tube' if module.longerons[first].cylinder is None else 'cylinder'}"
        rows.setdefault((module.name, field), []).append(index)
    return rows


def greatest_use(chain, poses, payload):
    """Of each member in every case and pose, by the envelope that the report uses."""
    model, section = make_load_model(chain, payload, GRAVITY), make_sections(chain)
    worst = find_envelope(model, section, poses, CASES, OMEGA)
    return np.maximum(worst.strength, worst.pressure).max(axis=(0, 1))


def test_sized_arm_stands_every_case_with_its_own_weight(hanging_arm, poses, payload, sized):
    """And is used as the sizing says: the envelope reads sections from the arm, not from the catalogue."""
    chain = Chain(sized.manipulator, hanging_arm.mount)
    used = greatest_use(chain, poses, payload)
    assert used.max() <= TARGET + 1e-9
    for place, rows in place_rows(chain).items():
        assert used[rows].max() == pytest.approx(sized.utilisation[place], rel=1e-9)


def other_kind(name):
    """An arm of other kinds, and one with a joint offset."""
    if name == "offset":
        arm = with_offset(load_manipulator(ARM))
        return arm.model_copy(update={"modules": arm.modules[:4]})
    arm = load_manipulator(name)
    return arm.model_copy(update={"modules": arm.modules[:6]}) if name == "arm30" else arm


def thinner(arm, place, sizes):
    """The arm with the next lighter size of the catalogue at one place of its file; None where there is none."""
    module = next(item for item in arm.modules if item.name == place[0])
    old = module.sections()[place[1]]
    kind = "cylinders" if place[1].endswith("cylinder") else "tubes"
    part = getattr(arm, kind)[old]
    lighter = [size for size in sizes[kind] if weight(size) < weight(part) * (1 - 1e-9)]
    if not lighter:
        return None
    thin = part.model_copy(update=max(lighter, key=weight).model_dump(exclude_none=True))
    modules = [item.with_sections({place[1]: "thin"}) if item is module else item for item in arm.modules]
    return arm.model_copy(update={kind: getattr(arm, kind) | {"thin": thin}, "modules": tuple(modules)})


def weight(part):
    """What sizes of tubes, or of cylinders, are ordered by."""
    return part.wall * (part.outer_diameter - part.wall) if hasattr(part, "wall") else part.bore + part.rod / 10


@pytest.mark.parametrize("name", ["mixed", "arm30", "offset", "octahedron_general", "tetra4"])
def test_arms_of_every_kind_are_sized_to_the_full_at_every_place(name):
    """Every place stands the demand as the envelope has it; and a lighter size at any place would not."""
    chain = Chain(other_kind(name), hanging_mount(9.0))
    poses, load = chain.nodes(sample_inputs(chain, 12, seed=3, part=0.6)), Payload(mass=200.0, radius=0.15)
    catalogue = load_catalogue()
    found = size_arm(chain, catalogue, Demand(poses, None, load, CASES, GRAVITY, OMEGA), TARGET)
    sized = Chain(found.manipulator, chain.mount)
    used, rows = greatest_use(sized, poses, load), place_rows(sized)
    assert used.max() <= TARGET + 1e-9
    assert set(found.utilisation) == set(rows)
    sizes, tried = {"tubes": catalogue.tubes, "cylinders": catalogue.cylinders}, 0
    for place, members in rows.items():
        assert used[members].max() == pytest.approx(found.utilisation[place], rel=1e-9)
        lighter = thinner(found.manipulator, place, sizes)
        if lighter is not None:
            chain = Chain(lighter, sized.mount)
            sections = make_sections(chain)
            slender = rate(sections, chain.truss.lengths(poses), OMEGA).slenderness[:, members].max()
            stands = greatest_use(chain, poses, load)[members].max() <= TARGET
            assert not stands or (slender > SLENDERNESS_ADVICE and place[1].endswith("tube"))
            tried += 1
    assert tried >= 1
    again = size_arm(sized, catalogue, Demand(poses, None, load, CASES, GRAVITY, OMEGA), TARGET)
    assert again.chosen == found.chosen


def test_bending_of_a_joint_offset_is_part_of_the_sizing():
    """With tall blocks bending decides on cylinders: by their axial forces alone lighter ones would do."""
    arm = with_offset(load_manipulator(ARM), 0.4)
    chain = Chain(arm.model_copy(update={"modules": arm.modules[:2]}), hanging_mount(9.0))
    poses, load = chain.nodes(sample_inputs(chain, 12, seed=3, part=0.6)), Payload(mass=400.0, radius=0.15)
    found = size_arm(chain, load_catalogue(), Demand(poses, None, load, CASES, GRAVITY, OMEGA), TARGET)
    sized = Chain(found.manipulator, chain.mount)
    rate_of = rate(make_sections(sized), sized.truss.lengths(poses), OMEGA)
    use = utilise(rate_of, solve_members(make_load_model(sized, load, GRAVITY), poses))
    axial = np.max([use.tension, use.compression, use.rod, use.pressure, use.pin], axis=0)
    bent = sized.truss.ring_actuators.ravel()
    assert use.bent[:, bent].max() > 1.1 * axial[:, bent].max()
    place = (sized.manipulator.modules[0].name, "cylinder")
    lighter = thinner(sized.manipulator, place, {"cylinders": load_catalogue().cylinders})
    assert greatest_use(Chain(lighter, sized.mount), poses, load)[bent].max() > TARGET


def test_sized_arm_has_no_member_too_slender(hanging_arm, poses, sized):
    chain = Chain(sized.manipulator, hanging_arm.mount)
    ends = chain.truss.ends
    length = np.linalg.norm(poses[:, ends[:, 1]] - poses[:, ends[:, 0]], axis=-1)
    slender = rate(make_sections(chain), length, OMEGA).slenderness
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
        model, section = make_load_model(chain, payload, GRAVITY), make_sections(chain)
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
    used = utilise(rate(make_sections(chain), length, OMEGA), forces)
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
