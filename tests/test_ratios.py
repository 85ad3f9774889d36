"""Times and ratios that the documentation quotes stand in one file, which `make ratios` writes."""

import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
RATIOS = ROOT / "docs" / "ratios.md"
#: A time of a program, or a ratio of two: these must not be typed by hand. Flights last seconds and hours.
SPEED = re.compile(r"\b\d[\d.,]* ?(us|µs|ns)\b|\b\d[\d.]* times (faster|slower|as long|as fast)\b")
PAGES = [ROOT / "README.md", *(page for page in sorted((ROOT / "docs").glob("*.md")) if page != RATIOS)]


def marked(text, name):
    return re.search(rf"<!-- {name} -->\n(.*?)\n<!-- /{name} -->", text, re.DOTALL)


def test_the_readme_says_what_was_measured():
    told = marked((ROOT / "README.md").read_text(encoding="utf-8"), "readme")
    measured = marked(RATIOS.read_text(encoding="utf-8"), "readme")
    assert measured
    assert told
    assert told.group(1) == measured.group(1)
    assert SPEED.search(told.group(1))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_no_page_quotes_a_speed_of_its_own(page):
    text = page.read_text(encoding="utf-8")
    block = marked(text, "readme")
    if block:
        text = text.replace(block.group(0), "")
    # The shift and the meaning of columns are settings, not measurements.
    found = [line for line in text.splitlines() if SPEED.search(line) and "shift" not in line]
    assert not [line for line in found if "s = 10 us" not in line]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_pages_include_is_there(page):
    text, measured = page.read_text(encoding="utf-8"), RATIOS.read_text(encoding="utf-8")
    for name in re.findall(r":start-after: <!-- (\w+) -->", text):
        assert marked(measured, name), f"{page.name} includes {name}"


SCRIPTS = [
    pytest.param(script, id=script.name, marks=[pytest.mark.packages("jax")] if script.stem == "jax_flight" else [])
    for script in sorted((ROOT / "tests" / "bench").glob("*.py"))
]


@pytest.mark.parametrize("script", SCRIPTS)
def test_what_measures_can_be_loaded(script):
    """Scripts that run for minutes find what they import, and read what they measure."""
    spec = importlib.util.spec_from_file_location(f"bench_{script.stem}", script)
    assert spec
    assert spec.loader
    spec.loader.exec_module(importlib.util.module_from_spec(spec))
