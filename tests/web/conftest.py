"""The synthetic run, and Debian's Chromium without a screen, driven by Playwright, its pictures drawn by software."""

from __future__ import annotations

import shutil

import pytest
from synthetic_run import make_log, make_report, make_scene

from vgtsim.site import Site

_ARGUMENTS = (
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
_DRAWN = (
    "count => new Promise(done => { const go = k => k ? requestAnimationFrame(() => go(k - 1)) : done(); go(count); })"
)


@pytest.fixture(scope="session")
def site():
    return Site(make_scene())


@pytest.fixture(scope="session")
def log(site):
    return make_log(site.scene)


@pytest.fixture(scope="session")
def report(site, log):
    return make_report(site.scene, log)


@pytest.fixture(scope="session")
def drawn():
    """What a page evaluates to wait until it has drawn so many pictures: a busy browser may draw none in a second."""
    return _DRAWN


@pytest.fixture(scope="session")
def browser():
    program = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if program is None:
        pytest.skip("no browser; on Debian: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="no playwright; pip install playwright")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=program, args=list(_ARGUMENTS))
        yield opened
        opened.close()
