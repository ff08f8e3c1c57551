"""Things in a tank that are no upright cylinders, risers beside its axis, and tanks over tanks."""

import json
from math import pi

import numpy as np
import pytest
import trimesh

from vgtsim.description import load_scene, load_tank
from vgtsim.description.files import dump_scene, parse_scene
from vgtsim.description.mesh_file import split_meshes
from vgtsim.errors import DescriptionError, MissingLibraryError
from vgtsim.geometry import cylinder_axis, find_hulls, make_profile, obstacles
from vgtsim.site import Site

HEAD = 'base = "type_ii"\nname = "mine"\ntitle = "Mine"\n'


def a_tank(folder, text):
    file = folder / "mine.toml"
    file.write_text(HEAD + text)
    return file


def a_mesh(folder, mesh, name="thing.stl"):
    mesh.export(folder / name)
    return f'[[meshes]]\nname = "thing"\nfile = "{name}"\nunit = "1 mm"\nradius = "5 m"\nazimuth = "90 deg"\n'


def test_a_tank_over_another_holds_what_differs(tmp_path):
    mine, base = load_tank(a_tank(tmp_path, '[waste]\nlevel = "1 m"\n')), load_tank("type_ii")
    assert mine.waste.level == 1.0
    assert mine.waste.density == base.waste.density
    assert mine.shell == base.shell
    assert mine.equipment == base.equipment


def test_a_tank_that_leads_back_to_itself_is_refused(tmp_path):
    file = a_tank(tmp_path, "")
    file.write_text(file.read_text().replace("type_ii", "mine.toml"))
    with pytest.raises(DescriptionError, match="a tank that does not lead back here"):
        load_tank(file)


def test_a_ring_of_pipes_and_boxes_turns_as_one(tmp_path):
    text = """[[equipment]]
name = "pipe"
diameter = "0.1 m"
radius = "4 m"
azimuth = "10 deg"
top = "3 m"
top_radius = "6 m"
top_azimuth = "40 deg"
count = 3

[[boxes]]
name = "box"
length = "1 m"
width = "0.5 m"
radius = "7 m"
azimuth = "0 deg"
heading = "20 deg"
top = "1 m"
count = 4
first = 0
"""
    tank = load_tank(a_tank(tmp_path, text))
    profile = make_profile(tank.shell)
    pipes = [cylinder_axis(item, profile) for item in tank.standing]
    assert [item.name for item in tank.things] == ["pipe_1", "pipe_2", "pipe_3", "box_0", "box_1", "box_2", "box_3"]
    for k, turn in enumerate((0, 2 * pi / 3, 4 * pi / 3)):
        spin = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
        assert pipes[k] == pytest.approx(pipes[0] @ spin.T)
    assert pipes[0][0, 2] == pytest.approx(float(profile.floor_at(4.0)))
    first, second = (find_hulls(item, profile)[0] for item in tank.solids[:2])
    assert second == pytest.approx(first @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]).T)
    size = np.linalg.norm(first[:, None] - first[None], axis=-1)
    assert size.max() == pytest.approx(np.sqrt(1 + 0.25 + np.ptp(first[:, 2]) ** 2))


def test_a_box_that_hangs_ends_at_the_dome(tmp_path):
    text = '[[boxes]]\nname = "box"\nlength = "1 m"\nwidth = "1 m"\nradius = "5 m"\nazimuth = 0\nbottom = "6 m"\n'
    tank = load_tank(a_tank(tmp_path, text))
    profile = make_profile(tank.shell)
    corners = find_hulls(tank.solids[0], profile)[0]
    assert corners[:, 2].min() == 6.0
    assert corners[:, 2].max() == pytest.approx(float(profile.ceiling_at(4.5)), abs=0.01)  # where the dome is highest


def test_a_convex_mesh_stands_on_the_floor_in_its_own_unit(tmp_path):
    mesh = trimesh.creation.cone(radius=400, height=1000, sections=12)
    tank = load_tank(a_tank(tmp_path, a_mesh(tmp_path, mesh)))
    profile = make_profile(tank.shell)
    (hull,) = find_hulls(tank.solids[0], profile)
    assert np.ptp(hull[:, 2]) == pytest.approx(1.0)
    assert hull[:, 2].min() == pytest.approx(float(profile.floor_at(5.0)))
    assert hull[:, :2].mean(axis=0) == pytest.approx([0, 5], abs=0.05)
    assert len(obstacles(tank).solids.owner) == 1


def test_a_mesh_with_a_bay_is_cut_into_parts_that_fill_it(tmp_path):
    pytest.importorskip("coacd")
    outline = [[0, 0], [900, 0], [900, 300], [300, 300], [300, 900], [0, 900]]
    mesh = extrude(outline, 500)
    parts = load_tank(a_tank(tmp_path, a_mesh(tmp_path, mesh))).meshes[0].parts
    assert 2 <= len(parts) <= 4
    volumes = [trimesh.convex.convex_hull(np.array(part)).volume for part in parts]
    assert sum(volumes) == pytest.approx(mesh.volume * 1e-9, rel=0.05)
    again = split_meshes(load_tank(a_tank(tmp_path, a_mesh(tmp_path, mesh))), tmp_path / "mine.toml").meshes[0].parts
    assert again == parts


def extrude(outline, height):
    """A prism over an L-shaped outline."""
    low = np.array([[x, y, 0] for x, y in outline], float)
    faces = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    count = len(low)
    sides = [[i, (i + 1) % count, (i + 1) % count + count] for i in range(count)]
    sides += [[i, (i + 1) % count + count, i + count] for i in range(count)]
    ends = [face[::-1] for face in faces] + [[i + count for i in face] for face in faces]
    return trimesh.Trimesh(np.concatenate([low, low + [0, 0, height]]), ends + sides)


def test_without_coacd_the_error_names_the_extra(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "coacd", None)
    mesh = extrude([[0, 0], [901, 0], [901, 300], [300, 300], [300, 900], [0, 900]], 500)
    with pytest.raises(MissingLibraryError, match=r"vgtsim\[mesh\]"):
        load_tank(a_tank(tmp_path, a_mesh(tmp_path, mesh)))


def test_a_mesh_that_cannot_be_used_is_told_with_its_key(tmp_path):
    text = a_mesh(tmp_path, trimesh.creation.box())
    for change, told in [
        (text.replace("thing.stl", "lost.stl"), "No such file"),
        (text.replace("thing.stl", "open.stl"), "holes"),
        (text + "parts = [[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]]\n", "one of the two"),
    ]:
        mesh = trimesh.creation.box()
        trimesh.Trimesh(mesh.vertices, mesh.faces[:-1]).export(tmp_path / "open.stl")
        with pytest.raises(DescriptionError, match=rf"(?s)mine\.toml.*meshes\.0.*{told}"):
            load_tank(a_tank(tmp_path, change))


def test_a_scene_hangs_its_arm_in_the_riser_that_it_names():
    scene = Site(load_scene("side_riser")).scene
    assert scene.tank.arm_riser.name == "riser_42in_side"
    assert [riser.name for riser in scene.tank.risers] == ["riser_42in"]
    again = parse_scene(dump_scene(scene))
    assert again.tank == scene.tank  # with the parts of its meshes: a log needs no file
    assert json.loads(dump_scene(scene))["tank"]["meshes"][0]["file"] is None


def test_an_unknown_riser_is_told_with_the_nearest(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text('base = "side_riser"\n[mast]\nriser = "riser_42in_sid"\n')
    with pytest.raises(DescriptionError, match=r"mast\.riser.*did you mean 'riser_42in_side'"):
        load_scene(file)
