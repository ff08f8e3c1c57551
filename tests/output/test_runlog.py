"""Logs that are damaged, or of something else: one error that says what, and never a verdict of passed."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from synthetic_run import make_log, make_scene

from vgtsim.errors import DescriptionError
from vgtsim.runlog import load_run, save_run
from vgtsim.site import Site
from vgtsim.verification import verify


@pytest.fixture(scope="module")
def scene():
    return make_scene()


@pytest.fixture(scope="module")
def log(scene):
    return make_log(scene, records=30, duration=15.0)


def test_damaged_file_is_named(scene, log, tmp_path):
    """A byte turned over in every part of the file, one at a time."""
    save_run(tmp_path / "run.npz", scene, log)
    whole = (tmp_path / "run.npz").read_bytes()
    said = []
    for place in np.random.default_rng(2).integers(0, len(whole), 60).tolist():
        (tmp_path / "bad.npz").write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            load_run(tmp_path / "bad.npz")
        except DescriptionError as error:
            said.append(str(error))
    assert len(said) > 30
    assert all("bad.npz" in words for words in said)
    np.save(tmp_path / "array.npy", np.zeros(3))
    with pytest.raises(DescriptionError, match=r"array\.npy"):
        load_run(tmp_path / "array.npy")


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("nodes", None, "nodes: found nothing"),
        ("nodes", np.zeros((30, 3)), "nodes: found float64 in 2 dimensions; allowed: floats in 3"),
        ("time", np.array(["now"]), "time: found <U3 in 1 dimensions; allowed: floats in 1"),
        ("extra", np.zeros(3), "extra: found an unknown array"),
        ("meta", np.array("[]"), "meta: found list"),
        ("meta", np.array("{}"), r"meta\.warnings: found nothing"),
        ("scene", np.array("{}"), "scene in the log: found 'task'"),
    ],
)
def test_what_is_not_a_logs_is_named(scene, log, tmp_path, name, value, said):
    file = tmp_path / "run.npz"
    save_run(file, scene, log)
    with np.load(file) as data:
        fields = {key: data[key] for key in data.files if key != name}
    np.savez(file, **fields, **({} if value is None else {name: value}))
    with pytest.raises(DescriptionError, match=rf"run\.npz: {said}"):
        load_run(file)


def test_figure_of_the_run_that_is_no_number_is_named(scene, log, tmp_path):
    file = tmp_path / "run.npz"
    save_run(file, scene, log)
    with np.load(file) as data:
        fields = dict(data)
    meta = json.loads(str(fields.pop("meta")))
    meta["performance"]["real_time_factor"] = "fast"
    np.savez(file, **fields, meta=np.array(json.dumps(meta)))
    with pytest.raises(DescriptionError, match=r"meta\.performance\.real_time_factor: found fast; allowed: a number"):
        load_run(file)


@pytest.mark.parametrize(
    ("name", "change", "said"),
    [
        ("nodes", lambda x: x[:, :-3], "nodes has shape"),
        ("member_force", lambda x: x[:, :-1], "member_force has shape"),
        ("actual", lambda x: x[:, :-1], "actual has shape"),
        ("settled", lambda x: x[:0], "settled has 0 records, time has 30"),
        ("goal", lambda x: x + 9, "are in the log; allowed: -1 to"),
    ],
)
def test_log_of_another_arm_or_tour_fails_every_check(scene, log, name, change, said):
    report = verify(Site(scene), dataclasses.replace(log, **{name: change(getattr(log, name))}))
    assert not any(check.passed for check in report.checks)
    assert said in report.checks[0].detail
