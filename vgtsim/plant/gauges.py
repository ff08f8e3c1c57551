"""What is read from the model of a plant: of an arm whose members are bodies, or of one with rigid sections."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.graphics import mujoco
from vgtsim.kinematics import find_rigid_sections
from vgtsim.mjcf import fill_qpos, make_pose_map, make_section_pose, names
from vgtsim.plant.addresses import find_addresses, find_rows
from vgtsim.site import Site
from vgtsim.statics import Loading, LoadModel, NodeMotion, make_load_model, motion_from_log, solve_loadings, tool_forces

Records = Mapping[str, NDArray[Any]]

_TRIPLE = np.arange(3)
FELT = "felt_acceleration"  # as `RunLog.acceleration`, of records that no log keeps


class MemberGauges:
    """Reads an arm whose members are bodies with force sensors, and stands it in a posture; N nodes, M members, J cylinders.

    Attributes:
        at: Where all quantities stand.
        nodes: Sites of the hubs, shape (N,).
        tool: Site of the tool point.
        tip: Body of the tip plate.
        hub_speeds: Degrees of freedom that move hubs along an axis.
        counts: N, M and J.
        senses: Whether a record needs MuJoCo's sensors.
    """

    senses = True

    def __init__(self, model: mujoco.MjModel, site: Site) -> None:
        self.at = at = find_addresses(model, site.truss)
        self._truss, self._pose = site.truss, make_pose_map(model, site.truss)
        self.nodes, self.tool, self.tip, self.hub_speeds = at.nodes, at.tool, at.tip, at.hub_speeds
        self.counts = _count(site)

    def stand(self, data: mujoco.MjData, nodes: Array) -> None:
        """Put the hubs at nodes, shape (N, 3), m."""
        fill_qpos(self._pose, self._truss, nodes, data.qpos)

    def lengths(self, data: mujoco.MjData) -> Array:
        """Lengths of the cylinders now, shape (J,), m; places of sites must be those of now."""
        return data.qpos[self.at.position]

    def rates(self, data: mujoco.MjData) -> Array:
        """Speeds of the cylinders in the last step, shape (J,), m/s; places of sites must be those of now."""
        return data.qvel[self.at.slide]

    def note(self, data: mujoco.MjData) -> Array:
        """Keep before a step what `read` needs after it: speeds of the cylinders, shape (J,), m/s."""
        return self.rates(data)

    def read(self, data: mujoco.MjData, noted: Array) -> dict[str, Array]:
        """Quantities of a record at the begin of the last step, before which something was noted.

        MuJoCo's force sensors give what the parent exerts on the child; the force of a member on its hub is the opposite.
        """
        at, sensed = self.at, data.sensordata
        sites, frames = data.site_xpos, data.site_xmat
        force, moment = np.empty((2, len(at.near), 3))
        turn_sensed(sensed, at.force, frames, at.near, force)
        turn_sensed(sensed, at.torque, frames, at.near, moment)
        flange = frames[at.flange].reshape(3, 3)
        wrench = sensed[at.flange_force : at.flange_force + 6].reshape(2, 3)
        return {
            "nodes": sites.take(at.nodes, axis=0),
            "ends": np.stack([sites.take(at.near, axis=0), sites.take(at.far, axis=0)], axis=1),
            "actual": sensed[at.length],
            "rates": noted,
            "member_force": force,
            "member_moment": moment,
            "actuator_force": -sensed[at.drive_force + 2],
            "mast_reaction": (wrench @ flange.T).ravel(),
        }

    def complete(self, records: Records, part: slice) -> Records:
        """A part of stacked records, with the quantities that follow from all of them; here nothing is missing."""
        return {name: value[part] for name, value in records.items()}


@compiled
def turn_sensed(sensed: Array, first: Index, frames: Array, sites: Index, turned: Array) -> None:
    """Write the opposites of sensed vectors, from first values of shape (M,), from their sites' frames into G, shape (M, 3)."""
    for m in range(len(first)):
        for i in range(3):
            total = 0.0
            for j in range(3):
                total += frames[sites[m], 3 * i + j] * sensed[first[m] + j]
            turned[m, i] = -total


