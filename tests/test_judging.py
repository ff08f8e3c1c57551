"""The verb `verify` judges by the scene's file, and says so; the log says what it was made of."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from vgtsim import cli
from vgtsim.errors import DescriptionError
from vgtsim.log import open_log, save_log
from vgtsim.plant import Plant
from vgtsim.site import Site, load_site
from vgtsim.verification import verify

pytestmark = pytest.mark.long

GAP = 5e-3  # m


@pytest.fixture(scope="module")
def loosened():
    """The nine-actuator arm with limits that let a gap of a centimetre pass, and its log of some steps at rest."""
    scene = load_site("arm9_nullspace").scene
    limits = scene.task.limits.model_copy(update={"closure": 0.01})
    site = Site(replace(scene, task=scene.task.model_copy(update={"limits": limits})))
    plant = Plant(site)
    plant.reset()
    plant.step(100)
    return site, plant.log


def closure(report):
    return next(check for check in report["checks"] if check["name"] == "closure")


def test_loosened_limits_in_a_log_do_not_let_a_gap_pass(loosened, tmp_path):
    site, log = loosened
    ends = np.array(log.ends)
    ends[5, 0, 1] += [GAP, 0, 0]
    save_log(tmp_path / "log", site.scene, replace(log, ends=ends))
    result = CliRunner().invoke(cli.app, ["verify", str(tmp_path), "--no-plan"], env={"COLUMNS": "200"})
    assert result.exit_code == 1
    assert "limits changed since the run" in result.output
    assert "limits.closure: 0.01 in the log, 1e-0" in result.output
    report = json.loads((tmp_path / "report.json").read_text())
    assert "limits.closure" in report["notes"][0]
    assert "limits.closure" in (tmp_path / "report.html").read_text()
    assert closure(report)["measured"] == pytest.approx(GAP, rel=1e-3)
    assert not closure(report)["passed"]
    assert closure(verify(site, replace(log, ends=ends)).to_dict())["passed"]  # by the log's own limits it would


def test_copy_of_the_scene_that_was_edited_in_the_log_is_refused(loosened, tmp_path):
    site, log = loosened
    save_log(tmp_path, site.scene, log)
    begin = tmp_path / "_begin.json"
    begin.write_text(begin.read_text().replace('"safety_factor": 1.67', '"safety_factor": 1.0'))
    with pytest.raises(DescriptionError, match="changed after the run"):
        open_log(tmp_path)


def test_log_says_what_it_was_made_of(loosened):
    site, log = loosened
    assert set(log.digests) == {"description", "code"}
    assert verify(site, log).notes == ()
    strange = replace(log, digests=dict.fromkeys(log.digests, "0" * 64))
    description, code = verify(site, strange).notes
    assert "the description is not that of the run" in description
    assert "the code is not that of the run" in code
