"""Sizing: nothing overloaded, nothing heavier than need be, and the file it leaves is the arm it found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.catalogue import load_catalogue, write_sized_arm
from vgtsim.description.scene import LoadCase, Payload
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.statics import make_load_model, make_sections
from vgtsim.statics.cases import find_envelope
from vgtsim.statics.sizing import size_arm

ARM = Path(__file__).parents[2] / "models" / "arm15" / "arm15.toml"
CASES = (LoadCase(name="run"), LoadCase(name="quake", seismic=(0.1, 0.1, 0.0)))
GRAVITY, OMEGA, TARGET = 9.80665, 1.67, 0.9


@pytest.fixture(scope="module")
def poses(hanging_arm):
    rng = np.random.default_rng(51)
    q = np.repeat(hanging_arm.straight[None], 60, axis=0)
    q[..., :2] += 0.2 * rng.uniform(-1, 1, (*q.shape[:2], 2))
    return hanging_arm.nodes(q)


@pytest.fixture(scope="module")
def payload():
    return Payload(mass=300.0, radius=0.15)


@pytest.fixture(scope="module")
def sized(hanging_arm, poses, payload):
    return size_arm(hanging_arm, load_catalogue(), poses, payload, CASES, GRAVITY, OMEGA, TARGET)


def test_sized_arm_stands_every_case_with_its_own_weight(hanging_arm, poses, payload, sized):
    chain = Chain(sized.manipulator, hanging_arm.mount)
    model, section = make_load_model(chain, payload, GRAVITY), make_sections(sized.manipulator, chain.truss)
    worst = find_envelope(model, section, poses, CASES, OMEGA)
    assert worst.strength.max() <= TARGET + 1e-9
    assert worst.pressure.max() <= TARGET + 1e-9
    assert worst.strength.max() == pytest.approx(max(sized.utilisation.values()), abs=0.2)


def test_sized_arm_is_lighter_than_one_for_more_and_its_mass_is_said(hanging_arm, poses, payload, sized):
    more = size_arm(hanging_arm, load_catalogue(), poses, payload, CASES, GRAVITY, OMEGA, 0.6)
    assert sized.mass[1] < more.mass[1]
    chain = Chain(sized.manipulator, hanging_arm.mount)
    assert make_load_model(chain, payload, GRAVITY).mass - payload.mass == pytest.approx(sized.mass[1])


def test_written_file_is_the_sized_arm_with_derived_labels(sized, tmp_path):
    file = tmp_path / "sized.toml"
    tubes, cylinders = sized.manipulator.tubes, sized.manipulator.cylinders
    write_sized_arm(ARM, file, tubes, cylinders, sized.chosen, ("tubes' standard", "cylinders' standard", "sized"))
    back = load_manipulator(file)
    assert back.modules == sized.manipulator.modules
    for name, tube in tubes.items():
        assert back.tubes[name].area == pytest.approx(tube.area, rel=1e-5)
    for name, part in cylinders.items():
        assert back.cylinders[name].push == pytest.approx(part.push, rel=1e-5)
        assert back.cylinders[name].stroke == part.stroke
    assert back.provenance["modules.0.longeron_tube"].label == "derived"
    assert back.provenance["face_side"] == load_manipulator(ARM).provenance["face_side"]


def test_load_beyond_the_catalogue_is_named_with_its_forces(hanging_arm, poses):
    heavy = Payload(mass=20000.0, radius=0.15)
    with pytest.raises(DescriptionError, match=r"modules\.\w+\.\w+: found [0-9.]+ kN of pull and [0-9.]+ kN of push"):
        size_arm(hanging_arm, load_catalogue(), poses, heavy, CASES, GRAVITY, OMEGA, TARGET)


def test_catalogue_walls_hold_their_pressure():
    """Hoop stress p D / (2 t) of every cylinder below 180 MPa, as its file says."""
    for size in load_catalogue().cylinders:
        assert size.pressure * size.bore / (2 * size.barrel_wall) < 180e6
        assert size.rod < size.bore
