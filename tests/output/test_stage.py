"""A picture is drawn in part and looks as if it were drawn whole."""

from contextlib import closing
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from vgtsim.description.conveyance import Conveyance
from vgtsim.output.colours import scale_end
from vgtsim.output.replay import project
from vgtsim.output.stage import Stage, compile_view
from vgtsim.site import Site

SIZE = (320, 180)
LEVELS = 4  # of 255: lighting and smoothing with another projection matrix round another way
ODD = 1e-4  # of the pixels: samples that lie on an edge but for rounding

pytestmark = [pytest.mark.long, pytest.mark.render]


@pytest.fixture(scope="module")
def stage(site, log, egl):
    with closing(Stage(site, compile_view(site), SIZE, scale_end(log.axial(site.truss.ends)))) as made:
        yield made


@pytest.mark.parametrize("camera", ["overview", "cutaway", "riser", "tool"])
def test_a_part_of_a_picture_is_that_of_the_whole(stage, site, log, camera, monkeypatch):
    axial = log.axial(site.truss.ends)
    drawn = [stage.draw(camera, log.nodes[k], axial[k]).result()[0] for k in (0, 100, 239)]
    monkeypatch.setattr(stage, "_find_arm", lambda: (0, 0, *SIZE))
    for picture, k in zip(drawn, (0, 100, 239), strict=True):
        whole, _ = stage.draw(camera, log.nodes[k], axial[k]).result()
        assert (np.abs(picture.astype(int) - whole).max(axis=-1) > LEVELS).mean() < ODD
        assert picture.std() > LEVELS


def test_the_part_is_small_and_holds_all_that_moves(stage, site, log):
    axial = log.axial(site.truss.ends)
    first, second = (stage.draw("cutaway", log.nodes[k], axial[k]).result()[0] for k in (100, 239))
    left, top, right, bottom = stage._find_arm()
    assert 0 < (right - left) * (bottom - top) < 0.5 * SIZE[0] * SIZE[1]
    ground = stage._grounds["cutaway"]
    outside = np.ones(ground.shape[:2], dtype=bool)
    outside[top:bottom, left:right] = False
    np.testing.assert_array_equal(second[outside], ground[outside])
    assert (second != ground).any()
    assert (first != second).any()


def test_an_arm_out_of_sight_leaves_the_tank_alone_and_one_beside_the_camera_takes_the_whole(stage, site, log):
    axial = np.zeros(len(site.truss.members))
    below = log.nodes[0] - [0.0, 0.0, 500.0]
    picture, _ = stage.draw("cutaway", below, axial).result()
    np.testing.assert_array_equal(picture, stage._grounds["cutaway"])
    behind = log.nodes[0] - [0.0, 500.0, 0.0]
    stage.draw("cutaway", behind, axial).result()
    assert stage._find_arm() == (0, 0, *SIZE)


def test_the_line_of_conveyance_is_drawn_along_the_axis(stage, site, log):
    """Pictures with and without it differ, and nowhere but near the axis."""
    task = site.task.model_copy(update={"conveyance": Conveyance(diameter=0.12)})
    fed, axial = Site(replace(site.scene, task=task)), np.zeros(len(site.truss.members))
    bare, _ = stage.draw("cutaway", log.nodes[100], axial).result()
    with closing(Stage(fed, compile_view(fed), SIZE, 1.0)) as made:
        picture, _ = made.draw("cutaway", log.nodes[100], axial).result()
        middles = log.nodes[100][site.truss.faces].mean(axis=1)
        axis = np.concatenate([middles[:-1] + t * np.diff(middles, axis=0) for t in np.linspace(0, 1, 50)])
        made._look("cutaway", mujoco.mjtCatBit.mjCAT_ALL)
        columns, rows = project(made._scene, axis, *SIZE).T
    other = np.argwhere(np.abs(picture.astype(int) - bare).max(axis=-1) > LEVELS)
    assert len(other) > 50
    away = np.hypot(other[:, :1] - rows, other[:, 1:] - columns).min(axis=1)
    assert away.max() < 8


def test_an_open_stand_is_drawn_without_a_wall(site, log, egl):
    shell = site.tank.shell.model_copy(update={"open": True})
    bare = Site(replace(site.scene, tank=site.tank.model_copy(update={"shell": shell})))
    axial = log.axial(site.truss.ends)
    with closing(Stage(bare, compile_view(bare), SIZE, scale_end(axial))) as made:
        picture, _ = made.draw("cutaway", log.nodes[100], axial[100]).result()
    assert picture.std() > LEVELS
