"""Whether a scene can work at all: what is checked before anything is planned."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.modules import GeneralDoubleOctahedral, Octahedral
from vgtsim.description.scene import Scene
from vgtsim.errors import AssemblyError, DescriptionError
from vgtsim.geometry import enclosure_distance, segment_distance
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.start import bend_start
from vgtsim.kinematics.stroke_boxes import check_strokes
from vgtsim.planning.riser import check_riser
from vgtsim.positioning.strokes import make_box
from vgtsim.positioning.surroundings import Surroundings
from vgtsim.statics.elasticity import ElasticModel, hold_cylinders, make_elastic_model
from vgtsim.statics.stiffness import deflect

Array = NDArray[np.float64]


def sags(scene: Scene) -> bool:
    """Whether the arm of a scene gives under its load: by its members and oil, or by its servos."""
    simulation = scene.task.simulation
    return simulation.members == "elastic" or simulation.drive == "servo"


def surroundings_of(scene: Scene, chain: Chain) -> Surroundings:
    """What the arm of a scene must keep clear of.

    Args:
        scene: The scene.
        chain: Its arm on its mast.

    Returns:
        Tank, equipment, waste, mast and the arm itself with its payload; of an arm that gives where it sags to.
    """
    task, sag = scene.task, None
    if sags(scene):
        sag = _sagging(elastic_model_of(scene, chain))
    return Surroundings(chain, scene.tank, task.payload.radius, task.mast.outer_diameter / 2, sag)


def elastic_model_of(scene: Scene, chain: Chain) -> ElasticModel:
    """The arm of a scene with its payload, masses where the scene has them, and cylinders as their drives hold them."""
    simulation = scene.task.simulation
    model = make_elastic_model(chain, scene.task.payload, simulation.gravity, lumped=simulation.lumped)
    return hold_cylinders(model, simulation)


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
        DescriptionError: A module has static longerons, or does not assemble over its strokes; the
            stowed arm does not pass the riser;
            the start is outside a stroke or too near something; a goal is outside the tank or too near
            something.
    """
    _check_kinds(scene, chain)
    check_assembly(scene, chain)
    check_riser(scene, chain)
    _check_start(scene, chain)
    _check_goals(scene, chain)


def require_positionable(chain: Chain) -> None:
    """Refuse arms with modules that cannot be positioned.

    Args:
        chain: The arm.

    Raises:
        DescriptionError: It has general double octahedra: their upper cell is found by following it from the straight
            pose, which no batch of trial steps can be asked to do.
    """
    general = [item.name for item in chain.manipulator.modules if isinstance(item, GeneralDoubleOctahedral)]
    if general:
        allowed = "symmetric double octahedra, octahedra and tetrahedra: general double octahedra are not positioned"
        raise DescriptionError(None, "modules", f"{', '.join(general)} of {chain.manipulator.name}", allowed)


def _check_kinds(scene: Scene, chain: Chain) -> None:
    require_positionable(chain)
    for module in scene.manipulator.actuated:
        if isinstance(module, Octahedral) and module.freedom < 6:
            raise scene.error(
                "manipulator",
                f"{scene.manipulator.name}, whose module {module.name} has {6 - module.freedom} static longerons",
                "octahedra with six actuators: a path between poses would not leave static longerons their length",
            )


def check_assembly(scene: Scene, chain: Chain) -> None:
    """Refuse strokes over which a module does not assemble, or might change its assembly.

    Args:
        scene: The scene, for the error.
        chain: Its arm.

    Raises:
        DescriptionError: With the module and its strokes.
    """
    try:
        check_strokes(chain)
    except AssemblyError as error:
        place = next(item for item in chain.layout.places if error.module in item.modules.names)
        m = place.modules.names.index(error.module)
        low, high = chain.stroke[:, place.lengths[m][place.modules.actuated[m]]]
        module = next(item for item in scene.manipulator.actuated if item.name == error.module)
        key = "longerons" if isinstance(module, Octahedral) else "cylinder"
        raise scene.error(
            f"manipulator.modules.{error.module}.{key}",
            f"strokes from {low.min():.4f} to {high.max():.4f} m: {error}",
            f"strokes over whose whole range {error.module} assembles",
        ) from None


def _check_start(scene: Scene, chain: Chain) -> None:
    motion = scene.task.motion
    q, box = bend_start(chain, scene.task.motion.start), make_box(chain, motion.stroke_margin)
    owner, names = chain.layout.owner, chain.layout.names
    for a, name in enumerate(names):
        alone = np.array(chain.straight)
        alone[owner == a] = q[owner == a]
        try:
            chain.lengths(alone)
        except (AssemblyError, ValueError) as error:
            raise scene.error(f"motion.start.{a}", f"a shape {name} cannot take: {error}", "a smaller bend") from None
    length = chain.lengths(q)
    spare = box.spare(length)
    if np.min(spare) <= 0:
        worst = int(np.argmin(spare))
        actuator = chain.truss.members[chain.truss.actuated[worst]].name
        raise scene.error(
            f"motion.start.{names.index(actuator.split('/')[0])}",
            f"{actuator} at {length[worst]:.4f} m",
            f"{box.least[worst]:.4f} to {box.greatest[worst]:.4f} m: its stroke less the margin",
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
