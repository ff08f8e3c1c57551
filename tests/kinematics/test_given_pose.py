"""Poses written by hand: units, strokes and names are looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.given_pose import read_pose

MODELS = Path(__file__).parents[2] / "models"
EXACT = 1e-10  # m


def hanging(name):
    return Chain(load_manipulator(MODELS / name / f"{name}.toml"), hanging_mount(0.0))


@pytest.fixture(scope="module")
def chain():
    return hanging("mixed")


def test_named_modules_have_what_was_written_and_the_others_are_straight(chain):
    q = read_pose(chain, ["m1=36 in,1.0,38 in"], ["h1=60 deg"])
    assert q[0] == pytest.approx(np.pi / 3)
    lengths = chain.lengths(q)
    first = list(chain.truss.member_names).index("m1/actuator/1")
    place = int(np.flatnonzero(chain.truss.actuated == first)[0])
    assert np.allclose(lengths[place : place + 3], [36 * 0.0254, 1.0, 38 * 0.0254], atol=EXACT)
    straight = chain.lengths(chain.straight)
    assert np.allclose(lengths[place + 3 :], straight[place + 3 :], atol=EXACT)


def test_nothing_written_is_straight(chain):
    assert np.allclose(read_pose(chain, [], []), chain.straight, atol=EXACT)


@pytest.mark.parametrize(
    ("lengths", "inputs", "words"),
    [
        (["m1=1,1"], [], r"--lengths m1: found 2 values; allowed: 3, in m, m, m"),
        (["m1=1,1,2"], [], r"--lengths m1: found 2 m; allowed: 0\.7874 to 1\.372 m, the stroke of its actuator 3"),
        (["m1=1,1,1 kg"], [], r"--lengths m1: found '1 kg'.*dimension"),
        (["m1=1,1,x"], [], r"--lengths m1: found 'x'"),
        (["m9=1,1,1"], [], r"'m9'.*known: h1, m1"),
        ([], ["s9=1"], r"--inputs: found 's9'.*active module"),
        (["h1=0.6"], ["h1=1"], r"--inputs h1: found lengths too"),
        ([], ["h1"], r"--inputs: found 'h1'; allowed: MODULE=VALUE"),
    ],
)
def test_what_cannot_be_is_named(chain, lengths, inputs, words):
    with pytest.raises(DescriptionError, match=words):
        read_pose(chain, lengths, inputs)


def test_inputs_have_the_units_of_their_kind():
    """Three inputs are angles of a general double octahedron, and two numbers and a length of a symmetric one."""
    general = hanging("octahedron_general")
    degrees = np.degrees(general.straight)
    q = read_pose(general, [], ["m=" + ",".join(f"{value:.12f} deg" for value in degrees)])
    assert np.allclose(q, general.straight, atol=EXACT)
    with pytest.raises(DescriptionError, match=r"--inputs m: found 0\.1687 m.*the stroke of its actuator 3"):
        read_pose(general, [], ["m=60 deg,60 deg,60 deg"])  # read, and folded further than its cylinders go
    with pytest.raises(DescriptionError, match=r"--inputs m: found '36 in'.*expected that of rad"):
        read_pose(general, [], ["m=36 in,1,1"])


@pytest.mark.parametrize(
    ("arm", "inputs", "words"),
    [
        ("stewart", "p=0,0,3,0,0,0", r"--inputs p: found 3\.\d+ m; allowed: .* m, the stroke of its actuator"),
        ("stewart", "p=0,0,-0.7,0,0,0", r"--inputs p: found .*"),
        ("tetra4", "h1=400 deg", r"--inputs h1: found .* m; allowed: .* m, the stroke of its actuator 1"),
        ("mixed", "h1=170 deg", r"--inputs h1: found .* m; allowed: .* m, the stroke of its actuator 1"),
        ("arm15", "m1=2,0,0.6", r"--inputs m1: found inputs that m1 cannot have"),
    ],
)
def test_inputs_that_are_no_pose_of_the_arm_are_refused(arm, inputs, words):
    with pytest.raises(DescriptionError, match=words):
        read_pose(hanging(arm), [], [inputs])


def test_mirrored_pose_with_possible_lengths_is_refused():
    """Below its base a platform has the lengths that it has above."""
    stewart = hanging("stewart")
    x, y, z, *turn = stewart.straight
    assert z > 0
    assert np.allclose(turn[:2], 0)
    below = ",".join(f"{value:.15g}" for value in (x, y, -z, *turn))
    with pytest.raises(DescriptionError, match=r"--inputs p: found one of another assembly mode"):
        read_pose(stewart, [], [f"p={below}"])
