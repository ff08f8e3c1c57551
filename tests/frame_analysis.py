"""Near-end axial forces of an arm at rest by a finite-element frame program: none of the project's statics takes part.

Weights are put on the hubs in proportion to the distance of each member's centre of mass, the payload on a node of its
own that three bars hold to the tip plate.
"""

from __future__ import annotations

import numpy as np
from Pynite import FEModel3D

from vgtsim.description import Scene
from vgtsim.kinematics import Chain
from vgtsim.kinematics.inertia import make_member_inertia


def solve_with_pynite(chain: Chain, scene: Scene, nodes: np.ndarray) -> np.ndarray:
    truss, arm, g = chain.truss, chain.manipulator, scene.task.simulation.gravity
    inertia = make_member_inertia(chain)
    span = nodes[truss.ends[:, 1]] - nodes[truss.ends[:, 0]]
    length = np.linalg.norm(span, axis=1)
    mass = inertia.mass.sum(axis=1)
    centre = (inertia.mass[:, 0] * inertia.centre[:, 0] + inertia.mass[:, 1] * (length - inertia.centre[:, 1])) / mass
    near = mass * g * (1 - centre / length)
    weight = np.full(len(nodes) + 1, arm.hub_mass * g)
    np.add.at(weight, truss.ends[:, 0], near)
    np.add.at(weight, truss.ends[:, 1], mass * g - near)
    weight[truss.tip] += arm.tip_plate_mass * g / 3
    weight[-1] = scene.task.payload.mass * g

    corner = nodes[truss.tip]
    normal = np.cross(corner[0] - corner[2], corner[1] - corner[2])
    tool = corner.mean(axis=0) + arm.tip_plate.tool_offset * normal / np.linalg.norm(normal)
    last = len(nodes)
    tripod = [(node, last) for node in range(truss.tip.start, truss.tip.stop)]
    bars = [*map(tuple, truss.ends), *map(tuple, truss.tip_edges), *tripod]

    frame = FEModel3D()
    frame.add_material("steel", 2e11, 8e10, 0.3, 7850.0)
    frame.add_section("bar", 1e-3, 1e-7, 1e-7, 1e-7)
    for index, point in enumerate(np.vstack([nodes, tool])):
        frame.add_node(f"n{index}", *map(float, point))
        frame.def_support(f"n{index}", *[index < 3] * 3, True, True, True)
        frame.add_node_load(f"n{index}", "FZ", -float(weight[index]))
    for index, (first, second) in enumerate(bars):
        frame.add_member(f"m{index}", f"n{first}", f"n{second}", "steel", "bar")
        frame.def_releases(f"m{index}", Ryi=True, Rzi=True, Ryj=True, Rzj=True)
    frame.analyze_linear(check_stability=False)
    bar = np.array([-frame.members[f"m{i}"].axial(0.0, "Combo 1") for i in range(len(truss.members))])
    return bar - near * span[:, 2] / length
