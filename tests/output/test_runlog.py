"""Logs that are damaged, or of something else: one error that says what, and never a verdict of passed."""

from __future__ import annotations

import dataclasses
import tracemalloc

import numpy as np
import pyarrow as pa
import pytest
from pyarrow import parquet
from synthetic_run import make_log, make_scene

from vgtsim.errors import DescriptionError
from vgtsim.log import ARRAYS, chunks, open_log, save_log, stretches
from vgtsim.site import Site
from vgtsim.verification import verify


@pytest.fixture(scope="module")
def scene():
    return make_scene()


@pytest.fixture(scope="module")
def log(scene):
    return make_log(scene, records=30, duration=15.0)


@pytest.fixture
def folder(scene, log, tmp_path):
    save_log(tmp_path / "log", scene, log)
    return tmp_path / "log"


def read(folder):
    book = open_log(folder)
    return book.read(0, book.count)


def rewrite(folder, change):
    """Write the first chunk again with another table."""
    file = folder / "000000.parquet"
    parquet.write_table(change(parquet.read_table(file)), file, use_dictionary=False, compression="zstd")


def test_others_read_it_with_two_lines(folder, log):
    table = parquet.read_table(folder)
    np.testing.assert_array_equal(table["nodes"].combine_chunks().to_numpy_ndarray(), log.nodes)


def test_damaged_file_is_named(folder):
    """A byte turned over in every part of the file, one at a time: refused, or without meaning, as in a writer's name."""
    good, file, said = read(folder), folder / "000000.parquet", 0
    whole = file.read_bytes()
    for place in np.random.default_rng(2).integers(0, len(whole), 60).tolist():
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        try:
            found = read(folder)
        except DescriptionError as error:
            said += "000000.parquet" in str(error)
        else:
            for name in ARRAYS:
                np.testing.assert_array_equal(getattr(found, name), getattr(good, name))
    assert said > 50


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda t: t.drop_columns("nodes"), "nodes: found nothing"),
        (lambda t: t.set_column(0, "time", t["settled"]), "time: found bool; allowed: float64 in 1 dimensions"),
        (lambda t: t.append_column("extra", t["time"]), "extra: found an unknown quantity"),
        (lambda t: t.append_column("time", t["time"]), "time: found 2 columns of that name; allowed: one"),
        (lambda t: t.replace_schema_metadata({"contacts": "[" * 100000}), "contacts: found"),
        (lambda t: t.replace_schema_metadata({"contacts": "[[1]]"}), "contacts: found"),
    ],
)
def test_a_chunk_that_is_not_a_logs_is_named(folder, change, said):
    rewrite(folder, change)
    with pytest.raises(DescriptionError, match=rf"000000\.parquet: {said}"):
        read(folder)


def test_arrays_of_absurd_size_are_refused_before_memory_is_taken(folder, monkeypatch):
    """A small file that asks for a hundred times its size, which is taken for absurd here."""
    monkeypatch.setattr(chunks, "_MOST_BYTES", 1 << 22)

    def blow_up(table):
        count, row = 4000, (100, 2)
        storage = pa.FixedSizeListArray.from_arrays(pa.array(np.zeros(count * 200)), 200)
        nodes = pa.ExtensionArray.from_storage(pa.fixed_shape_tensor(pa.float64(), row), storage)
        taken = table.take(pa.array(np.zeros(count, int)))
        return taken.set_column(table.schema.get_field_index("nodes"), "nodes", nodes)

    rewrite(folder, blow_up)
    assert (folder / "000000.parquet").stat().st_size < 1 << 18
    tracemalloc.start()
    before = pa.total_allocated_bytes()
    with pytest.raises(DescriptionError, match=r"4000 records, \d+ bytes; allowed: at most .* bytes in a chunk"):
        open_log(folder)
    assert tracemalloc.get_traced_memory()[1] < 1e6
    assert pa.total_allocated_bytes() - before < 1e6
    tracemalloc.stop()


