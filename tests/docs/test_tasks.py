"""The twelve tasks of docs/tasks.md: each block runs as it stands, and each task that stands elsewhere is run there."""

import re
from pathlib import Path

import pytest
from running_pages import ROOT, run, sections

PAGE = "tasks.md"
_ROW = re.compile(r"^\| ([^|]+) \| (?:below|\[[^]]+\]\((\w+\.md)\)(?:: ([^|]+))?) \|$", re.MULTILINE)


def test_twelve_tasks_each_with_a_section_that_a_test_runs():
    rows = _ROW.findall((ROOT / "docs" / PAGE).read_text(encoding="utf-8"))
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("test_*.py"))
    assert len(rows) == 12
    assert len([page for _, page, _ in rows if not page]) == len(sections(PAGE))
    for task, page, named in rows:
        if page:
            there = [section.title for section in sections(page)]
            assert f'"{page}"' in tests or f'"{page.removesuffix(".md")}"' in tests, task
            for title in filter(None, re.split(r"[,;] (?=[A-Z])", named)):
                assert title in there, (task, title, there)


@pytest.mark.slow
@pytest.mark.parametrize("section", [section.title for section in sections(PAGE)])
def test_section(section, tmp_path):
    run(PAGE, section, tmp_path)
