"""What a run leaves, and what it leaves when it cannot."""

import numpy as np
import pytest

from vgtsim.errors import DescriptionError
from vgtsim.output.write import prepare_folder, write_outputs
from vgtsim.replacing import replacing
from vgtsim.runlog import load_run


@pytest.mark.long
def test_reports_and_log_are_written_and_nothing_else(site, log, report, tmp_path):
    assert write_outputs(site, log, report, tmp_path / "a" / "b") is None
    assert sorted(file.name for file in (tmp_path / "a" / "b").iterdir()) == [
        "report.html",
        "report.json",
        "run.npz",
    ]
    _, read = load_run(tmp_path / "a" / "b" / "run.npz")
    np.testing.assert_array_equal(read.nodes, log.nodes)


def test_a_folder_that_cannot_be_made_is_named(site, log, report, tmp_path):
    (tmp_path / "file").write_text("", encoding="utf-8")
    folder = tmp_path / "file" / "out"
    for attempt in (lambda: prepare_folder(folder), lambda: write_outputs(site, log, report, folder)):
        with pytest.raises(DescriptionError) as caught:
            attempt()
        assert str(folder) in str(caught.value)


def test_a_failed_block_leaves_nothing(tmp_path):
    def fail_half_way():
        with replacing(tmp_path / "file.txt") as partial:
            partial.write_text("half", encoding="utf-8")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail_half_way()
    assert list(tmp_path.iterdir()) == []


def test_a_partial_file_keeps_its_suffix(tmp_path):
    with replacing(tmp_path / "run.npz") as partial:
        assert partial.suffix == ".npz"
        assert partial.parent == tmp_path
        partial.write_bytes(b"")
