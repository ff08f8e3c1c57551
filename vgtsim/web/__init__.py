"""Pages for a browser: the tank with the arm in it, coloured by force, and a recorded run as one file.

`Display` draws a site in a viser server and shows one `Sight` after the other. A `Session` is an arm that a person drives:
its loop in this process, its page in another. Viser is the extra `live`.
"""

from __future__ import annotations

from vgtsim.errors import MissingLibraryError

try:
    import viser  # noqa: F401
except ImportError:
    raise MissingLibraryError("viser", "pip install 'vgtsim[live]'") from None

from vgtsim.web.recording import write_recording
from vgtsim.web.session import Session

__all__ = ["Session", "write_recording"]
