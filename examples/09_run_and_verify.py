"""All stages: load a scene, plan it, run it in MuJoCo, verify the log without MuJoCo, write report and log."""

import json
from pathlib import Path

import vgtsim

TASK = """
base = "arm9_nullspace"
name = "one_goal"
[motion]
hold = "0.5 s"
goals = [{ name = "heel", position = ["-6.76 m", "-1.81 m", "0.95 m"], direction = [-0.889, -0.238, -0.391] }]
"""
(folder := Path("out/09")).mkdir(parents=True, exist_ok=True)
(folder / "task.toml").write_text(TASK)

site = vgtsim.load(folder / "task.toml")
plan = vgtsim.plan(site)
log = vgtsim.run(site, plan)
report = vgtsim.verify(site, log)
vgtsim.write(site, log, report, folder)

print(f"{report.scene}: {'passed' if report.passed else 'failed'}, {log.time[-1]:.1f} s simulated")
for check in report.checks:
    sign = "<=" if check.sense == "at most" else ">="
    print(f"  {check.name}: {check.quantity} {check.measured:.2g} {sign} {check.limit:.2g} {check.unit}, {check.where}")
written = json.loads((folder / "report.json").read_text())
print(f"checks passed: {sum(check.passed for check in report.checks)}, expected {len(written['checks'])}")
print(*sorted(folder.iterdir()), sep="\n")
