"""What pictures of a tank show."""

import numpy as np
from matplotlib.figure import Figure

from vgtsim import load
from vgtsim.description import load_tank
from vgtsim.description.waste import Mound
from vgtsim.output.stage import compile_view
from vgtsim.output.tank_drawing import draw_rose, draw_tank_side, draw_tank_top


def test_a_scene_of_sections_is_shown_with_its_tank_and_members():
    site = load("side_riser")
    model = compile_view(site)
    names = {model.geom(k).name for k in range(model.ngeom)}
    assert {"tank/rings", "tank/analyser", "tank/pump_1", "tank/liner/back", *site.truss.member_names} <= names


def test_uneven_waste_is_drawn_as_high_as_its_mound():
    tank = load_tank("type_ii")
    mound = Mound(radius=5.0, azimuth=0.0, height=1.5, foot=3.0)
    heap = tank.model_copy(update={"waste": tank.waste.model_copy(update={"mounds": (mound,)})})
    tops = []
    for one in (tank, heap):
        axes = Figure().add_subplot()
        draw_tank_side(axes, one, 0.0)
        tops.append(max(path.vertices[:, 1].max() for path in axes.collections[0].get_paths()))
    level = tank.waste.level
    assert abs(tops[1] - level - 1.5) < 0.02  # heights are 0.2 m apart
    assert tops[0] < 2 * level + 1.0


def test_azimuths_and_rings_are_named_from_above():
    axes = Figure().add_subplot()
    tank = load("side_riser").tank
    draw_tank_top(axes, tank)
    draw_rose(axes, tank)
    told = {text.get_text() for text in axes.texts}
    assert {"0° (+x)", "90°", "330°", "2 m", "analyser", "fallen lance", "pump 2"} <= told
    assert any(
        np.allclose(patch.get_center(), tank.arm_riser.place) for patch in axes.patches if hasattr(patch, "get_center")
    )
