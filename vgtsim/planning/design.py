"""An arm sized for the tour and the load cases of a scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vgtsim.arrays import Array
from vgtsim.description import Catalogue, CylinderSize, LoadCase, TubeSize
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain, bend_all, sample_inputs, swing, within_strokes
from vgtsim.planning.checks import RISER_SPARE, asked_spare, riser_fit
from vgtsim.planning.tour import Tour, plan_tour
from vgtsim.positioning import bring_inside, make_box
from vgtsim.site import Site
from vgtsim.statics import GREATEST_BEND, Demand, NodeMotion, Sizing, size_arm

_SPACING = 0.2  # s from pose to pose of a tour
_ROUNDS = 8  # tours after which sizes that still change are given up
_AROUND = 24  # directions in which the arm reaches out
_HOOKS = 8  # local directions into which the free modules bend
_HOOK = 0.6  # bend of each, rad: what the strokes leave at the straight extension in any direction
_DRAWN = 1500  # postures drawn at random; about 60 % of arm15's are inside the strokes


@dataclass(frozen=True)
class Design:
    """A sized arm and the demand on it; the mass before is that of the scene's arm.

    `poses` counts the poses on the tour and the further postures.
    """

    sizing: Sizing
    poses: tuple[int, int]
    cases: tuple[str, ...]


def design_arm(site: Site, catalogue: Catalogue, target: float = 1.0, *, anywhere: bool = True) -> Design:
    """Size the arm of a scene for its tour, inertia included, and its load cases, to at most a target utilisation.

    The tour depends on the thickness of the arm, so it is planned again for the sized arm until the sizes stay the
    same. Sizing the result again gives the same result. Sizes with which the stowed arm does not pass the riser are
    left out. `anywhere` asks that the arm stands the load cases in any posture too, see `sample_postures`.

    Raises:
        DescriptionError: Nothing in the catalogue passes the riser or carries the load of a place; or sizes keep
            changing.
        ReachError: A goal of the tour cannot be met.
        PathError: A goal cannot be come to.
    """
    task = site.task
    catalogue = passing_sizes(site.chain, catalogue, site.tank.arm_riser.bore, asked_spare(site))
    beside = sample_postures(site.chain) if anywhere else np.empty((0, len(site.truss.nodes), 3))
    still = np.zeros(beside.shape)
    cases = (LoadCase(name="run"), *task.loads)
    now, before, mass = site, None, None
    for _ in range(_ROUNDS):
        nodes, motion = sample_motion(now.chain, plan_tour(now))
        moving = NodeMotion(np.concatenate([motion.velocity, still]), np.concatenate([motion.acceleration, still]))
        every, gravity = np.concatenate([nodes, beside]), task.simulation.gravity
        demand = Demand(
            nodes=every,
            motion=moving,
            payload=task.payload,
            cases=cases,
            gravity=gravity,
            safety_factor=task.limits.safety_factor,
        )
        found = size_arm(now.chain, catalogue, demand, target)
        mass = found.mass[0] if mass is None else mass
        if found.chosen == before:
            whole = replace(found, mass=(mass, found.mass[1]))
            return Design(whole, (len(nodes), len(beside)), tuple(case.name for case in cases))
        before, now = found.chosen, Site(replace(site.scene, manipulator=found.manipulator))
    changes = f"a tour that changes sizes {_ROUNDS} times"
    raise DescriptionError(site.scene.file, "motion", changes, "a tour with a fixed point")


def passing_sizes(chain: Chain, catalogue: Catalogue, bore: float, spare: float = RISER_SPARE) -> Catalogue:
    """Leave out sizes with which the stowed arm keeps less than `spare`, m, from a bore, its inner diameter in m.

    Raises:
        DescriptionError: No tube or no cylinder is left.
    """
    thin = min(catalogue.tubes, key=lambda size: size.outer_diameter)
    slim = min(catalogue.cylinders, key=lambda size: size.bore)
    tubes = tuple(size for size in catalogue.tubes if _spare(chain, size, slim, bore) >= spare)
    cylinders = tuple(size for size in catalogue.cylinders if _spare(chain, thin, size, bore) >= spare)
    if not tubes or not cylinders:
        left, found = riser_fit(chain, bore).spare, f"none that leaves the stowed arm {spare:.4g} m"
        kind = "cylinders" if tubes else "tubes"
        raise DescriptionError(None, kind, found, f"smaller ones; the arm's own leave {left:.4g} m")
    return catalogue.model_copy(update={"tubes": tubes, "cylinders": cylinders})


def _spare(chain: Chain, tube: TubeSize, cylinder: CylinderSize, bore: float) -> float:
    """Distance of the stowed arm from a bore when all its tubes and all its cylinders have one size, m."""
    arm, changed = chain.manipulator, tube.model_dump()
    tubes = {name: item.model_copy(update=changed) for name, item in arm.tubes.items()}
    changed = cylinder.model_dump(exclude_none=True)
    cylinders = {name: item.model_copy(update=changed) for name, item in arm.cylinders.items()}
    thick = arm.model_copy(update={"tubes": tubes, "cylinders": cylinders})
    return riser_fit(replace(chain, manipulator=thick), bore).spare


def sample_motion(chain: Chain, tour: Tour) -> tuple[Array, NodeMotion]:
    """Nodes along a tour, goals included, shape (K, N, 3), m, in frame G, and their velocities and accelerations.

    The motion is by central differences over one step of the tour.
    """
    every, step = max(1, round(_SPACING / tour.timestep)), tour.timestep
    rows = []
    for leg in tour.legs:
        last = len(leg.lengths) - 1
        picked = np.append(np.arange(0, last, every), last)
        # a leg begins and ends at rest: the lengths before and after it are those at its ends
        rows.append(np.stack([leg.lengths[np.clip(picked + offset, 0, last)] for offset in (-1, 0, 1)], axis=1))
    lengths = np.concatenate(rows)
    nodes = chain.nodes(chain.inputs_from_lengths(lengths))
    before, now, after = np.moveaxis(nodes, 1, 0)
    return now, NodeMotion((after - before) / (2 * step), (after - 2 * now + before) / step**2)


def sample_postures(chain: Chain, *, bring: bool = False) -> Array:
    """Nodes of an arm in many postures, shape (K, N, 3), m, in frame G.

    Some postures reach out horizontally in all directions: the first three or more modules bend evenly to the
    horizontal, and the others stay straight, or bend together into every local direction, which twists the modules that
    carry them. In random postures each module bends in any direction by up to 45 degrees; the seed is fixed. Postures
    outside a stroke are left out, or, with `bring`, their modules drawn towards mid-stroke until they are inside. An arm with
    modules that do more than bend, or bend in fewer directions, has as many postures with lengths evenly spread over its
    strokes beside them.
    """
    active = len(chain.layout.names)
    angles, directions = [], []
    for bent in range(min(3, active), active + 1):
        plain = np.where(np.arange(active) < bent, min(np.pi / 2 / bent, GREATEST_BEND), 0.0)
        hooks = 2 * np.pi / _HOOKS * np.arange(_HOOKS if bent < active else 0)
        for turn in (None, *hooks):
            free = (np.arange(active) >= bent) & (turn is not None)
            angles.append(np.where(free, _HOOK, plain))
            directions.append(np.where(free, turn or 0.0, 0.0))
    shapes = bend_all(chain, angles, directions)
    q = np.concatenate([swing(chain, shapes, angle) for angle in 2 * np.pi / _AROUND * np.arange(_AROUND)])
    rng = np.random.default_rng(0)
    bend, turn = rng.uniform((0.0, -np.pi), (GREATEST_BEND, np.pi), (_DRAWN, active, 2)).transpose(2, 0, 1)
    q = np.concatenate([q, bend_all(chain, bend, turn)])
    q = bring_inside(make_box(chain, 0.0), q) if bring else q[within_strokes(chain, q)]
    return chain.nodes(q if chain.leans else np.concatenate([q, sample_inputs(chain, _DRAWN, 0)]))
