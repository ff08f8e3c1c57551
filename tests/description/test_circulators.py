from __future__ import annotations

import numpy as np
import pytest

from vgtsim.description import load_tank
from vgtsim.description.shipped import list_shipped
from vgtsim.errors import DescriptionError
from vgtsim.geometry import make_profile, obstacles

CUBIC_METRES = 0.003785411784  # in a US gallon


def test_a_type_iv_tank_holds_a_million_gallons_at_its_operating_depth():
    volume = make_profile(load_tank("type_iv").shell).volume(9.14)
    assert volume / CUBIC_METRES == pytest.approx(1.0e6, rel=0.01)


def test_a_type_i_tank_holds_55_000_gallons_under_the_top_of_its_wall():
    volume = make_profile(load_tank("type_i").shell).volume(7.35)
    assert volume / CUBIC_METRES == pytest.approx(55e3, rel=0.01)


def test_a_type_iii_tank_holds_228_000_gallons_more_than_a_type_ii_tank_of_the_same_freeboard():
    two, three = (load_tank(name).shell for name in ("type_ii", "type_iii"))
    more = make_profile(three).volume(three.wall_top) - make_profile(two).volume(two.wall_top)
    assert more / CUBIC_METRES == pytest.approx(228e3, rel=0.001)


def test_rings_stand_at_equal_angles_under_names_with_numbers():
    tank = load_tank("type_iv")
    names = [item.name for item in tank.standing]
    assert names[:22] == [f"alc_{number}" for number in range(1, 23)]
    around = obstacles(tank)
    assert around.names == tuple(names)
    for ring, radius in ((slice(0, 7), 3.8), (slice(7, 22), 8.4)):
        feet = around.axes[ring, 0, :2]
        assert np.allclose(np.hypot(*feet.T), radius)
        apart = np.linalg.norm(feet - np.roll(feet, 1, axis=0), axis=1)
        assert np.allclose(apart, 2 * radius * np.sin(np.pi / len(feet)))


def test_names_of_rings_must_differ(tmp_path):
    text = list_shipped("tank")["type_iv"].read_text().replace("first = { value = 8", "first = { value = 7")
    file = tmp_path / "tank.toml"
    file.write_text(text)
    with pytest.raises(DescriptionError, match="alc_1"):
        load_tank(file)
