"""What a check says of a mission before anything is planned: all that keeps the arm from coming in, at once."""

from __future__ import annotations

from dataclasses import replace

import pytest

from vgtsim.description import Conveyance, Equipment
from vgtsim.planning import inspect_site
from vgtsim.site import Site, load_site


@pytest.fixture(scope="module")
def mission() -> Site:
    return load_site("type_ii_mission")


def test_headroom_mouth_and_line_are_told_together(mission):
    pump = Equipment(name="stuck_pump", diameter=0.3048, radius=0.2, azimuth=0.0, bottom=6.0, top=9.0)
    tank = mission.tank.model_copy(update={"headroom": 0.5, "equipment": (*mission.tank.equipment, pump)})
    line = Conveyance(kind="hose", diameter=0.508, bore=0.45, bend_radius=3.0)
    task = mission.task.model_copy(update={"conveyance": line})
    faults = inspect_site(Site(replace(mission.scene, tank=tank, task=task)))
    said = "\n".join(map(str, faults))
    assert len(faults) == 3
    assert "tank.headroom: found 0.5 m" in said
    assert "found stuck_pump, 0.486 m inside the cylinder below the mouth" in said
    assert "conveyance.diameter: found 0.508 m, 0.2222 m too thick" in said
