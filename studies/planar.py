"""The planar three-joint arm that chapters 5 and 6 compute by hand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlanarArm:
    """Links in a plane, joined by revolute joints.

    Attributes:
        links: Lengths, shape (n,); 2, 2 and 1 in the dissertation.
    """

    links: tuple[float, ...] = (2.0, 2.0, 1.0)

    def joints(self, theta: ArrayLike) -> Array:
        """Positions of the base, the joints and the tip.

        Args:
            theta: Joint angles, each from the link before, shape (..., n), rad.

        Returns:
            Shape (..., n + 1, 2).
        """
        heading = np.cumsum(np.asarray(theta, float), axis=-1)
        link = np.stack([np.cos(heading), np.sin(heading)], axis=-1) * np.array(self.links)[:, None]
        return np.concatenate([np.zeros((*heading.shape[:-1], 1, 2)), np.cumsum(link, axis=-2)], axis=-2)

    def tip(self, theta: ArrayLike) -> Array:
        """Position of the tip (5.1, 5.2), shape (..., 2), for angles of shape (..., n), rad."""
        return self.joints(theta)[..., -1, :]

    def jacobian(self, theta: ArrayLike) -> Array:
        """Closed-form Jacobian of the tip (6.10), shape (..., 2, n), for angles of shape (..., n), rad."""
        joints = self.joints(theta)
        arm = joints[..., -1:, :] - joints[..., :-1, :]
        return np.stack([-arm[..., 1], arm[..., 0]], axis=-2)

    def jacobian_by_differences(self, theta: ArrayLike, step: float = 1e-6) -> Array:
        """Differential forward approach: one forward solution for each input beyond the first (6.5).

        Args:
            theta: Shape (n,), rad.
            step: rad.

        Returns:
            Shape (2, n).
        """
        at = np.asarray(theta, float)
        ahead = at + step * np.eye(len(at))
        return (self.tip(ahead) - self.tip(at)).T / step

    def solutions(self, tip: ArrayLike, heading: ArrayLike) -> Array:
        """Both branches of the solution space of a three-link arm (figure 5.3).

        Args:
            tip: Wanted position, shape (2,).
            heading: Direction of the last link, theta_1 + theta_2 + theta_3, shape (k,), rad.

        Returns:
            theta, shape (2 branches, k, 3), rad; NaN where the wrist is out of the first two links' reach. The first
            branch has theta_2 >= 0.
        """
        first, second, last = self.links
        end = np.asarray(heading, float)
        wrist = np.asarray(tip, float) - last * np.stack([np.cos(end), np.sin(end)], axis=-1)
        cosine = (np.sum(wrist**2, axis=-1) - first**2 - second**2) / (2 * first * second)
        with np.errstate(invalid="ignore"):
            bend = np.arccos(cosine)
        bends = np.stack([bend, -bend])
        shoulder = np.arctan2(wrist[:, 1], wrist[:, 0])
        shoulder = shoulder - np.arctan2(second * np.sin(bends), first + second * np.cos(bends))
        return np.stack([shoulder, bends, end - shoulder - bends], axis=-1)
