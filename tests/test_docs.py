"""Snippets of the documentation run as they stand."""

import doctest
import re
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from casadi_gnc.problem_files.allocation_file import load_allocation

ROOT = Path(__file__).parents[1]
PYTHON = [
    (path.name, block)
    for path in (ROOT / "README.md", ROOT / "docs" / "allocation.md")
    for block in re.findall(r"```python\n(.*?)```", path.read_text(encoding="utf-8"), re.DOTALL)
]

#: Sections of the errata with their snippets, which build on each other.
ERRATA = [
    (section.split("\n", 1)[0], "\n".join(re.findall(r"```pycon\n(.*?)```", section, re.DOTALL)))
    for section in re.split(r"^## ", (ROOT / "docs" / "errata.md").read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    if "```pycon" in section
]


@pytest.mark.parametrize(("section", "snippets"), ERRATA, ids=[section for section, _ in ERRATA])
def test_errata_have_evidence_that_runs(section, snippets):
    """Each snippet prints what stands below it."""
    test = doctest.DocTestParser().get_doctest(snippets, {}, section, "errata.md", 0)
    told: list[str] = []
    found = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test, out=told.append)
    assert found.attempted > 5
    assert not found.failed, "".join(told)


@pytest.mark.parametrize(("name", "block"), PYTHON, ids=[name for name, _ in PYTHON])
def test_python_snippets_run(name, block):
    exec(compile(block, name, "exec"), {})


def test_the_examples_of_allocation_files_load(tmp_path):
    text = (ROOT / "docs" / "allocation.md").read_text(encoding="utf-8")
    examples = [block for block in re.findall(r"```toml\n(.*?)```", text, re.DOTALL) if "format = 1" in block]
    counts = []
    for number, example in enumerate(examples):
        path = tmp_path / f"{number}.toml"
        path.write_text(example)
        counts.append(load_allocation(path).problem.count)
    assert counts == [3, 4]


def test_links_lead_to_files():
    for page in (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "docs").glob("*.md")):
        prose = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        for target in re.findall(r"\]\(([^)#]+)\)", prose):
            if "://" not in target and not target.startswith("catalogue/"):  # made where the documentation is built
                assert (page.parent / target).exists(), f"{page.name} -> {target}"


PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_pages_import_is_there(page):
    """In blocks that are not run, too: names move when rooms do."""
    text = page.read_text(encoding="utf-8")
    for module, names in re.findall(r"^(?:>>> )?from (casadi_gnc[\w.]*) import ([\w, ]+)", text, re.MULTILINE):
        for name in (each.split(" as ")[0].strip() for each in names.split(", ")):
            assert hasattr(import_module(module), name) or find_spec(f"{module}.{name}"), f"{module} has no {name}"
