"""Mechanisms of the IFToMM library of multibody benchmarks, built of the bodies and rows that arms are built of.

A joint between members is a hub, a point on slides. A member is a body on a ball joint at its near hub; a `connect` row
closes it on its far hub. A hinge is two such rows, on the middle and on the head of its pin, as on the pins of joint blocks.
`vgtsim.mjcf` makes and stiffens the rows. Units are SI, gravity is 9.81 m/s² along -Y. Every member is a uniform rod, unless
its text says that it has no mass.

Source: M. Gonzalez, D. Dopico, U. Lugris and J. Cuadrado, A benchmarking system for MBS simulation software, Multibody
System Dynamics 16 (2006), 179-190; problems A01, A02 and A04 of the IFToMM library.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vgtsim.graphics import mujoco
from vgtsim.mjcf import names
from vgtsim.mjcf.fittings import hold_sites
from vgtsim.mjcf.pose import quaternions_to
from vgtsim.mjcf.rows import LEAST_INERTIA, LEAST_MASS, SOLIMP, SOLREF_RATIO, SOLREF_STEPS, stiffen

Array = NDArray[np.float64]

POINT = "point"  # site of the point whose place is published
WEIGHT_SCALE = 1e-5  # the scenes' own
_GRAVITY = 9.81  # m/s², the library's
_WIDTH = 0.1  # of the Bricard mechanism's square rods, m
_PIN = 0.5  # from middle to head of a hinge's pin, m: half a rod, so both rows weigh alike
_CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
_AXES = "yzxyzx"  # of the hinges at those corners


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A compiled mechanism and how it starts: velocities of hubs, m/s, and angular velocities of members, rad/s, by name."""

    model: mujoco.MjModel
    moving: Mapping[str, Array] = field(default_factory=dict)
    turning: Mapping[str, Array] = field(default_factory=dict)

    def start(self) -> mujoco.MjData:
        """The state at time zero."""
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        for hub, velocity in self.moving.items():
            for axis, slide in enumerate(names.slides(hub)):
                if (joint := mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_JOINT, slide)) >= 0:
                    data.qvel[self.model.jnt_dofadr[joint]] = velocity[axis]
        for member, velocity in self.turning.items():
            first = self.model.jnt_dofadr[self.model.joint(member).id]
            data.qvel[first : first + 3] = data.body(member).xmat.reshape(3, 3).T @ velocity
        return data


def pendulum(step: float) -> Mechanism:
    """A01: a point of 1 kg on a bar of 1 m without mass about the origin, released level at x = -1."""
    spec = _start(step)
    hub = _add_hub(spec, "end", (-1, 0, 0), mass=1.0)
    hub.add_site(name=POINT)
    _add_member(spec.worldbody, "bar", (-1, 0, 0), mass=0.0)
    hold_sites(spec, names.closure("bar"), names.far("bar"), POINT)
    return Mechanism(_finish(spec))


def four_bars(step: float, count: int) -> Mechanism:
    """A02: count + 1 upright bars joined at their tops by count level ones; the tops start at 1 m/s along X.

    The mechanism lies in the plane of X and Y: its hubs have no slide across.
    """
    spec = _start(step)
    tops = [f"top{index}" for index in range(count + 1)]
    for index, top in enumerate(tops):
        hub = _add_hub(spec, top, (index, 1, 0), axes="xy")
        hub.add_site(name=top if index else POINT)
        foot = spec.worldbody.add_site(name=f"foot{index}", pos=[index, 0, 0]).name
        _add_member(hub, f"upright{index}", (0, -1, 0))
        hold_sites(spec, names.closure(f"upright{index}"), names.far(f"upright{index}"), foot)
    for index in range(count):
        level = f"level{index}"
        _add_member(spec.body(tops[index]), level, (1, 0, 0))
        hold_sites(spec, names.closure(level), names.far(level), tops[index + 1])
    sideways, turn = np.array([1.0, 0, 0]), np.array([0, 0, -1.0])
    return Mechanism(_finish(spec), dict.fromkeys(tops, sideways), {f"upright{i}": turn for i in range(count + 1)})


