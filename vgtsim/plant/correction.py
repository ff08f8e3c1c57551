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

from vgtsim.compilation import compiled
from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.plant.foresight import Foresight
from vgtsim.plant.hose import Hose

Array = NDArray[np.float64]
Index = NDArray[np.intp]


class Correction:
    """A step of MuJoCo with all equality rows corrected; the foresight of imposed lengths, if there is any, is asked.

    Speeds are otherwise foreseen to change as in the step before.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, foresight: Foresight | None, hose: Hose | None = None
    ) -> None:
        """Start at rest: no force is known yet; a hose through the arm loads it in every step."""
        self._model, self._data, self._foresight, self._hose = model, data, foresight, hose
        self._ahead = mujoco.MjData(model)  # bodies and sites where they are foreseen
        self._frames = np.array(model.geom_sameframe)
        self._speeds = np.zeros(model.nv)
        self._count = -1
        self._tool, self._tip = model.site(names.TOOL).id, model.body(names.TIP).id

    def step(self, lengths: Array, mast: tuple[float, float] = (0.0, 0.0), push: Array | None = None) -> Array:
        """Make a step towards lengths, shape (J,), m, and a feed, m, and turn of the mast, rad.

        A push acts on the tool point, shape (3,), N, in frame G.

        Returns the gaps of the equality rows at its begin, shape (E,), m.
        """
        model, data = self._model, self._data
        mujoco.mj_step1(model, data)
        if push is not None:
            lever = data.site_xpos[self._tool] - data.xipos[self._tip]
            data.xfrc_applied[self._tip] = [*push, *np.cross(lever, push)]
        if data.ne != self._count:
            self._find_rows()
        gaps = np.array(data.efc_pos[: self._count])
        way = gaps - self._given_way + self._find_departures(lengths, mast)
        speeds = model.opt.timestep * data.efc_vel[: self._count]
        data.efc_pos[: self._count] = (self._inertia * way + speeds) / self._stiffness
        if self._hose is not None:
            self._hose.press(data)
        mujoco.mj_step2(model, data)
        self._given_way = model.opt.timestep**2 * data.efc_R[: self._count] * data.efc_force[: self._count]
        return gaps

    def find_sites(self, data: mujoco.MjData) -> Array:
        """Places of all sites after the last step, shape (sites, 3), m; those in the data are still of its begin."""
        self._ahead.qpos = data.qpos
        mujoco.mj_kinematics(self._model, self._ahead)
        return self._ahead.site_xpos

    def _find_rows(self) -> None:
        """Look the rows up: they stay the same while no equality is switched."""
        model, data = self._model, self._data
        self._count = data.ne
        equality = data.efc_id[: self._count]
        kind, first, second = model.eq_type[equality], model.eq_obj1id[equality], model.eq_obj2id[equality]
        self._closures, self._spans = (
            np.flatnonzero(kind == of) for of in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_TENDON)
        )
        self._closures = self._closures[::3]
        wraps = model.tendon_adr[first[self._spans]]
        self._joined = np.stack([first[self._closures], second[self._closures]], axis=1).astype(np.intp)
        self._spanned = np.stack([model.wrap_objid[wraps], model.wrap_objid[wraps + 1]], axis=1).astype(np.intp)
        constant, ratio = model.eq_solref[equality].T
        impedance = model.eq_solimp[equality, 1]  # the same at any gap, see `mjcf.rows`
        steps = constant / model.opt.timestep * impedance
        self._stiffness = impedance / (steps * ratio) ** 2
        self._inertia = 1 + 2 / steps + self._stiffness
        self._given_way = np.zeros(self._count)

    def _find_departures(self, lengths: Array, mast: tuple[float, float]) -> Array:
        """Gaps that the step ends with beyond what its tangent foretells, shape (E,), m."""
        model, data, ahead = self._model, self._data, self._ahead
        step, now = model.opt.timestep, data.qvel
        speeds = 2 * now - self._speeds
        self._speeds = np.array(now)
        if self._foresight is not None:
            self._foresight.correct(data, lengths, mast, speeds)
        ahead.qpos = data.qpos
        mujoco.mj_integratePos(model, ahead.qpos, speeds, step)
        model.geom_sameframe[:] = (
            mujoco.mjtSameFrame.mjSAMEFRAME_BODY
        )  # of the tank's two thousand geoms nothing is asked
        mujoco.mj_kinematics(model, ahead)
        model.geom_sameframe[:] = self._frames
        along, departures = np.empty(data.nefc), np.zeros(self._count)
        mujoco.mj_mulJacVec(model, data, along, speeds)
        along *= step
        here, there = data.site_xpos, ahead.site_xpos
        measure_departures(self._closures, self._joined, here, there, along, departures)
        measure_lengthening(self._spans, self._spanned, here, there, along, departures)
        return departures


@compiled
def measure_departures(rows: Index, joined: Index, here: Array, there: Array, along: Array, departures: Array) -> None:
    """Write how far two joined sites come apart beyond the way along tangents, for three rows from each of some, m.

    Sites are here, and later there, both of shape (sites, 3), m; ways along tangents and departures have shape (E,), m.
    """
    for i in range(len(rows)):
        row, first, second = rows[i], joined[i, 0], joined[i, 1]
        for k in range(3):
            apart = (there[first, k] - there[second, k]) - (here[first, k] - here[second, k])
            departures[row + k] = apart - along[row + k]


@compiled
def measure_lengthening(
    rows: Index, spanned: Index, here: Array, there: Array, along: Array, departures: Array
) -> None:
    """As `measure_departures`, for the length between two sites, one row each."""
    for i in range(len(rows)):
        start, end = spanned[i, 0], spanned[i, 1]
        before, after = 0.0, 0.0
        for k in range(3):
            before += (here[end, k] - here[start, k]) ** 2
            after += (there[end, k] - there[start, k]) ** 2
        departures[rows[i]] = np.sqrt(after) - np.sqrt(before) - along[rows[i]]
