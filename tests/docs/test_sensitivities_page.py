"""docs/sensitivities.md: every script as it stands there, one after the other, as a reader's session."""

import contextlib
import io

import pytest
from running_pages import sections

PAGE = "sensitivities.md"


@pytest.mark.slow
def test_page():
    known: dict = {}
    for section in sections(PAGE):
        printed = ""
        for block in section.blocks:
            if block.language == "python":
                out = io.StringIO()
                with contextlib.redirect_stdout(out):
                    exec(block.text, known)
                printed = out.getvalue()
            elif block.language == "text":
                assert printed.split() == block.text.split()
