"""Poses as people write them: some modules by actuator lengths, some by canonical inputs, the others straight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vgtsim.description import closest
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.mixed_inputs import MixedInputs, Share, mix_inputs
from vgtsim.units import to_si

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # m: of a stroke's end that was converted from inches
_SAME = 1e-6  # m: between the nodes of one pose by its inputs and by its lengths


def read_pose(chain: Chain, lengths: Sequence[str], inputs: Sequence[str]) -> Array:
    """Canonical inputs, shape (n,), of modules given by name; those that are not named stay straight.

    Args:
        lengths: `MODULE=l1,l2,...`: actuator lengths, bare numbers in m or quantities such as `36 in`.
        inputs: `MODULE=x1,...`: canonical inputs, see `chain`; bare numbers in m and rad or quantities.

    Raises:
        DescriptionError: A name, a number of inputs, a unit, inputs that no pose has, a length outside its stroke, or
            a pose that the arm cannot come to from its straight one.
        AssemblyError: The lengths do not assemble, or inputs ask other lengths of static longerons.
    """
    written = {"--lengths": _split(lengths, "--lengths"), "--inputs": _split(inputs, "--inputs")}
    for name in written["--inputs"]:
        if name not in chain.layout.names:
            raise DescriptionError(None, "--inputs", repr(name), f"an active module{closest(name, chain.layout.names)}")
        if name in written["--lengths"]:
            raise DescriptionError(None, f"--inputs {name}", "lengths too", "one or the other")
    mixed = mix_inputs(chain, written["--lengths"])
    y = mixed.from_canonical(chain.straight)
    low, high = chain.stroke
    units = {name: place.modules.units for place in chain.layout.places for name in place.modules.names}
    for share in mixed.shares:
        option = "--lengths" if share.conventional else "--inputs"
        if share.name not in written[option]:
            continue
        unit = ("m",) * len(share.actuators) if share.conventional else units[share.name]
        y[share.own] = _numbers(written[option][share.name], unit, f"{option} {share.name}")
        if share.conventional:
            _require_stroke(share, y[share.own], low[share.actuators], high[share.actuators])
    q = mixed.canonical(y)
    _require_pose(mixed, q)
    return q


def _split(entries: Sequence[str], option: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for entry in entries:
        name, sign, values = entry.partition("=")
        if not sign or name in found:
            raise DescriptionError(None, option, repr(entry), "MODULE=VALUE,VALUE,... once for each module")
        found[name] = values.split(",")
    return found


def _numbers(texts: list[str], units: tuple[str, ...], key: str) -> list[float]:
    if len(texts) != len(units):
        raise DescriptionError(None, key, f"{len(texts)} values", f"{len(units)}, in {', '.join(units)}")
    values = []
    for text, unit in zip(texts, units, strict=True):
        try:
            values.append(to_si(text, unit, bare=True))
        except ValueError as error:
            raise DescriptionError(None, key, repr(text), str(error)) from None
    return values


def _require_stroke(share: Share, lengths: Array, low: Array, high: Array) -> None:
    beyond = np.maximum(low - lengths, lengths - high)
    if beyond.max() > _ROUNDING:
        leg = int(np.argmax(beyond))
        allowed = f"{low[leg]:.4g} to {high[leg]:.4g} m, the stroke of its actuator {leg + 1}"
        option = "--lengths" if share.conventional else "--inputs"
        raise DescriptionError(None, f"{option} {share.name}", f"{lengths[leg]:.4g} m", allowed)


def _require_pose(mixed: MixedInputs, q: Array) -> None:
    """Refuse inputs that are no pose, are outside the strokes, or are on another assembly mode than the straight pose."""
    chain = mixed.chain
    low, high = chain.stroke
    for share in mixed.shares:
        key, pose = f"--inputs {share.name}", np.array(chain.straight)
        pose[share.inputs] = q[share.inputs]
        try:
            lengths = chain.lengths(pose)
        except ValueError as error:
            raise DescriptionError(None, key, f"inputs that {share.name} cannot have", str(error)) from None
        _require_stroke(share, lengths[share.actuators], low[share.actuators], high[share.actuators])
        away = np.abs(chain.nodes(pose) - chain.nodes(chain.inputs_from_lengths(lengths))).max()
        if away > _SAME:
            allowed = f"the assembly that {share.name} comes to from its straight pose with these lengths"
            raise DescriptionError(
                None, key, f"one of another assembly mode, its nodes up to {away:.3g} m off", allowed
            )
