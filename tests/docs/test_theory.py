"""The theory pages: what they compute comes out as they say."""

import pytest
from running_pages import run, sections

PAGES = ["theory_attitude.md", "theory_observers.md", "theory_allocation.md"]


@pytest.mark.parametrize(("page", "section"), [(page, section.title) for page in PAGES for section in sections(page)])
def test_section(page, section, tmp_path):
    run(page, section, tmp_path)
