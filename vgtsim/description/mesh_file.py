"""Meshes of things in a tank: read by trimesh and cut into convex parts, by CoACD where a mesh is not convex."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any

from vgtsim.description.tank import MeshThing, Tank
from vgtsim.errors import DescriptionError, MissingLibraryError

_LARGEST = 64_000_000  # bytes of a mesh; a pump of a million triangles has 50 million
_CONCAVE = 0.05  # how far a part may be from convex, of the size of the mesh: CoACD's usual threshold
_CORNERS = 64  # of a convex part at most
_SEED = 0  # of the search for cuts: the same file gives the same parts
_CAD = 6  # digits of a corner, in the file's unit: the same parts on every machine

Parts = tuple[tuple[tuple[float, float, float], ...], ...]


def list_meshes(tables: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Tables of things that name a file, in the tables of a tank."""
    meshes = tables.get("meshes")
    for entry in meshes if isinstance(meshes, list) else ():
        if isinstance(entry, dict) and isinstance(entry.get("file"), str):
            yield entry


def split_meshes(tank: Tank, file: Path) -> Tank:
    """The tank of a file with the convex parts of its meshes, whose files lie beside it.

    Raises:
        DescriptionError: A mesh is missing, cannot be read, is not closed, or has parts of its own besides.
        MissingLibraryError: A mesh is not convex, and CoACD is not installed.
    """
    if all(item.file is None for item in tank.meshes):
        return tank
    found = []
    for index, item in enumerate(tank.meshes):
        if item.file is not None:
            key = f"meshes.{index}"
            if item.parts:
                raise DescriptionError(file, f"{key}.parts", "parts besides a file", "one of the two")
            try:
                item = _split(item, file.parent / item.file)
            except ValueError as error:
                raise DescriptionError(file, f"{key}.file", f"{item.file!r}, {error}", "a closed mesh") from None
        found.append(item)
    return tank.model_copy(update={"meshes": tuple(found)})


def _split(item: MeshThing, path: Path) -> MeshThing:
    """The thing with the parts of a mesh in metres, in place of its file."""
    try:
        stamp = path.stat()
    except OSError as error:
        raise ValueError(error.strerror) from None
    if stamp.st_size > _LARGEST:
        raise ValueError(f"more than {_LARGEST} bytes")
    parts = _read_parts(path.resolve(), stamp.st_mtime_ns)
    scaled = tuple(tuple((x * item.unit, y * item.unit, z * item.unit) for x, y, z in part) for part in parts)
    return MeshThing.model_validate(item.model_dump() | {"file": None, "unit": 1.0, "parts": scaled})


@lru_cache(maxsize=32)
def _read_parts(path: Path, _: int) -> Parts:
    """Corners of the convex parts of a mesh, in the file's unit; a file that was changed is read again."""
    import numpy as np  # both are slow to load, and most tanks have no mesh
    import trimesh

    try:
        mesh = trimesh.load_mesh(path)
    except Exception as error:  # each of trimesh's readers raises errors of its own
        raise ValueError(str(error)[:80]) from None
    if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
        raise ValueError("no triangles")
    if not mesh.is_watertight:
        raise ValueError("a surface with holes or without thickness")
    hulls = [mesh.convex_hull.vertices] if mesh.is_convex else _decompose(mesh.vertices, mesh.faces)
    return tuple(tuple((float(x), float(y), float(z)) for x, y, z in np.round(part, _CAD)) for part in hulls)


def _decompose(vertices: Any, faces: Any) -> list[Any]:
    try:
        coacd: Any = import_module("coacd")
    except ImportError:
        raise MissingLibraryError("CoACD, which cuts a mesh that is not convex", 'pip install "vgtsim[mesh]"') from None
    coacd.set_log_level("error")
    parts = coacd.run_coacd(coacd.Mesh(vertices, faces), threshold=_CONCAVE, max_ch_vertex=_CORNERS, seed=_SEED)
    return [corners for corners, _ in parts]
