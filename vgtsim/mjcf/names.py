"""Every name that appears in a generated MJCF, made in this one place.

A node or member keeps its name from the truss (`m2/longeron/1`) for its body and geom; the parts add a suffix.
"""

from __future__ import annotations

MAST = "mast"
FEED = "mast/feed"
FLANGE = "mast/flange"
TIP = "tip"
TOOL = "tool"
PAYLOAD = "payload"
TANK = "tank"
WASTE = "tank/waste"
CAMERAS = ("overview", "cutaway", "riser", "tool")
KEYFRAMES = ("stowed", "straight", "first_goal")
WEIGHT_SCALE = "vgtsim_weight_scale"


def slides(node: str) -> tuple[str, str, str]:
    """The three slide joints of a hub."""
    return f"{node}/x", f"{node}/y", f"{node}/z"


def turn(block: str) -> str:
    """Ball joint of a joint block."""
    return f"{block}/turn"


def pin(member: str) -> str:
    """Hinge of a barrel on the joint block at its near end."""
    return f"{member}/pin"


def roll(member: str) -> str:
    """Hinge of a rod in a barrel between joint blocks."""
    return f"{member}/roll"


def lug(member: str) -> str:
    """Site on the pin of a rod, away from its far end."""
    return f"{member}/lug"


def alignment(member: str) -> str:
    """Connect equality that aligns the pin of a rod with the joint block at its far end."""
    return f"{member}/alignment"


def near(member: str) -> str:
    """Site at the member's ball joint, z along the member."""
    return f"{member}/near"


def far(member: str) -> str:
    """Site at the member's closed end."""
    return f"{member}/far"


def closure(member: str) -> str:
    """Connect equality of the member's closed end."""
    return f"{member}/closure"


def rod(member: str) -> str:
    """Second body of a cylinder, and its geom."""
    return f"{member}/rod"


def half(member: str) -> str:
    """Far half of an elastic tube, a body and its geom."""
    return f"{member}/half"


def slide(member: str) -> str:
    """Slide joint of a cylinder, zero when retracted; of an elastic tube, zero when unloaded."""
    return f"{member}/slide"


def drive(joint: str) -> str:
    """Joint equality of the rigid drive of a member or of the feed."""
    return f"{joint}/drive"


def servo(joint: str) -> str:
    """Position actuator of a member or of the feed."""
    return f"{joint}/servo"


def force(member: str) -> str:
    """Force sensor."""
    return f"{member}/force"


def torque(member: str) -> str:
    """Torque sensor."""
    return f"{member}/torque"


def length(member: str) -> str:
    """Length sensor of a cylinder: pin to pin less the retracted length."""
    return f"{member}/length"


def drive_force(member: str) -> str:
    """Actuator force sensor of a cylinder's servo."""
    return f"{member}/drive_force"


def face_frame(module: str) -> str:
    """Site of frame T of a module."""
    return f"{module}/T"


def goal(name: str) -> str:
    """Marker of a goal."""
    return f"goal/{name}"


def equipment(name: str) -> str:
    """Geom of a piece of tank equipment."""
    return f"tank/{name}"
