"""The exported truss: in equilibrium, and other programs read the same forces from it."""

from __future__ import annotations

import dataclasses
import json
import runpy

import numpy as np
import pytest
from offset_arms import with_offset
from playing import bend, change, play, shorten

from vgtsim.errors import DescriptionError
from vgtsim.output.truss_export import describe_truss, write_truss
from vgtsim.site import Site
from vgtsim.verification import find_instant

FINITE_ELEMENTS = 1e-6  # of the largest force


@pytest.fixture(scope="module")
def played(reach_scene):
    scene = change(shorten(reach_scene, 1), log_rate=40.0)

    def out_of_the_tank(spec):
        for geom in spec.geoms:
            geom.contype = geom.conaffinity = 0

    start, end = bend(scene, [0.3], [0.2]), bend(scene, [0.5], [0.5])
    return Site(scene), play(scene, start, end, 2.0, out_of_the_tank)


def test_exported_nodes_are_in_equilibrium(played):
    data = describe_truss(played[0], find_instant(*played))
    place = {node["name"]: np.array(node["position"]) for node in data["nodes"]}
    left = {node["name"]: np.array(node["load"]) for node in data["nodes"]}
    for bar in data["members"]:
        if bar["role"] == "rigid":
            continue
        near, far = bar["ends"]
        pull = bar["force"] * (place[far] - place[near]) / bar["length"]
        left[near], left[far] = left[near] + pull, left[far] - pull
    largest = max(abs(bar["force"]) for bar in data["members"])
    free = [node["name"] for node in data["nodes"] if not node["fixed"]][:-3]  # the rigid plate holds its own corners
    assert max(np.abs(left[name]).max() for name in free) < 1e-9 * largest
    corners = sum(left[node["name"]] for node in data["nodes"][-3:])
    assert np.abs(corners).max() < 1e-9 * largest


def test_exported_forces_are_the_measured_ones_within_a_members_own_weight(played):
    data = describe_truss(played[0], find_instant(*played, 1.0))
    assert data["time"] == pytest.approx(1.0, abs=0.03)
    for bar in data["members"]:
        assert abs(bar["force"] - bar["measured"]) < 500.0


def test_pynite_finds_the_exported_forces(played, tmp_path):
    site, log = played
    write_truss(site, find_instant(site, log), tmp_path, vtk=False)
    frame = runpy.run_path(str(tmp_path / "truss_pynite.py"))["frame"]
    frame.analyze_linear(check_stability=False)
    data = json.loads((tmp_path / "truss.json").read_text())
    largest = max(abs(bar["force"]) for bar in data["members"])
    for bar in data["members"]:
        if bar["role"] != "rigid":
            found = -frame.members[bar["name"]].axial(0.0, "Combo 1")
            assert abs(found - bar["force"]) < FINITE_ELEMENTS * largest


def test_paraview_s_file_holds_the_forces(played, tmp_path):
    meshio = pytest.importorskip("meshio")
    site, log = played
    *_, file = write_truss(site, find_instant(site, log), tmp_path)
    mesh, data = meshio.read(file), describe_truss(site, find_instant(site, log))
    assert mesh.points.shape == (len(data["nodes"]), 3)
    assert mesh.cell_data["force"][0] == pytest.approx([bar["force"] for bar in data["members"]])


def test_time_outside_the_log_and_a_joint_offset_are_refused(played):
    site, log = played
    with pytest.raises(DescriptionError, match=rf"time: found 99999 s; allowed: 0 to {log.time[-1]:.6g} s"):
        find_instant(*played, 99999.0)
    with pytest.raises(DescriptionError, match="0 where a truss is exported"):
        find_instant(Site(dataclasses.replace(site.scene, manipulator=with_offset(site.arm))), log)
