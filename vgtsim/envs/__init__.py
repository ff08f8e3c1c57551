"""Gymnasium environments of the arms: reach a goal, rake over a patch, enter the tank.

Importing this room registers the ids; `docs/learning.md` has rewards, and what is exact in each tier. Gymnasium is the extra
`env`.
"""

from __future__ import annotations

from vgtsim.errors import MissingLibraryError

try:
    import gymnasium
except ImportError:
    raise MissingLibraryError("gymnasium", "pip install 'vgtsim[env]'") from None

from vgtsim.envs.arm_env import ArmEnv
from vgtsim.envs.baseline import steer
from vgtsim.envs.tasks import Entrance, Raster, Reach

__all__ = ["IDS", "ArmEnv", "Entrance", "Raster", "Reach", "steer"]

_SCENES = {"arm9": "arm9_nullspace", "arm15": "type_ii_reach"}
_STEPS = {"Reach": 200, "Raster": 400, "Insertion": 2000}  # half seconds after which an episode is cut
IDS = tuple(f"vgtsim/{task}-{arm}-v0" for task in _STEPS for arm in _SCENES)

for _id in IDS:
    _task, _arm, _ = _id.removeprefix("vgtsim/").split("-")
    gymnasium.register(
        id=_id,
        entry_point="vgtsim.envs.arm_env:ArmEnv",
        max_episode_steps=_STEPS[_task],
        kwargs={"task": _task.lower(), "scene": _SCENES[_arm]},
    )
