"""The questions that a chain, and all that is built on it, asks of its active modules of one kind.

The modules of a kind are solved together. A set has M modules with the same number of inputs (canonical, see the kind's
file) and of legs (the members whose lengths can change). Inputs are x, shape (b, M, inputs), where b is a batch. All
vectors are in the frames B of the modules.

A kind answers by a subclass of `ModuleSet`; its `fill` holds all the kinematics. Questions with a default need an answer
only where the kind can do more: `docs/add_module_kind.md` goes through them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from vgtsim.arrays import Array, Index, Mask
from vgtsim.errors import AssemblyError, SingularityError
from vgtsim.kinematics.mode_following import worst_row

if TYPE_CHECKING:
    from vgtsim.kinematics.modules.static_section import StaticSection

# (x, figures, straight, marks, frame, motion, length, slope, inner, inner_slope) -> None: fills the last seven arrays at
# inputs x, see the properties of `ModuleState`; compiled, or plain Python where a formula is an iteration. An array
# without entries is not asked for. Marks, shape (b, M, 4), say whether a module is placed, closed, kept and valid; the
# last two are asked for with lengths alone.
Fill = Callable[[Array, Array, Array, Mask, Array, Array, Array, Array, Array, Array], None]
TRIANGLE = ((0, 1), (1, 2), (2, 0))  # edges 12, 23, 31 of a face, as indices of its corners

Groups = dict[str, list[int]]  # node indices of a module: `base`, `top`, and what lies between


@dataclass(frozen=True)
class Chord:
    """Where the static sections beyond a module are to lie, in the module's frame B.

    Attributes:
        begin: Shape (3,), m: on the curve that the arm is laid along.
        direction: Shape (3,), unit.
        end: Shape (3,), m: on the curve.
        length: Of the sections, m; the chord of the curve may be shorter.
    """

    begin: Array
    direction: Array
    end: Array
    length: float


_NO_FRAMES, _NO_MOTION, _NO_LEGS = np.empty((0, 0, 3, 4)), np.empty((0, 0, 0, 6)), np.empty((0, 0, 0))
_NO_SLOPES, _NO_NODES, _NO_NODE_SLOPES = np.empty((0, 0, 0, 0)), np.empty((0, 0, 0, 3)), np.empty((0, 0, 0, 3, 0))


@dataclass(frozen=True, eq=False)
class ModuleState:
    """Kinematics of a set at inputs x. Each property is worked out when it is first asked for, see `ModuleSet.fill`.

    Nothing here raises: masks say what the numbers are worth, because one bad trial must not stop a batch. Numbers of a
    module that its mask leaves out are finite and mean nothing. Inputs are x, shape (b, M, inputs), stored by rows.
    """

    x: Array
    modules: ModuleSet

    def _fill(
        self,
        frame: Array = _NO_FRAMES,
        motion: Array = _NO_MOTION,
        length: Array = _NO_LEGS,
        slope: Array = _NO_SLOPES,
        inner: Array = _NO_NODES,
        inner_slope: Array = _NO_NODE_SLOPES,
    ) -> Mask:
        own, marks = self.modules, np.empty((*self.x.shape[:2], 4), dtype=bool)
        own.fill(self.x, own.figures, own.straight, marks, frame, motion, length, slope, inner, inner_slope)
        return marks

    @cached_property
    def _moving(self) -> tuple[Mask, Array, Array]:
        """Marks, frames and motions."""
        frame, motion = np.empty((*self.x.shape[:2], 3, 4)), np.empty((*self.x.shape, 6))
        return self._fill(frame, motion), frame, motion

    @cached_property
    def _standing(self) -> tuple[Mask, Array]:
        """Marks and frames."""
        if "_moving" in self.__dict__:
            return self._moving[:2]
        frame = np.empty((*self.x.shape[:2], 3, 4))
        return self._fill(frame), frame

    @cached_property
    def _reaching(self) -> tuple[Mask, Array, Array]:
        """Marks, lengths of legs and their slopes."""
        batch, legs = self.x.shape[:2], self.modules.actuated.shape[1]
        length, slope = np.empty((*batch, legs)), np.empty((*batch, legs, self.x.shape[2]))
        return self._fill(length=length, slope=slope), length, slope

    @property
    def placed(self) -> Mask:
        """Which modules have a frame, shape (b, M)."""
        return (self._reaching if "_reaching" in self.__dict__ else self._standing)[0][..., 0]

    @property
    def closed(self) -> Mask:
        """Which modules have inner nodes, shape (b, M)."""
        return (self._reaching if "_reaching" in self.__dict__ else self._standing)[0][..., 1]

    @property
    def kept(self) -> Mask:
        """Which modules have lengths, and static legs of their own length, shape (b, M)."""
        return self._reaching[0][..., 2]

    @property
    def valid(self) -> Mask:
        """Which modules are on the assembly mode of the straight arm, and clear of the inputs' singularities, (b, M)."""
        return self._reaching[0][..., 3]

    @property
    def frame(self) -> Array:
        """R_BT beside P_BT, shape (b, M, 3, 4), m."""
        return self._standing[1]

    @property
    def motion(self) -> Array:
        """Angular velocity of T, then velocity of its origin, m, per unit rate of each input, (b, M, inputs, 6)."""
        return self._moving[2]

    @property
    def legs(self) -> tuple[Array, Array]:
        """Lengths of all legs, shape (b, M, legs), m, and their derivatives, shape (b, M, legs, inputs)."""
        return self._reaching[1:]

    @cached_property
    def inner(self) -> Array:
        """Nodes on neither face, shape (b, M, inner_count, 3), m."""
        found = np.empty((*self.x.shape[:2], self.modules.inner_count, 3))
        self._fill(inner=found)
        return found

    @cached_property
    def inner_slope(self) -> Array:
        """Derivatives of the inner nodes, shape (b, M, inner_count, 3, inputs)."""
        found = np.empty((*self.x.shape[:2], self.modules.inner_count, 3, self.x.shape[2]))
        self._fill(inner_slope=found)
        return found


