"""The site on a page: what a display tells a viser server, without a browser."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh

import vgtsim
from vgtsim.description import load_manipulator, load_tank
from vgtsim.errors import MissingLibraryError
from vgtsim.geometry import make_profile, solids
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.output.colours import force_colours
from vgtsim.output.quantities import MINUS
from vgtsim.positioning import LeastGap

viser = pytest.importorskip("viser")

from vgtsim.web.display import Display, Sight, draw_scale  # noqa: E402
from vgtsim.web.parts import make_bars, place_points  # noqa: E402
from vgtsim.web.scenery import show_tank  # noqa: E402

MODELS = Path(__file__).parents[2] / "models"
ARMS = [path.stem for path in sorted(MODELS.glob("*/*.toml"))]
SCENES = Path(__file__).parents[2] / "scenes/tanks"
TANKS = [path.stem for path in sorted(SCENES.glob("*.toml"))]
END = 80e3  # N
MOST = 0.010  # s of processor time that an update may take
TIGHT = 1e-9  # m
GRAIN = 2.0**-13  # m: half the grid that places are rounded to
STRAIGHT = 2e-6  # m: a bar that points down to 1e-6 is drawn as one that points down


@pytest.fixture(scope="module")
def shown():
    site = vgtsim.load("type_ii_reach")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield site, server, Display(server, site, END)
    server.stop()


@pytest.mark.parametrize("name", ARMS)
def test_bars_lie_on_their_members(name):
    """Middles and turns of the bars against the nodes: every bar is within its member, and tubes are as long as theirs."""
    chain = Chain(load_manipulator(MODELS / name / f"{name}.toml"), hanging_mount(3.0))
    bars, nodes = make_bars(chain), chain.nodes(chain.straight)
    points = place_points(chain, nodes)
    middles, turns = bars.place(points)
    w, x, y, z = turns.T
    along = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=-1)  # z, turned
    tool, direction = chain.tool(chain.straight)
    assert np.allclose(points[-1], tool, atol=TIGHT)
    assert np.allclose(points[-1] - points[-2], chain.manipulator.tip_plate.tool_offset * direction, atol=TIGHT)
    for side in (-0.5, 0.5):
        end = middles + side * bars.length[:, None] * along
        near, far = points[bars.ends[:, 0]], points[bars.ends[:, 1]]
        span = far - near
        part = np.sum((end - near) * span, axis=-1) / np.sum(span**2, axis=-1)
        assert np.linalg.norm(end - near - part[:, None] * span, axis=-1).max() < STRAIGHT
        assert part.min() > -TIGHT
        assert part.max() < 1 + TIGHT
    driven = np.isin(bars.owner, chain.truss.actuated)
    tubes = (bars.owner >= 0) & ~driven
    assert np.allclose(bars.length[tubes], chain.truss.lengths(nodes)[bars.owner[tubes]], atol=TIGHT)
    assert sorted(set(bars.owner[bars.owner >= 0].tolist())) == list(range(len(chain.truss.members)))


def test_a_sight_moves_and_colours_the_arm(shown):
    site, server, display = shown
    rng = np.random.default_rng(3)
    nodes, axial = site.chain.nodes(site.chain.straight), rng.normal(0, END, len(site.truss.members))
    arm = server.scene.get_handle_by_name("/arm/members")
    before = arm.batched_positions.copy()
    display.show(Sight(nodes=nodes, axial=axial, height=0.5))
    bars = make_bars(site.chain)
    middles, _ = bars.place(place_points(site.chain, nodes))
    assert np.abs(arm.batched_positions - middles).max() < 1.5e-4  # half a grain, and single precision
    assert np.abs(arm.batched_positions - before).max() > 1
    owned = bars.owner >= 0
    wanted = 255 * force_colours(axial, END)[bars.owner[owned], :3]
    assert np.abs(arm.batched_colors[owned] - wanted).max() < 1
    mast = server.scene.get_handle_by_name("/mast")
    assert mast.position[2] == pytest.approx(site.scene.pivot_height + 0.5)


def test_aids_are_seen_only_where_they_are_given(shown):
    site, server, display = shown
    nodes, axial = site.chain.nodes(site.start), np.zeros(len(site.truss.members))
    target = np.array([1.0, 2.0, 3.0, 0.0, 0.0, -1.0])
    gap = LeastGap(1.0, "payload to sludge", np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]]))
    handles = [server.scene.get_handle_by_name(name) for name in ("/target", "/gap", "/gap/name")]
    display.show(Sight(nodes=nodes, axial=axial, target=target, gap=gap))
    assert [handle.visible for handle in handles] == [True, True, True]
    assert handles[0].position == pytest.approx(target[:3])
    assert handles[2].text == "1.00 m"
    display.show(Sight(nodes=nodes, axial=axial))
    assert [handle.visible for handle in handles] == [False, False, False]


def test_things_of_the_tank_are_named(shown):
    site, server, _ = shown
    names = [site.tank.waste.kind, site.tank.arm_riser.name, *(item.name for item in site.tank.equipment)]
    for name in names:
        label = server.scene.get_handle_by_name(f"/names/{name.replace(' ', '_')}")
        assert label.text == name.replace("_", " ")
    assert server.scene.get_handle_by_name("/mast/name").text == "mast"


def test_an_update_is_cheap(shown):
    site, _, display = shown
    sight = Sight(nodes=site.chain.nodes(site.start), axial=np.ones(len(site.truss.members)))
    took = []
    for _ in range(20):
        begin = time.process_time()
        display.show(sight)
        took.append(time.process_time() - begin)
    assert min(took) < MOST


def test_wrong_arrays_are_refused_by_their_shapes(shown):
    _, _, display = shown
    with pytest.raises(ValueError, match=r"nodes \(2, 3\) and forces \(1,\) are not those of an arm with \d+ nodes"):
        display.show(Sight(nodes=np.zeros((2, 3)), axial=np.zeros(1)))


def test_the_scale_says_its_ends():
    svg = draw_scale(82e3)
    assert "+82" in svg
    assert f"{MINUS}82" in svg
    assert "compression" in svg


def test_the_missing_extra_is_named(monkeypatch):
    for name in [name for name in sys.modules if name == "vgtsim.web" or name.startswith("vgtsim.web.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MissingLibraryError, match=r"viser is missing; install it with: pip install 'vgtsim\[live\]'"):
        import vgtsim.web  # noqa: F401


@pytest.mark.parametrize("name", TANKS)
def test_every_thing_in_a_shipped_tank_is_drawn(name):
    tank = load_tank(SCENES / f"{name}.toml")
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    show_tank(server.scene, tank)
    wanted = [item.name for item in (*tank.standing, *tank.solids)] + ["shell", "risers", "rings"]
    assert all(server.scene.get_handle_by_name(f"/tank/{thing}") is not None for thing in wanted)
    solid = [thing for thing in (*wanted, "waste", "soil") if thing != "rings"]
    assert not any(is_both_sided(server, f"/tank/{thing}") for thing in solid)
    assert is_both_sided(server, "/tank/rings")  # they have no thickness
    server.stop()


def is_both_sided(server, name):
    """Whether a thing is drawn from both sides, at twice the cost; a thing that is not there is not."""
    handle = server.scene.get_handle_by_name(name)
    if handle is None:
        return False
    size = int.from_bytes(handle.glb_data[12:16], "little")  # after the header of a binary glTF
    return json.loads(handle.glb_data[20 : 20 + size])["materials"][0]["doubleSided"]


@pytest.mark.parametrize("name", TANKS)
def test_layers_without_the_surfaces_where_they_meet_are_one_closed_solid(name):
    """Liner on concrete, and dome under soil: from outside nothing is missing."""
    tank = load_tank(SCENES / f"{name}.toml")
    profile = make_profile(tank.shell)
    for front in (False, True):
        for pieces in (("dish",), ("knuckle", "wall")):
            make = solids.make_liner, solids.make_concrete
            check_layers(*([layer(tank, profile, front, pieces, covered=c) for layer in make] for c in (True, False)))
    if not tank.shell.open and not tank.arm_riser.radius:  # a hole beside the axis is cut into each on its own
        make = solids.make_dome, solids.make_soil
        check_layers(*([layer(tank, profile, False, covered=c) for layer in make] for c in (True, False)))


def check_layers(covered, whole):
    assert all(solid.is_watertight for solid in whole)
    assert all(len(thin.faces) < 0.8 * len(solid.faces) for thin, solid in zip(covered, whole, strict=True))
    joint = trimesh.util.concatenate(covered)
    joint.merge_vertices()
    assert joint.is_watertight
    assert joint.volume == pytest.approx(sum(solid.volume for solid in whole), rel=1e-9)


@pytest.mark.long
def test_waste_that_is_cut_falls_by_its_heights_and_a_thin_layer_waits_for_the_next():
    site, diggings = vgtsim.load("type_ii_reach"), vgtsim.load("type_ii_heel").diggings
    site.__dict__["diggings"], chain = diggings, site.chain  # of another tank: no path of an arm is needed here
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    display, pit = Display(server, site, END), server.scene.get_handle_by_name("/tank/pit")

    def show(heights):
        nodes = chain.nodes(chain.straight)
        display.show(Sight(nodes=nodes, axial=np.zeros(len(chain.truss.members)), heights=heights))
        return np.array(pit.vertices)

    whole = show(None)
    assert np.allclose(whole, np.column_stack([diggings.places, diggings.start]), atol=GRAIN)
    across = np.cross(*(whole[pit.faces[:, k]] - whole[pit.faces[:, 0]] for k in (1, 2)))[:, 2]
    low, high = diggings.places.min(axis=0), diggings.places.max(axis=0)
    assert np.abs(across).sum() / 2 == pytest.approx(np.prod(high - low), rel=1e-3)  # once over the whole window
    cut = np.array(diggings.start)
    cut[100] -= 0.004
    assert np.array_equal(show(cut), whole)
    cut[100] -= 0.004
    assert np.allclose(show(cut)[:, 2], cut, atol=GRAIN)
    assert np.allclose(show(None), whole, atol=GRAIN)
    server.stop()
