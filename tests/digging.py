"""A short arm over waste that it cuts: two modules, a patch below the tool, and a programme of rows made by hand."""

from __future__ import annotations

import dataclasses

import numpy as np
from playing import bend, change, hoist, shorten

from vgtsim.description import CuttingTool, Patch, Scene
from vgtsim.description.mission import CutStep, InsertStep, MoveStep
from vgtsim.planning import Leg, Tour
from vgtsim.site import Site

TOOL = CuttingTool(
    kind="jet", width=0.4, reach=0.45, removal=1e-3, energy=100.0, ramp=0.4, pressure=3.8e8, flow=3.15e-4
)
DEPTH, GRID, CLEAR = 0.06, 0.1, 0.45 - 0.06  # m: of the layer, between heights, of the tool point over the waste
BENT, TURNED = ([0.5, 0.3], [0.4, 0.9]), ([0.53, 0.28], [0.43, 0.85])  # bends and azimuths, rad


def over_waste(scene: Scene, tool: CuttingTool = TOOL, **settings: object) -> Scene:
    """The scene's first two modules, whose mission cuts the waste below their tool."""
    scene = hoist(change(shorten(scene, 2), log_rate=25.0, **settings))
    chain = Site(scene).chain
    place, direction = (item.tolist() for item in chain.tool(bend(scene, *BENT)))
    waste = scene.tank.waste.model_copy(update={"level": place[2] - CLEAR, "grid": GRID, "strength": 1e6})
    patch = Patch(name="here", corner=(place[0] - 0.1, place[1] - 0.1), along=(0.2, 0.0), across=(0.0, 0.2))
    goal = scene.task.motion.goals[0].model_copy(
        update={"name": "above", "position": tuple(place), "direction": tuple(direction), "at": None}
    )
    motion = scene.task.motion.model_copy(
        update={"goals": (goal,), "hold": 0.4, "acceleration": 0.2, "settle_speed": 1e-8, "patience": 1.0}
    )
    steps = (
        InsertStep(do="insert"),
        MoveStep(do="move", goal="above"),
        CutStep(do="cut", patch="here", depth=DEPTH, rows=2),
    )
    task = scene.task.model_copy(
        update={"tool": tool, "patches": (patch,), "mission": steps, "motion": motion, "contacts": ()}
    )
    tank = scene.tank.model_copy(update={"waste": waste})
    return dataclasses.replace(scene, task=task, tank=tank)


def sweep(site: Site, way: float = 2.4) -> Tour:
    """Rest, rest, and then a sweep of the tool at full power that lasts some s."""
    step, stations = site.timestep, [bend(site.scene, *pose) for pose in (BENT, TURNED)]
    s = np.linspace(0, 1, round(way / step) + 1)[:, None]
    s = s**4 * (35 - 84 * s + 70 * s**2 - 20 * s**3)
    lengths = site.chain.lengths(stations[0] + s * (stations[1] - stations[0]))
    part = np.linspace(0, 1, round(TOOL.ramp / step) + 1)[:-1]
    rise = part**2 * (3 - 2 * part)
    share = np.concatenate([rise, np.ones(len(lengths)), rise[::-1]])
    still = np.ones((len(part), 1))
    rows = np.concatenate([still * lengths[0], lengths, still * lengths[-1]])
    near = {"clearance": 1.0, "place": "nothing"}
    rests = [Leg(name=str(k), goal=k, lengths=lengths[:1].repeat(3, 0), q=stations[0], **near) for k in range(2)]
    return Tour(stations[0], (*rests, Leg(name="cut", goal=2, lengths=rows, q=stations[1], tool=share, **near)), step)
