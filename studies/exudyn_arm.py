"""The arm in Exudyn: rigid parts and point masses, joined by distance constraints whose lengths are prescribed.

Settings, each the best of what was tried on the reference arm: the sparse solver (the dense one takes 1.4 times as long) and
modified Newton (full: 1.4 to 2 times), one thread, a fixed step, index 3. A tolerance looser than the usual 1e-8 saves less
than a fifth and opens the loops. Rigid parts have Euler parameters, as quick as three angles and never singular.
"""

from __future__ import annotations

import importlib
import importlib.util
import time
from typing import Any

import numpy as np

from studies.peer_arms import take_apart
from studies.peer_task import Played, Task

INSTALLED = importlib.util.find_spec("exudyn") is not None


def play_exudyn(task: Task, step: float, *, sections: bool, damping: float) -> Played:
    """The task at a step, s; a spectral radius of generalized alpha of `damping`, 1 for none, 0 for the most.

    The lengths of each step are set by a function in Python, which takes some hundredths of the time.
    """
    exudyn: Any = importlib.import_module("exudyn")
    tools: Any = importlib.import_module("exudyn.utilities")
    parts, truss, model = take_apart(task, sections=sections), task.site.truss, task.site.load_model
    system, gravity, place = exudyn.SystemContainer().AddSystem(), model.gravity.tolist(), {}
    ground = system.CreateGround(show=False)
    for node in parts.fixed:
        place[node] = (ground, parts.start[node].tolist())
    for node in parts.free:
        mass, where = float(model.hub_mass[node]), parts.start[node].tolist()
        body = system.CreateMassPoint(referencePosition=where, mass=mass, gravity=gravity, show=False)
        place[node] = (body, [0.0, 0.0, 0.0])
    for part in parts.bodies:
        body = system.CreateRigidBody(
            referencePosition=part.centre.tolist(),
            inertia=tools.RigidBodyInertia(part.mass, part.inertia),
            gravity=gravity,
            nodeType=exudyn.NodeType.RotationEulerParameters,
            show=False,
        )
        place |= {node: (body, (parts.start[node] - part.centre).tolist()) for node in part.nodes}
    rows = {}
    for member, length in zip(parts.rows, truss.lengths(parts.start)[parts.rows].tolist(), strict=True):
        (near, here), (far, there) = (place[node] for node in truss.ends[member])
        rows[member] = system.CreateDistanceConstraint(
            bodyNumbers=[near, far], localPosition0=here, localPosition1=there, distance=length, show=False
        )
    of, kept = exudyn.OutputVariableType, {"storeInternal": True}
    places = [
        system.AddSensor(tools.SensorBody(bodyNumber=body, localPosition=at, outputVariableType=of.Position, **kept))
        for body, at in (place[node] for node in range(len(place)))
    ]
    forces = {
        member: system.AddSensor(tools.SensorObject(objectNumber=row, outputVariableType=of.Force, **kept))
        for member, row in rows.items()
    }
    instants = task.instants(step)
    lengths, driven = task.lengths(instants).tolist(), [rows[member] for member in truss.actuated]

    def prescribe(mbs: Any, now: float) -> bool:
        for row, length in zip(driven, lengths[round(now / step)], strict=True):
            mbs.SetObjectParameter(row, "distance", length)
        return True

    system.Assemble()
    system.SetPreStepUserFunction(prescribe)
    settings = _choose(exudyn, task, step, damping)
    begin = time.process_time()
    system.SolveDynamic(settings)
    spent = time.process_time() - begin
    clock = system.GetSensorStoredData(places[0])[:, 0]
    axial = np.full((len(clock), len(truss.ends)), np.nan)
    for member, sensor in forces.items():
        axial[:, member] = system.GetSensorStoredData(sensor)[:, 1]
    nodes = np.stack([system.GetSensorStoredData(sensor)[:, 1:] for sensor in places], axis=1)
    return Played(clock, nodes, axial, spent, len(instants) - 1)


def _choose(exudyn: Any, task: Task, step: float, damping: float) -> Any:
    """Settings of the solver."""
    settings, count = exudyn.SimulationSettings(), len(task.instants(step)) - 1
    marching = settings.timeIntegration
    marching.numberOfSteps, marching.endTime = count, count * step
    marching.adaptiveStep = False
    marching.generalizedAlpha.spectralRadius = damping
    marching.newton.useModifiedNewton = True
    settings.linearSolver.solverType = exudyn.LinearSolverType.EigenSparse
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1 / task.rate
    settings.parallel.numberOfThreads = 1
    return settings
