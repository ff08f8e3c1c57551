"""Solids whose light and shade are colours of their corners: a page draws them without lamps, at a third of the cost."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import trimesh
from trimesh.exchange.gltf import export_glb
from trimesh.visual import ColorVisuals

from vgtsim.arrays import Array

if TYPE_CHECKING:
    from viser import GlbHandle, SceneApi

Colour = tuple[int, int, int]  # red, green and blue to 255
Piece = tuple[trimesh.Trimesh, Colour]

SHARP = np.radians(30)  # between faces: from there on an edge is drawn as one
_LAMP = np.array([-0.42, -0.70, 0.57])  # unit vector toward it: from the left, in front and above
_DARK, _LAMP_PART, _SKY_PART = 0.62, 0.34, 0.10  # of a colour: in the shade, by the lamp, and by the sky above
_GAMMA = 2.2  # colours in glTF are linear
_UNLIT = "KHR_materials_unlit"


def add_baked(scene: SceneApi, name: str, solids: Iterable[Piece], *, both: bool = False) -> GlbHandle:
    """Add solids as one thing that casts and takes no shadow, drawn from outside alone, or from both sides: twice the cost."""
    mesh = trimesh.util.concatenate([_shade(solid, colour) for solid, colour in solids])
    data = export_glb(trimesh.Scene(mesh), include_normals=False, tree_postprocessor=partial(_unlight, both=both))
    return scene.add_glb(name, data, cast_shadow=False, receive_shadow=False)


def _shade(solid: trimesh.Trimesh, colour: Colour) -> trimesh.Trimesh:
    """A solid with a colour at each corner, its edges sharp where its faces meet at more than thirty degrees."""
    mesh = trimesh.graph.smooth_shade(solid, angle=SHARP)
    normals = np.asarray(mesh.vertex_normals)
    light = _DARK + _LAMP_PART * np.clip(normals @ _LAMP, 0, 1) + _SKY_PART * normals[:, 2]
    linear: Array = np.clip(np.array(colour) / 255 * light[:, None], 0, 1) ** _GAMMA
    shown = np.concatenate([linear, np.ones((len(linear), 1))], axis=-1)
    mesh.visual = ColorVisuals(mesh, vertex_colors=np.round(255 * shown).astype(np.uint8))
    return mesh


def _unlight(tree: dict[str, Any], *, both: bool) -> None:
    """Give all surfaces of a glTF tree a material that shows the colours of the corners as they are."""
    tree["extensionsUsed"] = [*tree.get("extensionsUsed", []), _UNLIT]
    tree["materials"] = [{"doubleSided": both, "extensions": {_UNLIT: {}}}]
    for mesh in tree["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["material"] = 0