class SectionGauges:
    """As `MemberGauges`, of an arm with rigid sections, whose length rows tell their axial forces.

    All else that members carry follows from statics of the described arm, whose members have their mass along them. What
    the forces of the rows differ by from statics of the simulated arm, whose mass is in its hubs, is added to it: a force
    that is wrong in the simulation is wrong in the log.
    """

    senses = False

    def __init__(self, model: mujoco.MjModel, site: Site) -> None:
        self._timestep, self._site, truss = model.opt.timestep, site, site.truss
        self.pose, self.rows = make_section_pose(model, site.chain), find_rigid_sections(site.chain).rows
        self.nodes = np.array([model.site(node).id for node in truss.nodes])
        self.tool, self.tip = model.site(names.TOOL).id, model.body(names.TIP).id
        self.hub_speeds = np.concatenate(
            [self.pose.slide_speeds.ravel(), (self.pose.move_speeds[:, None] + _TRIPLE).ravel()]
        )
        labels = [names.row(truss.members[i].name) for i in self.rows]
        self._equalities = np.array([model.equality(label).id for label in labels])
        self._driven = np.array([model.tendon(names.row(truss.members[i].name)).id for i in truss.actuated])
        self._order: Index | None = None
        task, chain = site.task, site.chain
        gravity, line = task.simulation.gravity, task.conveyance
        self._lumped = make_load_model(chain, task.payload, gravity, lumped=True, line=line)
        self._lengths = truss.lengths(chain.nodes(chain.straight))
        on_flange = truss.ends < truss.base.stop
        # members at the flange, and their nodes there
        self._seated = np.flatnonzero(on_flange[:, 0] != on_flange[:, 1])
        first = on_flange[self._seated, 0]
        self._feet, self._pulls = np.where(first, *truss.ends[self._seated].T), np.where(first, -1.0, 1.0)
        self.counts = _count(site)

    def stand(self, data: mujoco.MjData, nodes: Array) -> None:
        """See `MemberGauges.stand`."""
        self.pose.fill(nodes, data.qpos)

    def lengths(self, data: mujoco.MjData) -> Array:
        """See `MemberGauges.lengths`."""
        truss = self._site.truss
        near, far = data.site_xpos[self.nodes[truss.ends[truss.actuated]]].swapaxes(0, 1)
        return np.linalg.norm(far - near, axis=-1)

    def rates(self, data: mujoco.MjData) -> Array:
        """See `MemberGauges.rates`."""
        return (self.lengths(data) - data.ten_length[self._driven]) / self._timestep

    def note(self, data: mujoco.MjData) -> Array:
        """See `MemberGauges.note`: lengths a step before, shape (J,), m."""
        return data.ten_length.take(self._driven)

    def read(self, data: mujoco.MjData, noted: Array) -> dict[str, Array]:
        """See `MemberGauges.read`."""
        if self._order is None:
            self._order = find_rows(data, self._equalities)
        length = data.ten_length.take(self._driven)
        return {
            "nodes": data.site_xpos.take(self.nodes, axis=0),
            "actual": length,
            "rates": (length - noted) / self._timestep,
            "row_force": -data.efc_force.take(self._order),
        }

    def complete(self, records: Records, part: slice) -> Records:
        """See `MemberGauges.complete`: forces, and ends of members, which are off their hubs by what their rows are off."""
        motion = motion_from_log(records["time"], records["nodes"], self._timestep)
        felt = records.get("acceleration", records.get(FELT, motion.acceleration))
        motion = NodeMotion(motion.velocity, felt).at(part)
        records = {name: value[part] for name, value in records.items() if name != FELT}
        site, truss, nodes = self._site, self._site.truss, records["nodes"]
        still = (records["settled"] | ~np.isfinite(motion.acceleration).all(axis=(1, 2)))[:, None, None]
        # at rest differences of records from before the rest say nothing
        known = NodeMotion(*(np.where(still, 0.0, item) for item in (motion.velocity, motion.acceleration)))
        models = site.load_model, self._lumped
        both = solve_loadings(truss, nodes, [Loading(model, known, _push(model, records)) for model in models])
        described = both.at(0)
        off = np.zeros(described.bar.shape)
        off[:, self.rows] = records["row_force"] - both.bar[1][:, self.rows]
        force = described.near_axial + off
        length = np.broadcast_to(self._lengths, off.shape).copy()
        length[:, truss.actuated] = records["actual"]
        near = nodes[:, truss.ends[:, 0]]
        seated = self._seated
        pull = (off[:, seated] * self._pulls)[..., None] * described.direction[:, seated]
        foot = nodes[:, self._feet] - nodes[:, truss.base].mean(axis=1)[:, None]
        extra = np.concatenate([pull.sum(axis=1), np.cross(foot, pull).sum(axis=1)], axis=-1)
        added = {
            "ends": np.stack([near, near + length[..., None] * described.direction], axis=2),
            "member_force": force[..., None] * described.direction + described.near_transverse,
            "member_moment": np.zeros((*off.shape, 3)),
            "actuator_force": described.bar[:, truss.actuated] + off[:, truss.actuated],
            "mast_reaction": described.reaction + extra,
        }
        if "turn_torque" in records:  # the same mass, nearer to the mast's axis than in the hubs
            added["turn_torque"] = records["turn_torque"] + (described.reaction - both.reaction[1])[:, 5]
        del records["row_force"]
        return records | added


def _push(model: LoadModel, records: Records) -> Array | None:
    """Forces of the tool at the nodes, shape (T, N, 3), N; None where it removes no waste."""
    if "tool_force" not in records:
        return None
    force = records["tool_force"]
    return tool_forces(model, records["nodes"], np.concatenate([force, np.zeros_like(force)], axis=1))


def _count(site: Site) -> tuple[int, int, int]:
    return len(site.truss.nodes), len(site.truss.members), len(site.truss.actuated)


Gauges = MemberGauges | SectionGauges


def find_gauges(model: mujoco.MjModel, site: Site) -> Gauges:
    """The gauges of a site's model."""
    return (SectionGauges if site.task.simulation.members == "sections" else MemberGauges)(model, site)
