#!/usr/bin/env -S uv run --script
# /// script
# dependencies = ["nox>=2025.2", "uv"]
# ///
"""Tasks of a developer that need an environment of their own: `nox` runs all, `nox -s lowest` one, `nox -l` lists them."""

from __future__ import annotations

import filecmp
import os
from pathlib import Path

import nox

nox.needs_version = ">=2025.2"
nox.options.default_venv_backend = "uv"
nox.options.reuse_existing_virtualenvs = True

for setting in ("UV_SYSTEM_CERTS", "UV_NATIVE_TLS"):  # of new and old versions: certificates as pip takes them
    os.environ.setdefault(setting, "1")

PROJECT = nox.project.load_toml("pyproject.toml")
PYTHONS = nox.project.python_versions(PROJECT)
TESTING = nox.project.dependency_groups(PROJECT, "test")
PINNED = ("--constraint", "scripts/constraints.txt")
QUICK = ("-m", "not slow and not long")
ENVIRONMENT = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}


def run_tests(session: nox.Session, *chosen: str) -> None:
    """Run the quick tests, or those that are asked for, with compiled functions kept in the session's own folder."""
    cache = {"NUMBA_CACHE_DIR": str(Path(session.create_tmp()) / "compiled")}  # of another Numba than the checkout's
    session.run("pytest", "-n", "2", "--dist", "loadfile", *chosen, env=ENVIRONMENT | cache)


def find_programs() -> list[str]:
    """Python programs in `scripts/` whose names have no ending."""
    files = [path for path in Path("scripts").iterdir() if path.is_file() and not path.suffix]
    return sorted(str(path) for path in files if "python" in path.read_text(encoding="utf-8").split("\n", 1)[0])


@nox.session(python=PYTHONS)
def tests(session: nox.Session) -> None:
    """Tests with one version of Python and the pinned versions; arguments after `--` go to pytest."""
    session.install(*PINNED, "--editable", ".[env,live,mesh,study]", *TESTING)
    run_tests(session, *(session.posargs or QUICK))


@nox.session(python=PYTHONS[0])
def lowest(session: nox.Session) -> None:
    """Tests with the oldest versions that pyproject.toml allows; arguments after `--` go to pytest."""
    floors = Path(session.create_tmp()) / "lowest.txt"
    how = (
        "--resolution",
        "lowest-direct",
        "--only-binary",
        ":all:",
        "--extra",
        "env",
        "--extra",
        "study",
        "--python-version",
        PYTHONS[0],
    )
    session.run("uv", "pip", "compile", "--quiet", *how, "pyproject.toml", "--output-file", str(floors), external=True)
    session.install(
        "--constraint", str(floors), "--editable", ".[env,study]", *TESTING, "pip"
    )  # old PyNiteFEA imports pip
    run_tests(session, *(session.posargs or QUICK))


@nox.session(venv_backend="none")
def lint(session: nox.Session) -> None:
    """Style, spelling, types and the review of Scientific Python, with the tools of the environment that nox runs in."""
    session.run("pre-commit", "run", "--all-files", "--show-diff-on-failure")
    session.run("pyright")
    session.run("pyright", *find_programs())  # it looks by itself at names that end in .py only
    session.run("sp-repo-review", ".")


@nox.session(venv_backend="none")
def docs(session: nox.Session) -> None:
    """Make the documents site in docs/_build: pages are run, warnings are errors; arguments after `--` go to Sphinx."""
    session.run("python", "scripts/run_pages", env=ENVIRONMENT)
    session.run("python", "scripts/run_commands", env=ENVIRONMENT)
    session.run("sphinx-build", "-W", "--keep-going", "-q", "-b", "html", *session.posargs, "docs", "docs/_build")


@nox.session
def build(session: nox.Session) -> None:
    """Build sdist and wheel twice, hold that both are the same, start the wheel from an empty folder, list its materials."""
    seconds = session.run("git", "log", "-1", "--format=%ct", external=True, silent=True)
    once, twice = Path("dist").absolute(), Path(session.create_tmp()).absolute() / "again"
    for folder in (once, twice):
        stamp = {"SOURCE_DATE_EPOCH": str(seconds).strip()}
        session.run("uv", "build", "--quiet", "--clear", "--out-dir", str(folder), external=True, env=stamp)
    made = sorted(path.name for path in once.iterdir() if path.suffix in (".whl", ".gz"))
    _, different, missing = filecmp.cmpfiles(once, twice, made, shallow=False)
    if different or missing or len(made) != 2:
        session.error(f"two builds differ: {different + missing}; made: {made}")
    (wheel,) = once.glob("*.whl")
    session.install(*PINNED, str(wheel))
    materials = ("--output-reproducible", "--output-file", f"{wheel}.cdx.json")
    session.run("cyclonedx-py", "environment", *materials, session.virtualenv.location, external=True)
    session.chdir(session.create_tmp())
    for command in (
        ("python", "-c", "import vgtsim, vgtsim.cli, vgtsim.mjcf"),
        ("vgtsim", "models"),
        ("vgtsim", "build", "arm9_nullspace", "--out", "model"),
        ("vgtsim", "ik", "arm9", "--position", "4.5", "0", "-8.4", "--direction", "0.7", "0", "-0.7"),
    ):
        session.run(*command, silent=True, env={"PYTHONPATH": ""})
    session.log(f"{os.path.getsize(wheel)} bytes, twice the same: {wheel.name}")


if __name__ == "__main__":
    nox.main()
