"""Commands and scripts at the head of pages, every block as it stands there; and what pages name is there."""

import re

import pytest
import running_pages
from running_pages import ROOT, run, sections

from casadi_gnc.problem_files.document import shipped

PAGES = ["allocation", "check", "command_line", "docking", "falsify", "flight_c", "index", "margins", "synthesis"]
HEADS = [(f"{page}.md", sections(f"{page}.md")[0]) for page in PAGES]
HEADS += [
    ("synthesis.md", section) for section in sections("synthesis.md") if section.title == "Structured uncertainty"
]


CASES = [
    pytest.param(page, head.title, marks=[pytest.mark.tools(*head.tools)] * bool(head.tools)) for page, head in HEADS
]


@pytest.mark.slow  # first_law is the page that the fast tests run
@pytest.mark.parametrize(("page", "section"), CASES, ids=[*PAGES, "synthesis, uncertainty"])
def test_head(page, section, tmp_path):
    run(page, section, tmp_path)


#: What flies for minutes, or times solvers, or answers every claim of five papers.
AT_LENGTH = [
    pytest.param(f"{page}.md", section.title, marks=[pytest.mark.tools(*section.tools)] * bool(section.tools), id=page)
    for page in ("../README", "allocation", "benchmarks", "drag_free", "proximity", "report", "reproduce", "wheels")
    for section in sections(f"{page}.md")[page == "../README" :]  # its head is make demo and make test
    if (f"{page}.md", section) not in HEADS and any(block.language == "sh" for block in section.blocks)
]


@pytest.mark.long
@pytest.mark.parametrize(("page", "section"), AT_LENGTH)
def test_section_at_length(page, section, tmp_path, monkeypatch):
    monkeypatch.setattr(running_pages, "PATIENCE_S", 1800)
    activate = tmp_path / ".venv/bin/activate"  # of the environment that make demo has made
    activate.parent.mkdir(parents=True)
    activate.touch()
    run(page, section, tmp_path)


def test_problems_that_pages_call_are_shipped():
    """The pages of the papers' missions fly them by name, as tests/missions does."""
    called = {}
    for page in (ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))):
        for name in re.findall(r"casadi-gnc (?:[a-z]+ )+([a-z0-9]+/\w+)", page.read_text(encoding="utf-8")):
            called.setdefault(name, page.name)
    assert len(called) > 20
    own = ("flight/", "fw/", "out/", "examples/")  # folders that the page itself makes or the repository has
    assert {name: page for name, page in called.items() if name not in shipped() and not name.startswith(own)} == {}
