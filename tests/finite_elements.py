"""An arm as a pin-jointed finite-element model of PyNiteFEA, loads given: none of the project's solvers takes part."""

from __future__ import annotations

import numpy as np
from Pynite import FEModel3D

STIFF = 1e4  # rigid tip: bars this much stiffer than the stiffest member
ENOUGH = 1e-2  # of the way: a later pass moves the square of such a part or less, a hundredth of what is allowed


def settle_with_pynite(truss, nodes, spring, force, tool, tool_force, passes=4):
    """Nodes and tool point at rest under full load: each pass solves for the forces that Hooke's law leaves over."""
    ends = np.array([*map(tuple, truss.ends), *map(tuple, truss.tip_edges)])
    tripod = [(node, len(nodes)) for node in range(truss.tip.start, truss.tip.stop)]
    ends = np.concatenate([ends, tripod])
    points, loads = np.vstack([nodes, tool]), np.vstack([force, tool_force])
    stiff = np.concatenate([spring, np.full(len(ends) - len(spring), STIFF * spring.max())])
    rest = np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
    begun = points
    for _ in range(passes):
        span = points[ends[:, 1]] - points[ends[:, 0]]
        length = np.linalg.norm(span, axis=1)
        pull = (stiff * (length - rest) / length)[:, None] * span
        left = loads.copy()
        np.add.at(left, ends[:, 0], pull)
        np.add.at(left, ends[:, 1], -pull)
        shift = deflect_with_pynite(truss, points[:-1], spring, left[:-1], points[-1], left[-1])
        points = points + shift
        if np.abs(shift).max() < ENOUGH * np.abs(points - begun).max():
            break
    return points


def deflect_with_pynite(truss, nodes, spring, force, tool, tool_force):
    """Displacements of the nodes and of the tool point under forces on both.

    The rigid tip is a tetrahedron of very stiff bars over the three corners and the tool point.
    """
    last = len(nodes)
    tip = range(truss.tip.start, truss.tip.stop)
    bars = [*map(tuple, truss.ends), *map(tuple, truss.tip_edges), *[(node, last) for node in tip]]
    points = np.vstack([nodes, tool])
    hard = STIFF * spring.max()
    frame = FEModel3D()
    frame.add_material("steel", 2e11, 8e10, 0.3, 7850.0)
    loads = np.vstack([force, tool_force])
    for index, point in enumerate(points):
        frame.add_node(f"n{index}", *map(float, point))
        frame.def_support(f"n{index}", *[index < 3] * 3, True, True, True)
        for axis, value in zip(("FX", "FY", "FZ"), loads[index], strict=True):
            frame.add_node_load(f"n{index}", axis, float(value))
    for index, (first, second) in enumerate(bars):
        stiffness = spring[index] if index < len(spring) else hard
        area = stiffness * float(np.linalg.norm(points[second] - points[first])) / 2e11
        frame.add_section(f"s{index}", area, 1e-12, 1e-12, 1e-12)
        frame.add_member(f"m{index}", f"n{first}", f"n{second}", "steel", f"s{index}")
        frame.def_releases(f"m{index}", Ryi=True, Rzi=True, Ryj=True, Rzj=True)
    frame.analyze_linear(check_stability=False)
    moved = [[getattr(frame.nodes[f"n{i}"], axis)["Combo 1"] for axis in ("DX", "DY", "DZ")] for i in range(last + 1)]
    return np.array(moved)


def forces_with_pynite(truss, nodes, force):
    """Axial forces of the members, tension positive, under forces at the nodes; the tip plate is its three edges."""
    frame = FEModel3D()
    frame.add_material("steel", 200e9, 77e9, 0.3, 7850.0)
    frame.add_section("bar", 1e-3, 1e-6, 1e-6, 2e-6)
    for index, (position, load) in enumerate(zip(nodes, force, strict=True)):
        name = f"n{index}"
        frame.add_node(name, *map(float, position))
        frame.def_support(name, *[index < 3] * 3, True, True, True)
        for axis, value in zip(("FX", "FY", "FZ"), load, strict=True):
            frame.add_node_load(name, axis, float(value))
    for index, (first, second) in enumerate(np.concatenate([truss.ends, truss.tip_edges])):
        frame.add_member(f"m{index}", f"n{first}", f"n{second}", "steel", "bar")
        frame.def_releases(f"m{index}", Ryi=True, Rzi=True, Ryj=True, Rzj=True)
    frame.analyze_linear(check_stability=False)
    # PyNite counts compression positive
    return np.array([-frame.members[f"m{i}"].axial(0.0, "Combo 1") for i in range(len(truss.members))])
