"""Every name that appears in a generated MJCF, made in this one place.

A node or member keeps its name from the truss (`m2/longeron/1`) for its body and geom; the parts add a suffix.
"""

from __future__ import annotations

from collections.abc import Callable

MAST = "mast"
FEED = "mast/feed"
TURN = "mast/turn"
FLANGE = "mast/flange"
TIP = "tip"
TOOL = "tool"
PAYLOAD = "payload"
TANK = "tank"
WASTE = "tank/waste"
PIT = "tank/waste/pit"
BALL = "ball"  # default class of the joints on which members turn
FLOOR = "floor"
WEIGHT_SCALE = "vgtsim_weight_scale"


def _of(form: str) -> Callable[[str], str]:
    """Make a name of its owner's."""
    return form.format


near = _of("{}/near")  # site at a member's ball joint, z along the member
far = _of("{}/far")  # site at a member's closed end
closure = _of("{}/closure")  # connect equality of a member's closed end
force = _of("{}/force")  # force sensor of a member
torque = _of("{}/torque")  # torque sensor of a member
half = _of("{}/half")  # far half of an elastic tube, a body and its geom
rod = _of("{}/rod")  # second body of a cylinder, and its geom
slide = _of("{}/slide")  # joint of a cylinder, its length pin to pin; of an elastic tube, zero when unloaded
length = _of("{}/length")  # sensor of a cylinder: pin to pin
cylinder = _of("cylinder/{}")  # default class of the slides and servos of a kind of cylinder
drive = _of("{}/drive")  # joint equality of the rigid drive of a member, of the feed or of the mast's turn
servo = _of("{}/servo")  # position actuator of a member, of the feed or of the mast's turn
drive_force = _of("{}/drive_force")  # sensor of the force of a cylinder's drive
turn = _of("{}/turn")  # ball joint of a joint block
pin = _of("{}/pin")  # hinge of a barrel on the joint block at its near end
roll = _of("{}/roll")  # hinge of a rod in a barrel between joint blocks
lug = _of("{}/lug")  # site on the pin of a rod, away from its far end
alignment = _of("{}/alignment")  # connect equality that aligns the pin of a rod with the joint block at its far end
face_frame = _of("{}/T")  # site of frame T of a module
goal = _of("goal/{}")  # marker of a goal
section = _of("{}/section")  # rigid section that ends at a node, a body and its joint
row = _of("{}/length_row")  # tendon and tendon equality that keep or impose a member's length
equipment = _of("tank/{}")  # geom of a piece of tank equipment


def slides(node: str) -> tuple[str, str, str]:
    """The three slide joints of a hub."""
    return f"{node}/x", f"{node}/y", f"{node}/z"
