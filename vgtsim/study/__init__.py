"""Many runs: the cases of a study on all cores or a cluster, each done once, with a table at the end."""

from vgtsim.study.conduct import Result, conduct_study
from vgtsim.study.engines import Engine, count_cores, spread_out, use_cluster, use_processes

__all__ = ["Engine", "Result", "conduct_study", "count_cores", "spread_out", "use_cluster", "use_processes"]
