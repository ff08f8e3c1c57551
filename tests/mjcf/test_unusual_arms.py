"""Arms at the edge of what modules can do: used where they can be, refused with key, lengths and reason where not."""

from __future__ import annotations

import re

import numpy as np
import pytest

from vgtsim.description import load_manipulator, load_scene
from vgtsim.description.shipped import list_shipped
from vgtsim.errors import AssemblyError, DescriptionError, SingularityError, UnusualWarning
from vgtsim.kinematics import check_strokes
from vgtsim.mjcf import build_arm_spec, reach_pose
from vgtsim.site import load_arm

FLAT = {"face_side": "0.70 m", "longeron": "0.70 m", "straight": "1.143 m", "head": "0.5 in", "eye": "0.4 in"}


def write(tmp_path, name="octahedron_double", more="", **figures):
    text = list_shipped("arm")[name].read_text()
    for key, value in figures.items():
        text, count = re.subn(rf"(?m)^{key} = .*$", f'{key} = "{value}"', text)
        assert count
    file = tmp_path / "arm.toml"
    file.write_text(text.replace('kind = "double_octahedral"', f'kind = "double_octahedral"\n{more}'))
    return file


@pytest.fixture
def flat(tmp_path):
    """A module so flat that it cannot lean by 15 degrees."""
    sizes = {"bore": "3 in", "rod": "1.5 in", "cylinder_length": "0.6 m"}
    return write(tmp_path, retracted="0.53 m", stroke="0.20 m", **FLAT, **sizes)


def test_a_demonstration_pose_is_one_that_the_arm_can_take(flat):
    chain = load_arm(flat)
    check_strokes(chain)
    q, (low, high) = reach_pose(chain), chain.stroke
    lengths = chain.lengths(q)
    assert np.all((low <= lengths) & (lengths <= high))
    steeper = np.array(chain.straight)
    steeper[0] = np.sin(np.arcsin(q[0]) + np.radians(2))  # one step more
    try:
        lengths = chain.lengths(steeper)
        assert not np.all((low <= lengths) & (lengths <= high))
    except AssemblyError:
        pass
    assert build_arm_spec(load_manipulator(flat)).compile().nkey == 3


def test_a_refusal_names_strokes_lengths_and_reason_and_may_be_set_aside(tmp_path):
    wide = {"retracted": "0.395 m", "stroke": "0.345 m", "bore": "3 in", "rod": "1.5 in", "cylinder_length": "0.6 m"}
    words = r"modules\.0, cylinder strokes of 0\.395 to 0\.74 m: .*tangent to a mid node's circle on the way to actuators of \["
    with pytest.raises(SingularityError, match=words):
        check_strokes(load_arm(write(tmp_path, **FLAT, **wide)))
    with pytest.warns(UnusualWarning, match=r"modules\.0\.unproved: .*accepted though"):
        check_strokes(load_arm(write(tmp_path, **FLAT, **wide, more='unproved = "bent little"')))


def test_a_tool_point_may_lie_in_the_tip_plate(tmp_path):
    file = write(tmp_path, "stewart", tool_offset="0 m")
    model = build_arm_spec(load_manipulator(file)).compile()
    chain = load_arm(file)
    assert chain.tool(chain.straight)[0] == pytest.approx(chain.frames(chain.straight)[1][-1])
    assert model.site("tool").pos == pytest.approx(np.zeros(3))


def test_a_stowed_pose_is_asked_of_arms_that_a_scene_stows_only(tmp_path):
    text = list_shipped("arm")["arm9"].read_text()
    begin = text.index("[stowed]")
    (tmp_path / "arm.toml").write_text(text[:begin] + text[text.index("\n[", begin) :])
    assert load_manipulator(tmp_path / "arm.toml").stowed is None
    scene = list_shipped("scene")["arm9_nullspace"].read_text()
    scene = scene.replace("../models/arm9/arm9.toml", "arm.toml").replace("tanks/type_ii.toml", "type_ii")
    (tmp_path / "scene.toml").write_text(scene)
    with pytest.raises(DescriptionError, match=r"manipulator.stowed: found nothing; allowed: a table \[stowed\]"):
        load_scene(tmp_path / "scene.toml")
