"""What can go wrong in a step, looked at after every step: divergence and contact."""

from __future__ import annotations

import numpy as np

from vgtsim.errors import DivergenceError
from vgtsim.graphics import mujoco
from vgtsim.plant.recorder import Contact

OPEN_GAP = 0.02  # m; a loop open by this much is no longer the mechanism, whatever MuJoCo says of it


def check_state(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Stop on a state that is no longer physical.

    MuJoCo raises nothing when a state diverges: it counts a warning. So the counters are read, and the closures too.

    Raises:
        DivergenceError: A warning was counted, a coordinate is not finite, or a loop has opened.
    """
    rows = data.efc_pos[: data.ne]
    if np.abs(rows).max(initial=0.0) < OPEN_GAP and not data.warning.number.any():
        return
    finite = np.isfinite(rows)
    worst = int(np.argmax(np.where(finite, np.abs(rows), np.inf))) if len(rows) else -1
    row = model.equality(int(data.efc_id[worst])).name if worst >= 0 else "none"
    raise DivergenceError(float(data.time), row, float(rows[worst]) if worst >= 0 else float("nan"))


def list_warnings(data: mujoco.MjData) -> tuple[str, ...]:
    """Name what MuJoCo warned of, one line a kind of warning."""
    kinds = [kind.removeprefix("mjWARN_") for kind in mujoco.mjtWarning.__members__ if kind != "mjNWARNING"]
    return tuple(f"{kind}: {data.warning[i].number}" for i, kind in enumerate(kinds) if data.warning[i].number)


def list_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> list[Contact]:
    """Name the geoms of each contact whose gap is closed."""
    found = []
    for contact in data.contact:
        if contact.dist <= 0:
            first, second = (model.geom(int(geom)).name for geom in contact.geom)
            found.append(Contact(float(data.time), first, second, float(contact.dist)))
    return found


def name_collision(contact: Contact, drive: str) -> str:
    """Say why a contact stops the plant; an empty string under servos, which yield.

    Imposed lengths and oil do not: one step later the forces are those of the drives against a rigid wall.
    """
    if drive == "servo":
        return ""
    return f"collision of {contact.first} with {contact.second} at t = {contact.time:.3f} s under {drive} drives"