def bricard(step: float) -> Mechanism:
    """A04: five rods and the ground by six hinges at the corners of a cube, movable by its special lengths alone.

    The published point is the fourth corner, which the third and the fourth rod share.
    """
    spec = _start(step)
    seats = [(spec.worldbody, np.zeros(3))]
    for index in range(5):
        middle, along = _CORNERS[index : index + 2].mean(axis=0), _CORNERS[index + 1] - _CORNERS[index]
        rod = _add_hub(spec, f"rod{index}", middle, mass=1.0)
        rod.add_joint(name=names.turn(rod.name), type=mujoco.mjtJoint.mjJNT_BALL)
        rod.inertia = np.where(along == 0, 1 + _WIDTH**2, 2 * _WIDTH**2) / 12
        seats.append((rod, middle))
    seats.append(seats[0])
    for index, (corner, axis) in enumerate(zip(_CORNERS, _AXES, strict=True)):
        head = corner + _PIN * np.eye(3)["xyz".index(axis)]
        for part, place in (("pin", corner), ("head", head)):
            sites = (f"{part}{index}/a", f"{part}{index}/b")
            for site, (body, centre) in zip(sites, seats[index : index + 2], strict=True):
                body.add_site(name=site, pos=place - centre)
            hold_sites(spec, names.closure(f"{part}{index}"), sites[0], sites[1])
    seats[3][0].add_site(name=POINT, pos=_CORNERS[3] - seats[3][1])
    return Mechanism(_finish(spec))


def _start(step: float) -> mujoco.MjSpec:
    """Options as `vgtsim.mjcf.build` sets them, with the library's gravity."""
    spec = mujoco.MjSpec()
    spec.option.timestep = step
    spec.default.equality.solref = [SOLREF_STEPS * step, SOLREF_RATIO]
    spec.default.equality.solimp = SOLIMP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_DISCRETE
    spec.option.gravity = [0, -_GRAVITY, 0]
    spec.option.tolerance = 0.0
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_REFSAFE
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return spec


def _finish(spec: mujoco.MjSpec) -> mujoco.MjModel:
    model = spec.compile()
    stiffen(model, WEIGHT_SCALE)
    return model


def _add_hub(
    spec: mujoco.MjSpec, name: str, place: ArrayLike, mass: float = LEAST_MASS, axes: str = "xyz"
) -> mujoco.MjsBody:
    """A point mass on slides along some axes."""
    hub = spec.worldbody.add_body(name=name, pos=np.asarray(place, float))
    for axis, slide in zip("xyz", names.slides(name), strict=True):
        if axis in axes:
            direction = np.eye(3)["xyz".index(axis)]
            hub.add_joint(name=slide, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=direction)
    hub.explicitinertial = True
    hub.mass, hub.ipos, hub.inertia = mass, [0, 0, 0], [LEAST_INERTIA] * 3
    return hub


def _add_member(parent: mujoco.MjsBody, name: str, span: ArrayLike, mass: float = 1.0) -> None:
    """A slender rod on a ball joint at its parent's origin, Z along it."""
    along = np.asarray(span, float)
    length = float(np.linalg.norm(along))
    rod = parent.add_body(name=name, quat=quaternions_to(along[None] / length)[0])
    rod.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_BALL)
    rod.explicitinertial = True
    rod.mass, rod.ipos = max(mass, LEAST_MASS), [0, 0, length / 2]
    across = max(mass * length**2 / 12, LEAST_INERTIA)
    rod.inertia = [across, across, LEAST_INERTIA]
    rod.add_site(name=names.far(name), pos=[0, 0, length])


@dataclass(frozen=True)
class Published:
    """A mechanism by its step, the time at which its place is published, s, and the place there, m."""

    name: str
    build: Callable[[float], Mechanism]
    duration: float
    point: tuple[float, float, float]


PUBLISHED = (
    Published("A01 pendulum", pendulum, 10.0, (-0.275087462577, -0.961419205099, 0.0)),
    Published("A02 four-bar, N = 2", partial(four_bars, count=2), 10.0, (0.328458111539, 0.944518538179, 0.0)),
    Published("A02 four-bar, N = 40", partial(four_bars, count=40), 10.0, (0.180512226685, 0.983572740583, 0.0)),
    Published("A04 Bricard", bricard, 2.0, (-0.9693403448, -1.2212468950, 0.7542780108)),
    Published("A04 Bricard, 10 s", bricard, 10.0, (0.9999999638, -1.0002690127, 0.9997309511)),
)
