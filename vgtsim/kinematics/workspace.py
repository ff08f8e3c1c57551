"""What an arm can reach: seeded random configurations, how near each is to a singularity, and what they say of its reach."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vgtsim.arrays import Array, Mask
from vgtsim.errors import SingularityError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.modules import find_singular

NEAR_SINGULAR = 0.1  # smallest singular value of a module, a pure number, below which a region counts as singular
_CELLS = 20  # cells along the reach, of the grid that the volume is counted on
_DIGITS = 1e-9  # of a Jacobian's greatest singular value: below it a direction cannot be moved in at all


@dataclass(frozen=True)
class Workspace:
    """A sample of what an arm reaches; N configurations.

    Attributes:
        tool: Tool points in the frame of the base face, shape (N, 3), m.
        direction: Tool directions there, shape (N, 3).
        tilt: Angle of the tool direction from that of the straight pose, shape (N,), rad.
        dexterity: Least over greatest singular value of the tool's motion by the actuators, rotations in units of the
            reach, over as many directions as the arm can move in, shape (N,).
        singular: Smallest singular value over the modules, shape (N,), a pure number.
        mobility: Directions that the tool can move in, one to six.
        cell: Edge of the cells that the volume is counted on, m.
    """

    tool: Array
    direction: Array
    tilt: Array
    dexterity: Array
    singular: Array
    mobility: int
    cell: float

    @property
    def reach(self) -> float:
        """Greatest distance of the tool from the centre of the base face, m."""
        return float(np.linalg.norm(self.tool, axis=-1).max())

    @property
    def volume(self) -> float:
        """Volume of the cells that hold a tool point, m³: a lower bound that grows with the sample."""
        return len(np.unique(np.floor(self.tool / self.cell), axis=0)) * self.cell**3

    @property
    def near_singular(self) -> float:
        """Part of the sample with a module nearer to a singularity than `NEAR_SINGULAR`."""
        return float(np.mean(self.singular < NEAR_SINGULAR))


def sample_workspace(chain: Chain, count: int, seed: int) -> Workspace:
    """Sample evenly over the strokes as `sample_inputs`, whose errors it has; the arm may collide with itself."""
    q = sample_inputs(chain, count, seed)
    turn, origin = chain.mount[:3, :3], chain.mount[:3, 3]
    position, direction, J = chain.tool_jacobian(q)
    ahead = chain.tool(chain.straight)[1]
    tilt = np.arctan2(np.linalg.norm(np.cross(direction, ahead), axis=-1), direction @ ahead)
    tool = (position - origin) @ turn
    reach = float(np.linalg.norm(tool, axis=-1).max())
    motion = J @ chain.input_rates(q)
    motion[:, :3] /= reach
    value = np.linalg.svd(motion, compute_uv=False)
    mobility = int(np.sum(np.median(value / value[:, :1], axis=0) > _DIGITS))
    return Workspace(
        tool=tool,
        direction=direction @ turn,
        tilt=tilt,
        dexterity=value[:, mobility - 1] / value[:, 0],
        singular=singular_values(chain, q)[0].min(axis=-1),
        mobility=mobility,
        cell=reach / _CELLS,
    )


def sample_inputs(chain: Chain, count: int, seed: int, part: float = 1.0) -> Array:
    """Configurations q, shape (count, n), with lengths evenly spread over a part of the strokes about their middle.

    Each is on the assembly mode of the straight pose. Lengths that only a way through a singularity reaches are drawn
    again.

    Raises:
        SingularityError: Hardly any lengths can be reached.
    """
    rng = np.random.default_rng(seed)
    least, greatest = chain.stroke
    middle, half = (least + greatest) / 2, part * (greatest - least) / 2
    x = np.empty((count, chain.layout.inputs))
    for place in chain.layout.places:
        modules, straight = place.modules, place.modules.straight_legs[0]
        for m in range(len(modules.names)):
            own = place.lengths[m][modules.actuated[m]]
            rows, tries = np.empty((0, modules.inputs)), 0
            while len(rows) < count:
                size = 2 * (count - len(rows)) + 8
                legs = np.broadcast_to(straight, (size, *straight.shape)).copy()
                legs[:, m, modules.actuated[m]] = middle[own] + half[own] * rng.uniform(-1, 1, (size, len(own)))
                found, reached = modules.attempt(legs)
                rows = np.concatenate([rows, found[reached[:, m] == 1.0, m]])
                tries += 1
                if tries > 100:
                    raise SingularityError(modules.names[m], 0.0, chain.truss.member_names[place.moving[0]], 0.0, 0.0)
            x[:, place.columns[m]] = rows[:count]
    return x


def within_strokes(chain: Chain, q: Array) -> Mask:
    """Which configurations of shape (N, n) assemble with every actuator in its stroke and every static leg at its length."""
    state, (low, high) = chain.state(q), chain.stroke
    kept = [part.kept.all(axis=1) for part in state.parts]
    return state.assembles & np.all(kept, axis=0) & np.all((state.lengths >= low) & (state.lengths <= high), axis=1)


def singular_values(chain: Chain, q: Array) -> tuple[Array, Array]:
    """Smallest singular value of each module, a pure number, and the leg worst of it, shapes (N, A), at q of shape (N, n)."""
    value, worst = np.empty((2, len(q), len(chain.layout.names)))
    for place in chain.layout.places:
        value[:, place.active], worst[:, place.active] = find_singular(place.modules, place.take(q))
    return value, worst
