"""Notebooks run from the first cell to the last, show something, and are kept without what they showed."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "examples").glob("*.ipynb"))

#: Runs the cells of a notebook as its kernel does, one after the other in one namespace, and prints what each shows.
RUN = """
import ast, json, sys
namespace = {"__name__": "__main__"}
for cell in json.load(open(sys.argv[1], encoding="utf-8"))["cells"]:
    if cell["cell_type"] != "code":
        continue
    body = ast.parse("".join(cell["source"])).body
    last = ast.Expression(body.pop().value) if isinstance(body[-1], ast.Expr) else None
    exec(compile(ast.Module(body, []), cell["id"], "exec"), namespace)
    value = None if last is None else eval(compile(last, cell["id"], "eval"), namespace)
    html = getattr(value, "_repr_html_", lambda: None)()
    print(json.dumps({"cell": cell["id"], "shown": None if value is None else html or repr(value)}))
"""


def cells(path: Path, kind: str) -> list[dict]:
    return [one for one in json.loads(path.read_text(encoding="utf-8"))["cells"] if one["cell_type"] == kind]


def test_there_are_few():
    assert 1 <= len(NOTEBOOKS) <= 2


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_stripped_and_words_lead(path):
    content = json.loads(path.read_text(encoding="utf-8"))
    assert (content["nbformat"], content["cells"][0]["cell_type"]) == (4, "markdown")
    names = [one["id"] for one in content["cells"]]
    assert len(set(names)) == len(names)
    for one in cells(path, "code"):
        assert one["outputs"] == []
        assert one["execution_count"] is None
        assert ast.parse("".join(one["source"])).body
    assert path.stat().st_size < 20_000


@pytest.mark.slow
def test_the_first_flight_runs_and_shows_what_it_says(tmp_path):
    (path,) = [one for one in NOTEBOOKS if one.stem == "first_flight"]
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(path)],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=300,
        env={**os.environ, "MPLBACKEND": "agg"},
    )
    assert done.returncode == 0, done.stderr
    shown = {one["cell"]: one["shown"] for one in map(json.loads, done.stdout.splitlines())}
    assert list(shown) == [one["id"] for one in cells(path, "code")]
    assert "<td>settling_time</td><td>967.2 s</td>" in shown["fly"]
    assert "authority.virtual_control" in shown["check"]
    assert "matplotlib.legend.Legend" in shown["look"]
    before, after = json.loads(shown["change"])
    assert after > 10 * before
    assert "torque 1" in shown["margins"]
