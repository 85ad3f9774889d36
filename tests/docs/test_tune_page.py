"""docs/tune.md: every block as it stands there."""

import pytest
from running_pages import run, sections

PAGE = "tune.md"


@pytest.mark.slow
@pytest.mark.parametrize("section", [section.title for section in sections(PAGE)])
def test_section(section, tmp_path):
    run(PAGE, section, tmp_path)
