"""docs/satellite.md: every block as it stands there."""

import pytest
from running_pages import run, sections

PAGE = "satellite.md"


@pytest.mark.slow
@pytest.mark.parametrize("section", [section.title for section in sections(PAGE)])
def test_section(section, tmp_path):
    run(PAGE, section, tmp_path)


def test_a_first_file_is_short():
    """What a stranger writes is at most 60 lines."""
    (first,) = [
        block
        for section in sections(PAGE)
        for block in section.blocks
        if block.place == "whole" and block.file == "sat.toml"
    ]
    assert len(first.text.splitlines()) <= 60
