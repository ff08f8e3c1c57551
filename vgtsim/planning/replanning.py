"""Tours and missions planned anew on their way, when something appears in the tank that nobody knew of.

The leg that runs is stopped on its own path, mast and tool with it, within the acceleration of the scene. The arm stands for the
scene's hold, and the ways to goals are planned from where it stands. Of a mission rows of the tool, a hold and the way through
the riser go on as they were where the rest of them is clear. Where it is not, an arm in the riser goes back to where that way
began, and another way in or out is sought.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import FollowStep, InsertStep, MissionStep, RasterStep, WithdrawStep
from vgtsim.errors import DescriptionError, FollowError, PathError, ReachError, TrussError
from vgtsim.log import Revision
from vgtsim.planning.cutting import foresee_cut, rise_to_power
from vgtsim.planning.directrix import Leader, LeaderPair
from vgtsim.planning.entry import Entry
from vgtsim.planning.insertion import ask_gap, judge_again
from vgtsim.planning.mission import LegPart, MissionPlan, find_leader, make_leg
from vgtsim.planning.programme import ROUNDING, ProgrammeRows, go_on_rows, read_height, stop_rows
from vgtsim.planning.tour import Leg, Tour, plan_goals
from vgtsim.site import Site

_SAME_INSTANT = 1e-6  # of a step: rounding in the clock of a run must not hide what appeared at this very instant
_JUDGED = 1000  # instants of the rest of a step at which clearance is measured


@dataclass(frozen=True)
class _Halt:
    """A leg that was stopped: its rows as one array, shape (T, C), m, and where on them the arm stands.

    `begun` are the rows up to there, the rest included; the row at which it `stood` has shape (C,).
    """

    leg: Leg
    rows: Array
    begun: ProgrammeRows
    stood: Array
    place: float
    timestep: float


def revise_as_run(site: Site, tour: Tour, revisions: Iterable[Revision]) -> Tour:
    """A tour as it was planned anew in a run, by the instants that its log tells."""
    for revision in revisions:
        tour = revise_tour(site, tour, revision)
    return tour


def revise_tour(site: Site, tour: Tour, revision: Revision) -> Tour:
    """The tour from an instant on with what has appeared in the tank by then.

    Legs before it and the rows up to it stay. Where there is no way on, the tour ends where the arm stopped, and says why.
    """
    index, now, step = revision.leg, tour.legs[revision.leg], tour.timestep
    halt = _stop(site, now, revision.row, step)
    begun = halt.begun
    plan = _resume(site.learn(revision.time + _SAME_INSTANT * step), tour, index, halt)
    here = plan.here
    last = ProgrammeRows(begun.lengths[-1:], None if begun.feed is None else begun.feed[-1:])
    gap, place = min((gap, name) for name, gap in _distances(plan, last))
    try:
        if site.task.mission:
            stand = LegPart(clearance=gap, place=place, rows=lambda _: begun, turn=plan.site.turn)
            legs = _plan_steps(site, plan, tour, index, halt, stand)
        else:
            first, *legs = plan_goals(plan.site, here, now.goal, step).legs
            legs = [replace(first, lengths=np.concatenate([begun.lengths, first.lengths[1:]])), *legs]
        return replace(tour, legs=(*tour.legs[:index], *legs), planned=tour.digest, way=plan.way)
    except (PathError, ReachError, FollowError, TrussError, DescriptionError) as error:
        blocked = f"no way on from {revision.time:.6g} s, at which something appeared in the tank: {error}"
        end = replace(now, **begun._asdict(), q=here, clearance=gap, place=place)
        return replace(tour, legs=(*tour.legs[:index], end), planned=tour.digest, blocked=blocked)


def _plan_steps(site: Site, plan: MissionPlan, tour: Tour, index: int, halt: _Halt, stand: LegPart) -> list[Leg]:
    """The legs of a mission from one of an index on, which begins with the part up to where the arm stands."""
    which, steps = _find_step(site.task.mission, index)
    start = tour.legs[index - 1].q if index else tour.start
    pieces, leader, bound = _go_on(plan, halt, steps[0], which, start)
    plan.lay([stand, *pieces])
    if which == 0 and isinstance(steps[0], FollowStep):
        plan.add_path()
    for later in steps[1:]:
        plan.add(later)
    plan.check_lines()
    legs = [make_leg(site, index + k, plan, k, tour.timestep) for k in range(len(plan.pieces))]
    return [replace(legs[0], leader=leader, bound=legs[0].bound if bound is None else bound), *legs[1:]]


def _find_step(steps: Sequence[MissionStep], leg: int) -> tuple[int, Sequence[MissionStep]]:
    """Which leg of its step one is, 0 or 1, and that step with those after it."""
    owner = list(chain.from_iterable([k] * (1 + isinstance(step, FollowStep)) for k, step in enumerate(steps)))
    return leg - owner.index(owner[leg]), steps[owner[leg] :]


def _stop(site: Site, leg: Leg, row: int, timestep: float) -> _Halt:
    """The leg brought to rest from a row on, and its hold; the tool comes to rest after the arm."""
    motion, mast = site.task.motion, site.task.mast
    columns = [leg.lengths]
    for places, drive in ((leg.feed, mast.feed), (leg.turn, mast.turn)):
        if places is not None and drive is not None:  # as lengths that may be accelerated as cylinders may
            columns.append(places[:, None] * (motion.acceleration / drive.acceleration))
    rows = np.concatenate(columns, axis=1)
    stopped = stop_rows(rows, row, timestep, motion.acceleration)
    rest = round(motion.hold / timestep)
    share = None
    if leg.tool is not None:
        at = np.interp(stopped.places, np.arange(len(leg.tool)), leg.tool)
        fall = at[-1] * (1 - _rise(site, timestep)) if at[-1] else np.zeros(0)
        share = np.concatenate([at, fall, np.zeros(rest)])
        rest += len(fall)
    stood, place = stopped.rows[-1], float(stopped.places[-1])
    begun = _split(site, leg, np.concatenate([stopped.rows, np.tile(stood, (rest, 1))]), share)
    return _Halt(leg=leg, rows=rows, begun=begun, stood=stood, place=place, timestep=timestep)


def _rise(site: Site, timestep: float) -> Array:
    """Share of its power with which the tool starts, row by row, the last one full."""
    assert site.task.tool is not None  # of a scene with such a leg
    return rise_to_power(site.task.tool, timestep)[1:]


def _split(site: Site, leg: Leg, rows: Array, share: Array | None) -> ProgrammeRows:
    """Rows of one array as those of a programme."""
    motion, mast, count = site.task.motion, site.task.mast, leg.lengths.shape[1]
    found: list[Array | None] = []
    column = count
    for places, drive in ((leg.feed, mast.feed), (leg.turn, mast.turn)):
        if places is None or drive is None:
            found.append(places)
            continue
        found.append(rows[:, column] * (drive.acceleration / motion.acceleration))
        column += 1
    return ProgrammeRows(rows[:, :count], found[0], found[1], share)


def _resume(site: Site, tour: Tour, index: int, halt: _Halt) -> MissionPlan:
    """What is planned so far, where the arm was stopped in a leg of an index."""
    heights = site.begun
    rows = [ProgrammeRows(leg.lengths, leg.feed, leg.turn, leg.tool) for leg in tour.legs[:index]]
    for part in (*rows, halt.begun):
        if part.tool is not None and heights is not None:
            heights = foresee_cut(site, part.lengths, part.tool, tour.timestep, heights)
    turns = [turn for turn in (*(leg.turn for leg in tour.legs[:index]), halt.begun.turn) if turn is not None]
    site = site.lower_waste(heights).turn_mast(float(turns[-1][-1]) if turns else site.turn)
    here = np.array(site.chain.inputs_from_lengths(halt.begun.lengths[-1]))
    way = None
    if tour.way is not None:
        try:
            way = judge_again(site.turn_mast(0.0), tour.way)
        except PathError:
            way = None  # another one is found when it is asked for
    plan = MissionPlan(site=site, here=here, height=read_height(halt.begun.feed), way=way)
    plan.trail = list(tour.legs[index - 1].trail) if index and halt.begun.turn is None else []
    return plan


def _go_on(
    plan: MissionPlan, halt: _Halt, step: MissionStep, which: int, start: Array
) -> tuple[list[LegPart], Leader | LeaderPair | None, int | None]:
    """Pieces from where the arm stands to the end of the leg, what the arm follows meanwhile, and from which row, if as before.

    The arm had inputs of shape (n,) as the step began.
    """
    leg = halt.leg
    loose = leg.bound is None or halt.place < leg.bound
    if loose and not plan.height:
        if isinstance(step, FollowStep) and which == 0:
            return plan.approach(step), None, None
        if isinstance(step, RasterStep):
            return plan.raster(step, plan.site.chain.tool(start)), None, None
        pieces = plan.take(step)
        return pieces, find_leader(pieces), None
    rest = _rest(plan.site, halt)
    gap, place, room = _judge(plan, rest)
    if room >= 0:
        plan.here, plan.height = leg.q, read_height(rest.feed)
        if rest.tool is not None and plan.heights is not None:
            plan.lower(foresee_cut(plan.site, rest.lengths, rest.tool, halt.timestep, plan.heights))
        return (
            [LegPart(clearance=gap, place=place, rows=lambda _: rest, turn=plan.site.turn, bound=True)],
            leg.leader,
            leg.bound,
        )
    if loose or not isinstance(step, InsertStep | WithdrawStep):
        raise PathError(f"the rest of {leg.name}", gap, place)
    back = _rest(plan.site, halt, back=True)
    gap, place, room = _judge(plan, back)
    if room < 0:
        raise PathError(f"where {leg.name} began", gap, place)
    plan.here = np.array(plan.site.chain.inputs_from_lengths(back.lengths[-1]))
    plan.height, plan.way = read_height(back.feed), None
    pieces = plan.take(step)
    leader = find_leader(pieces)
    assert leg.leader is not None
    assert leader is not None  # ways in and out have one
    return (
        [LegPart(clearance=gap, place=place, rows=lambda _: back, turn=plan.site.turn), *pieces],
        LeaderPair(leg.leader, leader),
        None,
    )


def _rest(site: Site, halt: _Halt, *, back: bool = False) -> ProgrammeRows:
    """Rows from where the arm stands to the end of the leg, or back to where its last piece began."""
    leg, first = halt.leg, halt.leg.bound or 0
    rows, place = (halt.rows[first:][::-1], len(halt.rows) - 1 - halt.place) if back else (halt.rows, halt.place)
    course = go_on_rows(rows, place, halt.timestep, site.task.motion.acceleration)
    whole = np.concatenate([halt.stood[None], course.rows])
    share = None
    if leg.tool is not None:
        at = np.interp(np.append(place, course.places), np.arange(len(leg.tool)), leg.tool)
        rise = at[0] * _rise(site, halt.timestep) if at[0] else np.zeros(0)
        whole = np.concatenate([np.tile(whole[0], (len(rise), 1)), whole])
        share = np.concatenate([[0.0], rise[:-1], at]) if len(rise) else at
    return _split(site, leg, whole, share)


def _judge(plan: MissionPlan, rows: ProgrammeRows) -> tuple[float, str, float]:
    """Least distance of rows from anything, m, from what, and how much more it is than asked for; the worst of all places."""
    found = dict(_distances(plan, rows))
    room, place = min(
        (gap - (ask_gap(plan.site, name) if rows.feed is not None else plan.site.clearance), name)
        for name, gap in found.items()
    )
    return found[place], place, room


def _distances(plan: MissionPlan, rows: ProgrammeRows) -> Iterator[tuple[str, float]]:
    """Names of places, and the least distances of rows from them, m."""
    picked = slice(None, None, max(1, len(rows.lengths) // _JUDGED))
    q = plan.site.chain.inputs_from_lengths(rows.lengths[picked])
    if rows.feed is not None and np.abs(rows.feed).max() > ROUNDING:
        yield from Entry(plan.site).gaps(q, rows.feed[picked]).least().items()
        return
    gap, place = plan.site.surroundings.least(q)
    yield place, gap
