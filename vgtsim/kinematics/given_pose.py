"""Poses as people write them: some modules by actuator lengths, some by canonical inputs, the others straight."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import numpy as np

from vgtsim.arrays import Array, Index
from vgtsim.description import closest
from vgtsim.errors import DescriptionError
from vgtsim.kinematics.chain import Chain
from vgtsim.units import to_si

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
    names = chain.layout.names
    by_length, by_input = _split(lengths, "--lengths", names), _split(inputs, "--inputs", names)
    for name in by_input.keys() & by_length.keys():
        raise DescriptionError(None, f"--inputs {name}", "lengths too", "one or the other")
    legs = chain.lengths(chain.straight)
    for name, own, _ in _modules(chain):
        if name in by_length:
            legs[own] = _numbers(by_length[name], ("m",) * len(own), f"--lengths {name}")
            _require_stroke(f"--lengths {name}", chain, own, legs)
    q = chain.inputs_from_lengths(legs)
    for (name, _, columns), (place, _) in zip(_modules(chain), chain.seats, strict=True):
        if name in by_input:
            q[columns] = _numbers(by_input[name], place.modules.units, f"--inputs {name}")
    _require_pose(chain, q, by_length)
    return q


def _modules(chain: Chain) -> Iterator[tuple[str, Index, Index]]:
    """Name, actuators among the chain's, in the order of its legs, and inputs of each active module."""
    for name, (place, m) in zip(chain.layout.names, chain.seats, strict=True):
        yield name, place.lengths[m][place.modules.actuated[m]], place.columns[m]


def _split(entries: Sequence[str], option: str, names: tuple[str, ...]) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for entry in entries:
        name, sign, values = entry.partition("=")
        if not sign or name in found:
            raise DescriptionError(None, option, repr(entry), "MODULE=VALUE,VALUE,... once for each module")
        if name not in names:
            raise DescriptionError(None, option, repr(name), f"an active module{closest(name, names)}")
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


def _require_stroke(key: str, chain: Chain, own: Index, legs: Array) -> None:
    low, high = chain.stroke[:, own]
    beyond = np.maximum(low - legs[own], legs[own] - high)
    if beyond.max() > _ROUNDING:
        leg = int(np.argmax(beyond))
        allowed = f"{low[leg]:.4g} to {high[leg]:.4g} m, the stroke of its actuator {leg + 1}"
        raise DescriptionError(None, key, f"{legs[own][leg]:.4g} m", allowed)


def _require_pose(chain: Chain, q: Array, by_length: Collection[str]) -> None:
    """Refuse inputs that are no pose, are outside the strokes, or are on another assembly mode than the straight pose."""
    for name, own, columns in _modules(chain):
        key, pose = f"--inputs {name}", np.array(chain.straight)
        pose[columns] = q[columns]
        try:
            legs = chain.lengths(pose)
        except ValueError as error:
            raise DescriptionError(None, key, f"inputs that {name} cannot have", str(error)) from None
        _require_stroke(f"--lengths {name}" if name in by_length else key, chain, own, legs)
        away = np.abs(chain.nodes(pose) - chain.nodes(chain.inputs_from_lengths(legs))).max()
        if away > _SAME:
            found = f"one of another assembly mode, its nodes up to {away:.3g} m off"
            allowed = f"the assembly that {name} comes to from its straight pose with these lengths"
            raise DescriptionError(None, key, found, allowed)
