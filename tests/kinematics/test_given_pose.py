"""Poses written by hand: units, strokes and names are looked at."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.kinematics.given_pose import read_pose

MIXED = Path(__file__).parents[2] / "models/mixed/mixed.toml"
EXACT = 1e-10  # m


@pytest.fixture(scope="module")
def chain():
    return Chain(load_manipulator(MIXED), hanging_mount(0.0))


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
