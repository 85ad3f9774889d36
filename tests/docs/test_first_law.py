"""docs/first_law.md: from an empty folder to words on an emulated Cortex-M7, every command as it stands there."""

import re

import pytest
from running_pages import ROOT, run, sections

from casadi_gnc.embedded import boards as targets

PAGE = "first_law.md"
#: Contracts are tested, and packages made, replayed and verified, by faster tests too.
SLOW = ("Test it", "Flight C")


def marks(section) -> list:
    return [pytest.mark.tools(*section.tools)] if section.tools else [pytest.mark.slow] if section.title in SLOW else []


SECTIONS = [pytest.param(section.title, marks=marks(section)) for section in sections(PAGE)]


@pytest.mark.parametrize("section", SECTIONS)
def test_section(section, tmp_path):
    run(PAGE, section, tmp_path)


def test_the_packages_to_install_are_those_of_the_target():
    text = (ROOT / "docs" / PAGE).read_text(encoding="utf-8")
    (named,) = re.findall(r"apt-get install --no-install-recommends (.*)", text)
    assert named.split() == list(targets.find("cortex-m7").packages)
