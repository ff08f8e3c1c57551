"""The only `mj_step` loop: a length programme played into a model, recorded as it goes."""

from __future__ import annotations

import importlib.metadata
import platform
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from vgtsim.description.scene import Scene
from vgtsim.errors import DivergenceError
from vgtsim.kinematics import Chain
from vgtsim.mjcf import build_model
from vgtsim.mjcf.pose import qpos_from_nodes
from vgtsim.planning import Tour
from vgtsim.plant.drives import Drive, HydraulicDrive, find_drive
from vgtsim.plant.hydraulics import require_pressure
from vgtsim.plant.progress import show_progress
from vgtsim.plant.recorder import Recorder, find_addresses
from vgtsim.plant.springs import Springs, fit_springs
from vgtsim.plant.watch import check_state, list_contacts, list_warnings
from vgtsim.runlog import RunLog
from vgtsim.site import Site
from vgtsim.statics.elasticity import hold_cylinders
from vgtsim.statics.settling import settle

Array = NDArray[np.float64]

PACKAGES = ("vgtsim", "mujoco", "numpy", "scipy", "trimesh")
_PRESSURE_POSES = 0.25  # s of motion between poses in which the supply pressure must hold the dead load
_MAX_CONTACTS = 1000  # of one run; a collision under rigid drives ends it long before


@dataclass
class _Contacts:
    time: list[float] = field(default_factory=list)
    pair: list[tuple[str, str]] = field(default_factory=list)
    distance: list[float] = field(default_factory=list)


def run(site: Site, program: Tour, compiled: mujoco.MjModel | None = None) -> RunLog:
    """Play a programme.

    Each command is the length wanted at the end of the step, because the rigid drives hold at the end of a step. A goal
    is held until the arm has settled, then for the scene's hold time. Under rigid drives a contact is a collision, not
    a load, so the first one ends the run.

    Args:
        site: The scene's.
        program: Lengths of every actuator at every step of every leg.
        compiled: In place of the one that `build_model` makes.

    Returns:
        The log.

    Raises:
        DescriptionError: The arm is so deep in something in its start posture that its state diverges.
        DivergenceError: The state stopped being physical; the error carries the log until then.
    """
    scene, chain = site.scene, site.chain
    model = compiled if compiled is not None else build_model(site)
    data = mujoco.MjData(model)
    nodes = chain.nodes(program.start)
    springs = None
    if scene.task.simulation.drive == "hydraulic":
        _require_pressure(scene, chain, program)
    if scene.task.simulation.members == "elastic":
        springs = fit_springs(model, data, chain, scene, nodes)
        nodes = settle(hold_cylinders(springs.elastic, scene.task.simulation), nodes)
    data.qpos[:] = qpos_from_nodes(model, chain.truss, nodes)
    recorder = Recorder(find_addresses(model, chain.truss))
    drive = find_drive(model, data, chain, scene, springs, nodes)
    _find_equilibrium(model, data, drive, program, scene, recorder.at.hub_speeds)
    hit = np.zeros(len(chain.truss.actuated), dtype=np.int64)
    contacts, stopped = _Contacts(), ""
    every = round(1 / (scene.task.simulation.log_rate * model.opt.timestep))
    sensor_bit = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
    begin, count, previous = time.perf_counter(), 0, program.legs[0].lengths[0]
    fault: DivergenceError | None = None
    for wanted, goal, settled in show_progress(
        _commands(program, scene, data, recorder.at.hub_speeds, springs), program, data
    ):
        logged = count % every == 0
        model.opt.disableflags = model.opt.disableflags & ~sensor_bit if logged else model.opt.disableflags | sensor_bit
        rates = data.qvel[recorder.at.slide]
        hit |= drive.command(wanted)
        mujoco.mj_step(model, data)
        count += 1
        try:
            check_state(model, data)
        except DivergenceError as error:
            fault = error
            break
        if logged:
            recorder.record(data, previous, rates, goal, settled)
            recorder.records.setdefault("time", []).append((count - 1) * model.opt.timestep)
            recorder.records.setdefault("saturation", []).append(hit.copy())
            hit[:] = 0
            if isinstance(drive, HydraulicDrive):
                recorder.records.setdefault("pressure", []).append(drive.pressure)
        previous = wanted
        if data.ncon and (stopped := _note_contacts(model, data, contacts, scene.task.simulation.drive)):
            break
    log = _make_log(model, data, recorder, contacts, count, time.perf_counter() - begin, stopped or str(fault or ""))
    if fault is not None:
        raise DivergenceError(fault.time, fault.row, fault.value, log)
    return log


