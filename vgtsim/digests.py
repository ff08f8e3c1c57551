"""Digests, by which a log says what it was made of."""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path


def digest(*parts: bytes) -> str:
    """SHA-256 of some bytes in their order, in hexadecimal digits."""
    return hashlib.sha256(b"".join(parts)).hexdigest()


@lru_cache(maxsize=1)
def digest_code() -> str:
    """Digest of the code of this package: two states of one version differ."""
    root = Path(__file__).parent
    files = sorted(root.rglob("*.py"))
    return digest(*(part for file in files for part in (file.relative_to(root).as_posix().encode(), file.read_bytes())))
