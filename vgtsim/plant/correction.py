"""The closure correction: loops stay closed however far the members turn within a step.

MuJoCo's discrete integrator closes the gap p of a constraint row, whose speed is u, by the way

    (k p - u) / (1 + b + k) + R f

where k and b are the row's stiffness and damping and R its softness to the force f, all in units of the step. It then
moves the bodies along arcs, which depart from their tangents. So between the two halves of the step the row is given
another gap: the one for which that way is p, plus the departure of the foreseen motion. The force is that of the step before.
Loops and imposed lengths then are at the end of the step as they are wanted.

`efc_pos` is read in the second half of a step and not before; `tests/plant/test_correction.py` holds MuJoCo to that.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vgtsim.graphics import mujoco
from vgtsim.plant.foresight import Foresight

Array = NDArray[np.float64]


class Correction:
    """A step of MuJoCo with all equality rows corrected; the foresight of imposed lengths, if there is any, is asked.

    Speeds are otherwise foreseen to change as in the step before.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, foresight: Foresight | None) -> None:
        """Start at rest: no force is known yet."""
        self._model, self._data, self._foresight = model, data, foresight
        self._ahead = mujoco.MjData(model)  # the bodies where they are foreseen
        self._speeds = np.zeros(model.nv)
        self._count = -1

    def step(self, lengths: Array) -> Array:
        """Make a step towards lengths, shape (J,), m; returns the gaps of the equality rows at its begin, shape (E,), m."""
        model, data = self._model, self._data
        mujoco.mj_step1(model, data)
        if data.ne != self._count:
            self._find_rows()
        gaps = np.array(data.efc_pos[: self._count])
        way = gaps - self._given_way
        way[self._bent] += self._find_departures(lengths, gaps)
        speeds = model.opt.timestep * data.efc_vel[: self._count]
        data.efc_pos[: self._count] = (self._inertia * way + speeds) / self._stiffness
        mujoco.mj_step2(model, data)
        self._given_way = model.opt.timestep**2 * data.efc_R[: self._count] * data.efc_force[: self._count]
        return gaps

    def _find_rows(self) -> None:
        """Look the rows up: they stay the same while no equality is switched."""
        model, data = self._model, self._data
        self._count = data.ne
        equality = data.efc_id[: self._count]
        self._closures = np.flatnonzero(model.eq_type[equality] == mujoco.mjtEq.mjEQ_CONNECT)
        own = equality[self._closures[::3]]
        self._first, self._second = model.eq_obj1id[own], model.eq_obj2id[own]
        self._spans = np.flatnonzero(model.eq_type[equality] == mujoco.mjtEq.mjEQ_TENDON)
        wraps = model.tendon_adr[model.eq_obj1id[equality[self._spans]]]
        self._start, self._end = model.wrap_objid[wraps], model.wrap_objid[wraps + 1]
        self._bent = np.concatenate([self._closures, self._spans])
        constant, ratio = model.eq_solref[equality].T
        impedance = model.eq_solimp[equality, 1]  # the same at any gap, see `mjcf.rows`
        steps = constant / model.opt.timestep * impedance
        self._stiffness = impedance / (steps * ratio) ** 2
        self._inertia = 1 + 2 / steps + self._stiffness
        self._given_way = np.zeros(self._count)

    def _find_departures(self, lengths: Array, gaps: Array) -> Array:
        """Gaps of closures, then of length rows, that the step ends with beyond what its tangent foretells, m."""
        model, data, ahead = self._model, self._data, self._ahead
        step, now = model.opt.timestep, data.qvel
        speeds = 2 * now - self._speeds
        self._speeds = np.array(now)
        if self._foresight is not None:
            self._foresight.correct(data, lengths, speeds)
        ahead.qpos = data.qpos
        mujoco.mj_integratePos(model, ahead.qpos, speeds, step)
        mujoco.mj_kinematics(model, ahead)
        place, along = ahead.site_xpos, np.empty(data.nefc)
        mujoco.mj_mulJacVec(model, data, along, speeds)
        gone = (place[self._first] - place[self._second]).ravel() - gaps[self._closures]
        if len(self._spans):
            span = place[self._end] - place[self._start], data.site_xpos[self._end] - data.site_xpos[self._start]
            after, before = (np.sqrt(np.einsum("ri,ri->r", item, item)) for item in span)
            gone = np.concatenate([gone, after - before])
        return gone - step * along[self._bent]
