"""The truss of one instant for other tools: JSON, a PyNiteFEA program that reads it, and VTK for ParaView."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from vgtsim.description import Scene
from vgtsim.errors import DescriptionError, MissingLibraryError
from vgtsim.kinematics import Chain
from vgtsim.replacing import replacing
from vgtsim.runlog import RunLog
from vgtsim.statics.elasticity import make_elastic_model, require_no_offset
from vgtsim.statics.equilibrium import solve_members
from vgtsim.statics.motion import Motion, motion_from_log
from vgtsim.statics.stiffness import node_loads

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
STIFF_EDGE = 1e3  # stiffness of the rigid tip plate's edges over that of the stiffest member


def describe_truss(scene: Scene, log: RunLog, chain: Chain, time: float | None = None) -> dict[str, Any]:
    """Collect nodes, members, loads and forces of one instant.

    Args:
        scene: The scene.
        log: Its run.
        chain: The arm.
        time: Simulated time, s; absent for that of the greatest axial force.

    Returns:
        What `truss.json` holds: SI units, frame G, tension positive. The loads are weight and inertia shared between
        the nodes; `force` is the bar force in equilibrium with them, `measured` the simulation's at the near end.

    Raises:
        DescriptionError: A module has a joint offset, or the time is not in the log.
    """
    require_no_offset(chain, "a truss is exported")
    truss = chain.truss
    if time is not None and not log.time[0] <= time <= log.time[-1]:
        raise DescriptionError(None, "time", f"{time:.6g} s", f"{log.time[0]:.6g} to {log.time[-1]:.6g} s, as logged")
    axial = log.axial(truss.ends)
    record = int(np.argmax(np.abs(axial).max(axis=1))) if time is None else int(np.argmin(np.abs(log.time - time)))
    nodes = log.nodes[record]
    simulation = scene.task.simulation
    model = make_elastic_model(chain, scene.task.payload, simulation.gravity, lumped=simulation.lumped)
    motion = motion_from_log(log.time, log.nodes)
    speed, change = motion.velocity[record], motion.acceleration[record]
    now = Motion(speed, change) if np.isfinite(change).all() else None
    load, bar = node_loads(model, nodes, now), solve_members(model.loads, nodes, now).bar
    edges = [f"tip/edge/{i + 1}" for i in range(3)]
    ends = np.concatenate([truss.ends, truss.tip_edges])
    length = np.linalg.norm(nodes[ends[:, 1]] - nodes[ends[:, 0]], axis=-1)
    spring = model.stiffness_at(nodes)
    spring = np.concatenate([spring, np.full(3, STIFF_EDGE * spring.max())])
    members = []
    for i, (near, far) in enumerate(ends):
        own = i < len(truss.members)
        entry = {
            "name": truss.members[i].name if own else edges[i - len(truss.members)],
            "role": truss.members[i].role if own else "rigid",
            "section": truss.members[i].section if own else "",
            "ends": [truss.nodes[near], truss.nodes[far]],
            "length": float(length[i]),
            "stiffness": float(spring[i]),
            "force": float(bar[i]) if own else 0.0,
            "measured": float(axial[record, i]) if own else 0.0,
        }
        members.append(entry)
    points = [
        {"name": name, "position": nodes[i].tolist(), "fixed": i in range(3), "load": load[i].tolist()}
        for i, name in enumerate(truss.nodes)
    ]
    return {"scene": scene.task.name, "time": float(log.time[record]), "nodes": points, "members": members}


def write_truss(
    scene: Scene, log: RunLog, chain: Chain, folder: Path, time: float | None = None, *, vtk: bool = True
) -> list[Path]:
    """Write `truss.json`, `truss_pynite.py` and, if asked for, `truss.vtu`.

    Args:
        scene: The scene.
        log: Its run.
        chain: The arm.
        folder: Existing folder.
        time: Simulated time, s; absent for that of the greatest axial force.
        vtk: Whether to write the VTK file.

    Returns:
        The files.

    Raises:
        DescriptionError: A module has a joint offset, or the time is not in the log.
        MissingLibraryError: `meshio`, which writes VTK, is not installed; the other files are there.
    """
    data = describe_truss(scene, log, chain, time)
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
