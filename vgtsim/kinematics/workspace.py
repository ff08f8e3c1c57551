"""What an arm can reach: a seeded sample over its strokes, with reach, volume, tilt, dexterity and singular regions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.sampling import sample_inputs, singular_values

Array = NDArray[np.float64]

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
    """Sample evenly over the strokes, on the assembly modes of the straight pose.

    Collisions of the arm with itself are not looked at.

    Raises:
        SingularityError: Hardly any lengths can be reached.
    """
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
