"""A browser for the tests of pages, and the flights that they show."""

import os
import shutil
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


@pytest.fixture(scope="module")
def browser():
    """Chromium without a window; it draws with the processor."""
    from playwright.sync_api import sync_playwright

    options = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    options += ["--no-sandbox"] if os.geteuid() == 0 else []
    with sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=shutil.which("chromium"), args=options)
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def flown(tmp_path_factory, detumble):
    """A folder with the three flights of the de-tumble, as `casadi-gnc fly` writes it; and the mission."""
    import casadi_gnc
    from casadi_gnc.missions.flight import save_summary
    from casadi_gnc.reports import describing, loops

    folder = tmp_path_factory.mktemp("flown")
    flights = casadi_gnc.fly_all(detumble)
    for flight in flights:
        flight.save(folder)
    save_summary(folder, flights)
    names = [one.scheme for one in flights]
    describing.save(folder, detumble, names)
    loops.save(folder, loops.loops_of(detumble, names))
    return folder
