"""Ways to spoil a text file: hostile figures, sizes and signs, lost and doubled lines, odd bytes, no plain file at all."""

from __future__ import annotations

import os
import random
import re
from pathlib import Path

LITERAL = re.compile(r'"[^"\n]*"|(?<![\w"])-?\d[\d.e+-]*')
SIGN = re.compile(r" = |(?<=\"): ")  # of TOML and of JSON; a line of a record has none
HOSTILE = (
    *(
        "0",
        "-1",
        "1",
        "nan",
        "inf",
        "-inf",
        "1e-300",
        "5e-324",
        "1e300",
        "1e200",
        "1e9",
        "1e-9",
        "1e17",
        "true",
        "[]",
        "{}",
    ),
    *(
        "9" * 400,
        "9" * 5000,
        "0x" + "f" * 5000,
        "1979-05-27",
        '"9**9**9 kg"',
        '"1 kg**9**9"',
        '"' + "m" * 100_000 + '"',
    ),
    *(
        '"0 m"',
        '"-1 m"',
        '"1e200 m"',
        '"1e-300 m"',
        '"75e9 ft"',
        '"1e9 kg"',
        '"1e-9 kg/m**3"',
        '"1e-6 s"',
        '"5e-324 s"',
    ),
    *(
        '"1e-300 1/s"',
        '"1e300 Pa"',
        '"1,5 m"',
        '"\u22121 m"',
        '"3 1/2 in"',
        '"1 m\\u0000"',
        '"../../../etc/passwd"',
        '"/dev/zero"',
    ),
    *('"\\u0000"', '"[/]"', '"-->"', '"$x^{$"', '"<script>"', '"\\u001b[31m"', '""', '"none"', '"steel"', "[1, 2]"),
    *('["1 m", "1 m", "1 m"]', "[" * 2000 + "]" * 2000, '"1 in"', '"1 deg"', '"89.999 deg"', '"180 deg"'),
)
LINES = (
    "[",
    "[[modules]]",
    "[materials.steel]",
    "[value]",
    'base = "scene.toml"',
    "\x00",
    "provenance = 1",
    "x" * 100_000,
)


def mutate(file: Path, rng: random.Random) -> str:
    """Change a file, and say how."""
    if not file.is_file() or file.is_symlink() or rng.random() < 0.04:
        return replace_file(file, rng)
    if rng.random() < 0.1:
        return mutate_bytes(file, rng)
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return mutate_bytes(file, rng)
    entries = [i for i, line in enumerate(lines) if SIGN.search(line) and not line.startswith("#")]
    entries = entries or [*range(max(len(lines), 1))]
    place = rng.choice(entries)
    old = lines[place] if lines else ""
    choice = rng.random()
    if choice < 0.72:
        new = _mutate_value(old, rng)
    elif choice < 0.78:
        new = ""
    elif choice < 0.82:
        new = f"{old}\n{old}"
    elif choice < 0.88:
        name, sign, value = _split(old)
        new = (
            rng.choice((name[:-1], f"{name}.{name}", f'"{name}\\u0000"', ".".join(["a"] * 3000), "value"))
            + sign
            + value
        )
    elif choice < 0.94:
        new = lines[rng.choice(entries)] if lines else ""
    else:
        new = rng.choice(LINES)
    lines[place : place + 1] = [new]
    file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return f"{cut(old)} -> {cut(new)}"


def _mutate_value(line: str, rng: random.Random) -> str:
    """Put another value in the place of one in a line: a hostile one, or the same number with another size or sign."""
    name, sign, value = _split(line)
    found = list(LITERAL.finditer(value))
    if not found:
        return f"{name}{sign}{rng.choice(HOSTILE)}"
    item = found[0] if name and rng.random() < 0.85 else rng.choice(found[:2] if name else found)
    number = re.search(r"-?\d[\d.]*(?:e-?\d+)?", item[0])
    if number and rng.random() < 0.75:
        far = 10 ** rng.uniform(-14, 14)
        factor = rng.choice((-1.0, 0.0, 0.5, 0.8, 0.9, 0.97, 0.99, 1.01, 1.03, 1.1, 1.3, 2.0, 0.2, 5.0, far, far))
        new = item[0].replace(number[0], repr(float(number[0].rstrip(".")) * factor), 1)
    else:
        new = rng.choice(HOSTILE)
    value = value[: item.start()] + new + value[item.end() :]
    if rng.random() < 0.8:
        value = re.sub(
            r", range = \[[^\]]*\]", "", value
        )  # it would refuse most figures before anything else sees them
    return name + sign + value


def _split(line: str) -> tuple[str, str, str]:
    """Name, sign and value of a line of TOML or JSON; a line of a record is all value."""
    sign = SIGN.search(line)
    return (line[: sign.start()], sign[0], line[sign.end() :]) if sign else ("", "", line)


def mutate_bytes(file: Path, rng: random.Random) -> str:
    content, place = bytearray(file.read_bytes()), 0
    kind = rng.choice(("bom", "utf-16", "latin-1", "flip", "insert", "cut", "nothing"))
    if content:
        place = rng.randrange(len(content))
    if kind == "bom":
        content[:0] = b"\xef\xbb\xbf"
    elif kind == "utf-16":
        content = bytearray(bytes(content).decode("latin-1").encode("utf-16"))
    elif kind == "latin-1":
        content[place:place] = b"\xe9"
    elif kind == "flip" and content:
        content[place] ^= 1 << rng.randrange(8)
    elif kind == "insert":
        content[place:place] = rng.randbytes(8)
    elif kind == "cut":
        del content[place:]
    else:
        content.clear()
    file.write_bytes(content)
    return f"bytes: {kind} at {place}"


def replace_file(file: Path, rng: random.Random) -> str:
    kind = rng.choice(("pipe", "folder", "loop", "zero", "large", "gone", "chain", "itself"))
    if file.is_file() or file.is_symlink():
        file.unlink()
    elif file.exists():
        return "left as it is"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "folder":
        file.mkdir()
    elif kind == "loop":
        file.symlink_to(file.name)
    elif kind == "zero":
        file.symlink_to("/dev/zero")
    elif kind == "large":
        file.write_text("x = 1\n" * 400_000)
    elif kind == "chain":
        for i in range(1500):
            (file.parent / f"base{i}.toml").write_text(f'base = "base{i + 1}.toml"\n')
        file.write_text('base = "base0.toml"\n')
    elif kind == "itself":
        file.write_text(f'base = "{file.name}"\n')
    return f"the file is {kind}"


def cut(text: str) -> str:
    return repr(text if len(text) < 120 else f"{text[:100]}... ({len(text)})")
