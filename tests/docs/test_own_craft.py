"""docs/own_craft.md: a craft by file and as objects, every block as it stands there."""

import inspect
import re

import pytest
from running_pages import ROOT, run, sections

import casadi_gnc as gnc

PAGE = "own_craft.md"


@pytest.mark.slow  # first_law is the page that the fast tests run
@pytest.mark.parametrize("section", [section.title for section in sections(PAGE)])
def test_section(section, tmp_path):
    run(PAGE, section, tmp_path)


@pytest.mark.parametrize(("title", "base"), [("The plant", gnc.Plant), ("The craft", gnc.Craft)])
def test_the_table_has_every_member(title, base):
    """What the class offers to override, and nothing that it does not."""
    text = (ROOT / "docs" / PAGE).read_text(encoding="utf-8")
    section = text.split(f"## {title}\n")[1].split("\n## ")[0]
    cells = [row.split("|")[1] for row in section.splitlines() if row.startswith("| `")]
    told = {name for cell in cells for name in re.findall(r"`(\w+)", cell)}
    members = {name for name, own in vars(base).items() if inspect.isfunction(own) or isinstance(own, property)}
    members |= set(inspect.get_annotations(base))
    assert told == {name for name in members if not name.startswith("_")}
