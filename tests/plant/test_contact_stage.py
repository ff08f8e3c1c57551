"""Steps without a search for contacts: runs have the same bits as with one in every step, up to a collision and on a load."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, climb

from vgtsim.description import AllowedContact
from vgtsim.log import ARRAYS
from vgtsim.plant import Plant
from vgtsim.plant.feeler import ContactStage
from vgtsim.site import Site, load_site

pytestmark = pytest.mark.long

WAY = 0.21  # m that the tool goes down; it meets the waste a centimetre before
STEP, PRESSED = 0.01, 8  # s, and steps on the waste, with a record or two among them


@pytest.fixture(scope="module", params=["rigid", "servo"])
def above(request):
    """The nine-actuator arm 20 cm over the waste, which servos may press on, and lengths that lower its tool."""
    scene = change(load_site("arm9_nullspace").scene, drive=request.param, timestep=STEP, log_rate=25.0)
    chain, q = Site(scene).chain, bend(scene, [0.7, 0.4, -0.3], [0.0, 0.0, 0.0])
    place, small = chain.tool(q)[0], 1e-6
    slope = (chain.tool(q + small * np.eye(len(q)))[0] - place).T / small
    down = q + np.linalg.pinv(slope) @ [0, 0, -WAY]
    level = float(place[2]) - scene.task.payload.radius - 0.2
    tank = scene.tank.model_copy(update={"waste": scene.tank.waste.model_copy(update={"level": level})})
    rules = (AllowedContact(part="tool", place="waste", force=1e9),) if request.param == "servo" else ()
    task = scene.task.model_copy(update={"contacts": rules})
    shares = climb(1.0, 1.0, STEP)
    first, last = chain.lengths(q), chain.lengths(down)
    rows = [first + share * (last - first) for share in shares]
    return Site(dataclasses.replace(scene, tank=tank, task=task)), q, rows


def play(above):
    site, q, rows = above
    plant, searched = Plant(site), []
    plant.reset(inputs=q)
    for row in rows:
        plant.command(row)
        plant.step()
        searched.append(plant.data.ncon)
        if plant.stopped or np.count_nonzero(searched) == PRESSED:
            break
    return plant.log, searched


def test_a_run_without_needless_searches_has_the_bits_of_one_with_all(above, monkeypatch):
    looks, look = [], ContactStage._look
    monkeypatch.setattr(ContactStage, "_look", lambda self, data: (looks.append(data.time), look(self, data)))
    spared, _ = play(above)
    monkeypatch.setattr(ContactStage, "prepare", lambda *_: None)
    every, touching = play(above)
    assert any(touching)
    assert spared.stopped == every.stopped
    assert bool(every.stopped) == (above[0].task.simulation.drive == "rigid")
    for name in ARRAYS:
        assert getattr(spared, name).tobytes() == getattr(every, name).tobytes(), name
    clear = next(k for k, count in enumerate(touching) if count)
    assert sum(when < STEP * clear for when in looks) < clear / 3
