"""`casadi-gnc synthesize`: gains with a certificate, or the constraint that makes them impossible."""

import json
import subprocess
import sys

import numpy as np
import pytest

from casadi_gnc.missions.loading import read

PROGRAM = [sys.executable, "-m", "casadi_gnc.cli.main", "synthesize"]


def run(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run([*PROGRAM, *arguments], capture_output=True, text=True, timeout=300)


def test_repaired_synthesis_is_certified():
    """Derived independently: certified 3.21, true norm 2.30 at s = 0.3. The loop is stable by the gains printed."""
    done = run("shi2020/synthesis", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["status"] == "CERTIFIED"
    assert found["promised_norm"] == pytest.approx(3.21, abs=5e-3)
    assert found["norm"]["upper"] == pytest.approx(2.30, abs=5e-3)
    assert all(one["holds"] and one["smallest"] >= 0.5 * one["margin"] for one in found["constraints"])
    recipe = read("shi2020/synthesis")[2]["recipe"]
    closed = np.array(recipe["A"]) - np.array(recipe["B"]) @ np.array(found["gains"]["K"])
    assert np.linalg.eigvals(closed).real.max() < 0


@pytest.mark.parametrize("backend", ["clarabel", "barrier"])
def test_printed_theorem_is_infeasible_and_named(backend):
    done = run("shi2020/as_printed", "--json", "--backend", backend)
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert found["status"] == "INFEASIBLE"
    assert found["gains"] == {}
    assert "(26) input" in found["sentence"]


def test_text_names_gains_and_constraints():
    done = run("shi2020/synthesis")
    assert "K =" in done.stdout
    assert "certified 3.21" in done.stdout
    assert "smallest eigenvalue" in done.stdout


STATE_FEEDBACK = """
format = 1
kind = "synthesis"
[recipe]
type = "state_feedback"
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
E = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 0.0]]
D = [[0.0], [1.0]]
"""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("B = [[0.0], [1.0]]", "B = [[0.0]]"), "B"),
        (("A = [[0.0, 1.0], [0.0, 0.0]]", "A = [[0.0, 1.0], [0.0]]"), "rows of different length: 2, 1"),
        (("D = [[0.0], [1.0]]", ""), "recipe.D: is missing"),
        (('type = "state_feedback"', 'type = "magic"'), "unknown type 'magic'"),
        (("A = [[0.0, 1.0]", "A = [[nan, 1.0]"), "recipe.A[1][1]"),
        (('kind = "synthesis"', 'kind = "mission"'), 'takes a file of kind "synthesis"'),
    ],
)
def test_bad_files_are_told(tmp_path, change, message):
    path = tmp_path / "bad.toml"
    assert change[0] in STATE_FEEDBACK
    path.write_text(STATE_FEEDBACK.replace(*change, 1))
    done = run(str(path))
    assert done.returncode == 2, done.stdout
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_other_recipes_run_from_files(tmp_path):
    path = tmp_path / "feedback.toml"
    path.write_text(STATE_FEEDBACK)
    found = json.loads(run(str(path), "--json").stdout)
    assert found["certified"]
    assert found["norm"]["upper"] <= found["promised_norm"]
    path.write_text(
        'format = 1\nkind = "synthesis"\n[recipe]\ntype = "input_ellipsoid"\nA = [[0.0, 1.0], [0.0, 0.0]]\n'
        "B = [[0.0], [1.0]]\nhalf_widths = [1.0, 0.1]\nlimit = 5.0\ndecay_1_s = 0.2\n"
    )
    found = json.loads(run(str(path), "--json").stdout)
    assert found["certified"]
    assert found["peak"]["bound"] <= 5.0


def test_unknown_back_end_is_told():
    done = run("shi2020/synthesis", "--backend", "magic")
    assert done.returncode == 2
    assert "no synthesis back end 'magic'" in done.stderr
