"""The page of checks."""

import re
import subprocess
import sys
from dataclasses import replace

import pytest
from looking import keep, legible, opened

from casadi_gnc.checking import check
from casadi_gnc.problem_files.checking import checked_file
from casadi_gnc.reports.check_page import of_checks
from casadi_gnc.reports.writing import write_report
from casadi_gnc.system.text import visible


@pytest.fixture(scope="module")
def found():
    return checked_file("huang2020/slew_as_printed")


@pytest.fixture(scope="module")
def page(found, tmp_path_factory):
    return of_checks(found.title, found.checks, tmp_path_factory.mktemp("page") / "a.html", found.mission)


def shell(page):
    return re.sub(r"<(script|style).*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)


def test_every_check_and_what_follows_is_there(page, found):
    told = shell(page)
    assert told.index("Fails") < told.index('id="checks"')
    for one in found.checks:
        assert one.name in told
        assert f"{one.value:.4g}" in told
        if one.verdict != "ok":
            assert one.name in told[told.index('id="look"') : told.index('id="checks"')]
    assert "<script" not in page.read_text(encoding="utf-8")
    assert "script-src &#39;none&#39;" in page.read_text(encoding="utf-8") or "script-src 'none'" in page.read_text(
        encoding="utf-8"
    )


def test_what_schemes_share_stands_once(page, found):
    shared = [one for one in found.checks if one.name == "geometry.effectiveness"]
    assert len(shared) > 1
    assert shell(page).count("geometry.effectiveness") == 1


@pytest.mark.slow
def test_commands_write_it(tmp_path):
    command = [sys.executable, "-m", "casadi_gnc.cli.main"]
    for words in (["check", "shi2020/synthesis", "--report"], ["report", "shi2020/synthesis", "--out"]):
        done = subprocess.run([*command, *words, str(tmp_path / "a.html")], capture_output=True, text=True, timeout=200)
        assert done.returncode == 0, done.stderr
        assert f"wrote {tmp_path / 'a.html'}" in done.stdout
        assert "Loops" not in (tmp_path / "a.html").read_text(encoding="utf-8")  # a synthesis has none to show


def test_hostile_titles(detumble, tmp_path):
    title = "</title><script>alert(1)</script>" + chr(0x2067)
    mission = replace(detumble, title=title, source=title)
    told = shell(of_checks(title, check(mission, "damping_pinv"), tmp_path / "a.html", mission))
    assert "<script>alert" not in told
    assert chr(0x2067) not in told


@pytest.mark.tools("chromium")
@pytest.mark.packages("playwright")
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (400, "dark")])
def test_quiet_and_legible(browser, page, width, scheme):
    with opened(browser, page, width=width, scheme=scheme) as sheet:
        # Of one loop with margins poles, Nichols and Bode; of two that are unstable the poles; of both kinds of
        # allocation three slices.
        assert sheet.locator("figure.chart").count() == 12
        legible(sheet, width)
        keep(sheet, f"check-{width}-{scheme}")


@pytest.mark.tools("chromium")
@pytest.mark.packages("playwright")
@pytest.mark.parametrize(
    "title", ["</title><script>alert(1)</script>\"'" + chr(0x202E), 10_000 * "x"], ids=["script", "long"]
)
def test_hostile_titles_show_as_text(browser, found, tmp_path, title):
    with opened(browser, of_checks(title, found.checks, tmp_path / "a.html"), width=400) as sheet:
        assert sheet.locator("h1").text_content() == visible(title)
        assert sheet.evaluate("document.documentElement.scrollWidth") <= 400
        assert sheet.evaluate("document.querySelectorAll('script').length") == 0


def test_a_problem_by_its_name(tmp_path):
    assert "Poles of the closed loop" in shell(write_report("huang2020/detumble", tmp_path / "a.html"))
