"""An arm without a scene: it stands in for a site where only the arm counts."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vgtsim.constants import GRAVITY, SAFETY_FACTOR
from vgtsim.description.scene import Payload
from vgtsim.kinematics import Chain
from vgtsim.positioning import StrokeBox, make_box
from vgtsim.site import Site
from vgtsim.statics import LoadModel, MemberSections, make_load_model, make_sections

_STROKE_MARGIN = 0.005  # m at the ends of strokes: what the shipped scenes keep


@dataclass(frozen=True, eq=False)
class ArmAlone:
    """An arm that hangs straight and carries nothing. Its properties have the names of those of a `Site`."""

    chain: Chain

    @property
    def start(self) -> NDArray[np.float64]:
        """Inputs of the straight arm, shape (n,)."""
        return self.chain.straight

    @cached_property
    def box(self) -> StrokeBox:
        """Actuator lengths that a plan may use: the strokes less a usual margin."""
        return make_box(self.chain, _STROKE_MARGIN)

    @cached_property
    def load_model(self) -> LoadModel:
        """Masses of the arm with nothing at its tool."""
        return make_load_model(self.chain, Payload(mass=0.0, radius=1e-3), GRAVITY)

    @cached_property
    def sections(self) -> MemberSections:
        """Section properties of the members."""
        return make_sections(self.chain.manipulator, self.chain.truss)


Place = Site | ArmAlone


def safety_factor_of(place: Place) -> float:
    """Safety factor that members are held to: the scene's, or that of AISC 360."""
    return place.task.limits.safety_factor if isinstance(place, Site) else SAFETY_FACTOR
