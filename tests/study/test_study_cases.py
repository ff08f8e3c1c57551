"""From the file of a study to its cases, and from a case to its scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from vgtsim.description import change_entries, list_shipped, load_scene, load_study, locate
from vgtsim.errors import DescriptionError
from vgtsim.study.cases import join_scene, plan_study, split_scene

OUT = Path("out")
MASS, MARGIN = "scene.payload.mass", "scene.motion.stroke_margin"
PLAN = 'name = "p"\nscene = "arm9_nullspace"\nwork.verb = "plan"\n'


def entries(study):
    return [case.entries for case in plan_study(study, OUT)[1]]


def test_a_grid_is_every_combination_and_the_last_key_is_fastest(make_study):
    study = make_study(
        f"[grid]\n{MASS} = {{ least = '0 kg', greatest = '2 t', count = 3 }}\n{MARGIN} = ['1 mm', 0.002]"
    )
    assert entries(study) == [(mass, margin) for mass in (0.0, 1000.0, 2000.0) for margin in ("1 mm", 0.002)]


@pytest.mark.parametrize("method", ["uniform", "latin_hypercube", "sobol"])
def test_a_sample_is_seeded_and_even(method, make_study):
    text = f"""[sample]\nmethod = "{method}"\ncount = 48\nseed = %d
    [sample.over]\n{MASS} = {{ least = "100 kg", greatest = "0.5 t" }}\n{MARGIN} = ["1 mm", "2 mm", "3 mm"]"""
    first, again, other = (entries(make_study(text % seed)) for seed in (1, 1, 2))
    assert first == again != other
    mass, margins = zip(*first, strict=True)
    assert 100 <= min(mass) < 150 < 450 < max(mass) <= 500
    assert set(margins) == {"1 mm", "2 mm", "3 mm"}
    counts = np.histogram(mass, bins=8, range=(100, 500))[0]
    if method == "latin_hypercube":
        assert set(counts) == {6}  # 48 strata of equal width, eight bins
    if method == "sobol":
        longer = entries(make_study(text.replace("48", "64") % 1))
        assert longer[:48] == first  # so a longer sample does none of these again
        assert set(np.histogram([case[0] for case in longer], bins=8, range=(100, 500))[0]) == {8}


def test_a_list_is_in_its_order_and_bare_keys_are_as_good_as_quoted_ones(make_study):
    study = make_study(f'[[cases]]\n"{MASS}" = 1\n"work.seed" = 5\n[[cases]]\nwork.seed = 3\nscene.payload.mass = 2')
    order, cases = plan_study(study, OUT)
    assert [order.list_keys(case) for case in cases] == [{MASS: 1.0, "work.seed": 5.0}, {MASS: 2.0, "work.seed": 3.0}]


def test_quantities_stand_in_the_table_in_si_and_a_mixed_column_as_text(make_study):
    text = '[[cases]]\nscene.payload.mass = "1 t"\narm.title = "a"\n[[cases]]\nscene.payload.mass = 2\narm.title = 1'
    order, cases = plan_study(make_study(text), OUT)
    assert [tuple(order.list_keys(case).values()) for case in cases] == [(1000.0, "a"), (2.0, "1")]


def test_a_digest_is_that_of_all_that_a_row_follows_from(make_study):
    def digests(text, head=PLAN):
        return [case.digest for case in plan_study(make_study(text, head), OUT)[1]]

    base = digests(f"[grid]\n{MASS} = [1, 2]")
    assert len({*base}) == 2
    assert digests(f"[grid]\n{MASS} = [2, 3, 1]")[::2] == base[::-1]
    assert digests(f"[[cases]]\n{MASS} = 1") == base[:1]
    assert not {*digests(f"[grid]\n{MASS} = [1, 2]", PLAN.replace("arm9_nullspace", "hydraulic_drives"))} & {*base}
    assert not {*digests(f"[grid]\n{MASS} = [1, 2]", PLAN + 'keep = ["duration"]\n')} & {*base}


def test_changed_entries_are_those_of_the_scene_as_if_written_there():
    scene = load_scene("arm9_nullspace")
    parts = split_scene(scene, scene.task)
    changes = {
        "scene.payload.mass": "1 t",
        "scene.motion.goals.mid.position.2": "2 m",
        "scene.simulation.members": "elastic",
        "arm.tubes.t300x250.wall": "0.3 in",
        "tank.waste.level": 0.2,
    }
    changed = change_entries(parts, {locate(parts, key, None): value for key, value in changes.items()}, None)
    made = join_scene(scene, changed)
    assert made.task.payload.mass == 1000.0
    assert [goal.position[2] for goal in made.task.motion.goals] == [0.95, 2.0, 3.9, 1.4]
    assert made.task.simulation.members == "elastic"
    assert made.manipulator.tubes["t300x250"].wall == pytest.approx(0.00762)
    assert made.tank.waste.level == 0.2
    assert "payload.mass" not in made.task.provenance
    assert made.task.provenance.keys() < scene.task.provenance.keys()
    assert made.manipulator.modules == scene.manipulator.modules


BAD = {
    "unknown key": (f"{PLAN}[grid]\nscene.payload.mas = [1, 2]", r"scene\.payload\.mas.*did you mean 'mass'"),
    "unknown part": (f"{PLAN}[grid]\nscenes.payload.mass = [1, 2]", "did you mean 'scene'"),
    "unknown goal": (f"{PLAN}[grid]\nscene.motion.goals.mit.name = ['a']", "did you mean 'mid'"),
    "index beyond the list": (f"{PLAN}[grid]\nscene.motion.goals.4.name = ['a']", r"goals\.4.*found '4'"),
    "whole description": (f"{PLAN}[[cases]]\nscene = 'arm15'", "found a whole description.*such as scene.name"),
    "another arm": (f"{PLAN}[grid]\nscene.manipulator = ['arm15']", "found 'manipulator'"),
    "wrong unit": (f"{PLAN}[grid]\n{MASS} = ['1 m', '2 m']", r"payload\.mass: found '1 m'.*dimension"),
    "wrong unit of a span": (f"{PLAN}[grid]\n{MASS} = {{least = '1 m', greatest = '2 m', count = 3}}", "found '1 m'"),
    "units that differ": (f"{PLAN}[grid]\n{MASS} = {{least = 1, greatest = '2 t', count = 3}}", "of one dimension"),
    "no such choice": (f"{PLAN}[grid]\nscene.simulation.drive = ['stiff']", "found 'stiff'.*rigid"),
    "one entry within another": (
        f"{PLAN}[[cases]]\n'scene.motion.goals' = []\n'scene.motion.goals.0.name' = 'a'",
        "twice",
    ),
    "span without a count": (f"{PLAN}[grid]\n{MASS} = {{least = 1, greatest = 2}}", "a span of a grid has a count"),
    "no cases": (PLAN, r"one of \[grid\], \[sample\] and \[\[cases\]\], not none"),
    "two kinds of cases": (f"{PLAN}[grid]\n{MASS} = [1]\n[[cases]]\n{MASS} = 1", "not grid and cases"),
    "cases of different keys": (f"{PLAN}[[cases]]\n{MASS} = 1\n[[cases]]\n{MARGIN} = 1", r"cases\.1"),
    "sample without a seed": (f"{PLAN}sample = {{method = 'sobol', count = 3, over = {{a = [1]}}}}", r"sample\.seed"),
    "unknown verb": (PLAN.replace('"plan"', '"plann"') + f"[grid]\n{MASS} = [1]", r"work.*plann"),
    "unknown figure": (f"{PLAN}keep = ['duratio']\n[grid]\n{MASS} = [1]", r"keep\.0.*did you mean 'duration, s'"),
    "setting of another verb": (f"{PLAN}work.seed = 1\n[grid]\n{MASS} = [1]", "unknown key 'seed'"),
    "too many": (
        f"{PLAN}[grid]\n{MASS} = {{least=1, greatest=2, count=9999}}\n{MARGIN} = {{least=0, greatest=1, count=9999}}",
        "found 99980001 cases",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_named_before_any_case_is_done(name, tmp_path):
    text, said = BAD[name]
    file = tmp_path / "bad.toml"
    file.write_text(text)
    with pytest.raises(DescriptionError, match=said) as raised:
        plan_study(load_study(file), OUT)
    assert "bad.toml" in str(raised.value)


def test_the_study_of_the_page_is_one(tmp_path):
    page = (Path(__file__).parents[2] / "docs/studies.md").read_text(encoding="utf-8")
    (tmp_path / "page.toml").write_text(page.split("```toml\n")[1].split("```")[0])
    assert len(entries(load_study(tmp_path / "page.toml"))) == 20


def test_shipped_studies_are_found_by_name_and_have_cases():
    for name in list_shipped("study"):
        assert entries(load_study(name))
