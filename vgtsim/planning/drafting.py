"""First drafts for a user: an arm laid out for a reach and a riser and sized for a payload, and goals that it reaches."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, cos, hypot, sin, sqrt
from typing import Any

import numpy as np

from vgtsim.constants import GRAVITY, PAYLOAD_RADIUS, SAFETY_FACTOR
from vgtsim.description import INCH, Catalogue, Feed, Goal, LoadCase, Manipulator, Payload, Tank
from vgtsim.errors import DescriptionError, PathError, ReachError
from vgtsim.kinematics import Chain, PlanarArm, check_strokes, hanging_mount
from vgtsim.planning.checks import RISER_SPARE, find_faults, riser_fit
from vgtsim.planning.design import passing_sizes, sample_postures
from vgtsim.planning.entry import check_entry, start_feed
from vgtsim.planning.path import plan_path
from vgtsim.planning.tour import configure
from vgtsim.planning.trajectory import Corridor
from vgtsim.positioning import make_postures
from vgtsim.site import Site
from vgtsim.statics import Demand, Sizing, size_arm
from vgtsim.units import to_si

# radius of the joint balls of the shipped arms, for risers of 42 in; smaller risers have smaller ones
_HUB = 1.5 * INCH
_WIDE = 42 * INCH  # riser of the shipped arms
_STRAIGHT = 1.25  # face sides from face to face of a straight active module: the middle of its working range
_ROUNDING = 1e-5  # m: lengths in the file have five digits
_RETRACTED = 0.994  # of the face side: just below it, so that a stowed module passes the riser
_EXTENDED = sqrt(3.0)  # face sides, up to which a module assembles whatever its lengths
USUAL_MODULES = 5  # of the shipped 45 ft arm
_SHORTEST = 0.4  # face sides, of a static module between two active ones
_TOOL_OFFSET = 0.3  # m, flange to tool point
_PLATE = 0.5 * INCH  # thickness of the tip plate, as of the shipped arms
_RATE = 0.05  # m/s
_RESERVE = 0.95  # use of every strength: the tours of a scene are not known yet
_BENDS = 0.2  # stroke over retracted length below which an arm hardly bends
_FIRST, _TURN = 22.5, 137.5  # degrees: each place to try is far from the one before it
_PLACES = 16  # over waste and at the wall
_OVER = 0.8  # m over the waste, for an arm that comes so deep
_DEEPEST, _FARTHEST = 0.55, 0.8  # parts of its length that an arm reaches down and outward from its base
_MISSES = 6  # goals in a row out of reach: a second or so each
_ROOM = 0.1  # m beyond the clearance that a posture keeps whose tool is a place to try
_SECTOR = 45  # degrees, of which one such place is tried
_LIFT_RATE, _LIFT_START = 0.3, 0.1  # m/s and m/s², of a crane's hoist
_BESIDE = 3  # entries of equipment that are gone beside
_CASES = (  # as the shipped scene asks for
    LoadCase(name="dead", payload=0.0),
    LoadCase(name="jerk", dynamic=1.1),
    LoadCase(name="tool", dynamic=1.1, reaction=500.0),
    LoadCase(name="quake", shaking=0.2),
)


@dataclass(frozen=True)
class ArmRequest:
    """An arm to draft: `reach` from its base face to the tool point and the riser's `bore`, m; `payload`, kg."""

    name: str
    reach: float
    bore: float
    payload: float
    modules: int


def draft_arm(asked: ArmRequest, catalogue: Catalogue) -> Sizing:
    """Lay out an arm of double octahedra and prisms by turns, with the longest strokes that carry the payload.

    The layout is that of the shipped 45 ft arm. The sizes carry the weight, the payload and the usual load cases in postures
    all round, at full reach too, with 5 % in reserve.

    Raises:
        DescriptionError: The riser is too narrow, the modules are too many for the reach, or nothing in the catalogue carries
            the payload.
    """
    eyes = sorted({size.head + 2 * size.eye for size in catalogue.cylinders})
    refused = None
    for ends in eyes:
        arm = _lay_out(asked, catalogue, ends)
        try:
            return _size(arm, asked, catalogue)
        except DescriptionError as error:  # longer ends leave less stroke and are of stronger cylinders
            refused = error
    assert refused is not None  # a catalogue has cylinders
    raise DescriptionError(None, refused.key, refused.found, f"{refused.allowed}; ask for less payload or reach")


def _size(arm: Manipulator, asked: ArmRequest, catalogue: Catalogue) -> Sizing:
    chain = Chain(arm, hanging_mount(0.0))
    check_strokes(chain)
    fitting = passing_sizes(chain, catalogue, asked.bore)
    payload = Payload(mass=asked.payload, radius=PAYLOAD_RADIUS)
    demand = Demand(
        nodes=sample_postures(chain, bring=True),
        motion=None,
        payload=payload,
        cases=(LoadCase(name="run"), *_CASES),
        gravity=GRAVITY,
        safety_factor=SAFETY_FACTOR,
    )
    found = size_arm(chain, fitting, demand, _RESERVE)
    left = riser_fit(Chain(found.manipulator, chain.mount), asked.bore).spare
    if left < RISER_SPARE:
        wanted = f"{RISER_SPARE * 1e3:.1f} mm"
        raise DescriptionError(None, "riser", f"an arm that leaves {left * 1e3:.1f} mm all round", wanted)
    return found


