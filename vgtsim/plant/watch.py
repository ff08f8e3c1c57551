"""What can go wrong in a step, looked at after every step: divergence and contact."""

from __future__ import annotations

import mujoco
import numpy as np

from vgtsim.errors import DivergenceError

OPEN_GAP = 0.02  # m; a loop open by this much is no longer the mechanism, whatever MuJoCo says of it


def check_state(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Stop on a state that is no longer physical.

    MuJoCo raises nothing when a state diverges: it counts a warning. So the counters are read, and the closures too.

    Args:
        model: The model.
        data: After a step.

    Raises:
        DivergenceError: A warning was counted, a coordinate is not finite, or a loop has opened.
    """
    rows = data.efc_pos[: data.ne]
    gap = np.max(np.abs(rows), initial=0.0)
    if gap < OPEN_GAP and not np.any(data.warning.number):
        return
    finite = np.isfinite(rows)
    worst = int(np.argmax(np.where(finite, np.abs(rows), np.inf))) if len(rows) else -1
    row = model.equality(int(data.efc_id[worst])).name if worst >= 0 else "none"
    raise DivergenceError(float(data.time), row, float(rows[worst]) if worst >= 0 else float("nan"))


def list_warnings(data: mujoco.MjData) -> tuple[str, ...]:
    """Name what MuJoCo warned of.

    Args:
        data: At the end of a run.

    Returns:
        One line a kind of warning.
    """
    found = []
    for index, kind in enumerate(mujoco.mjtWarning.__members__):
        if kind != "mjNWARNING" and data.warning[index].number:
            found.append(f"{kind.removeprefix('mjWARN_')}: {data.warning[index].number}")
    return tuple(found)


def list_contacts(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[str, str, float]]:
    """Name what touches what.

    Args:
        model: The model.
        data: After a step.

    Returns:
        Geom, geom and gap (negative in penetration, m) of each contact whose gap is closed.
    """
    return [
        (model.geom(int(contact.geom[0])).name, model.geom(int(contact.geom[1])).name, float(contact.dist))
        for contact in data.contact
        if contact.dist <= 0
    ]
