"""Smooth curves of inputs through given ones, inside the subspace that static longerons leave."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array
from vgtsim.kinematics import Subspace

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


@dataclass(frozen=True)
class Curve:
    """A spline of inputs over 0 to 1 whose values are brought into a subspace, which is as smooth as the spline.

    Called like a spline: inputs, shape (..., n), at parameters of shape (...). The first derivative is that along the
    subspace, to first order in how far the spline is from it.
    """

    spline: BSpline
    space: Subspace

    def __call__(self, parameter: ArrayLike, order: int = 0) -> Array:
        """Inputs, or their first derivative."""
        near = self.spline(parameter)
        flat = self.space.project(near.reshape(-1, near.shape[-1]))
        if order == 0:
            return flat.reshape(near.shape)
        slope, basis = self.spline(parameter, order).reshape(flat.shape), self.space.basis(self.space.chain.state(flat))
        return (basis @ (np.swapaxes(basis, 1, 2) @ slope[..., None]))[..., 0].reshape(near.shape)


def reverse_spline(spline: BSpline) -> BSpline:
    """The spline over 0 to 1 run from 1 to 0."""
    from scipy.interpolate import BSpline  # slow to load

    return BSpline(1 - spline.t[::-1], spline.c[::-1], spline.k)


def reverse_curve(curve: BSpline | Curve) -> BSpline | Curve:
    """The curve over 0 to 1 run from 1 to 0."""
    return Curve(reverse_spline(curve.spline), curve.space) if isinstance(curve, Curve) else reverse_spline(curve)


def make_curve(space: Subspace, inputs: Array) -> BSpline | Curve:
    """Curve over 0 to 1 through inputs of the subspace at even parameters, shape (W, n); its fourth derivative is continuous."""
    from scipy.interpolate import make_interp_spline  # slow to load, and only a path needs it

    spline = make_interp_spline(np.linspace(0.0, 1.0, len(inputs)), inputs, k=5)
    return Curve(spline, space) if space.bent else spline