def _require_pressure(scene: Scene, chain: Chain, program: Tour) -> None:
    """Hold the dead load against the supply pressure at poses all along the tour."""
    lengths = np.concatenate([leg.lengths for leg in program.legs])
    every = max(round(_PRESSURE_POSES / program.timestep), 1)
    time = np.arange(0.0, len(lengths), every) * program.timestep
    require_pressure(scene, chain, time, lengths[::every])


def _find_equilibrium(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    drive: Drive,
    program: Tour,
    scene: Scene,
    hub_speeds: NDArray[np.intp],
) -> None:
    """Let the constraints take up the weight before time zero: kinematics give the start pose, but not its forces."""
    touched: list[tuple[str, str, float]] = []
    for _ in range(round(scene.task.motion.patience / scene.task.simulation.timestep)):
        drive.command(program.legs[0].lengths[0])
        mujoco.mj_step(model, data)
        touched = touched or list_contacts(model, data)
        try:
            check_state(model, data)
        except DivergenceError:
            if not touched:
                raise
            first, second, gap = touched[0]
            found = f"{first} {-gap:.3g} m deep in {second}, which the drives cannot hold"
            raise scene.error("motion.start", found, "a posture clear of everything") from None
        if np.max(np.abs(data.qvel[hub_speeds])) < scene.task.motion.settle_speed:
            break
    data.time = 0.0


def _commands(
    program: Tour,
    scene: Scene,
    data: mujoco.MjData,
    hub_speeds: NDArray[np.intp],
    springs: Springs | None,
) -> Iterator[tuple[Array, int, bool]]:
    """Lengths wanted at the end of each coming step, with the goal and whether it is held, settled.

    A ringing arm stands still twice a period, so an elastic one has to be slow for a whole period.
    """
    motion, step = scene.task.motion, scene.task.simulation.timestep
    calm = 1 if springs is None else round(springs.period / step)
    for _ in range(round(motion.hold / step)):
        yield program.legs[0].lengths[0], -1, False
    for leg in program.legs:
        for row in leg.lengths[1:]:
            yield row, leg.goal, False
        slow = 0
        for _ in range(round(motion.patience / step)):
            slow = slow + 1 if np.max(np.abs(data.qvel[hub_speeds])) < motion.settle_speed else 0
            if slow >= calm:
                break
            yield leg.lengths[-1], leg.goal, False
        else:
            continue
        for _ in range(round(motion.hold / step)):
            yield leg.lengths[-1], leg.goal, True


def _note_contacts(model: mujoco.MjModel, data: mujoco.MjData, contacts: _Contacts, drive: str) -> str:
    """Log the contacts of a step; returns why the run must end, or an empty string."""
    for first, second, distance in list_contacts(model, data):
        if len(contacts.time) < _MAX_CONTACTS:
            contacts.time.append(float(data.time))
            contacts.pair.append((first, second))
            contacts.distance.append(distance)
    if drive != "servo" and contacts.time:
        first, second = contacts.pair[0]
        return f"collision of {first} with {second} at t = {contacts.time[0]:.3f} s under {drive} drives"
    return ""


def _make_log(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    recorder: Recorder,
    contacts: _Contacts,
    steps: int,
    wall: float,
    stopped: str,
) -> RunLog:
    simulated = steps * model.opt.timestep
    versions = {"python": platform.python_version()}
    versions |= {name: importlib.metadata.version(name) for name in PACKAGES}
    arrays: dict[str, Any] = recorder.arrays()
    return RunLog(
        **arrays,
        contact_time=np.array(contacts.time),
        contact_pair=np.array(contacts.pair, dtype=str).reshape(-1, 2),
        contact_distance=np.array(contacts.distance),
        warnings=list_warnings(data),
        performance={
            "simulated_s": simulated,
            "wall_s": wall,
            "real_time_factor": simulated / wall,
            "steps": float(steps),
            "nv": float(model.nv),
        },
        versions=versions,
        stopped=stopped,
    )
