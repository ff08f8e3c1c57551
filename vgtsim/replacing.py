"""Files that appear whole or not at all, whatever ends program or machine, and folders in which one program works at a time."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vgtsim.errors import DescriptionError


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Give a temporary path with the same suffix beside a file, and move it there when the block ends well.

    The content is on the disk before the name is, so that a loss of power leaves the old file or the new one. The temporary
    file is removed when the block raises.

    Raises:
        OSError: The folder does not exist or cannot be written.
    """
    final = Path(path)
    partial = final.with_name(f".{final.stem}.{os.getpid()}.partial{final.suffix}")
    try:
        yield partial
        flush_to_disk(partial)
        os.replace(partial, final)
        flush_to_disk(final.parent)
    finally:
        partial.unlink(missing_ok=True)


def flush_to_disk(path: Path) -> None:
    """Wait until the content of a file, or the names in a folder, are on the disk; an `OSError` where it is full or broken."""
    if os.name == "nt":  # it flushes no file that is open for reading alone, and no folder
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):  # a file system that has nothing to wait for
            raise
    finally:
        os.close(handle)


@contextmanager
def lock_folder(folder: Path, what: str) -> Iterator[None]:
    """Keep others out of a folder while the block runs, where the system can; the system opens it however the block ends.

    Raises:
        DescriptionError: Another program holds the folder; it does a `what`.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DescriptionError(folder, "", f"a {what} at work", f"one {what} at a time in a folder") from None
        except OSError:  # a file system without locks
            pass
        yield
    finally:
        os.close(handle)
