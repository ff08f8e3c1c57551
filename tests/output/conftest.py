"""A synthetic run, shared by the tests of the output room."""

import ctypes

import pytest
from synthetic_run import leave_out_plots, make_log, make_report, make_scene

from vgtsim.site import Site
from vgtsim.verification import JudgedRun


@pytest.fixture(scope="session")
def scene():
    return make_scene()


@pytest.fixture(scope="session")
def log(scene):
    return make_log(scene)


@pytest.fixture(scope="session")
def report(scene, log):
    return make_report(scene, log)


@pytest.fixture(scope="session")
def site(scene):
    return Site(scene)


@pytest.fixture(scope="session")
def judged(site, log, report):
    return JudgedRun(site, log, report)


@pytest.fixture(scope="session")
def egl():
    try:
        ctypes.CDLL("libEGL.so.1")
    except OSError:
        pytest.skip("libEGL is not installed; on Debian: apt-get install libegl1 libgl1-mesa-dri")


@pytest.fixture
def no_plots(monkeypatch):
    """For tests of what stands beside the plots of a page."""
    leave_out_plots(monkeypatch)
