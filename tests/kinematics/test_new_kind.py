"""A kind of module that only this test knows: no file asks for it by name."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from vgtsim.description import load_manipulator
from vgtsim.description.modules import KIND_NAMES
from vgtsim.errors import SingularityError
from vgtsim.kinematics import Chain, hanging_mount, sample_inputs
from vgtsim.kinematics.modules import KINDS, Kind, ModuleSet, PlannedMember

MODELS = Path(__file__).parents[2] / "models"
STEP, DIFFERENCE = 1e-6, 1e-8  # central differences: step² plus rounding over the step, with a margin


def fill_lifts(x, figures, straight, marks, frame, motion, length, slope, inner, inner_slope):
    """Plain Python does as well as a compiled function."""
    marks[..., 0] = marks[..., 1] = marks[..., 2] = np.isfinite(x[..., 0])
    marks[..., 3] = x[..., 0] > 0
    if frame.size:
        frame[..., :3], frame[..., 3] = np.eye(3), x * [0.0, 0.0, 1.0]
    if motion.size:
        motion[:] = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]
    if length.size:
        length[:], slope[:] = x, 1.0


@dataclass(frozen=True, eq=False)
class Lifts(ModuleSet):
    """The top rises straight above the base; the input is its height, which is the length of the one actuator."""

    inputs = 1
    units = ("m",)
    fill = staticmethod(fill_lifts)

    @property
    def figures(self):
        return np.empty((len(self.names), 0))

    def refuse(self, x):
        return ValueError(f"heights {x}")

    def attempt(self, lengths, start=None):
        return lengths, np.ones(lengths.shape[:-1])

    def tell_end(self, lengths, start, part):
        return SingularityError(self.names[0], 0.0, f"{self.names[0]}/actuator/1", 0.0, part)

    def conditioned(self, x):
        return np.ones((*x.shape, 1))

    def bend(self, angle, half):
        return np.broadcast_to(self.straight, (*angle.shape, 1))


def make_lifts(modules, side):
    return Lifts(tuple(module.name for module in modules), np.array([[module.straight] for module in modules]))


def plan_lift(module, groups):
    return [PlannedMember("actuator", module.cylinder, groups["base"][0], groups["top"][0], 1)]


@pytest.fixture
def chain(monkeypatch):
    """The arm of nine inputs on a lift."""
    monkeypatch.setitem(KINDS, "lift", Kind(plan_lift, make_set=make_lifts))
    arm = load_manipulator(MODELS / "arm9/arm9.toml")
    first = arm.modules[0]
    lift = SimpleNamespace(
        kind="lift",
        name="lift",
        cylinder=first.cylinder,
        batten_tube=first.batten_tube,
        offset=0.0,
        straight=float(np.mean([arm.cylinders[first.cylinder].retracted, arm.cylinders[first.cylinder].extended])),
        faces=lambda side: ((side,) * 3, (side,) * 3),
    )
    return Chain(arm.model_copy(update={"modules": (lift, *arm.modules)}), hanging_mount(9.0))


def test_each_described_kind_has_its_kinematics():
    assert set(KINDS) == set(KIND_NAMES)


def test_a_chain_takes_a_new_kind(chain):
    q = sample_inputs(chain, 4, seed=2)
    assert q.shape == (4, 10)
    assert chain.layout.names[0] == "lift"
    assert chain.truss.member_names[0] == "lift/actuator/1"
    plain = Chain(load_manipulator(MODELS / "arm9/arm9.toml"), chain.mount)
    drop = q[:, :1] * chain.mount[:3, 2]
    assert np.allclose(chain.tool(q)[0], plain.tool(q[:, 1:])[0] + drop, rtol=0, atol=1e-12)
    assert np.allclose(chain.inputs_from_lengths(chain.lengths(q)), q, rtol=0, atol=1e-10)
    assert chain.state(q).assembles.all()


def test_its_derivatives_are_those_of_differences(chain):
    q = sample_inputs(chain, 1, seed=3)[0]
    steps = STEP * np.eye(len(q))
    rise = (chain.tool(q + steps)[0] - chain.tool(q - steps)[0]).T / (2 * STEP)
    assert np.allclose(chain.jacobian(q)[:3], rise, rtol=0, atol=DIFFERENCE)
    moved = (chain.nodes(q + steps) - chain.nodes(q - steps)) / (2 * STEP)
    assert np.allclose(chain.node_jacobian(q)[1], np.moveaxis(moved, 0, -1), rtol=0, atol=DIFFERENCE)
