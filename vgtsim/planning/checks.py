"""Whether a scene can work at all, whether the stowed arm passes its riser, and whether its line passes the open truss."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Bend, StartPosture, begins_inside
from vgtsim.errors import AssemblyError, DescriptionError, PostureError, VgtError
from vgtsim.geometry import enclosure_distance
from vgtsim.kinematics import Chain, check_strokes, find_axis, find_rigid_sections, measure_passage, member_radii
from vgtsim.planning.collisions import list_collisions, tell_collisions
from vgtsim.site import Site

# The shipped arms are laid out to leave 1.5 in all round; their figures are rounded to five digits, m.
RISER_SPARE = 0.0381 - 1e-5
_COUPLED = 1e-9  # rounding of inputs of coupled modules, m and rad


def check_site(site: Site) -> None:
    """Refuse a scene that cannot work, before any planning.

    Raises:
        DescriptionError: Rigid sections are asked for that the arm does not have. A module does not assemble over its
            strokes; the stowed arm does not pass the riser; the start is outside a stroke, too near something, or not
            coupled; a goal is outside the tank or too near something.
    """
    for error in find_faults(site):
        raise error


def find_faults(site: Site) -> Iterator[VgtError]:
    """Each reason to refuse a scene, in the order of `check_site`; without a usable arm there is one."""
    for index, check in enumerate((_check_kinds, check_assembly, check_riser, _check_start)):
        try:
            check(site)
        except VgtError as error:
            yield error
            if index < 2:
                return
    yield from _find_goal_faults(site)


def _check_kinds(site: Site) -> None:
    if site.task.simulation.members == "sections":
        try:
            find_rigid_sections(site.chain)
        except DescriptionError as error:
            raise site.scene.error(error.key, error.found, error.allowed) from None


def check_assembly(site: Site) -> None:
    """Refuse strokes over which a module does not assemble, or may change its assembly; the `DescriptionError` names both."""
    scene, chain = site.scene, site.chain
    try:
        check_strokes(chain)
    except AssemblyError as error:
        place = next(item for item in chain.layout.places if error.module in item.modules.names)
        m = place.modules.names.index(error.module)
        low, high = chain.stroke[:, place.lengths[m][place.modules.actuated[m]]]
        where = f"manipulator.modules.{error.module}.{place.modules.sections_key}"
        found = f"strokes from {low.min():.4f} to {high.max():.4f} m: {error}"
        allowed = f"strokes over whose whole range {error.module} assembles"
        raise scene.error(where, found, allowed) from None


def _check_start(site: Site) -> None:
    scene, chain, motion = site.scene, site.chain, site.task.motion
    if site.task.mission and not begins_inside(site.task.mission):  # it begins above the riser
        return
    q, box = site.start, site.box
    owner, names = chain.layout.owner, chain.layout.names
    for a, name in enumerate(names):
        alone = np.array(chain.straight)
        alone[owner == a] = q[owner == a]
        try:
            chain.lengths(alone)
        except (AssemblyError, ValueError) as error:
            raise scene.error(
                _find_key(motion.start, a), f"a shape {name} cannot take: {error}", "a smaller bend"
            ) from None
    length = chain.lengths(q)
    spare = box.spare(length)
    if np.min(spare) <= 0:
        worst = int(np.argmin(spare))
        actuator = chain.truss.members[chain.truss.actuated[worst]].name
        where = _find_key(motion.start, names.index(actuator.split("/")[0]))
        found = f"{actuator} at {length[worst]:.4f} m"
        allowed = f"{box.least[worst]:.4f} to {box.greatest[worst]:.4f} m: its stroke less the margin"
        raise scene.error(where, found, allowed)
    _check_coupling(site)
    clearance, place = site.surroundings.least(q)
    if clearance >= motion.clearance:
        return
    collisions = list_collisions(site, q, motion.clearance)
    lines = "".join(f"\n  {line}" for line in tell_collisions(collisions))
    found = f"a posture {abs(clearance):.3f} m {'inside' if clearance < 0 else 'from'} {place}"
    allowed = f"{motion.clearance:.3f} m from everything; without motion.start a posture is searched"
    if motion.start is None:
        found = f"no posture clear of everything among {site.searched_start[1]}; the best is {found}"
        allowed = f"{motion.clearance:.3f} m from everything, or an arm and a tank that leave room for it"
    where = scene.file, "motion.start"
    raise PostureError(where, found, allowed + lines, name=scene.task.name, site=site, q=q, collisions=collisions)


def _find_key(start: tuple[Bend, ...] | StartPosture | str | None, module: int) -> str:
    """Key of what sets the inputs of an active module at the start."""
    if isinstance(start, tuple):
        return f"motion.start.{module}"
    given = (key for key in ("inputs", "lengths", "position") if getattr(start, key, None) is not None)
    return ".".join(["motion.start", *given])


def _check_coupling(site: Site) -> None:
    """Coupling holds on the way, so it must hold at its begin."""
    chain = site.chain
    off, owner, names = site.start - chain.straight, chain.layout.owner, chain.layout.names
    for follower, leader in site.coupling:
        apart = float(np.abs(off[owner == follower] - off[owner == leader]).max())
        if apart > _COUPLED:
            found = f"inputs of {names[follower]} that differ by {apart:.4g} from those of {names[leader]}"
            allowed = f"the bend of {names[leader]}: the two are coupled, on the way too"
            raise site.scene.error(_find_key(site.task.motion.start, follower), found, allowed)


def _find_goal_faults(site: Site) -> Iterator[VgtError]:
    """The ball of the payload at each goal must keep the planned clearance from everything that stands.

    In a mission these are the goals that it moves to.
    """
    scene, around = site.scene, site.surroundings
    radius, wanted = scene.task.payload.radius, scene.task.motion.clearance
    places = around.obstacles
    sought = {stage.name for stage in scene.task.stages}
    for index, goal in enumerate(scene.task.motion.goals):
        if goal.name not in sought:
            continue
        point = np.array(goal.position)
        gaps = {"the tank's shell": float(enclosure_distance(scene.tank, around.profile, point)[0])}
        gaps["the waste"] = float(
            point[2] - places.waste_level if places.bed is None else places.bed.distance(point)[0]
        )
        gaps |= zip(places.names, places.distances(point, point).tolist(), strict=True)
        place = min(gaps, key=lambda name: gaps[name])
        if gaps[place] < radius + wanted:
            side = "inside" if gaps[place] < 0 else f"{gaps[place]:.3f} m from"
            found = f"{goal.name} at ({point[0]:.3f}, {point[1]:.3f}, {point[2]:.3f}) m, {side} {place}"
            allowed = f"at least {radius + wanted:.3f} m from everything: payload radius and clearance"
            yield scene.error(f"motion.goals.{index}.position", found, allowed)


@dataclass(frozen=True)
class RiserFit:
    """Least distance of the stowed arm from the bore, m, negative when it does not pass, and the nearest node or member."""

    spare: float
    place: str


def riser_fit(chain: Chain, bore: float) -> RiserFit:
    """Least distance of the stowed arm from a bore about the mast's axis; the bore is its inner diameter, m.

    Double octahedra are stowed with retracted actuators; octahedra and hinges pass in their straight pose. Hubs are
    balls. Tubes are capsules, which are widest from the axis at their ends. The barrel of a cylinder runs from the eye
    at its base pin to its mouth. The rod is not looked at: it is thinner than the hub at its end.
    """
    local = (chain.nodes(chain.stowed) - chain.mount[:3, 3]) @ chain.mount[:3, :3]
    manipulator, truss = chain.manipulator, chain.truss
    hubs = np.hypot(local[:, 0], local[:, 1]) + manipulator.hub.radius
    widest, place = max((float(reach), f"node {name}") for reach, name in zip(hubs, truss.nodes, strict=True))
    for member, radius in zip(truss.members, member_radii(chain), strict=True):
        ends = local[list(member.ends)]
        if member.role == "actuator":
            cylinder = manipulator.cylinders[member.section]
            length = np.linalg.norm(ends[1] - ends[0])
            part = np.array([[cylinder.eye], [cylinder.barrel_length]]) / length
            ends = ends[0] + part * (ends[1] - ends[0])
        reach = float(np.max(np.hypot(ends[:, 0], ends[:, 1])) + radius)
        if reach > widest:
            widest, place = reach, f"member {member.name}"
    return RiserFit(bore / 2 - widest, place)


def asked_spare(site: Site) -> float:
    """Least distance of the stowed arm from the riser that a scene asks for, m."""
    return site.task.mast.riser_spare or RISER_SPARE


def check_riser(site: Site) -> None:
    """Refuse an arm that does not pass the riser with the spare it is meant to have.

    Raises:
        DescriptionError: The stowed length is outside a stroke; or a node or member does not fit: by how much.
    """
    scene = site.scene
    cylinders = scene.manipulator.stowable
    least, greatest = np.array([[item.retracted, item.extended] for item in cylinders]).reshape(-1, 2).T
    wanted = scene.manipulator.stowed_length if cylinders else 0.0
    if not np.all((least <= wanted) & (wanted <= greatest)):
        allowed = f"a length that every cylinder has, {least.max():.4f} to {greatest.min():.4f} m"
        raise scene.error("manipulator.stowed.cylinder_length", f"{wanted:.4f} m", allowed)
    riser = scene.tank.arm_riser
    fit, asked = riser_fit(site.chain, riser.bore), asked_spare(site)
    if fit.spare < asked:
        left = f"leaves {fit.spare * 1e3:.2f} mm of the bore all round, {(asked - fit.spare) * 1e3:.2f} mm too little"
        found = f"an arm that does not fit {riser.name}: {fit.place} {left}"
        raise scene.error("manipulator.stowed", found, f"a stowed arm that leaves {asked * 1e3:.1f} mm all round")


def check_passage(site: Site, q: Array) -> None:
    """Refuse a line that the arm does not pass in some posture, inputs of shape (T, n); the `DescriptionError` tells by what."""
    line = site.task.conveyance
    if line is None:
        return
    arm, truss, nodes = site.arm, site.truss, site.chain.nodes(q)
    room, key = site.task.limits.passage, "conveyance.diameter"
    free = measure_passage(truss, member_radii(site.chain), nodes, jointed=line.kind == "screws").min(axis=0)
    narrow, names = int(np.argmin(free)), [module.name for module in arm.modules]
    excess = line.diameter + room - free[narrow]
    if excess > 0:
        over = f"{line.diameter:.4g} m, {excess:.4g} m too thick to pass {truss.member_names[narrow]}"
        raise site.scene.error(key, over, f"at most {free[narrow] - room:.4g} m, the passage of {arm.name}")
    axis = find_axis(truss, nodes)
    if line.joint_angle is not None:
        bent = axis.angle.max(axis=0)
        most = int(np.argmax(bent))
        if bent[most] > line.joint_angle:
            over, allowed = np.degrees([line.joint_angle, bent[most]])
            found = f"{over:.4g} deg, while {names[most]} bends its axis by {allowed:.4g} deg"
            raise site.scene.error("conveyance.joint_angle", found, f"at least {allowed:.4g} deg")
    radius = axis.radius.min(axis=0)
    tight = int(np.argmin(radius))
    if line.bend_radius > radius[tight]:
        over = f"{line.bend_radius:.4g} m, while {names[tight]} bends its axis to {radius[tight]:.4g} m"
        raise site.scene.error("conveyance.bend_radius", over, f"at most {radius[tight]:.4g} m")
