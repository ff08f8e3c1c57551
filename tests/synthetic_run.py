"""A run that nobody simulated: exact kinematics, static member forces, made-up small errors. Seeded."""

from pathlib import Path

import numpy as np
import pytest

import vgtsim.output.html_report
from vgtsim.description import Scene, load_manipulator, load_tank
from vgtsim.description.scene import SceneFile
from vgtsim.kinematics import Chain, hanging_mount
from vgtsim.log import RunLog
from vgtsim.verification.report import Check, Report

ROOT = Path(__file__).parents[1]
GRAVITY = 9.81
PAYLOAD_MASS = 453.6


def make_scene() -> Scene:
    """The shipped arm and tank with four goals on the poses that `poses` visits."""
    manipulator = load_manipulator(ROOT / "models/arm15/arm15.toml")
    tank = load_tank(ROOT / "scenes/tanks/type_ii.toml")
    chain = Chain(manipulator, hanging_mount(tank.shell.crown - 1.75))
    position, direction = chain.tool(poses(chain)[1:])
    names = ("wall_north", "low", "high_west", "across")
    goals = [
        {"name": name, "position": list(point), "direction": list(normal)}
        for name, point, normal in zip(names, position, direction, strict=True)
    ]
    task = {
        "name": "synthetic",
        "title": "Synthetic tour of four goals & a <sanity> check",
        "manipulator": "../models/arm15/arm15.toml",
        "tank": "tanks/type_ii.toml",
        "mast": {"pivot_depth": 1.75, "outer_diameter": 0.6, "wall": 0.02, "density": 7850.0},
        "payload": {"mass": PAYLOAD_MASS, "radius": 0.25},
        "motion": {
            "start": [{} for _ in manipulator.active],
            "rate_fraction": 0.8,
            "acceleration": 0.1,
            "stroke_margin": 0.01,
            "clearance": 0.05,
            "settle_speed": 1e-4,
            "hold": 1.0,
            "patience": 10.0,
            "goals": goals,
        },
        "simulation": {"timestep": 0.005, "log_rate": 10.0, "gravity": GRAVITY, "weight_scale": 1e-5},
        "limits": {
            "closure": 1e-6,
            "kinematics_agreement": 1e-5,
            "tracking_position": 1e-3,
            "tracking_angle": np.deg2rad(0.1),
            "end_moment": 1e-6,
            "excess_shear": 1e-2,
            "axial_force_settled": 1e-6,
            "axial_force_moving": 1e-2,
            "member_utilisation": 1.0,
            "actuator_force": 1.0,
            "actuator_stroke": 0.005,
            "clearance": 0.02,
            "contacts": 0,
            "safety_factor": 1.67,
        },
        "video": {"cuts": [{"camera": "overview", "until": "8 s"}, {"camera": "cutaway"}]},
    }
    return Scene(SceneFile.model_validate(task), manipulator, tank, ROOT / "scenes/synthetic.toml")


def poses(chain: Chain) -> np.ndarray:
    """Inputs of the start and of four poses that stay inside the tank, shape (5, n)."""
    bends = np.array(
        [
            [30, 10, 35, 20, -5],
            [-20, -30, -44, 15, -10],
            [-35, 0, -30, -40, 40],
            [-15, -44, -30, -44, -35],
            [-20, -30, -25, -25, 44],
        ]
    )
    azimuth = np.deg2rad([350, 110, 60, 350, 160])
    q = np.broadcast_to(chain.straight, (5, chain.straight.size)).copy()
    tilt = np.deg2rad(bends) / 2  # the mid-plane leans half the bend
    q[:, ::3] = np.sin(tilt) * np.cos(azimuth)[:, None]
    q[:, 1::3] = np.sin(tilt) * np.sin(azimuth)[:, None]
    return q


def make_chain(scene: Scene) -> Chain:
    """The arm on its mast."""
    return Chain(scene.manipulator, hanging_mount(scene.pivot_height))


def make_log(scene: Scene, records: int = 240, duration: float = 120.0) -> RunLog:
    """Move and hold in turn through the poses; forces are those of rest."""
    chain, rng = make_chain(scene), np.random.default_rng(7)
    truss = chain.truss
    time = np.linspace(0.0, duration, records)
    stations = poses(chain)
    legs = len(stations) - 1
    leg = np.minimum((time / duration * legs).astype(int), legs - 1)
    part = np.clip((time / duration * legs - leg) / 0.85, 0, 1)
    blend = (10 * part**3 - 15 * part**4 + 6 * part**5)[:, None]
    q = (1 - blend) * stations[leg] + blend * stations[leg + 1]
    nodes = chain.nodes(q)
    lengths = chain.lengths(q)
    tool, normal = chain.tool(q)
    axial = static_forces(truss, nodes)
    span = nodes[:, truss.ends[:, 1]] - nodes[:, truss.ends[:, 0]]
    direction = span / np.linalg.norm(span, axis=-1, keepdims=True)
    ends = nodes[:, truss.ends] + 2e-8 * rng.standard_normal((records, len(truss.members), 2, 3))
    reaction = np.zeros((records, 6))
    reaction[:, 2] = GRAVITY * (1400.0 + PAYLOAD_MASS)
    reaction[:, 3:] = np.cross(tool - chain.mount[:3, 3], [0.0, 0.0, reaction[0, 2] / 2])
    wall = 14.0
    return RunLog(
        time=time,
        nodes=nodes,
        ends=ends,
        commanded=lengths,
        actual=lengths + 1e-7 * rng.standard_normal(lengths.shape),
        rates=np.gradient(lengths, time, axis=0),
        member_force=axial[..., None] * direction,
        member_moment=1e-9 * rng.standard_normal((*axial.shape, 3)),
        actuator_force=axial[:, truss.actuated],
        mast_reaction=reaction,
        tool_position=tool,
        tool_direction=normal,
        goal=leg.astype(np.int64),
        settled=part >= 1,
        contact_time=np.zeros(0),
        contact_pair=np.zeros((0, 2), dtype="U64"),
        contact_distance=np.zeros(0),
        warnings=(),
        performance={
            "simulated_s": duration,
            "wall_s": wall,
            "real_time_factor": duration / wall,
            "steps": duration / 0.005,
            "nv": 555.0,
        },
        versions={"vgtsim": "0.1.0", "mujoco": "3.17.0", "numpy": np.__version__},
    )


