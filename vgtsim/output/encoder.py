"""The H.264 encoder."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vgtsim.errors import MissingLibraryError

_SETTINGS = ["-preset", "veryfast", "-movflags", "+faststart"]
_QUALITY = 6  # of ten; constant rate factor 20


@contextmanager
def open_film(path: Path, width: int, height: int, fps: int) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    """Open an MP4 file for frames.

    Args:
        width: Even, pixels.
        height: Even, pixels.
        fps: Frames a second.

    Yields:
        A function that appends a frame, shape (height, width, 3).

    Raises:
        MissingLibraryError: There is no encoder.
        OSError: The encoder stopped.
    """
    try:
        import imageio_ffmpeg

        imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError):
        raise MissingLibraryError("the ffmpeg encoder", "pip install imageio[ffmpeg]") from None
    pipe = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        fps=fps,
        codec="libx264",
        pix_fmt_out="yuv420p",
        macro_block_size=2,
        quality=_QUALITY,
        ffmpeg_log_level="error",
        output_params=_SETTINGS,
    )
    pipe.send(None)
    try:
        yield lambda frame: pipe.send(np.ascontiguousarray(frame))
    finally:
        pipe.close()
