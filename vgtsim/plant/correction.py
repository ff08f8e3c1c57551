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

from collections.abc import Sequence

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.compilation import compiled
from vgtsim.errors import AssemblyError
from vgtsim.graphics import mujoco
from vgtsim.kinematics import Chain, State, move_points
from vgtsim.plant.loads import Load
from vgtsim.plant.turns import Turns

_BODY = int(mujoco.mjtSameFrame.mjSAMEFRAME_BODY)
# Newton's iterations where nothing touches: the cost is then a quadratic, and the first one ends at its least but for rounding.
# More gained nothing where it was measured, see docs/formulation.md.
_ENOUGH = 4
# m by which a parabola through the ways of three steps may miss the next one. A loop of the reference arm opens by a share of
# it, the turn of a member in a step, so by 1e-8 m at its fastest and 40 ms.
_SMOOTH = 2e-7


class Foresight:
    """Foresees the speeds of a step from the lengths and the place of the mast commanded for its end.

    Where the commands go on smoothly, the speeds of three steps tell the next ones as well and cost nothing; kinematics is
    asked elsewhere.
    """

    def __init__(self, turns: Turns, chain: Chain, q: Array, lengths: Array, turn: float = 0.0) -> None:
        """Start at rest at inputs, shape (n,), with lengths, shape (J,), m, and a turn of the mast, rad."""
        self._turns, self._chain = turns, chain
        self._last = chain.state(np.array(q)[None])
        self._past = np.tile(np.append(lengths, turn), (5, 1))  # commands of the last steps, this one at the end

    def correct(self, data: mujoco.MjData, lengths: Array, mast: tuple[float, float], speeds: Array) -> None:
        """Correct foreseen speeds in place, shape (nv,), where the lengths at the step's end, shape (J,), m, say better.

        The mast is then at a feed, m, and a turn, rad. The feed lifts all nodes alike, so its jumps open no loop.
        """
        if note_command(self._past, lengths, mast[1]) < _SMOOTH:  # a radian counts one metre
            return
        state = self._chain.follow(lengths, self._last) or self._search(lengths)
        if state is not None:
            self._last = state
            self._turns(data, move_points(self._chain, state.nodes[0], *mast), lengths, speeds)

    def _search(self, lengths: Array) -> State | None:
        """State of lengths far from the last ones that were asked for; None where the arm would pass a singularity."""
        try:
            return self._chain.state(self._chain.inputs_from_lengths(lengths, self._last.q[0])[None])
        except AssemblyError:
            return None


@compiled
def note_command(past: Array, lengths: Array, turn: float) -> float:
    """Move the last commands, shape (5, J + 1), on by one, and tell by how much it misses the parabola of those before, m."""
    worst = 0.0
    for i in range(past.shape[1]):
        for k in range(4):
            past[k, i] = past[k + 1, i]
        past[4, i] = lengths[i] if i < len(lengths) else turn
        miss = past[4, i] - 4 * (past[3, i] + past[1, i]) + 6 * past[2, i] + past[0, i]
        worst = max(worst, abs(miss))
    return worst


