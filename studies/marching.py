"""Models of this project's rows stepped in three ways: as runs do it, by Runge and Kutta, and extrapolated.

- `discrete`: MuJoCo's integrator of the runs. First order: it takes energy out of free motion.
- `rk4`: MuJoCo's RK4 with the same scaled weights and rows of two steps' time constant, damped critically. Second order in
  closure and energy and fourth in place while the step resolves every mode: stiff springs make it diverge.
- `extrapolated`: each step is made as one, as two and as three steps of `discrete`, with hubs put back on their loops after
  each. The three ends are combined so that the first two terms of their errors cancel. Second order or better, and stable
  however stiff the springs: this judges free swings of elastic and hydraulic arms.

No run needs them; see docs/benchmarks.md for their errors.

Source: P. Deuflhard, Recent progress in extrapolation methods for ordinary differential equations, SIAM Review 27 (1985),
505-535, for the extrapolated implicit Euler method.
"""

from __future__ import annotations

import copy
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from studies.multibody import POINT, Mechanism
from vgtsim.graphics import mujoco
from vgtsim.mjcf import retime

Array = NDArray[np.float64]

SCHEMES = ("discrete", "rk4", "extrapolated")
_PARTS = (1, 2, 3)  # steps that one extrapolated step is made of
_RIDGE = 1e-12  # of the largest diagonal: rows of a loop may repeat each other
_LOOKS = 200  # instants of a march at which gap and energy are taken


@dataclass(frozen=True, eq=False)
class March:
    """What a march ended with.

    Attributes:
        point: Place of the published point at the end, shape (3,), m.
        gap: Greatest distance that a row was open, m.
        energy: Greatest change of the energy since the start, J.
        spent: Processor time, s.
    """

    point: Array
    gap: float
    energy: float
    spent: float


class Marcher:
    """Steps a model by one of the schemes; the model is not changed."""

    def __init__(self, model: mujoco.MjModel, scheme: str, step: float) -> None:
        """Prepare a scheme with a step, s."""
        self.models = []
        for parts in _PARTS if scheme == "extrapolated" else (1,):
            part = copy.copy(model)
            retime(part, step / parts)
            self.models.append(part)
        if scheme == "rk4":
            self.models[0].opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
            self.models[0].eq_solref[:] = 2 * step, 1.0
        self._trials = [mujoco.MjData(part) for part in self.models]
        self._weights = [np.prod([k / (k - j) for j in _PARTS if j != k]) for k in _PARTS]

    def step(self, data: mujoco.MjData) -> None:
        """Go on by one step."""
        if len(self.models) == 1:
            mujoco.mj_step(self.models[0], data)
            return
        whole, ends = self.models[0], []
        for parts, model, trial in zip(_PARTS, self.models, self._trials, strict=True):
            trial.qpos[:], trial.qvel[:] = data.qpos, data.qvel
            for _ in range(parts):
                mujoco.mj_step(model, trial)
                close_loops(model, trial)
            settle_speeds(model, trial)
            ends.append((trial.qpos.copy(), trial.qvel.copy()))
        change, shift = np.zeros(whole.nv), np.zeros(whole.nv)
        for weight, (place, _) in zip(self._weights, ends, strict=True):
            mujoco.mj_differentiatePos(whole, change, 1.0, ends[-1][0], place)
            shift += weight * change
        data.qpos[:] = ends[-1][0]
        mujoco.mj_integratePos(whole, data.qpos, shift, 1.0)
        data.qvel[:] = sum(weight * speed for weight, (_, speed) in zip(self._weights, ends, strict=True))
        data.time += whole.opt.timestep
        close_loops(whole, data)
        settle_speeds(whole, data)


def march(mechanism: Mechanism, scheme: str, step: float, duration: float) -> March:
    """Let a mechanism go for a while, s."""
    marcher, data = Marcher(mechanism.model, scheme, step), mechanism.start()
    look = mujoco.MjData(mechanism.model)
    begun = find_energy(mechanism.model, data, look)
    count, gap, change, spent = round(duration / step), 0.0, 0.0, 0.0
    for index in range(1, count + 1):
        clock = time.process_time()
        marcher.step(data)
        spent += time.process_time() - clock
        if index % max(1, count // _LOOKS) == 0 or index == count:
            change = max(change, abs(find_energy(mechanism.model, data, look) - begun))
            gap = max(gap, float(np.abs(look.efc_pos).max()))
    return March(look.site(POINT).xpos.copy(), gap, change, spent)


def find_energy(model: mujoco.MjModel, data: mujoco.MjData, look: mujoco.MjData) -> float:
    """Energy of a state, J: of motion, gravity and springs; the second data is worked on, and holds the state's rows after."""
    look.qpos[:], look.qvel[:] = data.qpos, data.qvel
    mujoco.mj_fwdPosition(model, look)
    mujoco.mj_energyPos(model, look)
    mujoco.mj_energyVel(model, look)
    return float(look.energy.sum())


def close_loops(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Move a state by the shortest way, in the metric of its masses, to where its rows are closed; one Newton step."""
    rows, pull = _rows(model, data)
    mujoco.mj_integratePos(model, data.qpos, -pull @ _balance(rows, pull, data.efc_pos), 1.0)


def settle_speeds(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Take out of the speeds of a state what would open its rows."""
    rows, pull = _rows(model, data)
    data.qvel[:] -= pull @ _balance(rows, pull, rows @ data.qvel)


def _balance(rows: Array, pull: Array, wanted: Array) -> Array:
    matrix = rows @ pull
    matrix[np.diag_indices_from(matrix)] += _RIDGE * matrix.diagonal().max()
    return cho_solve(cho_factor(matrix), wanted)


def _rows(model: mujoco.MjModel, data: mujoco.MjData) -> tuple[Array, Array]:
    """Jacobian of the rows, shape (r, nv), and the motion that a unit of force in each makes, shape (nv, r)."""
    mujoco.mj_fwdPosition(model, data)
    rows = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model):
        mujoco.mju_sparse2dense(rows, data.efc_J, data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind)
    else:
        rows[:] = np.asarray(data.efc_J).reshape(rows.shape)
    pull = np.zeros_like(rows)
    mujoco.mj_solveM(model, data, pull, rows)
    return rows, pull.T
