"""A site on a page: the tank drawn once, then the arm as one batch of bars, coloured by axial force, moved at every update.

The colours have their scale in a piece of SVG.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from viser import ViserServer

from vgtsim.arrays import Array
from vgtsim.kinematics import Chain, quaternions_to
from vgtsim.output.colours import force_colours
from vgtsim.output.quantities import MINUS
from vgtsim.positioning import LeastGap
from vgtsim.site import Site
from vgtsim.web.parts import NOBODY, make_bars, place_points, turn_plate
from vgtsim.web.scenery import NAME, SHARP, add_baked, add_name, add_pit, add_scenery, make_mark, place_pit

_STEEL, _MAST, _PAYLOAD, _TARGET, _GAP = (70, 76, 86), (110, 118, 130), (240, 150, 40), (255, 214, 10), (230, 60, 180)
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_GRAIN = 2.0**-12  # 0.24 mm, and as much of a metre at the end of a bar
_ROUND = 24  # sides of the mast
_LARGER = 1.3  # than the mark of a goal, which the target covers
_LAYER = 0.005  # m of waste: a thinner cut is shown with the next ones
_SECTIONS = 8  # sides of a bar, which is some pixels wide
_STEPS = 41  # colours of the scale; odd, so that one of them is the grey of no force
_WIDE, _HIGH = 240, 46  # units of the scale, about pixels


@dataclass(frozen=True, kw_only=True, eq=False)
class Sight:
    """What is seen at one instant, in frame G.

    Attributes:
        nodes: Nodes of the arm, shape (N, 3), m; mast and hoist included.
        axial: Axial force of each member, tension positive, shape (M,), N.
        height: Of the mast above its working depth, m.
        heights: Of the waste in the site's diggings, shape (P,), m; or none, where nothing was cut.
        target: Tool point and direction that are wanted, shape (6,), m; or none.
        gap: Between the arm and the nearest thing; or none.
    """

    nodes: Array
    axial: Array
    height: float = 0.0
    heights: Array | None = None
    target: Array | None = None
    gap: LeastGap | None = None


class Display:
    """A site drawn in a viser server."""

    def __init__(self, server: ViserServer, site: Site, end: float) -> None:
        """Draw the site with its arm at the start; the colour scale ends at this axial force, N, see `scale_end`."""
        self.end = end
        self._server, self._chain, self._bars = server, site.chain, make_bars(site.chain)
        self._pivot, self._height = np.array(site.chain.mount[:3, 3]), 0.0
        self._balls = np.append(np.flatnonzero(site.truss.hubs), -1)  # the tool point at last
        self._owned = self._bars.owner != NOBODY
        self._colours = np.full((len(self._owned), 3), _STEEL, np.uint8)
        with server.atomic():
            add_scenery(server, site)
            self._diggings = site.diggings
            if self._diggings is not None:
                self._pit, self._cut = add_pit(server.scene, self._diggings), self._diggings.start
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
            self._hubs.batched_positions = _round(points[self._balls])
            self._plate.batched_positions = _round(points[-2:-1])
            self._plate.batched_wxyzs = _round(_quaternion(self._chain, sight.nodes))
            if sight.height != self._height:
                self._mast.position = self._pivot + [0.0, 0.0, sight.height]
                self._height = sight.height
            self._show_pit(sight.heights)
            if sight.target is not None:
                self._target.position, self._target.wxyz = sight.target[:3], quaternions_to(sight.target[None, 3:])[0]
            if self._target.visible != (sight.target is not None):
                self._target.visible = sight.target is not None
            self._show_gap(sight.gap)

    def _add_arm(self, site: Site) -> None:
        """Add members, hubs with the payload, and the tip plate as batches: their changes come to a picture together."""
        nodes = site.chain.nodes(site.start)
        points, scene = place_points(site.chain, nodes), self._server.scene
        middles, turns = self._bars.place(points)
        bar = trimesh.creation.cylinder(1.0, height=1.0, sections=_SECTIONS)
        bar = trimesh.graph.smooth_shade(bar, angle=SHARP)
        plain = {"lod": "off", "cast_shadow": False, "receive_shadow": False}
        shades = {"batched_scales": self._bars.scales, "batched_colors": self._colours}
        self._arm = scene.add_batched_meshes_simple(
            "/arm/members", bar.vertices, bar.faces, turns, middles, **shades, **plain
        )
        load = site.task.payload.radius if site.task.payload.mass else site.arm.hub.radius
        radii = np.append(np.full(len(self._balls) - 1, site.arm.hub.radius), load)
        shades = np.full((len(radii), 3), _STEEL, np.uint8)
        shades[-1] = _PAYLOAD
        ball, upright = trimesh.creation.icosphere(1), np.tile(_UPRIGHT, (len(radii), 1))
        more = {"batched_scales": radii, "batched_colors": shades}
        self._hubs = scene.add_batched_meshes_simple(
            "/arm/hubs", ball.vertices, ball.faces, upright, points[self._balls], **more, **plain
        )
        middle, R = turn_plate(site.chain, nodes)
        corners, half = (nodes[site.truss.tip] - middle) @ R, [0.0, 0.0, site.arm.tip_plate.thickness / 2]
        plate = trimesh.convex.convex_hull(np.concatenate([corners - half, corners + half]))
        turn = _quaternion(site.chain, nodes)
        self._plate = scene.add_batched_meshes_simple(
            "/arm/tip_plate",
            plate.vertices,
            plate.faces,
            turn,
            middle[None],
            batched_colors=_STEEL,
            flat_shading=True,
            **plain,
        )

    def _add_mast(self, site: Site) -> None:
        pipe = trimesh.creation.cylinder(site.mast.outer_diameter / 2, height=site.mast.length, sections=_ROUND)
        pipe.apply_translation([0.0, 0.0, site.mast.length / 2])
        self._mast = add_baked(self._server.scene, "/mast", [(pipe, _MAST)])
        self._mast.position = self._pivot
        add_name(self._server.scene, "/mast/name", "mast", np.array([0.0, 0.0, site.mast.length]))

    def _add_aids(self) -> None:
        """Add target and gap, hidden until they are shown."""
        scene, nowhere = self._server.scene, np.zeros((1, 2, 3))
        self._target = add_baked(scene, "/target", [(make_mark(_LARGER), _TARGET)])
        self._gap = scene.add_line_segments(
            "/gap", nowhere, _GAP, thickness=3.0, thickness_units="screen", visible=False
        )
        self._gap_name = scene.add_label("/gap/name", "", font_screen_scale=NAME, anchor="bottom-left", visible=False)
        self._target.visible = False

    def _show_pit(self, heights: Array | None) -> None:
        if self._diggings is None:
            return
        heights = self._diggings.start if heights is None else heights
        if np.abs(heights - self._cut).max() >= _LAYER:
            self._pit.vertices, self._cut = _round(place_pit(self._diggings, heights)), heights

    def _show_gap(self, gap: LeastGap | None) -> None:
        if gap is not None:
            self._gap.points = _round(gap.ends[None])
            self._gap_name.position, self._gap_name.text = gap.ends.mean(axis=0), f"{gap.gap:.2f} m"
        if self._gap.visible != (gap is not None):
            self._gap.visible = self._gap_name.visible = gap is not None


def _round(values: Array) -> NDArray[np.float32]:
    """Single precision on a grid that no picture resolves, so that records of a page pack to half their size."""
    return (np.round(values / _GRAIN) * _GRAIN).astype(np.float32)


def _quaternion(chain: Chain, nodes: Array) -> Array:
    """Turn of the tip plate, shape (1, 4)."""
    matrix = np.eye(4)
    matrix[:3, :3] = turn_plate(chain, nodes)[1]
    return trimesh.transformations.quaternion_from_matrix(matrix)[None]


def draw_scale(end: float) -> str:
    """Draw the scale, from compression at the left to tension at the right, with forces in kN; it ends at this force, N."""
    colours = [tuple(row) for row in to_bytes(force_colours(np.linspace(-1, 1, _STEPS), 1.0)).tolist()]
    left, bar = 20, _WIDE - 40
    cells = "".join(
        f'<rect x="{left + k * bar / _STEPS:.2f}" y="14" width="{bar / _STEPS + 0.5:.2f}" height="12" fill="rgb{colour}"/>'
        for k, colour in enumerate(colours)
    )
    ticks = "".join(
        f'<text x="{left + (part + 1) / 2 * bar:.1f}" y="40" text-anchor="middle">{_tell(part * end)}</text>'
        for part in (-1.0, -0.5, 0.0, 0.5, 1.0)
    )
    titles = (
        f'<text x="{left}" y="9">compression</text><text x="{left + bar}" y="9" text-anchor="end">tension, kN</text>'
    )
    label = f"Colours of axial force: compression red, none grey, tension blue, to {end / 1e3:.4g} kN"
    style = 'font-family="sans-serif" font-size="10" fill="currentColor"'
    size = f'width="{_WIDE}" height="{_HIGH}" viewBox="0 0 {_WIDE} {_HIGH}"'
    return f'<svg role="img" aria-label="{label}" {size} {style}>{titles}{cells}{ticks}</svg>'


def to_bytes(colours: np.ndarray) -> np.ndarray:
    """Red, green and blue from 0 to 1, shape (..., 4) with opacity or (..., 3), as whole numbers to 255, shape (..., 3)."""
    return np.round(255 * colours[..., :3]).astype(np.uint8)


def _tell(force: float) -> str:
    return f"{'+' if force > 0 else MINUS if force < 0 else ''}{abs(force) / 1e3:.3g}"
