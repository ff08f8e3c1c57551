"""What is read from MuJoCo at a logged instant, whole arrays at a time."""

from __future__ import annotations

from dataclasses import dataclass, field

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics import Truss
from vgtsim.mjcf import names

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Addresses:
    """Where the quantities of the log stand in a model.

    Attributes:
        nodes: Sites of the hubs, shape (N,).
        near: Sites of the members' near ends, shape (M,).
        far: Sites of the members' far ends, shape (M,).
        force: First sensor value of each member's force, shape (M,).
        torque: First sensor value of each member's torque, shape (M,).
        length: Sensor value of each cylinder's slide, shape (J,).
        retracted: Its length at zero slide, shape (J,), m.
        slide: Degree of freedom of each cylinder, shape (J,).
        drive_force: First sensor value of each drive's force, shape (J,).
        flange: Site of the mast flange.
        flange_force: First sensor value of its force; the torque follows.
        tool: Site of the tool point.
        tip: Body of the tip plate.
        hub_speeds: Degrees of freedom of the free hubs and the middles of joint blocks, shape (3 F,).
    """

    nodes: NDArray[np.intp]
    near: NDArray[np.intp]
    far: NDArray[np.intp]
    force: NDArray[np.intp]
    torque: NDArray[np.intp]
    length: NDArray[np.intp]
    retracted: Array
    slide: NDArray[np.intp]
    drive_force: NDArray[np.intp]
    flange: int
    flange_force: int
    tool: int
    tip: int
    hub_speeds: NDArray[np.intp]


def find_addresses(model: mujoco.MjModel, truss: Truss) -> Addresses:
    """Look the addresses up once.

    Args:
        model: Compiled model of the truss.
        truss: The truss.

    Returns:
        The addresses.
    """

    def sites(labels: list[str]) -> NDArray[np.intp]:
        return np.array([model.site(label).id for label in labels], dtype=int)

    def sensors(labels: list[str]) -> NDArray[np.intp]:
        return np.array([model.sensor(label).adr[0] for label in labels], dtype=int)

    members = list(truss.member_names)
    actuators = [members[i] for i in truss.actuated]
    hubs = [truss.nodes[i] for i in truss.free]
    return Addresses(
        nodes=sites(list(truss.nodes)),
        near=sites([names.near(name) for name in members]),
        far=sites([names.far(name) for name in members]),
        force=sensors([names.force(name) for name in members]),
        torque=sensors([names.torque(name) for name in members]),
        length=sensors([names.length(name) for name in actuators]),
        retracted=np.array([model.numeric(f"{name}/retracted").data[0] for name in actuators]),
        slide=np.array([model.joint(names.slide(name)).dofadr[0] for name in actuators], dtype=int),
        drive_force=sensors([names.drive_force(name) for name in actuators]),
        flange=model.site(names.FLANGE).id,
        flange_force=int(model.sensor(names.force(names.FLANGE)).adr[0]),
        tool=model.site(names.TOOL).id,
        tip=model.body(names.TIP).id,
        hub_speeds=np.array([model.joint(joint).dofadr[0] for node in hubs for joint in names.slides(node)], dtype=int),
    )


@dataclass
class Recorder:
    """Collects records; one list a quantity, turned into arrays at the end.

    Attributes:
        at: Addresses in the model.
        records: Quantity to its values so far.
    """

    at: Addresses
    records: dict[str, list[NDArray[np.generic] | float | int | bool]] = field(default_factory=dict)

    def record(self, data: mujoco.MjData, commanded: Array, rates: Array, goal: int, settled: bool) -> None:
        """Add the instant at which the last step began; `mj_step` leaves positions and sensors of that instant.

        MuJoCo's force sensors give what the parent exerts on the child; a member's force on its hub is the opposite.

        Args:
            data: After the step.
            commanded: Lengths asked for at that instant, shape (J,), m.
            rates: Cylinder speeds at that instant, shape (J,), m/s.
            goal: Goal being approached or held.
            settled: Whether it is held, settled.
        """
        at, sensed = self.at, data.sensordata
        triple = np.arange(3)
        turn = data.site_xmat[at.near].reshape(-1, 3, 3)
        flange = data.site_xmat[at.flange].reshape(3, 3)
        wrench = sensed[at.flange_force : at.flange_force + 6].reshape(2, 3)
        row = {
            "nodes": data.site_xpos[at.nodes],
            "ends": np.stack([data.site_xpos[at.near], data.site_xpos[at.far]], axis=1),
            "commanded": commanded,
            "actual": at.retracted + sensed[at.length],
            "rates": rates,
            "member_force": -np.einsum("mij,mj->mi", turn, sensed[at.force[:, None] + triple]),
            "member_moment": -np.einsum("mij,mj->mi", turn, sensed[at.torque[:, None] + triple]),
            "actuator_force": -sensed[at.drive_force + 2],
            "mast_reaction": (wrench @ flange.T).ravel(),
            "tool_position": data.site_xpos[at.tool].copy(),
            "tool_direction": data.xmat[at.tip].reshape(3, 3)[:, 2].copy(),
            "goal": goal,
            "settled": settled,
        }
        for name, value in row.items():
            self.records.setdefault(name, []).append(value)

    def arrays(self) -> dict[str, NDArray[np.generic]]:
        """Stack what was collected.

        Returns:
            Quantity to array, records along the first axis.
        """
        return {name: np.array(values) for name, values in self.records.items()}
