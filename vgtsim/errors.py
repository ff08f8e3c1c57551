"""The errors of the project: one tree, each carrying its evidence."""

from __future__ import annotations

from pathlib import Path


class VgtError(Exception):
    """Root of every error this project raises on purpose."""


class DescriptionError(VgtError):
    """A file that describes an arm, tank or scene is wrong.

    Attributes:
        file: The file that was read, or None when the data did not come from a file.
        key: Dotted path of the entry.
        found: The entry; empty if `allowed` says it all.
        allowed: Possible entries.
    """

    def __init__(self, file: Path | None, key: str, found: str, allowed: str) -> None:
        self.file, self.key, self.found, self.allowed = file, key, found, allowed
        place = f"{file}: " if file else ""
        message = f"found {found}; allowed: {allowed}" if found else allowed
        super().__init__(f"{place}{key or 'file'}: {message}")


class PostureError(DescriptionError):
    """A scene gives a posture in which the arm touches something or comes too near to it.

    `collisions` are all the places, the deepest first; `name` is that of the scene; `site` and `q` are what a picture of them
    is drawn from.
    """

    def __init__(
        self,
        place: tuple[Path, str],
        found: str,
        allowed: str,
        *,
        name: str,
        site: object,
        q: object,
        collisions: tuple[object, ...],
    ) -> None:
        super().__init__(*place, found, allowed)
        self.name, self.site, self.q, self.collisions = name, site, q, collisions


class AssemblyError(VgtError):
    """Given lengths do not close a module; `residual` is the greatest gap left in the loop equations, m."""

    def __init__(self, module: str, residual: float, detail: str = "") -> None:
        self.module, self.residual = module, residual
        super().__init__(f"{module} does not assemble: residual {residual:.3g} m{'; ' + detail if detail else ''}")


class SingularPoseError(AssemblyError):
    """A module stands in a singular pose: its lengths do not say how it moves.

    `value` is the smallest sine between one column of its Jacobian and the span of the others; it must be at least `bound`.
    """

    def __init__(self, module: str, value: float, bound: float) -> None:
        super().__init__(module, 0.0)
        self.value, self.bound = value, bound
        self.args = (
            f"{module} is singular: smallest sine between columns of its Jacobian {value:.2g}, allowed {bound:.0e}",
        )


class SingularityError(AssemblyError):
    """Given lengths lie behind a singularity, which `reason` names; the module may be on another assembly mode there.

    `value` is the smallest singular value at the end of the way, `member` the member with the largest part in it, and
    `reached` the fraction of the way covered.
    """

    def __init__(
        self,
        module: str,
        value: float,
        member: str,
        residual: float,
        reached: float,
        reason: str = "a singularity lies between",
    ) -> None:
        detail = f"smallest singular value {value:.2g}, {member}; {reached:.3f} of the way covered"
        super().__init__(module, residual, f"{reason}, {detail}")
        self.value, self.member, self.reached = value, member, reached


class ReachError(VgtError):
    """A tool goal cannot be met.

    `shortfall` is the distance between the goal and the nearest tool position, m; `binding` names the limits that stop the
    arm.
    """

    def __init__(self, goal: str, shortfall: float, binding: tuple[str, ...] = (), detail: str = "") -> None:
        self.goal, self.shortfall, self.binding, self.detail = goal, shortfall, binding, detail
        limits = f"; binding: {', '.join(binding)}" if binding else ""
        super().__init__(f"goal {goal!r} is out of reach by {shortfall:.4g} m{limits}{'; ' + detail if detail else ''}")


class GoalError(VgtError):
    """Goal rows, by their names, cannot all hold in any posture.

    `residual` is their residual at the best compromise, m or rad; zero if there are more rows than inputs.
    """

    def __init__(self, rows: tuple[str, ...], residual: float, detail: str) -> None:
        self.rows, self.residual = rows, residual
        super().__init__(f"{detail}; rows: {', '.join(rows)}")


class ObjectiveError(VgtError):
    """An objective is not finite at a count of configurations."""

    def __init__(self, objective: str, count: int, detail: str) -> None:
        self.objective, self.count = objective, count
        super().__init__(f"objective {objective!r} is not finite at {count} configurations: {detail}")


class PathError(VgtError):
    """No collision-free path between two configurations was found.

    `leg` is the goal at the end of the leg, `clearance` the least clearance of the best path, m, `place` the obstacle there.
    """

    def __init__(self, leg: str, clearance: float, place: str) -> None:
        self.leg, self.clearance, self.place = leg, clearance, place
        super().__init__(f"no clear path to {leg!r}: the best candidate comes to {clearance:.3f} m of {place}")


class FollowError(VgtError):
    """The tool leaves its path between two goals, however close they are: the posture jumps there.

    `deviation` is the greatest distance of the tool from the path, m, or of its direction, rad; `goals` is the number of
    goals solved on the piece.
    """

    def __init__(self, piece: str, deviation: float, tolerance: float, goals: int) -> None:
        self.piece, self.deviation, self.tolerance, self.goals = piece, deviation, tolerance, goals
        message = f"{piece}: between {goals} goals the tool is off by {deviation:.3g}; allowed {tolerance:.3g}"
        super().__init__(message)


class TrussError(VgtError):
    """A truss is a mechanism or over-constrained: the rank of its equilibrium matrix, the members that take part, the defect."""

    def __init__(self, rank: int, members: tuple[str, ...], detail: str) -> None:
        self.rank, self.members, self.detail = rank, members, detail
        super().__init__(f"{detail} (rank {rank}; members: {', '.join(members[:6]) or 'none'})")


class NearSingularWarning(UserWarning):
    """A truss or pose is sound, but so near a singular one that results have few digits; the figure is in the message."""


class UnusualWarning(UserWarning):
    """A figure in a file is possible but unusual; the message names file, key, figure and usual range."""


class DivergenceError(VgtError):
    """The simulated state stopped being physical at a time, s.

    `row` is the worst constraint row, `value` its violation, and `log` the `RunLog` until then, or None.
    """

    def __init__(self, time: float, row: str, value: float, log: object = None) -> None:
        self.time, self.row, self.value, self.log = time, row, value, log
        super().__init__(f"diverged at t = {time:.3f} s: worst row {row}, violation {value:.3g}")


class MissingLibraryError(VgtError):
    """A system library, or a display, that an optional output needs is not there.

    `package` is the command that installs it; where nothing can be installed, `remedy` says what else helps.
    """

    def __init__(self, library: str, package: str, remedy: str = "") -> None:
        self.needed, self.package = library, package
        super().__init__(f"{library} is missing; {remedy or f'install it with: {package}'}")


class ClusterError(VgtError):
    """Workers cannot serve: the address of their cluster, and the reason; what they have finished is kept."""

    def __init__(self, place: str, reason: str) -> None:
        self.place, self.reason = place, reason
        super().__init__(f"cluster {place}: {reason}")


class PageError(VgtError):
    """The server of a page cannot begin, or has ended: its address, and the reason."""

    def __init__(self, place: str, reason: str) -> None:
        self.place, self.reason = place, reason
        super().__init__(f"{place}: {reason}")


class CommandError(VgtError):
    """A plant was given a value that it cannot take."""

    def __init__(self, what: str, found: str, allowed: str) -> None:
        self.what, self.found, self.allowed = what, found, allowed
        super().__init__(f"{what}: found {found}; allowed: {allowed}")


class StoppedError(VgtError):
    """A plant that has stopped for good, or that was never reset, was told to go on."""

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"the plant cannot go on: {reason}")
