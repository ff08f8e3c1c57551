"""A site on a page: the tank drawn once, then the arm as one batch of bars, coloured by axial force, moved at every update."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from viser import ViserServer

from vgtsim.kinematics import Chain
from vgtsim.kinematics.vectors import quaternions_to
from vgtsim.output.colours import force_colours
from vgtsim.site import Site
from vgtsim.web.parts import NOBODY, make_bars, place_points, turn_plate
from vgtsim.web.scale import to_bytes
from vgtsim.web.scenery import NAME, SHARP, add_scenery, add_solid, make_mark

Array = NDArray[np.float64]

_STEEL, _MAST, _PAYLOAD, _TARGET, _GAP = (70, 76, 86), (96, 104, 116), (240, 150, 40), (255, 214, 10), (230, 60, 180)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_GRAIN = 2.0**-13  # 0.12 mm, and as much of a metre at the end of a bar
_FIELD = np.radians(38)  # of view, upright
_SECTIONS = 12  # sides of a bar, which is some pixels wide


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight:
    """What is seen at one instant, in frame G.

    Attributes:
        nodes: Nodes of the arm, shape (N, 3), m; mast and hoist included.
        axial: Axial force of each member, tension positive, shape (M,), N.
        height: Of the mast above its working depth, m.
        target: Tool point and direction that are wanted, shape (6,), m; or none.
        gap: Two points, shape (2, 3), m, between the arm and the nearest thing; or none.
        near: Name of that thing, with the distance where that is wanted.
    """

    nodes: Array
    axial: Array
    height: float = 0.0
    target: Array | None = None
    gap: Array | None = None
    near: str = ""


class Display:
    """A site drawn in a viser server."""

    def __init__(self, server: ViserServer, site: Site, end: float) -> None:
        """Draw the site with its arm at the start; the colour scale ends at this axial force, N, see `scale_end`."""
        self.end = end
        self._server, self._chain, self._bars = server, site.chain, make_bars(site.chain)
        self._pivot, self._height = np.array(site.chain.mount[:3, 3]), 0.0
        self._hub_nodes = np.flatnonzero(site.truss.hubs)
        self._owned = self._bars.owner != NOBODY
        self._colours = np.full((len(self._owned), 3), _STEEL, np.uint8)
        radius, crown = site.tank.shell.inner_diameter / 2, site.tank.shell.crown
        camera = server.initial_camera
        camera.position, camera.look_at = (0.0, -2.35 * radius, 0.9 * crown), (0.0, 0.0, 0.5 * crown)
        camera.fov = _FIELD
        with server.atomic():
            add_scenery(server.scene, site)
            self._add_arm(site)
            self._add_mast(site)
            self._add_aids()

    def show(self, sight: Sight) -> None:
        """Move the arm, its mast and the aids to what is seen, in one change of the page.

        Raises:
            ValueError: The nodes or forces are not those of the arm.
        """
        count, members = len(self._chain.truss.nodes), len(self._chain.truss.members)
        if sight.nodes.shape != (count, 3) or sight.axial.shape != (members,):
            found = f"nodes {sight.nodes.shape} and forces {sight.axial.shape}"
            raise ValueError(f"{found} are not those of an arm with {count} nodes and {members} members")
        points = place_points(self._chain, sight.nodes)
        middles, turns = self._bars.place(points)
        shades = to_bytes(force_colours(sight.axial, self.end))
        colours = self._colours.copy()
        colours[self._owned] = shades[self._bars.owner[self._owned]]
        with self._server.atomic():
            self._arm.batched_positions, self._arm.batched_wxyzs = _round(middles), _round(turns)
            self._arm.batched_colors = colours
            self._hubs.batched_positions = _round(points[self._hub_nodes])
            self._plate.position, self._plate.wxyz = points[-2], _quaternion(self._chain, sight.nodes)
            self._payload.position = points[-1]
            if sight.height != self._height:
                self._mast.position = self._pivot + [0.0, 0.0, sight.height]
                self._height = sight.height
            self._show_target(sight.target)
            self._show_gap(sight)

    def _add_arm(self, site: Site) -> None:
        scene, points = self._server.scene, place_points(site.chain, site.chain.nodes(site.start))
        middles, turns = self._bars.place(points)
        bar, ball = _make_bar(), trimesh.creation.icosphere(2, radius=site.arm.hub.radius)
        self._arm = scene.add_batched_meshes_simple(
            "/arm/members",
            bar.vertices,
            bar.faces,
            turns,
            middles,
            batched_scales=self._bars.scales,
            batched_colors=self._colours,
            lod="off",
            cast_shadow=False,
        )
        self._hubs = scene.add_batched_meshes_simple(
            "/arm/hubs",
            ball.vertices,
            ball.faces,
            np.tile(_UPRIGHT, (len(self._hub_nodes), 1)),
            points[self._hub_nodes],
            batched_colors=_STEEL,
            lod="off",
            cast_shadow=False,
        )
        middle, R = turn_plate(site.chain, points[:-2])
        corners = (points[site.truss.tip] - middle) @ R
        half = np.array([0.0, 0.0, site.arm.tip_plate.thickness / 2])
        plate = trimesh.convex.convex_hull(np.concatenate([corners - half, corners + half]))
        self._plate = add_solid(scene, "/arm/tip_plate", plate, _STEEL)
        load = trimesh.creation.icosphere(3, radius=site.task.payload.radius)
        self._payload = add_solid(scene, "/arm/payload", load, _PAYLOAD)

    def _add_mast(self, site: Site) -> None:
        scene, pipe = self._server.scene, site.mast
        shape = trimesh.creation.cylinder(pipe.outer_diameter / 2, height=pipe.length, sections=24)
        shape.apply_translation([0.0, 0.0, pipe.length / 2])
        self._mast = add_solid(scene, "/mast", shape, _MAST)
        self._mast.position = self._pivot
        scene.add_label(
            "/mast/name", "mast", position=(0.0, 0.0, pipe.length), font_screen_scale=NAME, anchor="bottom-center"
        )

    def _add_aids(self) -> None:
        """Add target and gap, hidden until they are shown."""
        scene, hidden = self._server.scene, np.zeros((1, 2, 3))
        self._target = add_solid(scene, "/target", make_mark(), _TARGET)
        self._gap = scene.add_line_segments(
            "/gap", hidden, _GAP, thickness=3.0, thickness_units="screen", visible=False
        )
        self._gap_name = scene.add_label("/gap/name", "", font_screen_scale=NAME, anchor="bottom-left", visible=False)
        self._target.visible = False

    def _show_target(self, target: Array | None) -> None:
        if target is not None:
            self._target.position, self._target.wxyz = target[:3], quaternions_to(target[None, 3:])[0]
        if self._target.visible != (target is not None):
            self._target.visible = target is not None

    def _show_gap(self, sight: Sight) -> None:
        if sight.gap is not None:
            self._gap.points = _round(sight.gap[None])
            self._gap_name.position, self._gap_name.text = sight.gap.mean(axis=0), sight.near
        if self._gap.visible != (sight.gap is not None):
            self._gap.visible = self._gap_name.visible = sight.gap is not None


def _round(values: Array) -> NDArray[np.float32]:
    """Single precision on a grid that no picture resolves, so that records of a page pack to half their size."""
    return (np.round(values / _GRAIN) * _GRAIN).astype(np.float32)


def _make_bar() -> trimesh.Trimesh:
    """A bar along z of radius and length 1, its middle at the origin, round on its side and flat at its ends."""
    return trimesh.graph.smooth_shade(trimesh.creation.cylinder(1.0, height=1.0, sections=_SECTIONS), angle=SHARP)


def _quaternion(chain: Chain, nodes: Array) -> Array:
    matrix = np.eye(4)
    matrix[:3, :3] = turn_plate(chain, nodes)[1]
    return trimesh.transformations.quaternion_from_matrix(matrix)
