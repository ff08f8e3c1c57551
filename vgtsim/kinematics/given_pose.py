"""Poses as people write them: some modules by actuator lengths, some by canonical inputs, the others straight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vgtsim.description.schema import closest
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.kinematics.mixed_inputs import Share, mix_inputs
from vgtsim.units import to_si

Array = NDArray[np.float64]

_UNITS = {1: ("rad",), 3: ("dimensionless", "dimensionless", "m"), 6: ("m", "m", "m", "rad", "rad", "rad")}
_ROUNDING = 1e-9  # m: of a stroke's end that was converted from inches


def read_pose(chain: Chain, lengths: Sequence[str], inputs: Sequence[str]) -> Array:
    """Pose of modules given by name; those that are not named stay straight.

    Args:
        chain: The arm.
        lengths: `MODULE=l1,l2,...`: actuator lengths, bare numbers in m or quantities such as `36 in`.
        inputs: `MODULE=x1,...`: canonical inputs, see `chain`; bare numbers in m and rad or quantities.

    Returns:
        Canonical inputs, shape (*q).

    Raises:
        DescriptionError: A name, a number of inputs, a unit, or a length outside its stroke.
        AssemblyError: The lengths do not assemble.
    """
    written = {"--lengths": _split(lengths, "--lengths"), "--inputs": _split(inputs, "--inputs")}
    for name in written["--inputs"]:
        if name not in chain.layout.names:
            raise DescriptionError(None, "--inputs", repr(name), f"an active module{closest(name, chain.layout.names)}")
        if name in written["--lengths"]:
            raise DescriptionError(None, f"--inputs {name}", "lengths too", "one or the other")
    mixed = mix_inputs(chain, written["--lengths"])
    y = mixed.from_canonical(chain.straight)
    low, high = chain.stroke.reshape(2, -1)
    for share in mixed.shares:
        option = "--lengths" if share.conventional else "--inputs"
        if share.name not in written[option]:
            continue
        units = ("m",) * len(share.actuators) if share.conventional else _UNITS[len(share.inputs)]
        y[share.own] = _numbers(written[option][share.name], units, f"{option} {share.name}")
        if share.conventional:
            _require_stroke(share, y[share.own], low[share.actuators], high[share.actuators])
    return mixed.canonical(y)


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
            bare = float(text)
        except ValueError:
            bare = text
        try:
            values.append(to_si(bare, unit))
        except ValueError as error:
            raise DescriptionError(None, key, repr(text), str(error)) from None
    return values


def _require_stroke(share: Share, lengths: Array, low: Array, high: Array) -> None:
    beyond = np.maximum(low - lengths, lengths - high)
    if beyond.max() > _ROUNDING:
        leg = int(np.argmax(beyond))
        allowed = f"{low[leg]:.4g} to {high[leg]:.4g} m, the stroke of its actuator {leg + 1}"
        raise DescriptionError(None, f"--lengths {share.name}", f"{lengths[leg]:.4g} m", allowed)
