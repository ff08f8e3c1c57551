"""Many programmes of a scene's arm at once, on all cores: MuJoCo's rollout of a model without plant and correction.

MuJoCo steps each programme alone, so results are those of stepping one after the other, bit for bit. Cylinders are held by
servos so stiff that they impose the lengths, because a rollout can change controls but no equality. What a plant does
besides is not there: closure correction, contact, drives with limits, records. `docs/models.md` has the accuracy.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from mujoco.rollout import Rollout
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.errors import CommandError
from vgtsim.graphics import mujoco
from vgtsim.mjcf import build_spec, fill_qpos, make_pose_map, measure_gap, names, select_drive, stiffen
from vgtsim.site import Site

# Of the servos, N/m: the heaviest loads of shipped arms, 3e5 N, lengthen a cylinder by 3e-7 m. The integrator takes their
# force at the end of the step, so nothing rings at any step.
STIFFNESS = 1e12
_STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)


@dataclass(frozen=True)
class Played:
    """States of B programmes of T steps, shape (B, T, S), at the end of each step, and what they say, shape (B, T, ...)."""

    states: Array
    lengths: Array
    tool: Array

    @property
    def last(self) -> Array:
        """States at the end, shape (B, S), from which another batch may go on."""
        return self.states[:, -1]


class Batch:
    """Rollouts of a site's arm; close it, or use it in a `with` statement, to end its threads.

    `model` is in steps of `timestep`, s. States are MuJoCo's full physics, shape (B, S).
    """

    def __init__(self, site: Site, *, timestep: float | None = None, threads: int = 2) -> None:
        """Make model and threads; the time step is by default the site's.

        Raises:
            CommandError: There is no thread to work, or the step is not positive.
        """
        if threads < 1:
            raise CommandError("threads", str(threads), "at least 1")
        step = site.timestep if timestep is None else timestep
        if not 0 < step < np.inf:
            raise CommandError("timestep", f"{step:g} s", "a positive time")
        self.site, self.timestep, self.model = site, step, build_batch_model(site, step)
        self._pose = make_pose_map(self.model, site.truss)
        self._slides = self._pose.members[: len(site.truss.actuated)]
        self._data = [mujoco.MjData(self.model) for _ in range(threads)]
        self._pool = Rollout(nthread=threads)

    def stand(self, inputs: ArrayLike) -> Array:
        """States at rest in some postures, inputs of shape (B, n); shape (B, S)."""
        chain, data = self.site.chain, self._data[0]
        nodes = chain.nodes(np.atleast_2d(inputs))
        states = np.empty((len(nodes), mujoco.mj_stateSize(self.model, _STATE)))
        for state, row in zip(states, nodes, strict=True):
            mujoco.mj_resetData(self.model, data)
            fill_qpos(self._pose, self.site.truss, row, data.qpos)
            mujoco.mj_getState(self.model, data, state, _STATE)
        return states

    def play(self, states: ArrayLike, lengths: ArrayLike, feed: ArrayLike | None = None) -> Played:
        """Go on from states, shape (B, S), with lengths wanted at the end of each step, shape (B, T, J), m.

        The feed, shape (B, T), m, is zero if absent. A policy plays a few steps, looks at `Played`, and goes on from `last`.

        Raises:
            CommandError: Something has the wrong shape or is not finite.
        """
        begin, wanted = np.array(states, dtype=float), np.array(lengths, dtype=float)
        size, count = mujoco.mj_stateSize(self.model, _STATE), len(self._slides)
        if begin.ndim != 2 or begin.shape[1] != size:
            raise CommandError("states", f"shape {begin.shape}", f"shape (B, {size})")
        if wanted.ndim != 3 or wanted.shape[::2] != (len(begin), count) or not wanted.shape[1]:
            raise CommandError("lengths", f"shape {wanted.shape}", f"shape ({len(begin)}, T, {count})")
        lifts = np.zeros(wanted.shape[:2]) if feed is None else np.array(feed, dtype=float)
        if lifts.shape != wanted.shape[:2]:
            raise CommandError("feed", f"shape {lifts.shape}", f"shape {wanted.shape[:2]}")
        if not (np.isfinite(begin).all() and np.isfinite(wanted).all() and np.isfinite(lifts).all()):
            raise CommandError("command", "a number that is not finite", "finite numbers")
        control = np.empty((*wanted.shape[:2], self.model.nu))
        control[..., 0], control[..., 1:] = lifts, wanted
        found = np.asarray(self._pool.rollout(self.model, self._data, begin, control)[0])
        qpos = found[..., 1 : 1 + self.model.nq]  # after the time
        return Played(states=found, lengths=qpos[..., self._slides], tool=self._find_tools(qpos))

    def measure_gaps(self, states: Array) -> Array:
        """Greatest distance between a member's end and its hub in each of some states, shape (..., S); shape (...), m."""
        model, data = self.model, self._data[0]
        rows = states.reshape(-1, states.shape[-1])
        gaps = np.empty(len(rows))
        for k, row in enumerate(rows):
            mujoco.mj_setState(model, data, row, _STATE)
            mujoco.mj_kinematics(model, data)
            gaps[k] = measure_gap(model, data)
        return gaps.reshape(states.shape[:-1])

    def _find_tools(self, qpos: Array) -> Array:
        """Tool points, shape (..., 3), m, for coordinates of shape (..., nq)."""
        place, (w, x, y, z) = self._pose.tip, np.moveaxis(qpos[..., self._pose.tip + 3 : self._pose.tip + 7], -1, 0)
        axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z], axis=-1)
        return qpos[..., place : place + 3] + self.site.arm.tip_plate.tool_offset * axis

    def close(self) -> None:
        """End the threads."""
        self._pool.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def build_batch_model(site: Site, timestep: float) -> mujoco.MjModel:
    """Compile a scene's full arm of rigid members for rollouts at a time step, s; MuJoCo Warp takes it too.

    Servos impose the lengths, contact and sensors are off, and MuJoCo resets what diverges.
    """
    simulation = site.task.simulation.model_copy(update={"members": "rigid", "drive": "servo"})
    task = site.task.model_copy(update={"simulation": simulation})
    task = task.model_copy(update={"mast": task.mast.model_copy(update={"turn": None})})  # it stays as it is
    spec = build_spec(Site(replace(site.scene, task=task)), timestep=timestep)
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONTACT
    spec.option.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    model = spec.compile()
    assert model.actuator(0).name == names.servo(names.FEED)
    stiffen(model, simulation.weight_scale)
    select_drive(model, "servo")
    model.actuator_gainprm[:, 0] = STIFFNESS
    model.actuator_biasprm[:, 1:3] = [-STIFFNESS, 0.0]
    model.actuator_forcelimited[:] = False
    return model
