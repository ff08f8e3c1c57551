"""Axial stiffness of members and cylinders, and the model that the stiffness solves share."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.description import Conveyance, Payload, Simulation
from vgtsim.errors import DescriptionError, TrussError
from vgtsim.kinematics import Chain, Truss
from vgtsim.statics.loads import LoadModel, make_load_model

_HELD = 1e12  # N/m, of a member that keeps its length: 0.1 micrometre under 1e5 N
TRAPPED = 0.005  # oil left beside the piston at either end of the stroke, m: ports and cushions


@dataclass(frozen=True)
class ElasticModel:
    """An arm whose members are springs along their axes.

    Attributes:
        loads: Masses, with every tube split in the middle: each half moves with its own hub along the member.
        spring: EA/L of the tubes, shape (M,), N/m; zero where an actuator stands.
        rod: Stiffness of the actuators' rods, shape (J,), N/m.
        oil: Bulk modulus times piston area and times annulus area, shape (2, J), N.
        stroke: Retracted and extended lengths of the actuators, shape (2, J), m.
    """

    loads: LoadModel
    spring: Array
    rod: Array
    oil: Array
    stroke: Array

    @property
    def truss(self) -> Truss:
        """Nodes and members."""
        return self.loads.truss

    def stiffness(self, actuators: ArrayLike) -> Array:
        """Axial stiffness of every member, shape (..., M), N/m, at actuator lengths of shape (..., J), m."""
        length, (low, high) = np.asarray(actuators, float), self.stroke
        column = self.oil[0] / (np.maximum(length - low, 0.0) + TRAPPED)
        column = column + self.oil[1] / (np.maximum(high - length, 0.0) + TRAPPED)
        result = np.broadcast_to(self.spring, (*length.shape[:-1], len(self.spring))).copy()
        result[..., self.truss.actuated] = 1 / (1 / column + 1 / self.rod)
        return result

    def stiffness_at(self, nodes: ArrayLike) -> Array:
        """Axial stiffness of every member, shape (..., M), N/m, in poses of shape (..., N, 3), m."""
        n = np.asarray(nodes, float)
        return self.stiffness(self.truss.lengths(n)[..., self.truss.actuated])


def make_elastic_model(
    chain: Chain, payload: Payload, gravity: float, *, lumped: bool = False, line: Conveyance | None = None
) -> ElasticModel:
    """Collect stiffnesses and masses from the description; gravity is m/s² along -z of frame G, as for `make_load_model`.

    A tube is EA/L from hub to hub. A cylinder is its oil, trapped on both sides of the piston by lock valves, in series
    with its solid rod; barrel wall, pins and joint blocks count as rigid, and so does an actuator in bending.

    Raises:
        TrussError: A member has no area or no stiffness.

    Source: oil column, H. E. Merritt, Hydraulic Control Systems (1967), equation 6-43, for unequal areas.
    """
    arm, truss = chain.manipulator, chain.truss
    spring, length = np.zeros(len(truss.members)), chain.member_lengths
    for index, member in enumerate(truss.members):
        if member.role != "actuator":
            tube = arm.tubes[member.section]
            spring[index] = arm.materials[tube.material].youngs_modulus * tube.area / float(length[index])
    cylinders = [arm.cylinders[truss.members[index].section] for index in truss.actuated]
    rows = [
        (
            part.rod_stiffness(arm.materials[part.material].youngs_modulus),
            part.bulk_modulus * part.bore_area,
            part.bulk_modulus * part.ring_area,
            part.retracted,
            part.extended,
        )
        for part in cylinders
    ]
    rod, *others = np.array(rows).reshape(-1, 5).T
    loads = make_load_model(chain, payload, gravity, split=True, lumped=lumped, line=line)
    model = ElasticModel(loads, spring=spring, rod=rod, oil=np.array(others[:2]), stroke=np.array(others[2:]))
    found = model.stiffness(model.stroke.mean(axis=0))
    wrong = np.flatnonzero(~(found > 0) | ~np.isfinite(found))
    if len(wrong):  # a description cannot hold members that are no springs; an edited copy of one can
        names = tuple(truss.member_names[i] for i in wrong)
        raise TrussError(len(found) - len(wrong), names, f"axial stiffness of {found[wrong[0]]:.4g} N/m, must be > 0")
    return model


def require_no_offset(chain: Chain, where: str) -> None:
    """Refuse an arm with a joint offset: a DescriptionError that ends with `where`, for example "members are elastic"."""
    for place, module in enumerate(chain.manipulator.modules):
        if offset := module.offset:
            found = f"{offset:.4g} m on {module.name}"
            raise DescriptionError(None, f"modules.{place}.joint_offset", found, f"0 where {where}")


def hold_cylinders(model: ElasticModel, simulation: Simulation) -> ElasticModel:
    """The same arm as its drives hold it at rest, with tubes as good as rigid where members are.

    Cylinders get the stiffness of their drive: oil and rod under imposed unloaded lengths, the servo's stiffness, or as good
    as rigid where valves make up for what the oil gives.
    """
    if simulation.members == "rigid":
        model = replace(model, spring=np.where(model.spring > 0, _HELD, 0.0))
    if simulation.drive == "rigid":
        return model
    stiffness = simulation.servo_stiffness if simulation.drive == "servo" else _HELD
    return replace(model, rod=np.full(model.rod.shape, stiffness), oil=np.full(model.oil.shape, np.inf))
