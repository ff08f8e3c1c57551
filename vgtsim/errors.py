"""The errors of the project: one tree, each carrying its evidence."""

from __future__ import annotations

from pathlib import Path


class VgtError(Exception):
    """Root of every error this project raises on purpose."""


class DescriptionError(VgtError):
    """A file that describes an arm, tank or scene is wrong.

    Attributes:
        file: The file that was read, or None when the data did not come from a file.
        key: Dotted path of the offending entry.
        found: The entry; empty if `allowed` says it all.
        allowed: Possible entries.
    """

    def __init__(self, file: Path | None, key: str, found: str, allowed: str) -> None:
        self.file, self.key, self.found, self.allowed = file, key, found, allowed
        place = f"{file}: " if file else ""
        message = f"found {found}; allowed: {allowed}" if found else allowed
        super().__init__(f"{place}{key or 'file'}: {message}")


class AssemblyError(VgtError):
    """Given lengths do not close a module.

    Attributes:
        module: Name or index of the module.
        residual: Greatest gap left in the loop equations, m.
    """

    def __init__(self, module: str, residual: float, detail: str = "") -> None:
        self.module, self.residual = module, residual
        super().__init__(f"{module} does not assemble: residual {residual:.3g} m{'; ' + detail if detail else ''}")


class SingularPoseError(AssemblyError):
    """A module stands in a singular pose: its lengths do not say how it moves.

    Attributes:
        value: Smallest sine between one column of its Jacobian and the span of the others, a pure number.
        bound: What it must be at least.
    """

    def __init__(self, module: str, value: float, bound: float) -> None:
        super().__init__(module, 0.0)
        self.value, self.bound = value, bound
        self.args = (
            f"{module} is singular: smallest sine between columns of its Jacobian {value:.2g}, allowed {bound:.0e}",
        )


class SingularityError(AssemblyError):
    """Given lengths lie behind a singularity; the module may be on another assembly mode there.

    Attributes:
        value: Smallest singular value at the end of the way, a pure number.
        member: The member with the largest part in it.
        reached: Fraction of the way covered.
    """

    def __init__(self, module: str, value: float, member: str, residual: float, reached: float) -> None:
        detail = f"smallest singular value {value:.2g}, {member}; {reached:.3f} of the way covered"
        super().__init__(module, residual, f"a singularity lies between, {detail}")
        self.value, self.member, self.reached = value, member, reached


class ReachError(VgtError):
    """A tool goal cannot be met.

    Attributes:
        goal: Name of the goal.
        shortfall: Distance between the goal and the nearest tool position, m.
        binding: Names of the limits that stop the arm.
        detail: Further words.
    """

    def __init__(self, goal: str, shortfall: float, binding: tuple[str, ...] = (), detail: str = "") -> None:
        self.goal, self.shortfall, self.binding, self.detail = goal, shortfall, binding, detail
        limits = f"; binding: {', '.join(binding)}" if binding else ""
        super().__init__(f"goal {goal!r} is out of reach by {shortfall:.4g} m{limits}{'; ' + detail if detail else ''}")


class GoalError(VgtError):
    """Goal rows cannot all hold in any posture.

    Attributes:
        rows: Names of these rows.
        residual: Their residual at the best compromise, m or rad; zero if there are more rows than inputs.
    """

    def __init__(self, rows: tuple[str, ...], residual: float, detail: str) -> None:
        self.rows, self.residual = rows, residual
        super().__init__(f"{detail}; rows: {', '.join(rows)}")


class ObjectiveError(VgtError):
    """An objective is not finite.

    Attributes:
        objective: Its name.
        count: Number of configurations at which it is not.
    """

    def __init__(self, objective: str, count: int, detail: str) -> None:
        self.objective, self.count = objective, count
        super().__init__(f"objective {objective!r} is not finite at {count} configurations: {detail}")


class PathError(VgtError):
    """No collision-free path between two configurations was found.

    Attributes:
        leg: Name of the goal at the end of the leg.
        clearance: Least clearance of the best candidate path, m.
        place: Name of the obstacle there.
    """

    def __init__(self, leg: str, clearance: float, place: str) -> None:
        self.leg, self.clearance, self.place = leg, clearance, place
        super().__init__(f"no clear path to {leg!r}: the best candidate comes to {clearance:.3f} m of {place}")


class RateError(VgtError):
    """A path of goals needs more of an actuator than it can do between two goals.

    Attributes:
        point: Index of the second of these goals.
        motion: Needed change of the actuator's length, m, at the best posture.
        limit: Allowed change, m.
    """

    def __init__(self, point: int, motion: float, limit: float) -> None:
        self.point, self.motion, self.limit = point, motion, limit
        super().__init__(f"to point {point} an actuator would move {motion:.4g} m; allowed {limit:.4g} m")


class FollowError(VgtError):
    """The tool leaves its path between two goals, however close they are: the posture jumps there.

    Attributes:
        piece: Name of the piece.
        deviation: Greatest distance of the tool from the path, m, or of its direction, rad.
        tolerance: Allowed deviation.
        goals: Number of goals solved on the piece.
    """

    def __init__(self, piece: str, deviation: float, tolerance: float, goals: int) -> None:
        self.piece, self.deviation, self.tolerance, self.goals = piece, deviation, tolerance, goals
        message = f"{piece}: between {goals} goals the tool is off by {deviation:.3g}; allowed {tolerance:.3g}"
        super().__init__(message)


class TrussError(VgtError):
    """A truss is a mechanism or over-constrained.

    Attributes:
        rank: Rank of the equilibrium matrix.
        members: Names of the members that take part.
        detail: The defect, in words.
    """

    def __init__(self, rank: int, members: tuple[str, ...], detail: str) -> None:
        self.rank, self.members, self.detail = rank, members, detail
        super().__init__(f"{detail} (rank {rank}; members: {', '.join(members[:6]) or 'none'})")


class NearSingularWarning(UserWarning):
    """A truss or pose is sound, but so near a singular one that results have few digits; the figure is in the message."""


class DivergenceError(VgtError):
    """The simulated state stopped being physical.

    Attributes:
        time: Simulated time, s.
        row: Name of the worst constraint row.
        value: Its violation.
        log: Records until then, a `RunLog`, or None.
    """

    def __init__(self, time: float, row: str, value: float, log: object = None) -> None:
        self.time, self.row, self.value, self.log = time, row, value, log
        super().__init__(f"diverged at t = {time:.3f} s: worst row {row}, violation {value:.3g}")


class MissingLibraryError(VgtError):
    """A system library that an optional output needs is not installed.

    Attributes:
        needed: The library.
        package: The package that brings it.
    """

    def __init__(self, library: str, package: str) -> None:
        self.needed, self.package = library, package
        super().__init__(f"{library} is missing; install it with: {package}")


class CommandError(VgtError):
    """A plant was told something that it cannot take.

    Attributes:
        what: What was told.
        found: What it was.
        allowed: What it may be.
    """

    def __init__(self, what: str, found: str, allowed: str) -> None:
        self.what, self.found, self.allowed = what, found, allowed
        super().__init__(f"{what}: found {found}; allowed: {allowed}")


class StoppedError(VgtError):
    """A plant was told to go on that has stopped for good, or that was never reset.

    Attributes:
        reason: Why it cannot go on.
    """

    def __init__(self, reason: str) -> None:
        self.reason = reason
        super().__init__(f"the plant cannot go on: {reason}")