@dataclass(frozen=True, eq=False)
class ModuleSet(ABC):
    """The modules of one kind.

    Attributes:
        names: Of the modules.
        straight: Inputs of the straight working pose, shape (M, inputs).
        fill: The kinematics of the kind.
        inputs: Number of canonical inputs of a module.
        units: Unit of each input, for inputs that a user writes.
        leans: Whether the first two inputs are the sine of half the bend times cosine and sine of its direction.
        stows: Whether the pose that passes the riser is another than the straight one.
        turns_alike: Whether modules that are turned to each other may be coupled.
        sections_key: Key of the description that names its cylinders.
    """

    names: tuple[str, ...]
    straight: Array
    fill: ClassVar[Fill]
    inputs: ClassVar[int]
    units: ClassVar[tuple[str, ...]]
    leans: ClassVar[bool] = False
    stows: ClassVar[bool] = False
    turns_alike: ClassVar[bool] = False
    sections_key: ClassVar[str] = "cylinder"

    @cached_property
    @abstractmethod
    def figures(self) -> Array:
        """Dimensions of each module as `fill` reads them, shape (M, k)."""

    def at(self, x: Array) -> ModuleState:
        """Kinematics at inputs of shape (b, M, inputs)."""
        return ModuleState(np.ascontiguousarray(x, float), self)

    @abstractmethod
    def refuse(self, x: Array) -> Exception:
        """The error of inputs of which some are not `kept`; it names the module."""

    @cached_property
    def inner_count(self) -> int:
        """Number of nodes of a module that are on neither face."""
        return 0

    @cached_property
    def actuated(self) -> Mask:
        """Which legs are actuators, shape (M, legs); all, and as many as inputs, of a kind without static legs."""
        return np.ones((len(self.names), self.inputs), dtype=bool)

    @cached_property
    def straight_legs(self) -> tuple[Array, Array]:
        """Lengths of all legs of the straight pose, shape (M, legs), m, and their derivatives, (M, legs, inputs)."""
        length, block = self.at(self.straight[None]).legs
        return length[0], block[0]

    @cached_property
    def usual_slopes(self) -> Array:
        """Sizes of the columns of those derivatives, shape (M, inputs)."""
        return np.linalg.norm(self.straight_legs[1], axis=-2)

    @abstractmethod
    def attempt(self, lengths: Array, start: Array | None = None) -> tuple[Array, Array]:
        """Follow leg lengths, shape (..., M, legs), from a start, shape (..., M, inputs), on its assembly mode.

        Without a start, from the straight pose. Returns inputs, and the fraction of the way covered, shape (..., M): one
        where the lengths were reached.
        """

    def solve(self, lengths: Array, start: Array | None = None) -> Array:
        """As `attempt`, but all lengths must be reached.

        Raises:
            AssemblyError: Lengths that no pose can have; the module is named.
            SingularityError: A singularity lies between.
        """
        self.require_closing(lengths)
        x, reached = self.attempt(lengths, start)
        if reached.min(initial=1.0) == 1.0:
            return x
        *where, m = np.unravel_index(int(np.argmin(reached)), reached.shape)
        at = (*where, slice(m, m + 1))  # what got least far
        begin = None if start is None else np.broadcast_to(start, x.shape)[at]
        raise self.one(int(m)).tell_end(lengths[at], begin, float(reached[at][0]))

    def require_closing(self, lengths: Array) -> None:  # noqa: B027  # an attempt ends early where they cannot be
        """Refuse lengths, shape (..., M, legs), m, that no pose can have: an AssemblyError names the module."""

    @abstractmethod
    def tell_end(self, lengths: Array, start: Array | None, part: float) -> SingularityError:
        """The error of a set of one module, which got only a part of the way; arguments are those of its `attempt`."""

    @abstractmethod
    def conditioned(self, x: Array) -> Array:
        """Derivatives of the legs' lengths in units that make them pure numbers, shape (..., M, legs, legs)."""

    def find_least(self, x: Array) -> Array:
        """Smallest singular value of each module, a pure number, shape (..., M)."""
        return find_singular(self, x)[0]

    def one(self, m: int) -> Self:
        """The set of module m alone."""
        return replace(self, **{item.name: getattr(self, item.name)[m : m + 1] for item in fields(self)})

    def dimensions(self, m: int) -> object:
        """What makes module m differ from another: two modules of equal dimensions behave alike."""
        return self.figures[m].tobytes()

    def check_strokes(self, low: Array, high: Array) -> None:  # noqa: B027  # the description may have refused already
        """Refuse a set of one module if its strokes, low to high, shape (k,), m, hold a singularity.

        Raises:
            AssemblyError: Lengths within the strokes do not make the module.
            SingularityError: Where the way ends, and the member.
        """

    def stow(self, length: float) -> Array:
        """Inputs that pass the riser, shape (M, inputs): of a kind that `stows`, with all actuators at a length, m."""
        return self.solve(np.full(self.actuated.shape, length)) if self.stows else self.straight

    def is_free(self, m: int) -> bool:  # noqa: ARG002
        """Whether module m can point anywhere: it follows a `swing`, and `lay` puts it along a curve."""
        return False

    def swing(self, x: Array, turn: Array) -> Array:  # noqa: ARG002
        """Inputs, shape (..., M, inputs), with transforms turned about Z by `turn`, shape (..., 1, 3, 3)."""
        return x

    @abstractmethod
    def bend(self, angle: Array, half: Array) -> Array:
        """Inputs, shape (..., M, inputs), of modules bent symmetrically at their straight extension.

        Angles between the end faces have shape (..., M), rad; the normal midway between the faces is `half`, (..., M, 3).
        """

    def extend(self, m: int | slice, x: Array, extension: ArrayLike) -> Array:  # noqa: ARG002
        """Inputs of module m, shape (..., inputs), with its end faces extensions apart, shape (...), m; or of a slice of them.

        They stay as they are where the extension cannot be chosen.
        """
        return x

    def sideways(self, m: int, angle: float) -> Array:  # noqa: ARG002
        """Linear forms on the inputs of module m that vanish when it bends in the plane at an angle about Z, (r, inputs)."""
        return np.empty((0, self.inputs))

    def lay(self, m: int, chord: Chord, share: Array) -> tuple[Array, Array, Array]:
        """Inputs of module m, shape (inputs,), that bring what follows onto a chord; the module is free.

        `share` is the turn of its top about the top's normal, shape (3, 3), where that can be chosen. Returns the
        inputs, R_BT, shape (3, 3), and where the chord then ends, shape (3,), m.
        """
        raise NotImplementedError


