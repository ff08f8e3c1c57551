"""The replay shows what was logged."""

import dataclasses

import numpy as np
import pytest

from vgtsim.description.judging import Cut
from vgtsim.mjcf import build_spec, names
from vgtsim.output.colours import force_colours, scale_end
from vgtsim.output.replay import camera_at, frame_times, interpolate, make_replay, pose_model

PLACE = 1e-9  # m; rounding of positions of ten metres through quaternions
FORCE = 1e-6  # N; rounding of forces of 1e5 N


@pytest.fixture(scope="module")
def replay(site, log):
    model = build_spec(site).compile()
    return make_replay(model, site.truss, scale_end(log.axial(site.truss.ends)))


@pytest.mark.parametrize("record", [0, 100, 239])
def test_hubs_stand_where_they_were_logged(replay, site, log, record):
    pose_model(replay, log.nodes[record], log.axial(site.truss.ends)[record])
    free = range(site.truss.tip.start)
    hubs = np.array([replay.data.body(site.truss.nodes[node]).xpos for node in free])
    np.testing.assert_allclose(hubs, log.nodes[record, free], atol=PLACE)
    np.testing.assert_allclose(replay.data.site(names.TOOL).xpos, log.tool_position[record], atol=PLACE)


def test_members_and_rods_take_the_colour_of_their_force(replay, site, log):
    axial = log.axial(site.truss.ends)[50]
    pose_model(replay, log.nodes[50], axial)
    for index in (0, int(site.truss.actuated[4]), len(site.truss.members) - 1):
        member = site.truss.members[index]
        parts = [member.name, names.rod(member.name)] if member.role == "actuator" else [member.name]
        for part in parts:
            wanted = force_colours(axial[index], replay.end)
            np.testing.assert_allclose(replay.model.geom(part).rgba, wanted, rtol=1e-6)  # MuJoCo keeps floats


def test_colour_changes_side_with_the_sign_of_the_force(replay, site, log):
    force = np.full(len(site.truss.members), 0.8 * replay.end)
    shown = []
    for sign in (1, -1):
        pose_model(replay, log.nodes[0], sign * force)
        shown.append(replay.model.geom_rgba[replay.geoms].copy())
    assert (shown[0][:, 2] > shown[0][:, 0]).all()
    assert (shown[1][:, 0] > shown[1][:, 2]).all()


def test_interpolation_meets_the_records_and_is_linear_between(site, log):
    axial = log.axial(site.truss.ends)
    for record in (0, 7, len(log.time) - 1):
        found, nodes, force = interpolate(log, axial, float(log.time[record]))
        assert found == record
        np.testing.assert_allclose(nodes, log.nodes[record], atol=PLACE)
        np.testing.assert_allclose(force, axial[record], atol=FORCE)
    _, nodes, force = interpolate(log, axial, float(log.time[7:9].mean()))
    np.testing.assert_allclose(nodes, log.nodes[7:9].mean(axis=0), atol=PLACE)
    np.testing.assert_allclose(force, axial[7:9].mean(axis=0), atol=FORCE)


def test_a_run_of_one_record_can_be_shown(site, log):
    one = dataclasses.replace(log, time=log.time[:1], nodes=log.nodes[:1])
    found, nodes, _ = interpolate(one, log.axial(site.truss.ends)[:1], 0.0)
    assert found == 0
    np.testing.assert_array_equal(nodes, log.nodes[0])
    assert len(frame_times(one, 25, 2.0)) == 1


@pytest.mark.parametrize(("fps", "speed"), [(25, 2.0), (30, 1.0), (24, 7.0)])
def test_film_runs_at_the_speed_asked_for(log, fps, speed):
    times = frame_times(log, fps, speed)
    np.testing.assert_allclose(np.diff(times), speed / fps)
    assert times[0] == log.time[0]
    assert log.time[-1] - speed / fps < times[-1] <= log.time[-1]


def test_each_cut_lasts_until_its_end_and_the_last_for_ever():
    cuts = (Cut(camera="overview", until=4.0), Cut(camera="riser", until=9.0), Cut(camera="tool", until=11.0))
    assert [camera_at(cuts, time) for time in (0.0, 3.9, 4.0, 9.0, 99.0)] == [
        "overview",
        "overview",
        "riser",
        "tool",
        "tool",
    ]