class Correction:
    """A step of MuJoCo with all equality rows corrected; the foresight of imposed lengths, if there is any, is asked.

    Speeds are otherwise foreseen to change as in the step before, with a foresight to go on changing as in the two before.
    """

    def __init__(
        self, model: mujoco.MjModel, data: mujoco.MjData, foresight: Foresight | None, loads: Sequence[Load] = ()
    ) -> None:
        """Start at rest: no force is known yet; loads press on the arm in every step."""
        self._model, self._data, self._foresight, self._loads = model, data, foresight, loads
        self._pressed = np.zeros((model.nbody, 6))
        self._most = model.opt.iterations
        self._ahead = mujoco.MjData(model)  # bodies and sites where they are foreseen
        self._frames = np.array(model.geom_sameframe)
        self._past = np.zeros((2, model.nv))  # speeds two steps ago, and one
        self._speeds = np.empty(model.nv)
        self._count = -1

    def step(self, lengths: Array, mast: tuple[float, float] = (0.0, 0.0)) -> Array:
        """Make a step towards lengths, shape (J,), m, and a feed, m, and turn of the mast, rad.

        Returns the gaps of the equality rows at its begin, shape (E,), m.
        """
        model, data = self._model, self._data
        mujoco.mj_step1(model, data)
        if data.ne != self._count:
            self._find_rows()
        departures = self._find_departures(lengths, mast)
        rows, speeds, step = data.efc_pos[: self._count], data.efc_vel, model.opt.timestep
        gaps = np.array(rows)
        aim_rows(rows, departures, speeds, self._given_way, self._inertia, self._stiffness, step)
        self._press()
        model.opt.iterations = _ENOUGH if data.nefc == data.ne else self._most
        mujoco.mj_step2(model, data)
        model.opt.iterations = self._most
        note_given_way(data.efc_R, data.efc_force, step**2, self._given_way)
        return gaps

    def _press(self) -> None:
        """Put the loads of this instant in place of those of the step before; forces of others stay."""
        if not self._loads:
            return
        before, self._pressed = self._pressed, np.zeros(self._pressed.shape)
        for load in self._loads:
            load.press(self._data, self._pressed)
        self._data.xfrc_applied += self._pressed - before

    def rest(self) -> None:
        """Take the speeds that are left for none, as in the steps before: checks take a log to begin at rest."""
        self._data.qvel[:] = 0
        for speeds in self._past:
            speeds[:] = 0

    @property
    def foreseen(self) -> Array:
        """Places of all sites at the end of the last step, shape (sites, 3), m, as they were foreseen or found."""
        return self._ahead.site_xpos

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
        self._closures = self._closures[::3].copy()
        wraps = model.tendon_adr[first[self._spans]]
        self._joined = np.stack([first[self._closures], second[self._closures]], axis=1).astype(np.intp)
        self._spanned = np.stack([model.wrap_objid[wraps], model.wrap_objid[wraps + 1]], axis=1).astype(np.intp)
        constant, ratio = model.eq_solref[equality].T
        impedance = model.eq_solimp[equality, 1]  # the same at any gap, see `mjcf.rows`
        steps = constant / model.opt.timestep * impedance
        self._stiffness = impedance / (steps * ratio) ** 2
        self._inertia = 1 + 2 / steps + self._stiffness
        self._given_way, self._departures = np.zeros((2, self._count))

    def _find_departures(self, lengths: Array, mast: tuple[float, float]) -> Array:
        """Gaps that the step ends with beyond what its tangent foretells, shape (E,), m, until the next step."""
        here, step, departures = self._data.site_xpos, self._model.opt.timestep, self._departures
        there, along = self._foresee(lengths, mast)
        measure_departures(self._closures, self._joined, here, there, along, step, departures)
        measure_lengthening(self._spans, self._spanned, here, there, along, step, departures)
        return departures

    def _foresee(self, lengths: Array, mast: tuple[float, float]) -> tuple[Array, Array]:
        """Places of sites at the end of the step, shape (sites, 3), m, and the rows' speeds that lead there, m/s."""
        model, data, ahead, speeds, step = self._model, self._data, self._ahead, self._speeds, self._model.opt.timestep
        go_on(data.qvel, self._past, self._foresight is not None, speeds)
        if self._foresight is not None:
            self._foresight.correct(data, lengths, mast, speeds)
        # the solver begins there: what rounding leaves of the moments of balls is a share of the way that it goes
        start_solver(speeds, data.qvel, step, data.qacc_warmstart)
        ahead.qpos = data.qpos
        mujoco.mj_integratePos(model, ahead.qpos, speeds, step)
        model.geom_sameframe[:] = _BODY  # of the tank's two thousand geoms nothing is asked
        mujoco.mj_kinematics(model, ahead)
        model.geom_sameframe[:] = self._frames
        along = np.empty(data.nefc)
        mujoco.mj_mulJacVec(model, data, along, speeds)
        return ahead.site_xpos, along


@compiled
def go_on(now: Array, past: Array, smooth: bool, speeds: Array) -> None:
    """Write speeds that go on as in the step before or, if smooth, as in the two before; past ones, shape (2, nv), move on."""
    for i in range(len(now)):
        speeds[i] = 2 * now[i] - past[1, i]
        if smooth:
            speeds[i] += now[i] - 2 * past[1, i] + past[0, i]
        past[0, i], past[1, i] = past[1, i], now[i]


@compiled
def start_solver(speeds: Array, now: Array, step: float, accelerations: Array) -> None:
    """Write the accelerations, shape (nv,), that lead to foreseen speeds within a step in s."""
    for i in range(len(now)):
        accelerations[i] = (speeds[i] - now[i]) / step


@compiled
def note_given_way(softness: Array, force: Array, square: float, given_way: Array) -> None:
    """Write by how much the first rows give way to their forces, shape (E,), m; given is the square of the step, s²."""
    for i in range(len(given_way)):
        given_way[i] = square * softness[i] * force[i]


@compiled
def aim_rows(
    gaps: Array, departures: Array, speeds: Array, given_way: Array, inertia: Array, stiffness: Array, step: float
) -> None:
    """Replace gaps, shape (E,), m, by those that a step in s closes in full, see the head of the file."""
    for i in range(len(gaps)):
        way = gaps[i] - given_way[i] + departures[i]
        gaps[i] = (inertia[i] * way + step * speeds[i]) / stiffness[i]


@compiled
def measure_departures(
    rows: Index, joined: Index, here: Array, there: Array, along: Array, step: float, departures: Array
) -> None:
    """Write how far two joined sites come apart beyond the way along tangents, for three rows from each of some, m.

    Sites are here, and a step in s later there, both of shape (sites, 3), m; departures have shape (E,), m, and speeds along
    tangents are those of at least as many rows, m/s.
    """
    for i in range(len(rows)):
        row, first, second = rows[i], joined[i, 0], joined[i, 1]
        for k in range(3):
            apart = (there[first, k] - there[second, k]) - (here[first, k] - here[second, k])
            departures[row + k] = apart - step * along[row + k]


@compiled
def measure_lengthening(
    rows: Index, spanned: Index, here: Array, there: Array, along: Array, step: float, departures: Array
) -> None:
    """As `measure_departures`, for the length between two sites, one row each."""
    for i in range(len(rows)):
        start, end = spanned[i, 0], spanned[i, 1]
        before, after = 0.0, 0.0
        for k in range(3):
            before += (here[end, k] - here[start, k]) ** 2
            after += (there[end, k] - there[start, k]) ** 2
        departures[rows[i]] = np.sqrt(after) - np.sqrt(before) - step * along[rows[i]]
