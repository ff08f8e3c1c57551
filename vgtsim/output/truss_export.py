"""The truss of one instant for other tools: JSON, a PyNiteFEA program that reads it, and VTK for ParaView."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from vgtsim.errors import MissingLibraryError
from vgtsim.replacing import replacing
from vgtsim.site import Site
from vgtsim.verification import Instant

PYNITE = '''"""The truss of truss.json in PyNiteFEA: builds `frame`, solves it, prints its forces and the file's."""

import json
from pathlib import Path

from Pynite import FEModel3D

E = 200e9  # Pa; areas are such that E A / L is each member's stiffness
truss = json.loads(Path(__file__).with_name("truss.json").read_text())
frame = FEModel3D()
frame.add_material("steel", E, 77e9, 0.3, 7850.0)
for node in truss["nodes"]:
    frame.add_node(node["name"], *node["position"])
    frame.def_support(node["name"], *[node["fixed"]] * 3, True, True, True)
    for axis, force in zip(("FX", "FY", "FZ"), node["load"]):
        frame.add_node_load(node["name"], axis, force)
for bar in truss["members"]:
    area = bar["stiffness"] * bar["length"] / E
    frame.add_section(bar["name"], area, 1e-12, 1e-12, 1e-12)
    frame.add_member(bar["name"], *bar["ends"], "steel", bar["name"])
    frame.def_releases(bar["name"], Ryi=True, Rzi=True, Ryj=True, Rzj=True)
if __name__ == "__main__":
    frame.analyze_linear(check_stability=False)
    for bar in truss["members"]:
        found = -frame.members[bar["name"]].axial(0.0, "Combo 1")
        print(f"{bar['name']:24s} {found:14.2f} N   {bar['force']:14.2f} N in the file")
'''


def describe_truss(site: Site, now: Instant) -> dict[str, Any]:
    """Collect the content of `truss.json`: SI units, frame G, tension positive; see `find_instant`.

    The loads are weight and inertia shared between the nodes; `force` is the bar force in equilibrium with them,
    `measured` the simulation's at the near end.
    """
    truss = site.truss
    known = [(member.name, member.role, member.section) for member in truss.members]
    known += [(f"tip/edge/{i + 1}", "rigid", "") for i in range(len(truss.tip_edges))]
    members = [
        {
            "name": name,
            "role": role,
            "section": section,
            "ends": [truss.nodes[end] for end in now.ends[i]],
            "length": float(now.length[i]),
            "stiffness": float(now.spring[i]),
            "force": float(now.force[i]),
            "measured": float(now.measured[i]),
        }
        for i, (name, role, section) in enumerate(known)
    ]
    points = [
        {"name": name, "position": now.nodes[i].tolist(), "fixed": i in range(3), "load": now.load[i].tolist()}
        for i, name in enumerate(truss.nodes)
    ]
    return {"scene": site.task.name, "time": now.time, "nodes": points, "members": members}


def write_truss(site: Site, now: Instant, folder: Path, *, vtk: bool = True) -> list[Path]:
    """Write `truss.json`, `truss_pynite.py` and, if asked for, `truss.vtu` into an existing folder.

    Raises:
        MissingLibraryError: `meshio`, which writes VTK, is not installed; the other files are there.
    """
    data = describe_truss(site, now)
    files = [folder / "truss.json", folder / "truss_pynite.py"]
    for file, text in zip(files, (json.dumps(data, indent=1), PYNITE), strict=True):
        with replacing(file) as partial:
            partial.write_text(text, encoding="utf-8")
    if vtk:
        files.append(folder / "truss.vtu")
        _write_vtk(data, files[-1])
    return files


def _write_vtk(data: dict[str, Any], file: Path) -> None:
    try:
        import meshio
    except ImportError:
        raise MissingLibraryError("meshio", "pip install meshio") from None
    index = {node["name"]: i for i, node in enumerate(data["nodes"])}
    lines = np.array([[index[end] for end in bar["ends"]] for bar in data["members"]])
    mesh = meshio.Mesh(
        np.array([node["position"] for node in data["nodes"]]),
        [("line", lines)],
        point_data={"load": np.array([node["load"] for node in data["nodes"]])},
        cell_data={
            key: [np.array([bar[key] for bar in data["members"]])] for key in ("force", "measured", "stiffness")
        },
    )
    with replacing(file) as partial:
        meshio.write(partial, mesh)
