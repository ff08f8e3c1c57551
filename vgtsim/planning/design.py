"""An arm sized for the tour and the load cases of a scene."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from vgtsim.description.catalogue import Catalogue, CylinderSize, TubeSize
from vgtsim.description.scene import LoadCase
from vgtsim.errors import DescriptionError
from vgtsim.kinematics import Chain
from vgtsim.planning.riser import RISER_SPARE, asked_spare, riser_fit
from vgtsim.planning.sampling import sample_motion, sample_postures
from vgtsim.planning.tour import plan_tour
from vgtsim.site import Site
from vgtsim.statics import Demand, NodeMotion, Sizing, size_arm

_ROUNDS = 8  # tours after which sizes that still change are given up


@dataclass(frozen=True)
class Design:
    """A sized arm and the demand on it; the mass before is that of the scene's arm.

    `poses` counts the poses on the tour and the further postures; `rounds` counts the tours planned.
    """

    sizing: Sizing
    poses: tuple[int, int]
    cases: tuple[str, ...]
    rounds: int


def design_arm(site: Site, catalogue: Catalogue, target: float = 1.0, *, anywhere: bool = True) -> Design:
    """Size the arm of a scene for its tour, inertia included, and its load cases, to at most a target utilisation.

    The tour depends on the thickness of the arm, so it is planned again for the sized arm until the sizes stay the
    same. Sizing the result again gives the same result. Sizes with which the stowed arm does not pass the riser are
    left out. `anywhere` asks that the arm stands the load cases in any posture too, see `sample_postures`.

    Raises:
        DescriptionError: The arm has modules that are not sized; nothing in the catalogue passes the riser or carries
            the load of a place; or sizes keep changing.
        ReachError: A goal of the tour cannot be met.
        PathError: A goal cannot be come to.
    """
    _require_sizable(site.chain, anywhere)
    task = site.task
    catalogue = passing_sizes(site.chain, catalogue, site.tank.arm_riser.bore, asked_spare(site))
    beside = sample_postures(site.chain) if anywhere else np.empty((0, len(site.truss.nodes), 3))
    still = np.zeros(beside.shape)
    cases = (LoadCase(name="run"), *task.loads)
    now, before, mass = site, None, None
    for count in range(1, _ROUNDS + 1):
        nodes, motion = sample_motion(now.chain, plan_tour(now))
        moving = NodeMotion(np.concatenate([motion.velocity, still]), np.concatenate([motion.acceleration, still]))
        demand = Demand(
            np.concatenate([nodes, beside]),
            moving,
            task.payload,
            cases,
            task.simulation.gravity,
            task.limits.safety_factor,
        )
        found = size_arm(now.chain, catalogue, demand, target)
        mass = found.mass[0] if mass is None else mass
        if found.chosen == before:
            whole = replace(found, mass=(mass, found.mass[1]))
            return Design(whole, (len(nodes), len(beside)), tuple(case.name for case in cases), count)
        before, now = found.chosen, Site(replace(site.scene, manipulator=found.manipulator))
    raise DescriptionError(
        site.scene.file, "motion", f"a tour that changes sizes {_ROUNDS} times", "a tour with a fixed point"
    )


def _require_sizable(chain: Chain, anywhere: bool) -> None:
    """Refuse arms whose members name a section each, and any posture of arms that do not bend by their inputs."""
    name, names = chain.manipulator.name, chain.layout.names
    apart = [names[a] for a, (place, _) in enumerate(chain.seats) if not place.modules.sizable]
    if apart:
        allowed = "double octahedra, tetrahedra and static sections: longerons of octahedra are not sized one by one"
        raise DescriptionError(None, "modules", f"{', '.join(apart)} of {name}, octahedral", allowed)
    if anywhere and not chain.leans:
        others = [names[a] for a, (place, _) in enumerate(chain.seats) if not place.modules.leans]
        allowed = "symmetric double octahedra, all of them or none with a joint offset; any other arm with --tour-only"
        raise DescriptionError(
            None, "modules", f"{', '.join(others or names)} of {name}, to be bent into any posture", allowed
        )


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
        kind = "cylinders" if tubes else "tubes"
        fit = riser_fit(chain, bore)
        raise DescriptionError(
            None,
            kind,
            f"none that leaves the stowed arm {spare:.4g} m",
            f"smaller ones; the arm's own leave {fit.spare:.4g} m",
        )
    return catalogue.model_copy(update={"tubes": tubes, "cylinders": cylinders})


def _spare(chain: Chain, tube: TubeSize, cylinder: CylinderSize, bore: float) -> float:
    """Distance of the stowed arm from a bore when all its tubes and all its cylinders have one size, m."""
    arm, changed = chain.manipulator, tube.model_dump()
    tubes = {name: item.model_copy(update=changed) for name, item in arm.tubes.items()}
    changed = cylinder.model_dump(exclude_none=True)
    cylinders = {name: item.model_copy(update=changed) for name, item in arm.cylinders.items()}
    thick = arm.model_copy(update={"tubes": tubes, "cylinders": cylinders})
    return riser_fit(replace(chain, manipulator=thick), bore).spare