def most_modules(reach: float, bore: float) -> int:
    """Number of active modules that an arm of a reach has room for, m, as wide as a riser's bore, m, lets it be."""
    return max(0, int((reach - _TOOL_OFFSET) / ((_STRAIGHT + _SHORTEST) * _face_side(bore))))


def _face_side(bore: float) -> float:
    return max(_ROUNDING, sqrt(3.0) * (bore / 2 - RISER_SPARE - _ROUNDING - _hub(bore)))


def _hub(bore: float) -> float:
    return _HUB * min(1.0, bore / _WIDE)


def _lay_out(asked: ArmRequest, catalogue: Catalogue, ends: float) -> Manipulator:
    """The arm with the lightest sections; `ends` is the length of a cylinder's heads and eyes, m."""
    hub, side = _hub(asked.bore), _face_side(asked.bore)
    retracted = _RETRACTED * side
    stroke = min(_EXTENDED * side, 2 * retracted - ends) - retracted
    if stroke < _BENDS * retracted:
        least = 2 * (RISER_SPARE + _HUB) + 2 / sqrt(3.0) * ends / _RETRACTED / (1 - _BENDS)
        raise DescriptionError(
            None, "riser", f"a bore of {asked.bore:.3f} m", f"some {least:.2f} m or more for these cylinders"
        )
    active = asked.modules * _STRAIGHT * side
    prism = (asked.reach - _TOOL_OFFSET - active) / asked.modules
    if prism < _SHORTEST * side:
        most = most_modules(asked.reach, asked.bore)
        found = f"{asked.modules} modules over {asked.reach:.2f} m in a riser of {asked.bore:.3f} m"
        allowed = f"at most {most}, or a longer reach" if most > 0 else "a longer reach"
        raise DescriptionError(None, "modules", found, f"{allowed}, or a narrower riser")
    tube, size = (
        catalogue.tubes[0],
        next(item for item in catalogue.cylinders if item.head + 2 * item.eye <= ends + 1e-9),
    )
    cylinder = size.model_dump(exclude_none=True) | {"retracted": round(retracted, 5), "stroke": round(stroke, 5)}
    modules = []
    for k in range(1, asked.modules + 1):
        tubes = {"longeron_tube": "tube", "batten_tube": "tube"}
        double = {"kind": "double_octahedral", "name": f"m{k}", "longeron": round(side, 5), "cylinder": "cylinder"}
        modules.append({**double, **tubes, "straight": round(_STRAIGHT * side, 5)})
        static = {"kind": "prism", "name": f"s{k}", "length": round(prism, 5), "cross_longeron_tube": "tube"}
        modules.append({**static, **tubes})
    title = f"{3 * asked.modules}-actuator arm of {asked.reach:.4g} m for {asked.payload:.4g} kg"
    return Manipulator.model_validate(
        {
            "name": asked.name,
            "title": title,
            "face_side": round(side, 5),
            "hub": {"radius": round(hub, 5), "material": "steel"},
            "tip_plate": {"thickness": _PLATE, "material": "steel", "tool_offset": _TOOL_OFFSET},
            "stowed": {"cylinder_length": round(side, 5)},
            "materials": {**catalogue.materials, "steel": catalogue.material_of("tube")},
            "tubes": {"tube": {**tube.model_dump(), "material": "steel"}},
            "cylinders": {"cylinder": {**cylinder, "rate": _RATE, "material": "steel"}},
            "modules": modules,
        }
    )


def list_goals(tank: Tank, pivot: float, reach: float) -> list[dict[str, Any]]:
    """Places to try for a first tour, as tables of goals: over the waste, at the wall and beside equipment, all round.

    `pivot` is the height of the arm's base face, and `reach` its straight length, m: a short arm works higher over the waste
    and nearer to the mast.
    """
    inner, top, level = tank.shell.inner_diameter / 2, tank.shell.wall_top, tank.waste.level
    over = max(_OVER, pivot - _DEEPEST * reach - level)
    most = sqrt(max((_FARTHEST * reach) ** 2 - (pivot - level - over) ** 2, 0.0))
    turns = [round(_FIRST + _TURN * k) % 360 for k in range(_PLACES)]
    tables = []
    for k, turn in enumerate(turns):
        azimuth, low = f"{turn} deg", k % 4 < 2
        if k % 2:
            height = f"{(0.4 if low else 0.6) * top:.1f} m"
            at = {"place": "wall", "azimuth": azimuth, "height": height, "distance": "1 m"}
        else:
            radius = f"{min((0.6 if low else 0.75) * inner, (0.8 if low else 1.0) * most):.1f} m"
            at = {"place": "waste", "azimuth": azimuth, "radius": radius, "height": f"{over:.1f} m"}
        tables.append({"name": f"{at['place']}_{turn}", "at": at})
    for k, item in enumerate(tank.things[:_BESIDE]):
        at = {"place": item.name, "height": f"{0.4 * top:.1f} m", "distance": "0.8 m"}
        tables.insert(3 * k + 2, {"name": f"beside_{item.name}", "at": at})
    return [table for table in tables if _away(tank, table["at"]) < most] if tank.arm_riser.radius else tables


