"""An arm as a line drawing in black, near members over far ones, and as a solid for other programs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from trimesh.visual import ColorVisuals

from vgtsim.arrays import Array
from vgtsim.kinematics import Chain, member_radii
from vgtsim.output.figure import save_figure, styled
from vgtsim.replacing import replacing

_BLACK, _WHITE = "#000000", "#ffffff"
_SINGLE = ((3.4, _WHITE), (1.5, _BLACK))  # widths of strokes over one another, points
_DOUBLE = ((5.5, _WHITE), (3.6, _BLACK), (2.0, _WHITE))
_VIEW = np.radians([-60.0, 20.0])  # azimuth of the eye and its height
_DPI = 200
_SOLID = {
    "longeron": (69, 115, 176),
    "cross_longeron": (115, 171, 209),
    "batten": (158, 158, 166),
    "actuator": (219, 115, 33),
}
_JOINT, _PLATE = (51, 56, 66), (89, 92, 102)


def draw_arm(chain: Chain, poses: dict[str, Array]) -> Figure:
    """Draw an arm in some poses side by side, in parallel projection: inputs, shape (n,), by the name over the drawing.

    Frame G has z up. Actuators are double lines, the mast flange and the tip plate filled triangles.
    """
    azimuth, height = _VIEW
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    eye = np.array([np.cos(azimuth) * np.cos(height), np.sin(azimuth) * np.cos(height), np.sin(height)])
    view = np.stack([right, np.cross(eye, right)])
    shapes = {name: chain.nodes(q) for name, q in poses.items()}
    flat = [nodes @ view.T for nodes in shapes.values()]
    widths = [np.ptp(points[:, 0]) + 0.6 for points in flat]
    tall = max(np.ptp(points[:, 1]) for points in flat) + 0.6
    scale = 7.0 / max(tall, sum(widths))
    with styled():
        size = (max(sum(widths) * scale, 2.5), max(tall * scale, 2.5) + 0.4)
        figure = Figure(figsize=size, layout="constrained", facecolor=_WHITE)
        row = figure.subplots(1, len(poses), squeeze=False, width_ratios=widths, sharey=True)[0]
        for axes, (name, nodes) in zip(row, shapes.items(), strict=True):
            _draw(axes, chain, nodes, view, eye, scale)
            axes.set_title(name, color=_BLACK, loc="center")
    return figure


def _draw(axes: Axes, chain: Chain, nodes: Array, view: Array, eye: Array, scale: float) -> None:
    truss, flat = chain.truss, nodes @ view.T
    ends = nodes[truss.ends]
    order = np.argsort(ends.mean(axis=1) @ eye)
    actuator = np.zeros(len(truss.members), dtype=bool)
    actuator[truss.actuated] = True
    unit = min(max(scale / 2.0, 0.25), 1.0)  # a long arm is drawn with thinner lines
    axes.fill(*flat[truss.base].T, color=_BLACK, linewidth=0)
    for index in order:  # each on a white halo that hides what is behind it
        strokes = _DOUBLE if actuator[index] else _SINGLE
        for width, colour in strokes:
            lines = LineCollection([flat[truss.ends[index]]], colors=colour, linewidths=width * unit, zorder=2)
            axes.add_collection(lines)
    for block in truss.rings.reshape(-1, 3):
        axes.plot(*flat[block[[0, 2]]].T, color=_BLACK, linewidth=4.0 * unit, zorder=3)
    axes.fill(*flat[truss.tip].T, color="#555555", linewidth=0, zorder=4)
    axes.plot(*flat[truss.hubs].T, "o", color=_BLACK, markersize=3.2 * unit, zorder=5)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def write_drawing(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a figure as PNG and as SVG; the stem is a path without suffix."""
    files = stem.with_suffix(".png"), stem.with_suffix(".svg")
    for file in files:
        save_figure(figure, file, _DPI)
    return files


def make_solid(chain: Chain, nodes: Array) -> trimesh.Scene:
    """Make an arm of cylinders and balls in a pose of nodes, shape (N, 3), m; z is up.

    Every member is a coloured mesh with its name in the truss.
    """
    truss, arm = chain.truss, chain.manipulator
    scene = trimesh.Scene()

    def add(mesh: trimesh.Trimesh, name: str, colour: tuple[int, int, int]) -> None:
        mesh.visual = ColorVisuals(mesh, face_colors=(*colour, 255))
        scene.add_geometry(mesh, geom_name=name, node_name=name)

    for member, radius in zip(truss.members, member_radii(chain), strict=True):
        bar = trimesh.creation.cylinder(float(radius), segment=nodes[list(member.ends)], sections=16)
        add(bar, member.name, _SOLID[member.role])
    for node in np.flatnonzero(truss.hubs).tolist():
        ball = trimesh.creation.icosphere(subdivisions=1, radius=arm.hub.radius)
        add(ball.apply_translation(nodes[node]), truss.nodes[node], _JOINT)
    for foot, middle, head in truss.rings.reshape(-1, 3).tolist():
        radius = arm.block_of(int(truss.node_module[middle])).diameter / 2
        post = trimesh.creation.cylinder(radius, segment=nodes[[foot, head]], sections=16)
        add(post, truss.nodes[middle], _JOINT)
    corners = nodes[truss.tip]
    normal = np.cross(corners[0] - corners[2], corners[1] - corners[2])
    half = arm.tip_plate.thickness / 2 * normal / np.linalg.norm(normal)
    add(trimesh.convex.convex_hull(np.concatenate([corners - half, corners + half])), "tip", _PLATE)
    return scene


def write_solid(solid: trimesh.Scene, stem: Path) -> tuple[Path, Path]:
    """Write a solid of an arm as GLB, with colours and names, and as STL, one mesh; the stem is a path without suffix."""
    glb, stl = stem.with_suffix(".glb"), stem.with_suffix(".stl")
    with replacing(glb) as whole:
        solid.export(whole)
    with replacing(stl) as whole:
        solid.to_mesh().export(whole)
    return glb, stl