def test_links_out_of_the_folder_are_not_followed(folder, tmp_path):
    for name in ("000000.parquet", "_end.json"):
        (folder / name).rename(tmp_path / name)
        (folder / name).symlink_to(tmp_path / name)
        with pytest.raises(DescriptionError, match=name):
            open_log(folder)
        (folder / name).unlink()
        (tmp_path / name).rename(folder / name)
    read(folder)


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("_begin.json", "[]", "file: found list"),
        ("_begin.json", "{", "file: found Expecting"),
        ("_begin.json", "[" * 100000, "file: found"),
        ("_begin.json", '{"scene": 1' + "0" * 5000 + "}", "file: found Exceeds the limit"),
        ("_begin.json", '{"scene": {}, "versions": {}, "digests": {}}', "scene in the log: found 'task'"),
        ("_begin.json", '{"scene": {}, "versions": {}, "digests": {}, "more": 1}', "more: found an unknown entry"),
        ("_end.json", "{}", "records: found nothing"),
        (
            "_end.json",
            '{"records": 1, "warnings": [], "performance": {}, "stopped": ""}',
            "performance.simulated_s: found",
        ),
        ("_end.json", '{"records": 1, "warnings": [3], "performance": {}, "stopped": ""}', "0: found 3"),
    ],
)
def test_texts_that_are_not_a_logs_are_named(folder, name, text, said):
    (folder / name).write_text(text)
    with pytest.raises(DescriptionError, match=rf"{name}: {said}"):
        open_log(folder)


def test_a_log_that_lacks_chunks_says_so(scene, tmp_path):
    log, site = make_log(scene, records=330, duration=165.0), Site(scene)
    save_log(tmp_path, scene, log)
    assert [file.name for file in sorted(tmp_path.glob("0*"))] == [f"{i:06d}.parquet" for i in range(4)]
    (tmp_path / "000003.parquet").unlink()
    assert "the log holds 300 records" in open_log(tmp_path).stopped
    assert "the run made 330" in open_log(tmp_path).stopped
    (tmp_path / "000001.parquet").unlink()
    assert "evenly spaced ones" in verify(site, open_log(tmp_path)).checks[0].detail
    (tmp_path / "_end.json").unlink()
    assert "the run never ended" in open_log(tmp_path).stopped


def test_a_chunk_that_was_being_written_is_passed_over(folder, log):
    """What a kill leaves beside the chunks."""
    (folder / ".000001.123.partial.parquet").write_bytes(b"PAR1")
    np.testing.assert_array_equal(read(folder).nodes, log.nodes)
    assert parquet.read_table(folder).num_rows == log.count


def test_stretches_of_a_log_give_what_the_whole_gives(scene, tmp_path, monkeypatch):
    """In memory at once, and from disk in stretches of some fifty records."""
    log, site = make_log(scene, records=330, duration=165.0), Site(scene)
    whole = verify(site, log)
    save_log(tmp_path, scene, log)
    monkeypatch.setattr(stretches, "_LENGTH", 50)
    parts = verify(site, open_log(tmp_path))
    for one, other in zip(whole.checks, parts.checks, strict=True):
        assert other.measured == pytest.approx(one.measured, rel=1e-6, abs=1e-12, nan_ok=True), one
        assert (other.where, other.when) == pytest.approx((one.where, one.when), nan_ok=True)
    for name, series in whole.series.items():
        np.testing.assert_allclose(parts.series[name], series, rtol=1e-9, atol=1e-12)
    monkeypatch.setattr(stretches, "_OVERVIEW", 50)
    few = verify(site, open_log(tmp_path))
    np.testing.assert_array_equal(few.series["closure"], parts.series["closure"][::7])
    np.testing.assert_array_equal(stretches.thin(open_log(tmp_path)).nodes, log.nodes[::7])


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
