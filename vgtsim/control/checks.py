"""Whether a scene can work at all: what is checked before anything is planned."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vgtsim.control.riser import check_riser
from vgtsim.description.scene import Scene
from vgtsim.errors import AssemblyError
from vgtsim.geometry import enclosure_distance, segment_distance
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.double_octahedron import Geometry, length_jacobian, midplane_from_lengths
from vgtsim.kinematics.start import start_inputs
from vgtsim.redundancy.strokes import make_box
from vgtsim.redundancy.surroundings import Surroundings
from vgtsim.statics.elasticity import ElasticModel, make_elastic_model
from vgtsim.statics.stiffness import deflect

Array = NDArray[np.float64]

_STATIONS = 5  # lengths tried over each stroke: 125 combinations a module
_CLOSED = 1e-9  # rounding of lengths that went there and back, m


def surroundings_of(scene: Scene, chain: Chain) -> Surroundings:
    """What the arm of a scene must keep clear of.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Returns:
        Tank, equipment, waste, mast and the arm itself with its payload; of an elastic arm where it sags to.
    """
    task, sag = scene.task, None
    if task.simulation.members == "elastic":
        sag = _sagging(make_elastic_model(chain, task.payload, task.simulation.gravity))
    return Surroundings(chain, scene.tank, task.payload.radius, task.mast.outer_diameter / 2, sag)


def _sagging(elastic: ElasticModel) -> Callable[[Array], Array]:
    """Displacements of nodes and tool point at rest, to first order: one solve, some millimetres off where arms sag most."""

    def sag(nodes: Array) -> Array:
        moved = deflect(elastic, nodes)
        return np.concatenate([moved.nodes, moved.tool[..., None, :3]], axis=-2)

    return sag


def check_scene(scene: Scene, chain: Chain) -> None:
    """Refuse a scene that cannot work, before any planning.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Raises:
        DescriptionError: A module does not assemble over its strokes; the stowed arm does not pass the riser;
            the start is outside a stroke or too near something; a goal is outside the tank or too near
            something.
    """
    check_assembly(scene, chain)
    check_riser(scene, chain)
    _check_start(scene, chain)
    _check_goals(scene, chain)


def check_assembly(scene: Scene, chain: Chain) -> None:
    """Refuse strokes over which a module does not assemble.

    All corners of the stroke box and a grid inside it are solved. The determinant of the actuator lengths by
    the inputs must keep its sign: where it vanishes the module is singular and may change its assembly mode.

    Args:
        scene: The scene, for the error.
        chain: Its arm.

    Raises:
        DescriptionError: With the module and the lengths.
    """
    done = set()
    for a, geometry in enumerate(chain.geometries):
        low, high = float(chain.stroke[0, a, 0]), float(chain.stroke[1, a, 0])
        if (geometry, low, high) in done:
            continue
        done.add((geometry, low, high))
        ticks = np.linspace(low, high, _STATIONS)
        for lengths in np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3):
            failure = _assembly_failure(geometry, lengths)
            if failure:
                name = chain.manipulator.active[a].name
                at = ", ".join(f"{length:.4f}" for length in lengths)
                raise scene.error(
                    f"manipulator.modules.{name}.cylinder",
                    f"a stroke from {low:.4f} to {high:.4f} m; at ({at}) m {failure}",
                    f"a stroke over whose whole range {name} assembles",
                )


def _assembly_failure(geometry: Geometry, lengths: Array) -> str:
    """Why a module does not take three actuator lengths, shape (3,), m; empty when it does."""
    try:
        back, block = length_jacobian(geometry, midplane_from_lengths(geometry, lengths))
    except (AssemblyError, ValueError, np.linalg.LinAlgError) as error:
        return str(error)
    if np.max(np.abs(back - lengths)) > _CLOSED or np.linalg.det(block) >= 0:
        return "only another assembly mode closes"
    return ""


def _check_start(scene: Scene, chain: Chain) -> None:
    motion = scene.task.motion
    q = start_inputs(scene, chain)
    box = make_box(chain, motion.stroke_margin)
    for a, module in enumerate(scene.manipulator.active):
        try:
            length = length_jacobian(chain.geometries[a], q[a])[0]
        except (AssemblyError, ValueError) as error:
            raise scene.error(
                f"motion.start.{a}", f"a shape {module.name} cannot take: {error}", "a smaller bend"
            ) from None
        spare = np.minimum(length - box.least[a], box.greatest[a] - length)
        if np.min(spare) <= 0:
            worst = int(np.argmin(spare))
            raise scene.error(
                f"motion.start.{a}",
                f"{module.name}/actuator/{worst + 1} at {length[worst]:.4f} m",
                f"{box.least[a, worst]:.4f} to {box.greatest[a, worst]:.4f} m: its stroke less the margin",
            )
    clearance, place = surroundings_of(scene, chain).least(q)
    if clearance < motion.clearance:
        raise scene.error(
            "motion.start", f"a shape that comes to {clearance:.3f} m of {place}", f"{motion.clearance:.3f} m"
        )


def _check_goals(scene: Scene, chain: Chain) -> None:
    """The ball of the payload at each goal must keep the planned clearance from everything that stands."""
    around = surroundings_of(scene, chain)
    radius, wanted = scene.task.payload.radius, scene.task.motion.clearance
    places = around.obstacles
    for index, goal in enumerate(scene.task.motion.goals):
        point = np.array(goal.position)
        gaps = {"the tank's shell": float(enclosure_distance(scene.tank, around.profile, point)[0])}
        gaps["the waste"] = float(point[2] - places.waste_level)
        for name, axis, thick in zip(places.names, places.axes, places.radii, strict=True):
            gaps[name] = float(segment_distance(point, point, axis[0], axis[1])[0] - thick)
        place = min(gaps, key=lambda name: gaps[name])
        if gaps[place] < radius + wanted:
            side = "inside" if gaps[place] < 0 else f"{gaps[place]:.3f} m from"
            raise scene.error(
                f"motion.goals.{index}.position",
                f"{goal.name} at ({point[0]:.3f}, {point[1]:.3f}, {point[2]:.3f}) m, {side} {place}",
                f"at least {radius + wanted:.3f} m from everything: payload radius and clearance",
            )
