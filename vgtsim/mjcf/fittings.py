"""Fittings of bodies in MJCF: closures, drives of slides, force sensors, inertia."""

from __future__ import annotations

import numpy as np

from vgtsim.arrays import Array
from vgtsim.graphics import mujoco
from vgtsim.kinematics import MemberInertia
from vgtsim.mjcf import names
from vgtsim.mjcf.rows import LEAST_INERTIA, LEAST_MASS


def hold_sites(spec: mujoco.MjSpec, name: str, first: str, second: str, info: str = "") -> None:
    """Hold two sites of different bodies together; `info` is the key path of the description that compile errors name."""
    spec.add_equality(
        name=name,
        type=mujoco.mjtEq.mjEQ_CONNECT,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=first,
        name2=second,
        info=info,
    )


def add_drives(spec: mujoco.MjSpec, owner: str, joint: str, kind: str) -> None:
    """Add the rigid drive and the servo, of a default class, of a joint; which is active is chosen after compilation."""
    spec.add_equality(
        name=names.drive(owner),
        type=mujoco.mjtEq.mjEQ_JOINT,
        objtype=mujoco.mjtObj.mjOBJ_JOINT,
        name1=joint,
        active=False,
        data=[0.0] * 12,
    )
    spec.add_actuator(spec.find_default(kind), name=names.servo(owner), trntype=mujoco.mjtTrn.mjTRN_JOINT, target=joint)


def add_force_sensors(spec: mujoco.MjSpec, owner: str, site: str) -> None:
    """Sense force and torque at a site."""
    kind = mujoco.mjtSensor
    for name, sensor in ((names.force(owner), kind.mjSENS_FORCE), (names.torque(owner), kind.mjSENS_TORQUE)):
        spec.add_sensor(name=name, type=sensor, objtype=mujoco.mjtObj.mjOBJ_SITE, objname=site)


def set_inertia(body: mujoco.MjsBody, inertia: MemberInertia, segment: tuple[int, int], outward: float) -> None:
    """Give a body, Z along its member, the mass of a segment, whose centre is on Z in the sense of `outward`, 1 or -1."""
    transverse, axial = np.maximum(inertia.centroidal[segment], LEAST_INERTIA)
    body.explicitinertial = True
    body.mass = max(inertia.mass[segment], LEAST_MASS)
    body.ipos = [0, 0, outward * inertia.centre[segment]]
    body.inertia = [transverse, transverse, axial]


# Of the greatest moment of inertia, by which the sum of the others is greater at least: MJCF has six digits of each, and of
# a plate without thickness MuJoCo would refuse what is read back.
_ROUND = 2e-5


def set_point_masses(body: mujoco.MjsBody, masses: Array, points: Array, tensor: Array) -> None:
    """Give a body masses, shape (P,), kg, at points of its frame, shape (P, 3), m.

    The tensor is the sum of their moments of inertia about themselves, shape (3, 3), kg·m².
    """
    centre = masses @ points / masses.sum()
    offset = points - centre
    spread = np.einsum("p,pi,pj->ij", masses, offset, offset)
    tensor = tensor + np.trace(spread) * np.eye(3) - spread
    least, middle, most = np.linalg.eigvalsh(tensor)
    tensor = tensor + max(_ROUND * most - (least + middle - most), 0.0) * np.eye(3)
    body.explicitinertial = True
    body.mass, body.ipos = float(masses.sum()), centre
    body.fullinertia = [*np.diag(tensor), tensor[0, 1], tensor[0, 2], tensor[1, 2]]
