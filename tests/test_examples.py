"""Every example runs, and stays short enough to read."""

import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = [
    path if path.stem in ("fly_and_look", "linearise_and_tune") else pytest.param(path, marks=pytest.mark.slow)
    for path in sorted((Path(__file__).parents[1] / "examples").glob("*.py"))
]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(example, tmp_path):
    assert len(example.read_text().splitlines()) < 120
    done = subprocess.run([sys.executable, str(example)], capture_output=True, text=True, cwd=tmp_path, timeout=300)
    assert done.returncode == 0, done.stderr
    assert done.stdout
    pictures = [path.suffix for path in tmp_path.iterdir() if path.suffix == ".png"]
    assert len(pictures) == example.read_text().count("savefig(")
