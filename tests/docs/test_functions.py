"""The page of functions does what it says."""

from pathlib import Path

import pytest


@pytest.mark.slow
def test_the_snippet_of_the_page_runs(tmp_path, monkeypatch):
    text = (Path(__file__).parents[2] / "docs" / "functions.md").read_text(encoding="utf-8")
    *lines, last = text.split("```python\n")[1].split("```")[0].strip().splitlines()
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec("\n".join(lines), names)
    assert eval(last, names) is True
    assert "law_real x[2]; /* rad */" in (tmp_path / "fw" / "law" / "law.h").read_text(encoding="utf-8")
