"""Solver settings that keep the loops closed, and what a model file can and cannot carry of them.

MuJoCo softens each constraint row by a regularisation R proportional to the inverse weights of the bodies it joins.
With the compiled weights a closure under load opens by about R f dt²: tens of millimetres of sag on this arm. Scaling
`body_invweight0` and `dof_invweight0` after compilation removes it. An MJB file keeps the scaled arrays; XML cannot, so
an XML file carries the factor as a custom numeric and `load_model` applies it.
"""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from vgtsim.description import find_file
from vgtsim.errors import DescriptionError
from vgtsim.mjcf import names

# Time constant in steps and damping ratio of closures and rigid drives. The discrete integrator takes both at the end
# of the step: a stiff, hardly damped row is met within it and trails a moving command by 2 ratio² time constants.
SOLREF_STEPS, SOLREF_RATIO = 0.2, 0.1
SOLIMP = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # the greatest impedance MuJoCo accepts
SERVO_GROUP = 1  # of the actuators, which are switched off by the bit of their group
# What MuJoCo is told of a member whose mass sits in its hubs, kg and kg·m²: it divides by them. Turned at 100 rad/s², a
# metre of such a member shears by 1e-7 N.
LEAST_MASS, LEAST_INERTIA = 1e-9, 1e-9


def stiffen(model: mujoco.MjModel, factor: float) -> None:
    """Scale the inverse weights that regularise the constraint rows by a factor from 0 to 1.

    Parts that have no mass count with the lightest part that has some: a massless bar moves with its hubs.
    """
    light = model.body_mass < 2 * LEAST_MASS
    light[0] = False  # the world
    if light.any():
        model.body_invweight0 = np.minimum(model.body_invweight0, model.body_invweight0[~light].max(axis=0))
        model.dof_invweight0 = np.minimum(model.dof_invweight0, model.dof_invweight0[~light[model.dof_bodyid]].max())
    model.body_invweight0 *= factor
    model.dof_invweight0 *= factor
    model.tendon_invweight0 *= factor


def retime(model: mujoco.MjModel, timestep: float) -> None:
    """Give a compiled model another time step, s, and its closures and drives the time constants that go with it."""
    model.opt.timestep = timestep
    model.eq_solref[:, 0] = SOLREF_STEPS * timestep


def select_drive(model: mujoco.MjModel, drive: str) -> None:
    """Let the rigid drives or the servos of a model hold the cylinders and the feed, in data made from now on.

    The drive is `rigid` (lengths imposed by joint equalities), `servo` (force-limited position actuators) or `hydraulic`
    (springs, which the step loop moves; only the feed is held by its equality).

    Raises:
        ValueError: Another drive was asked for.
    """
    if drive not in ("rigid", "servo", "hydraulic"):
        raise ValueError(f"drive {drive!r}: rigid, servo or hydraulic")
    model.eq_active0[model.eq_type == mujoco.mjtEq.mjEQ_JOINT] = drive != "servo"
    model.opt.disableactuator = 0 if drive == "servo" else 1 << SERVO_GROUP


def load_model(path: str | Path) -> mujoco.MjModel:
    """Load a model with its scaled weights: a shipped arm by name, or an `.xml` or `.mjb` that this project has written.

    The factor in an XML file is applied; an MJB file has the scaled weights.

    Raises:
        DescriptionError: The file is missing, of another kind, or carries no factor.
    """
    file = find_file(path, "model")
    if not file.is_file():
        raise DescriptionError(file, "", "no such file", "a generated .xml or .mjb")
    if file.suffix not in (".xml", ".mjb"):
        raise DescriptionError(file, "", f"a {file.suffix or 'suffixless'} file", "a generated .xml or .mjb")
    try:
        if file.suffix == ".mjb":
            return mujoco.MjModel.from_binary_path(str(file))
        model = mujoco.MjModel.from_xml_path(str(file))
        factor = float(model.numeric(names.WEIGHT_SCALE).data[0])
    except KeyError:
        raise DescriptionError(file, f"custom.{names.WEIGHT_SCALE}", "nothing", "a model written by vgtsim") from None
    except ValueError as error:
        raise DescriptionError(file, "", str(error), "a model that MuJoCo can read") from None
    stiffen(model, factor)
    return model
