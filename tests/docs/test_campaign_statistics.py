"""docs/campaign_statistics.md: every script runs as it stands there and prints what the page says."""

import pytest
from running_pages import run, sections

PAGE = "campaign_statistics.md"


@pytest.mark.parametrize("section", [section.title for section in sections(PAGE)])
def test_section(section, tmp_path):
    run(PAGE, section, tmp_path)
