"""Default classes of the MJCF: what roles look like, and what joints, drives, loops and contacts have in common."""

from __future__ import annotations

from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.mjcf.rigging import Rigging
from vgtsim.mjcf.rows import SERVO_GROUP, SOLIMP, SOLREF_RATIO, SOLREF_STEPS

ROLE_COLOURS = {
    "longeron": (0.27, 0.45, 0.69, 1.0),
    "cross_longeron": (0.45, 0.67, 0.82, 1.0),
    "batten": (0.62, 0.62, 0.65, 1.0),
    "actuator": (0.86, 0.45, 0.13, 1.0),
    "rod": (0.93, 0.90, 0.85, 1.0),
    "hub": (0.20, 0.22, 0.26, 1.0),
    "tip": (0.35, 0.36, 0.40, 1.0),
    "payload": (0.60, 0.12, 0.16, 1.0),
    "mast": (0.50, 0.52, 0.55, 1.0),
}
_SHAPES = {
    "actuator": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "hub": mujoco.mjtGeom.mjGEOM_SPHERE,
    "payload": mujoco.mjtGeom.mjGEOM_SPHERE,
    "mast": mujoco.mjtGeom.mjGEOM_CYLINDER,
}  # capsules otherwise
SITE_GROUP = 4  # hidden in viewers until asked for
# Of a member's ball joint in model files, N*m*s: it stops the idle spin of a member about its axis in some tenths of a
# second, and at 0.1 rad/s it bends the member by a millinewton metre.
BALL_DAMPING = 0.01
# Contact in model files: greasy steel slides at a third of what presses it, and parts stop each other within 10 ms.
FRICTION, CONTACT_SOLREF, CONTACT_SOLIMP = (0.3, 0.005, 0.0001), (0.01, 1.0), (0.95, 0.99, 0.001, 0.5, 2.0)


def add_defaults(spec: mujoco.MjSpec, rigging: Rigging) -> None:
    """Add the main class and those of roles, ball joints, kinds of cylinders and the motions of the mast."""
    main = spec.default
    main.site.group = SITE_GROUP
    main.site.size = [0.01, 0.01, 0.01]
    main.equality.solref = [SOLREF_STEPS * rigging.timestep, SOLREF_RATIO]
    main.equality.solimp = SOLIMP
    if rigging.limited:
        main.geom.friction, main.geom.solref, main.geom.solimp = FRICTION, CONTACT_SOLREF, CONTACT_SOLIMP
    for role, colour in ROLE_COLOURS.items():
        default = spec.add_default(role, main)
        default.geom.rgba = colour
        default.geom.type = _SHAPES.get(role, mujoco.mjtGeom.mjGEOM_CAPSULE)
    ball = spec.add_default(names.BALL, main).joint
    ball.type = mujoco.mjtJoint.mjJNT_BALL
    ball.damping[0] = BALL_DAMPING if rigging.limited else 0.0
    arm = rigging.chain.manipulator
    for kind in sorted({member.section for member in rigging.chain.truss.members if member.role == "actuator"}):
        part = arm.cylinders[kind]
        _add_slide(
            spec, rigging, names.cylinder(kind), (part.retracted, part.extended), (part.pull, part.push), part.rate
        )
    lift, turn = rigging.feed, rigging.turn
    _add_slide(spec, rigging, names.FEED, lift.range, (lift.force, lift.force), lift.rate)
    if turn is not None:
        joint = _add_slide(spec, rigging, names.TURN, turn.range, (turn.force, turn.force), turn.rate)
        joint.type = mujoco.mjtJoint.mjJNT_HINGE


def _add_slide(
    spec: mujoco.MjSpec,
    rigging: Rigging,
    name: str,
    reach: tuple[float, float],
    force: tuple[float, float],
    rate: float,
) -> mujoco.MjsJoint:
    """Add the class of a slide and its servo, of a reach, m, pull and push, N, and rate, m/s; returns the slide.

    In model files a position beyond the reach is neither taken nor reached, and the damping of the slide uses up the push at
    the rate. The plant goes where it is sent, and its log is judged.
    """
    default = spec.add_default(name, spec.default)
    joint, servo, limits = default.joint, default.actuator, mujoco.mjtLimited
    joint.type, joint.axis, joint.range = mujoco.mjtJoint.mjJNT_SLIDE, [0, 0, 1], reach
    joint.limited = limits.mjLIMITED_TRUE if rigging.limited else limits.mjLIMITED_FALSE
    servo.group = SERVO_GROUP
    servo.gaintype, servo.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
    servo.gainprm[0] = rigging.servo_stiffness
    servo.biasprm[:3] = [0.0, -rigging.servo_stiffness, -rigging.servo_damping]
    if rigging.limited or name not in (names.FEED, names.TURN):  # a plant's mast gets what it takes
        servo.forcelimited, servo.forcerange = limits.mjLIMITED_TRUE, [-force[0], force[1]]  # a push lengthens
    if rigging.limited:
        joint.damping[0], servo.biasprm[2] = force[1] / rate, 0.0
        servo.ctrllimited, servo.ctrlrange = limits.mjLIMITED_TRUE, reach
    return joint
