"""The mast on its feed: the arm rises as a whole, loops stay closed, and the hoist pulls what weight and inertia ask for."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from playing import bend, change, climb, hoist, shorten

from vgtsim.errors import CommandError
from vgtsim.log.runlog import FEED
from vgtsim.planning import Leg, Tour
from vgtsim.plant import Plant, run
from vgtsim.site import Site
from vgtsim.verification import verify

STEP = 0.02  # s
CLOSED = 1e-7  # m
FOLLOWED = 1e-6  # m: nodes against kinematics while lengths and feed are on their way
PULLED = 1e-5  # of the force: servos give a little
RINGS = 1e-3  # of the force, by an elastic arm that is lifted smoothly
HEIGHT, TIME = 1.5, 6.0  # m and s: 0.55 m/s at the most
SOFT = {"timestep": 0.01, "log_rate": 100.0, "damping_ratio": 0.5}
TIERS = {
    "rigid": {},
    "sections": {"members": "sections"},
    "servo": {"drive": "servo", "timestep": 5e-3},
    "springs": {"members": "elastic", **SOFT},
    "hydraulic": {"members": "elastic", "drive": "hydraulic", "member_mass": "lumped", **SOFT},
}
FEED_ROWS = (
    "distance to the end of the feed",
    "feed speed over rated speed",
    "commanded feed acceleration over rated",
    "commanded feed to the plan",
    "hoist force error at rest over the force",
    "hoist force error over the force",
    "hoist force over rated force",
)


@pytest.fixture(scope="module")
def scene(reach_scene):
    scene = hoist(change(shorten(reach_scene, 2), timestep=STEP, log_rate=50.0))
    motion = scene.task.motion.model_copy(update={"settle_speed": 1e-8})  # servos creep to rest
    return dataclasses.replace(scene, task=scene.task.model_copy(update={"motion": motion}))


@pytest.fixture(scope="module")
def sites(scene):
    """A site for each tier, whose model is compiled once."""
    return {tier: Site(change(scene, **settings)) for tier, settings in TIERS.items()}


def lift(site, lengths=None, height=HEIGHT, seconds=TIME):
    """The log of a lift from the working depth, lengths on their way meanwhile."""
    plant = Plant(site, record_rate=site.task.simulation.log_rate)
    q = bend(site.scene, [0.2, 0.25], [0.0, 1.0])
    plant.reset(inputs=q)
    for step, feed in enumerate(climb(height, seconds, plant.timestep)):
        plant.command(None if lengths is None else lengths[step], feed=feed)
        plant.step()
    return plant


@pytest.mark.parametrize("tier", ["rigid", "sections"])
def test_arm_rises_as_a_whole(scene, sites, tier):
    site = sites[tier]
    q, end = bend(scene, [0.2, 0.25], [0.0, 1.0]), bend(scene, [0.25, 0.2], [0.2, 0.9])
    s = climb(1.0, TIME, STEP)[:, None]
    plant = lift(site, site.chain.lengths(q + s * (end - q)))
    log, state = plant.log, plant.state
    gaps = np.linalg.norm(log.ends - log.nodes[:, site.truss.ends], axis=-1)
    nodes = site.chain.nodes(site.chain.inputs_from_lengths(log.actual))
    assert gaps.max() < CLOSED
    assert np.abs(log.nodes - nodes - log.feed[:, None, None] * [0, 0, 1]).max() < FOLLOWED
    assert np.abs(log.feed - log.feed_commanded).max() < FOLLOWED
    assert state.feed == pytest.approx(HEIGHT, abs=FOLLOWED)
    assert state.nodes[site.truss.base, 2].mean() == pytest.approx(site.scene.pivot_height + HEIGHT, abs=FOLLOWED)


@pytest.mark.parametrize("tier", TIERS)
def test_hoist_pulls_weight_and_inertia(sites, tier):
    """By hand: the mast, the arm and the payload are lifted as one, and an arm that gives rings a little about that."""
    site = sites[tier]
    log = lift(site).log
    a = np.diff(log.feed, n=2) / np.diff(log.time[:2]) ** 2
    pull = (site.mast.mass + site.load_model.mass) * (site.gravity + a)
    off = np.abs(log.feed_force[1:-1] / pull - 1).max()
    assert off < (RINGS if site.task.simulation.members == "elastic" else PULLED)
    assert np.ptp(pull) > 0.06 * pull.mean()


@pytest.mark.parametrize("tier", TIERS)
def test_checks_pass_while_mast_and_arm_move(scene, sites, tier):
    site = sites[tier]
    start, end = bend(scene, [0.2, 0.25], [0.0, 1.0]), bend(scene, [0.22, 0.23], [0.1, 1.0])
    s = climb(1.0, TIME, site.timestep)
    lengths = site.chain.lengths(start + s[:, None] * (end - start))
    tour = Tour(start, (Leg("goal", 0, lengths, end, 1.0, "nothing", feed=HEIGHT * s),), site.timestep)
    report = verify(site, run(site, tour), tour)
    parts = ("feed", "hoist", "headroom", "axial", "reaction", "drive force", "largest force")
    rows = [row for row in report.checks if any(part in row.quantity for part in parts)]
    assert {row.quantity for row in rows if "feed" in row.quantity or "hoist" in row.quantity} == {
        *FEED_ROWS,
        *(["feed to its command"] if site.task.simulation.drive != "servo" else []),
    }
    assert [row.quantity for row in rows if not row.passed] == []


def test_commands_of_the_feed(scene):
    site = Site(scene)
    plant = Plant(site)
    plant.reset(feed=1.0)
    assert plant.state.feed == pytest.approx(1.0, abs=CLOSED)
    plant.command(feed=1.001)
    plant.step()
    assert not plant.calm
    assert plant.state.commanded == pytest.approx(site.chain.lengths(site.start))
    for wrong in (-0.1, 20.1, np.nan):
        with pytest.raises(CommandError, match=r"feed.*0 to 20 m, the stroke of mast.feed"):
            plant.command(feed=wrong)
    with pytest.raises(CommandError, match="lengths"):
        plant.command([np.nan] * len(site.truss.actuated), feed=1.1)
    plant.step(5)
    assert plant.state.feed == pytest.approx(1.001, abs=CLOSED)  # nothing of a refused command is done
    mast = site.task.mast.model_copy(update={"feed": None})
    held = dataclasses.replace(scene, task=scene.task.model_copy(update={"mast": mast}))
    with pytest.raises(CommandError, match=r"no mast\.feed is given"):
        Plant(Site(held)).reset(feed=1.0)


def test_logs_without_a_feed_are_read(scene):
    log = lift(Site(scene), height=0.1, seconds=0.2).log
    old = dataclasses.replace(log, **{name: np.zeros(0) for name in FEED})
    assert not old.find_fault()
    assert not old.find_misfit(*_counts(Site(scene)))


def _counts(site):
    return len(site.truss.nodes), len(site.truss.members), len(site.truss.actuated), 1