def _away(tank: Tank, at: dict[str, Any]) -> float:
    """About how far a place is from the axis of the arm's riser, m."""
    things = {item.name: item for item in tank.things}
    if at["place"] in things:
        radius, azimuth = things[at["place"]].radius, things[at["place"]].azimuth
    else:
        azimuth = to_si(at["azimuth"], "rad")
        radius = to_si(at["radius"], "m") if "radius" in at else tank.shell.inner_diameter / 2
    x, y = tank.arm_riser.place
    return hypot(radius * cos(azimuth) - x, radius * sin(azimuth) - y)


def sample_goals(site: Site) -> list[dict[str, Any]]:
    """More places to try, as tables of goals: over the waste where the tool is in clear postures, the farthest out first.

    Figures are rounded, so a place is near such a posture, not in it.
    """
    q = make_postures(site.box).q
    clear = site.surroundings.unloaded.clearance(q)[0] > site.clearance + _ROOM
    (points, directions), level = site.chain.tool(q[clear]), site.tank.waste.level
    radius = np.hypot(points[:, 0], points[:, 1])
    tables: list[dict[str, Any]] = []
    taken: set[int] = set()
    for k in np.argsort(-radius):
        turn = round(np.degrees(np.arctan2(points[k, 1], points[k, 0]))) % 360
        if turn // _SECTOR in taken:
            continue
        taken.add(turn // _SECTOR)
        (x, y, z), height = directions[k], points[k, 2] - level
        at = {
            "place": "waste",
            "azimuth": f"{turn} deg",
            "radius": f"{radius[k]:.1f} m",
            "height": f"{height:.1f} m",
            "elevation": f"{np.degrees(np.arcsin(z)):.0f} deg",
            "heading": f"{np.degrees(np.arctan2(y, x)):.0f} deg",
        }
        tables.append({"name": f"free_{turn}", "at": at})
    return tables


def draft_feed(site: Site) -> Feed:
    """A hoist that lifts a site's arm out of its riser, with its force half as much again as the weight.

    Raises:
        DescriptionError: The arm cannot come through the riser, or no headroom is left for it.
    """
    first = start_feed(site, PlanarArm(site.chain, 0.0))
    weight = GRAVITY * (site.load_model.mass + site.mast.mass)
    feed = Feed(stroke=ceil(first), rate=_LIFT_RATE, acceleration=_LIFT_START, force=float(f"{1.5 * weight:.2g}"))
    mast = site.task.mast.model_copy(update={"feed": feed})
    check_entry(Site(replace(site.scene, task=site.task.model_copy(update={"mast": mast}))))
    return feed


def choose_goals(site: Site, wanted: int) -> tuple[int, ...]:
    """Indices of the first goals of a scene that the arm reaches one after another from its start, up to a number of them.

    It gives up after some goals in a row that the arm does not reach.

    Raises:
        DescriptionError: The scene cannot work, whatever its goals.
    """
    faults = list(find_faults(site))
    keys = [error.key if isinstance(error, DescriptionError) else "" for error in faults]
    for error, key in zip(faults, keys, strict=True):
        if not key.startswith("motion.goals."):
            raise error
    corridor = Corridor(site.box, site.surroundings, site.clearance)
    chosen: list[int] = []
    shape, missed = site.start, 0
    for index, goal in enumerate(site.task.motion.goals):
        if len(chosen) == wanted or missed == _MISSES:
            break
        if f"motion.goals.{index}.position" in keys or not _has_room(site, goal):
            continue
        try:
            q = configure(site, goal, shape)
            plan_path(corridor, shape, q, goal.name)
        except (ReachError, PathError):
            missed += 1
            continue
        chosen.append(index)
        shape, missed = q, 0
    return tuple(chosen)


def _has_room(site: Site, goal: Goal) -> bool:
    """Whether the last modules can stand behind the tool, clear of equipment: a quick look before a goal is solved."""
    chain, around = site.chain, site.surroundings.obstacles
    tail = float(np.linalg.norm(chain.tool(chain.straight)[0] - chain.mount[:3, 3])) / len(site.arm.active)
    thick = site.arm.face_side / sqrt(3.0) + site.arm.hub.radius + site.clearance
    point = np.array(goal.position)
    back = point - tail * np.array(goal.direction)
    return bool(np.all(around.distances(point, back) > thick))