@contextmanager
def naming(module: str) -> Iterator[None]:
    """Give the name of a module to what it does not assemble for."""
    try:
        yield
    except AssemblyError as error:
        raise AssemblyError(module, error.residual, str(error)) from None


def find_singular(modules: ModuleSet, x: Array) -> tuple[Array, Index]:
    """Smallest singular value of each module, a pure number, and the leg worst of it, shapes (..., M)."""
    left, value, _ = np.linalg.svd(modules.conditioned(x))
    return value[..., -1], worst_row(left, value)


class PlannedMember(NamedTuple):
    """One member of a module between two nodes, by index; numbers are counted from 1 within a role.

    The role is `longeron`, `cross_longeron` or `actuator`; the section is the name of its tube or cylinder.
    """

    role: str
    section: str
    first: int
    second: int
    number: int


@dataclass(frozen=True)
class Kind:
    """One kind of module. A function takes the module's description, whose class belongs to the kind.

    Attributes:
        plan: The members between its nodes, battens left out.
        groups: Names of the groups of three nodes that it adds between base and top, in order.
        top: Corners of its top that are nodes of its own; the others it shares with its base.
        battens: Edges of its top that are members, as pairs of corners.
        make_set: From modules of this kind and the arm's face side, m, to their set; absent for a static kind.
        make_static: From a module and the arm's face side to its section; absent for a kind with actuators.
    """

    plan: Callable[[Any, Groups], list[PlannedMember]]
    groups: Callable[[Any], tuple[str, ...]] = lambda _: ()
    top: tuple[int, ...] = (0, 1, 2)
    battens: tuple[tuple[int, int], ...] = TRIANGLE
    make_set: Callable[[Any, float], ModuleSet] | None = None
    make_static: Callable[[Any, float], StaticSection] | None = None
