"""The controller: from an operator's commands and the measured lengths to the lengths of the next step, in real time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index
from vgtsim.commands import read_inputs, read_row
from vgtsim.control.arm_now import ArmNow, Mobility, find_mobility
from vgtsim.control.feedback import Feedback
from vgtsim.control.limits import ACCELERATION, RATE, CylinderLimits
from vgtsim.control.postures import find_posture, read_goal_pose
from vgtsim.control.preference import Preference
from vgtsim.control.rates import Rates, solve_rates
from vgtsim.control.targets import Filter, LengthTarget, ToolTarget
from vgtsim.control.watches import GapWatch, UseWatch
from vgtsim.description import Operator
from vgtsim.errors import CommandError, StoppedError
from vgtsim.kinematics import State
from vgtsim.site import Site
from vgtsim.touches import Parts

_WHOLE = 0.98  # part of a wish from which nothing held it
_REST = Operator()


class Measured(Protocol):
    """What the controller must know of a plant before a step: `PlantState` has it."""

    @property
    def commanded(self) -> Array:
        """Lengths that the cylinders were told last, shape (J,), m."""
        ...

    @property
    def lengths(self) -> Array:
        """Measured lengths of the cylinders, shape (J,), m."""
        ...

    @property
    def contacts(self) -> Sequence[tuple[Any, ...]]:
        """Contacts during the last step; empty where nothing touches."""
        ...

    @property
    def stopped(self) -> str:
        """Why the plant goes no further; empty while it does."""
        ...


class Controller:
    """Drives a site's arm as an operator commands it, inside all limits and without a jump.

    `command` says what is wanted, at any time; `step` gives from the state of the plant the lengths that the plant is to have
    at the end of its next step. Each step asks for a little quadratic programme; nothing is planned ahead. Twists and
    goals are resolved rates with the null space (sections 6.3 and 6.4); a goal by `newton` is a posture, which is solved once.

    Attributes:
        timestep: Time between two steps, s.
        report: What the last step found: target, limits that hold the arm, clearance, use, condition.
    """

    def __init__(self, site: Site, timestep: float | None = None) -> None:
        """Make a controller of a site for a time step, s, by default the scene's; it begins where the first state is."""
        self.site, self.timestep = site, site.timestep if timestep is None else timestep
        self._how = site.task.operator or _REST
        self._limits = CylinderLimits(site, self._how.acceleration)
        self._nearness, self._strength = GapWatch(site=site), UseWatch(site=site)
        self._preference = Preference(site, site.task.motion.objective)
        self._feedback, self._parts = Feedback(site.chain), Parts(site)
        self._wanted: ToolTarget | LengthTarget | None = None
        self._arm: ArmNow | None = None
        self._rates = np.zeros(len(site.truss.actuated))
        self._held: tuple[str, ...] = ()
        self._last: tuple[Rates, Mobility, tuple[str, ...]] | None = None

    def start(self, lengths: ArrayLike, inputs: ArrayLike | None = None) -> None:
        """Begin at rest at lengths, shape (J,), m; inputs of the same posture save the way to them.

        Raises:
            CommandError: The size is wrong, or something is not finite.
            AssemblyError: The lengths do not close the loops.
        """
        chain = self.site.chain
        wanted = read_row("lengths", lengths, len(self._rates))
        q = chain.inputs_from_lengths(wanted, self.site.start) if inputs is None else np.asarray(inputs, float)
        self._arm = ArmNow(chain, chain.state(q[None]))
        self._rates = np.zeros_like(self._rates)
        self._feedback.start(self._arm.state)
        self._wanted = self._aim_lengths(None)
        self._held = ()

    def command(
        self,
        *,
        twist: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        inputs: ArrayLike | None = None,
        lengths: ArrayLike | None = None,
        hold: bool | None = None,
        method: str = "rate",
        objective: Sequence[str] | None = None,
    ) -> None:
        """Say what is wanted from the next step on; one target at a time. A command that is refused changes nothing.

        Args:
            twist: Velocity of the tool point and angular velocity of the tip plate in frame G, shape (6,), m/s and rad/s.
            goal: Tool point, m, and direction of the tool in frame G, shape (6,) or (2, 3).
            inputs: Inputs of the arm, shape (n,), to go to.
            lengths: Lengths of the cylinders, shape (J,), m, to go to.
            hold: Come to rest.
            method: Of a goal: "rate" or "newton".
            objective: What the null space is used for, terms as in the scene's `motion.objective`; none for nothing.

        Raises:
            CommandError: None or several targets, a wrong size, a figure that is not finite, inputs that a module cannot
                take, or lengths beyond a stroke.
            ReachError: The goal of method "newton" cannot be met.
            StoppedError: The arm has touched something or the plant has stopped; see `release`.
        """
        given = {"twist": twist, "goal": goal, "inputs": inputs, "lengths": lengths, "hold": hold or None}
        named = [name for name, value in given.items() if value is not None]
        if len(named) != 1:
            raise CommandError("command", " and ".join(named) or "nothing", f"one of {', '.join(given)}")
        if self._held:
            raise StoppedError(self._held[0])
        if self._arm is None:
            raise StoppedError("the controller has not seen a state yet")
        if method not in ("rate", "newton"):
            raise CommandError("method", repr(method), "'rate' or 'newton'")
        preference = self._preference if objective is None else Preference(self.site, tuple(objective))
        if goal is not None and method == "newton":
            posture = find_posture(self.site, goal, self._arm.q, preference.names)
            self._wanted = self._aim_lengths(posture)
        elif goal is not None:
            self._wanted = replace(self._aim_tool(), goal=read_goal_pose(goal), twist=None)
        elif twist is not None:
            self._wanted = replace(self._aim_tool(), twist=read_row("twist", twist, 6), goal=None)
        elif inputs is not None:
            chain = self.site.chain
            there = read_inputs(inputs, chain.straight.size, chain.lengths)[1]
            self._wanted = self._aim_lengths(self._require_strokes("inputs", there))
        elif lengths is not None:
            wanted = read_row("lengths", lengths, len(self._rates))
            self._wanted = self._aim_lengths(self._require_strokes("lengths", wanted))
        elif isinstance(self._wanted, ToolTarget):
            self._wanted = replace(self._wanted, twist=None, goal=None)
        else:
            self._wanted = self._aim_lengths(None)
        self._preference = preference

    def release(self) -> None:
        """Let the arm move again after a contact under drives that yield."""
        self._held = ()

    def step(self, state: Measured) -> Array:
        """Lengths that the plant is to have at the end of its next step, shape (J,), m, from its state now.

        After a contact that the scene does not allow, or where the plant has stopped, the last lengths are held.
        """
        if self._arm is None:
            self.start(state.commanded)
        assert self._arm is not None
        if state.contacts or state.stopped:
            touched = [
                f"contact of {first} with {second}"
                for _, first, second, *_ in state.contacts
                if not (self.site.yields and self._parts.find_rule((first, second)))
            ]
            self._held = tuple([state.stopped] if state.stopped else touched[:1]) or self._held
        self._feedback.look(self._arm.state, state.commanded, state.lengths)
        if self._held:
            self._rates = np.zeros_like(self._rates)
            self._wanted = self._aim_lengths(None)
            self._aimed = self.target
            return np.array(state.commanded)
        self._aimed = self.target
        moved = self._resolve(self._arm)
        trim = self._feedback.trim(self._limits.rate, moved is not None, self.timestep)
        low, high = self.site.chain.stroke
        return np.clip(self._arm.lengths + trim, low, high)

    def _resolve(self, arm: ArmNow) -> State | None:
        """Rates of the coming step, and the arm and its target moved by them; the state before, None where nothing moves."""
        dt, wanted = self.timestep, self._wanted
        most = self._limits.bound_accelerations(arm.jacobian)
        low, high, kinds = self._limits.bound_rates(arm.lengths, self._rates, most, dt)
        gaps, closing = self._nearness.bound(arm, most, dt)
        uses, rising = self._strength.bound(arm)
        if isinstance(wanted, ToolTarget):
            rows, wish, back = wanted.wish(arm, self.site.task.motion.acceleration, dt)
            task = rows @ arm.jacobian
            mobility = find_mobility(task)
            wish, lost = mobility.refuse(wish, rows)
            kept = mobility.refuse(back, rows)[0]
            wanted.give_up((back - kept) @ rows)
            back, way = kept, dt * wish @ rows
            liked = self._preference.like(arm, float(np.linalg.norm(wanted.filter.second)), self._limits.rate)
        else:
            assert wanted is not None
            task, lost, mobility = np.eye(len(low)), (), find_mobility(arm.jacobian[:5])
            wish, back = wanted.wish(arm, most, dt)
            liked, way = np.zeros_like(low), dt * wish
        found = solve_rates(
            task=task,
            wish=wish,
            back=back,
            liked=liked,
            full=self._limits.rate,
            low=low,
            high=high,
            rows=np.concatenate([gaps, uses]),
            least=np.concatenate([closing, rising]),
        )
        self._last = found, mobility, (*(f"lost direction {name}" for name in lost), *self._name(found, kinds))
        before = arm.state
        if not found.rates.any():
            self._rates = found.rates
            return None
        after = self.site.chain.follow(arm.lengths + dt * found.rates, arm.state)
        if after is None:  # not seen: strokes hold no singularity
            self._rates = np.zeros_like(low)
            self._last = found, mobility, ("a module that does not assemble there",)
            return None
        wanted.move(found.part * way)
        self._rates, self._arm = found.rates, ArmNow(self.site.chain, after)
        return before

    def _name(self, found: Rates, kinds: Index) -> tuple[str, ...]:
        """Limits that hold the arm back, where some do."""
        if found.part >= _WHOLE:
            return ()
        gaps = len(found.rows) - len(self._strength.picked)
        words = [f"clearance: {self._nearness.name(k)}" for k in np.flatnonzero(found.rows[:gaps]).tolist()]
        words += [f"rating: {self._strength.name(k)}" for k in np.flatnonzero(found.rows[gaps:]).tolist()]
        for j in np.flatnonzero(found.bounds):
            kind = int(kinds[1 if found.bounds[j] > 0 else 0, j])
            if kind != ACCELERATION:
                words.append(f"{'rate' if kind == RATE else 'stroke'}: {self._limits.names[j]}")
        return tuple(words)

    @property
    def target(self) -> Array:
        """Where the tool is meant to be at the end of the step that was asked for last, position, m, and direction, (6,)."""
        if isinstance(self._wanted, ToolTarget):
            return np.concatenate([self._wanted.position, self._wanted.direction])
        assert self._arm is not None
        return np.concatenate([self._arm.position, self._arm.direction])

    @property
    def report(self) -> ControlReport:
        """What the last step found."""
        if self._arm is None or self._last is None:
            raise StoppedError("the controller has made no step yet")
        found, mobility, words = self._last
        measured = self._feedback.measured
        clearance, nearest = self._nearness.nearest
        use, member = self._strength.worst
        return ControlReport(
            target_position=self._aimed[:3],
            tool_position=measured.tool[0][0],
            tool_direction=measured.tool[1][0],
            lengths=self._arm.lengths.copy(),
            rates=self._rates.copy(),
            part=0.0 if self._held else found.part,
            held_by=self._held or words,
            condition=mobility.condition,
            clearance=clearance,
            nearest=nearest,
            utilisation=use,
            member=member,
        )

    def _aim_tool(self) -> ToolTarget:
        """The tool's target, begun where the arm is and with its velocity if there is none yet."""
        if isinstance(self._wanted, ToolTarget):
            return self._wanted
        arm, how = self._arm, self._how
        assert arm is not None
        velocity = Filter.start(how.filter, arm.jacobian @ self._rates)
        return ToolTarget(
            position=arm.position.copy(),
            direction=arm.direction.copy(),
            filter=velocity,
            speed=how.speed,
            acceleration=how.acceleration,
        )

    def _aim_lengths(self, goal: Array | None) -> LengthTarget:
        """The target of the lengths, begun where the arm is and with its velocity if there is none yet."""
        if isinstance(self._wanted, LengthTarget) and not self._held and self._rates.any():
            return replace(self._wanted, goal=goal)
        assert self._arm is not None
        how = self._how
        return LengthTarget(
            lengths=self._arm.lengths.copy(),
            filter=Filter.start(how.filter, self._rates),
            rate=self._limits.rate,
            speed=how.speed,
            acceleration=how.acceleration,
            goal=goal,
        )

    def _require_strokes(self, what: str, lengths: Array) -> Array:
        box = self.site.box
        worst = int(np.argmin(box.spare(lengths)))
        if box.spare(lengths)[worst] < 0:
            found = f"{self._limits.names[worst]} at {lengths[worst]:.4f} m"
            raise CommandError(what, found, f"{box.least[worst]:.4f} to {box.greatest[worst]:.4f} m")
        return lengths


@dataclass(frozen=True, kw_only=True)
class ControlReport:
    """What a person at the controls wants to know. Vectors are in frame G.

    Attributes:
        target_position: Where the tool is meant to be, shape (3,), m.
        tool_position, tool_direction: The tool by the measured lengths.
        lengths, rates: Wanted lengths of the cylinders and their rates, shape (J,), m and m/s.
        part: Part of the wish that the last step did, 0 to 1.
        held_by: What kept it from more: limits by name, or a contact.
        condition: Condition number of the task; a radian counts as a metre.
        clearance: Least gap of the arm, m, and `nearest` the two bodies; infinite where nothing is within half a metre.
        utilisation: Greatest use of a member or drive at rest, a tenth added for motion, over its limit; `member` has it.
    """

    target_position: Array
    tool_position: Array
    tool_direction: Array
    lengths: Array
    rates: Array
    part: float
    held_by: tuple[str, ...]
    condition: float
    clearance: float
    nearest: str
    utilisation: float
    member: str
