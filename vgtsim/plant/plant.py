"""The plant: one arm in one tank, stepped from outside. The only place that steps MuJoCo in a run."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.commands import read_inputs, read_row
from vgtsim.errors import CommandError, DivergenceError, StoppedError
from vgtsim.graphics import mujoco
from vgtsim.kinematics import move_points
from vgtsim.log import Contact, Piece, Revision, RunLog
from vgtsim.mjcf import build_model, retime, show_things
from vgtsim.plant.feeler import Feeler
from vgtsim.plant.gauges import FELT, find_gauges
from vgtsim.plant.loads import command_tool, find_digger
from vgtsim.plant.mast_drive import MastDrives
from vgtsim.plant.recorder import RecordClock, Recorder, list_digests
from vgtsim.plant.standing import stand_arm
from vgtsim.plant.watch import PlantState, are_same, check_state, find_greatest_among, list_warnings, name_collision
from vgtsim.site import Site
from vgtsim.statics import solve_members

_SENSOR_BIT = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
_SAME_STEP = 1e-6  # of a step: by which rounding may move an instant
_NEVER_RESET = "it has not been reset yet"


class Plant:
    """An arm that is reset, commanded and stepped: tours, operators, missions and environments are its clients.

    Each command is a length wanted at the end of the next step, because the rigid drives hold at the end of a step.
    A contact that the scene does not allow is a collision, and stops the plant for good. One that it allows is a load, but not
    under imposed lengths of rigid members: nothing there yields, and it stops the plant as well.
    Between two steps the plant holds the last command.
    The drives change `model`; `data` is to be read only; `timestep` is in s; `stopped` says why the plant cannot be stepped.
    """

    def __init__(
        self,
        site: Site,
        *,
        timestep: float | None = None,
        record_rate: float | None = None,
        model: mujoco.MjModel | None = None,
        store: Callable[[Piece], None] | None = None,
    ) -> None:
        """Make a plant; the second one of a site is made in some hundredths of a second.

        A store is given the log piece by piece, in another thread, one at a time; by default the plant keeps it. An error of
        the store is raised by a later step, `wait` or `log`.
        Time step, s, records a second (see the property) and model, which the plant changes, are by default the scene's.

        Raises:
            CommandError: The step is not positive, or the rate is negative or above that of the steps.
        """
        simulation = site.task.simulation
        self.site = site
        self.timestep = site.timestep if timestep is None else timestep
        if not 0 < self.timestep < np.inf:
            raise CommandError("timestep", f"{self.timestep:g} s", "a positive time")
        self.model = build_model(site) if model is None else model
        if self.model.opt.timestep != self.timestep:
            retime(self.model, self.timestep)
        self.data = mujoco.MjData(self.model)
        self._gauges = find_gauges(self.model, site)
        self._count = len(site.truss.actuated)
        self._recorder = Recorder(gauges=self._gauges, store=store)
        # what is knocked, and the ends of quick moves, fall between two records
        jerks = bool(site.yields and site.task.contacts) or bool(site.task.mission)
        self._steps, self._wall, self.stopped = 0, 0.0, _NEVER_RESET
        self._clock = RecordClock(self.timestep, simulation.log_rate if record_rate is None else record_rate)
        skips = self._clock.rate * self.timestep < 1 - _SAME_STEP and simulation.members == "sections"
        self._felt = "acceleration" if jerks else FELT if skips else ""  # by steps, of records that are steps apart

    @property
    def record_rate(self) -> float:
        """Records a second, from none to one a step; it may be changed between two steps.

        A record is made at the first step at or after the instant that the rate asks for. So the log is evenly spaced,
        which verification needs, only where the rate is a whole fraction of the rate of steps.
        """
        return self._clock.rate

    @record_rate.setter
    def record_rate(self, rate: float) -> None:
        """Set the rate from the coming step on, Hz."""
        self._clock.set_rate(rate, self._steps)

    @property
    def time(self) -> float:
        """Simulated time since the reset, s."""
        return self._steps * self.timestep

    def reset(
        self, lengths: ArrayLike | None = None, inputs: ArrayLike | None = None, *, feed: float = 0.0, turn: float = 0.0
    ) -> PlantState:
        """Stand the arm in a posture, at rest and in equilibrium under its weight; time, log and goal start anew.

        Args:
            lengths: Lengths of the cylinders, shape (J,), m.
            inputs: Those of the same posture, shape (n,): saves the way there. Without both the arm stands as at the start.
            feed: Height of the mast above its working depth, m.
            turn: Of the mast about its axis, rad.

        Raises:
            CommandError: An array is of wrong size or not finite, an input is no module's, or feed or turn is out of reach.
            AssemblyError: The lengths do not close the loops.
            DescriptionError: The arm is so deep in something that its state diverges, or an elastic arm buckles.
        """
        chain = self.site.chain
        wanted = None if lengths is None else read_row("lengths", lengths, self._count)
        if inputs is None:
            q = self.site.start if wanted is None else np.asarray(chain.inputs_from_lengths(wanted))
        else:
            q = read_inputs(inputs, chain.straight.size, chain.lengths)[0]
        wanted = chain.lengths(q) if wanted is None else wanted
        self._mast_drives = MastDrives(self.model, self.data, self.site)
        self._mast = self._stood = self._mast_drives.read_command(feed, turn)
        self._digger = find_digger(self.model, self.site)
        self.stopped = _NEVER_RESET  # until the arm stands
        self._target = self._commanded = wanted
        self._rates: Array | None = None
        self._coming = sorted(set(self.site.tank.appearances.values()))
        self.appeared = 0  # instants so far at which things appeared in the tank
        show_things(self.model, self.site.tank, 0.0)
        self._drive, self._correction, self._calm_steps = stand_arm(
            self.model,
            self.data,
            self.site,
            self._gauges,
            inputs=q,
            nodes=move_points(chain, chain.nodes(q), *self._mast),
            lengths=wanted,
            turn=self._mast[1],
            loads=[] if self._digger is None else [self._digger],
        )
        self._feeler = Feeler(self.model, self.data, self.site, self._gauges, self._digger)
        self._find_equilibrium()
        self.wait()
        self._recorder = Recorder(gauges=self._gauges, store=self._recorder.store)
        self._steps, self._wall, self.stopped = 0, 0.0, ""
        self._clock.set_rate(self._clock.rate, 0)
        self._goal, self._settled, self._aimed = -1, False, None
        self._touched: list[Contact] = []
        self._slow = int(self._speed() < self.site.task.motion.settle_speed)
        self._state: PlantState | None = None
        self._before = self.state.nodes
        return self.state

    def command(
        self,
        lengths: ArrayLike | None = None,
        *,
        rates: ArrayLike | None = None,
        feed: float | None = None,
        turn: float | None = None,
        tool: float | None = None,
    ) -> None:
        """Say where cylinders and mast are to be at the end of the next step, or how fast cylinders are to go from now on.

        Args:
            lengths: Shape (J,), m; held until the next command.
            rates: Shape (J,), m/s; each step adds a step's way to the commanded lengths, until the next command.
            feed: Height of the mast above its working depth, m; held until the next command. Alone it leaves the cylinders
                their command.
            turn: Of the mast about its axis, rad; held until the next command.
            tool: Share of its power at which the tool then removes waste, 0 to 1; held until the next command.

        Raises:
            CommandError: Lengths and rates are given both, or nothing is, or the size is wrong, or something is not finite,
                or the feed or the turn is out of reach, or the tool is none that removes waste in the scene's mission.
            StoppedError: The plant has stopped.
        """
        self._require_going()
        given = (lengths is not None) + (rates is not None)
        if given == 2 or (not given and feed is None and turn is None and tool is None):
            raise CommandError("command", "neither or both", "either lengths or rates")
        wanted = self._mast_drives.read_command(feed, turn, self._mast)
        if lengths is not None:
            self._target, self._rates = read_row("lengths", lengths, self._count), None
        elif rates is not None:
            self._rates = read_row("rates", rates, self._count)
        self._mast = wanted
        if tool is not None:
            command_tool(self._digger, tool)

    def mark(self, goal: int, *, settled: bool = False, target: ArrayLike | None = None) -> None:
        """Say for the records which goal is approached from now on, or held, settled; -1 for none.

        Where an operator drives, `target` is where the tool is meant to be now: position, m, and direction, shape (6,).
        """
        self._goal, self._settled = goal, settled
        self._aimed = None if target is None else read_row("target", target, 6)

    def note_revision(self, leg: int, row: int) -> Revision:
        """Say for the log that a tour is planned anew now, at a row of the leg of an index."""
        revision = Revision(self.time, leg, row)
        self._recorder.revisions.append(revision)
        return revision

    def wait(self) -> None:
        """Wait until the store has taken all that it was given so far, beside the steps; its error is raised."""
        self._recorder.wait()

    def end(self, reason: str) -> None:
        """Stop for good, for a reason that the log gives."""
        self.stopped = reason

    def step(self, count: int = 1) -> None:
        """Go on by a number of steps, fewer after a contact that is not allowed.

        Raises:
            StoppedError: The plant has stopped before.
            DivergenceError: The state stopped being physical; the error carries the log until then.
        """
        self._require_going()
        self._state, self._touched = None, []
        for _ in range(count):
            self._advance()
            if self.stopped:
                break

    @property
    def calm(self) -> bool:
        """Whether the arm has come to rest, see `PlantState.calm`."""
        return self._slow >= self._calm_steps

    @property
    def state(self) -> PlantState:
        """The state now; raises `StoppedError` before the first reset."""
        if self.stopped == _NEVER_RESET:
            self._require_going()
        if self._state is None:
            data, gauges = self.data, self._gauges
            drive_force, mast = self._drive.force(), self._mast_drives
            mujoco.mj_kinematics(self.model, data)  # a step leaves the places of its begin
            self._state = PlantState(
                time=self.time,
                commanded=np.array(self._commanded),
                lengths=gauges.lengths(data),
                rates=gauges.rates(data),
                nodes=data.site_xpos[gauges.nodes],
                tool_position=data.site_xpos[gauges.tool].copy(),
                tool_rotation=data.xmat[gauges.tip].reshape(3, 3).copy(),
                drive_force=drive_force,
                feed=mast.feed.place,
                feed_force=mast.feed.effort(),
                turn=mast.turn.place,
                turn_torque=mast.turn.effort(),
                speed=self._speed(),
                calm=self.calm,
                contacts=tuple(self._touched),
                stopped=self.stopped,
            )
        return self._state

    @property
    def axial(self) -> Array:
        """Axial forces of the members at the last record, tension positive, shape (M,), N; before the first one, at rest."""
        known = self._recorder.axial(self.site.truss.ends)
        return solve_members(self.site.load_model, self.state.nodes).near_axial if known is None else known

    @property
    def log(self) -> RunLog:
        """All records since the reset; with a store, those that it was not given yet."""
        simulated, wall = self.time, max(self._wall, 1e-9)  # no division by zero before the first step
        performance = {"simulated_s": simulated, "wall_s": wall, "real_time_factor": simulated / wall}
        performance |= {"timestep_s": self.timestep, "steps": float(self._steps), "nv": float(self.model.nv)}
        return self._recorder.make_log(list_warnings(self.data), performance, self.stopped, list_digests(self.site))

    def _require_going(self) -> None:
        if self.stopped:
            raise StoppedError(self.stopped)

    def _find_equilibrium(self) -> None:
        """Let the constraints take up the weight before time zero: kinematics give the posture, but not its forces."""
        motion = self.site.task.motion
        touched: list[Contact] = []
        for _ in range(round(motion.patience / self.timestep)):
            self._drive.command(self._target)
            self._mast_drives.command(self._mast)
            gaps = self._correction.step(self._target, self._mast)
            touched = touched or self._feeler.list_contacts()
            try:
                check_state(self.model, self.data, gaps)
            except DivergenceError:
                if not touched:
                    raise
                found = f"{touched[0].first} {-touched[0].gap:.3g} m deep in {touched[0].second}, which the drives cannot hold"
                raise self.site.scene.error("motion.start", found, "a posture clear of everything") from None
            if self._speed() < motion.settle_speed:
                break
        self._correction.rest()
        self.data.time = 0.0

    def _speed(self) -> float:
        """Greatest speed of a node along an axis, m/s."""
        return find_greatest_among(self.data.qvel, self._gauges.hub_speeds)

    def _advance(self) -> None:
        """One step: drives, MuJoCo, divergence, record, rest, contact."""
        begin, data = time.perf_counter(), self.data
        if self._rates is not None:
            self._target = self._target + self._rates * self.timestep
        recorded = self._start_step()
        noted, reached = self._gauges.note(data), self._mast_drives.reached
        self._recorder.note_saturation(self._drive.command(self._target))
        self._mast_drives.command(self._mast)
        self._feeler.stage.prepare(data, self._correction.foreseen)
        try:
            gaps = self._correction.step(self._target, self._mast)
        finally:
            self._feeler.stage.restore()
        self._mast_drives.discount(gaps, self._mast, self._stood)
        self._steps += 1
        try:
            check_state(self.model, data, gaps)
        except DivergenceError as error:
            self.stopped = str(error)
            self._wall += time.perf_counter() - begin
            raise DivergenceError(error.time, error.row, error.value, self.log) from None
        if recorded:
            self._recorder.record(
                data,
                time=(self._steps - 1) * self.timestep,
                commanded=self._commanded,
                noted=noted,
                goal=self._goal,
                settled=self._settled,
                pressure=self._drive.pressure,
                more=self._find_more() | reached,
            )
        if self._digger is not None:
            self._digger.dig(data.site_xpos[self._gauges.tool], self.timestep)
        if self._felt:
            self._before = data.site_xpos[self._gauges.nodes]
        self._note_rest()
        self._note_contacts(self._feeler.list_contacts(), recorded=recorded)
        if self.appeared < len(self._coming):
            self._note_appearances()
        self._wall += time.perf_counter() - begin

    def _note_appearances(self) -> None:
        """Show and feel from now on what has appeared by now."""
        now = self.time + _SAME_STEP * self.timestep
        if self._coming[self.appeared] <= now:
            self.appeared = int(np.searchsorted(self._coming, now, side="right"))
            show_things(self.model, self.site.tank, now)
            self._feeler.stage.forget()

    def _start_step(self) -> bool:
        """Whether the coming step is recorded; only then sensors are worked out, as they cost time."""
        recorded = self._clock.is_due(self._steps)
        flags, sensed = self.model.opt.disableflags, recorded and self._gauges.senses
        if bool(flags & _SENSOR_BIT) == sensed:
            self.model.opt.disableflags = flags ^ _SENSOR_BIT
        return recorded

    def _find_more(self) -> dict[str, float | Array]:
        """More quantities of the record of the last step, by name."""
        dug = {} if self._digger is None else self._digger.record
        more: dict[str, float | Array] = {**self._mast_drives.tell(self._stood), **dug}
        if self._aimed is not None:
            more["target"] = self._aimed
        if self._felt:
            here, there, nodes = self.data.site_xpos, self._correction.find_sites(self.data), self._gauges.nodes
            more[self._felt] = (there[nodes] - 2 * here[nodes] + self._before) / self.timestep**2
        return more

    def _note_rest(self) -> None:
        """Count the steps for which the arm has been slow under one command."""
        if not are_same(self._target, self._commanded) or self._mast != self._stood:
            self._slow = 0
        self._slow = self._slow + 1 if self._speed() < self.site.task.motion.settle_speed else 0
        self._commanded, self._stood = self._target, self._mast

    def _note_contacts(self, contacts: list[Contact], *, recorded: bool) -> None:
        """Note what touches; loads are noted with the record that they act in, collisions at once."""
        if not contacts:
            return
        loads, collisions = self._feeler.sort(contacts)
        self._touched += loads + collisions
        if recorded:
            now = (self._steps - 1) * self.timestep
            self._recorder.note_contacts([contact._replace(time=now) for contact in loads])
        self._recorder.note_contacts(collisions)
        if collisions:
            self.stopped = name_collision(collisions[0], self.site.task.simulation.drive)