def static_forces(truss, nodes: np.ndarray) -> np.ndarray:
    """Axial forces of a pin-jointed truss under hub weights and the payload, shape (T, M), N."""
    bars = np.concatenate([truss.ends, truss.tip_edges])
    span = nodes[:, bars[:, 1]] - nodes[:, bars[:, 0]]
    unit = span / np.linalg.norm(span, axis=-1, keepdims=True)
    T, N = nodes.shape[:2]
    A = np.zeros((T, N, 3, len(bars)))
    index = np.arange(len(bars))
    A[:, bars[:, 0], :, index] += np.swapaxes(unit, 0, 1)
    A[:, bars[:, 1], :, index] -= np.swapaxes(unit, 0, 1)
    load = np.zeros((N, 3))
    load[:, 2] = -GRAVITY * 30.0
    load[truss.tip, 2] -= GRAVITY * PAYLOAD_MASS / 3
    force = np.linalg.solve(
        A[:, 3:].reshape(T, -1, len(bars)), np.broadcast_to(-load[3:].reshape(-1, 1), (T, len(bars), 1))
    )
    return force[:, : len(truss.members), 0]


def make_report(scene: Scene, log: RunLog) -> Report:
    """One row or two for each check, all passed, with series for every plot."""
    truss, rng = make_chain(scene).truss, np.random.default_rng(8)
    axial = log.axial(truss.ends)
    wanted = np.array([goal.position for goal in scene.task.motion.goals])[log.goal]
    limits = scene.task.limits
    utilisation = np.abs(axial) / 4.5e5
    gap = np.linalg.norm(log.ends - log.nodes[:, truss.ends], axis=-1).max(axis=(1, 2))
    clearance = 0.35 + 0.3 * np.sin(log.time[::4] / 9.0)
    error = np.linalg.norm(log.tool_position - wanted, axis=-1) + 2e-5 * rng.random(len(log.time))
    rows = (
        ("record", "record from its instant", 2e-12, limits.record_time, "s"),
        ("closure", "gap between a member's end and its hub", gap.max(), limits.closure, "m"),
        ("kinematics_agreement", "node from forward kinematics", 3.2e-6, limits.kinematics_agreement, "m"),
        ("tracking", "tool from a settled goal", error[log.settled].max(), limits.tracking_position, "m"),
        ("tracking", "tool direction from a settled goal", 2e-5, limits.tracking_angle, "rad"),
        ("axial_purity", "moment at a member's end", 4e-9, limits.end_moment, "N·m"),
        ("axial_purity", "shear beyond weight and inertia", 2e-6, limits.excess_shear, "N"),
        ("axial_force", "error at rest over the largest force", 4e-10, limits.axial_force_settled, "1"),
        ("axial_force", "error in motion over the largest force", 3e-3, limits.axial_force_moving, "1"),
        ("actuator_stroke", "distance to the end of a stroke", 0.0312, limits.actuator_stroke, "m"),
        ("actuator_speed", "speed over rated speed", 0.43, limits.actuator_speed, "1"),
        ("actuator_force", "demand over capacity", 0.71, limits.actuator_force, "1"),
        ("member_utilisation", "demand over capacity", utilisation.max(), limits.member_utilisation, "1"),
        ("clearance", "least distance to anything", clearance.min(), limits.clearance, "m"),
        ("contacts", "logged contacts", 0.0, limits.contacts, "contacts"),
    )
    least = ("actuator_stroke", "clearance")
    checks = tuple(
        Check(
            name=name,
            quantity=quantity,
            measured=float(measured),
            limit=float(limit),
            unit=unit,
            sense="at least" if name in least else "at most",
            where="m1/actuator/2",
            when=23.5,
            source=f"scene limits.{name}",
        )
        for name, quantity, measured, limit, unit in rows
    )
    series = {
        "closure": gap,
        "tool_position_error": error,
        "tool_angle_error": 1e-4 + error / 10,
        "utilisation": utilisation,
        "utilisation_tension": np.where(axial > 0, utilisation, 0.0),
        "utilisation_compression": np.where(axial < 0, utilisation, 0.0),
        "clearance_time": log.time[::4],
        "clearance": clearance,
    }
    return Report(scene.task.name, checks, log.performance, log.versions, series)


def leave_out_plots(patch: pytest.MonkeyPatch) -> None:
    """Leave out the plots of a report, which take nine tenths of its time."""
    lacking = {"lacking": ["time"], "title": "", "caption": ""}
    patch.setattr(vgtsim.output.html_report, "_draw", lambda plot, _: {"name": plot.name} | lacking)
