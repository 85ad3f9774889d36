"""`casadi-gnc synthesize` with an output feedback: two numbers of a law, found, certified, written where they fly."""

import json
import subprocess
import sys

import numpy as np
import pytest

from casadi_gnc.errors import ProblemError
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load
from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize

PROGRAM = [sys.executable, "-m", "casadi_gnc.cli.main", "synthesize"]
RECIPE = f"""
format = 1
kind = "synthesis"
[recipe]
type = "output_feedback"
mission = "slew.toml"
C = {np.diag([1.0] * 3 + [0.0] * 3).tolist()}
D = {np.vstack([np.zeros((3, 3)), 0.1 * np.eye(3)]).tolist()}
damping = 0.7
structure = [
  ["k_sigma", 0, 0, "k_omega", 0, 0],
  [0, "k_sigma", 0, 0, "k_omega", 0],
  [0, 0, "k_sigma", 0, 0, "k_omega"],
]
"""


def run(folder, text, *arguments):
    (folder / "slew.toml").write_text(read("satellites/slew").text)
    (folder / "pd.toml").write_text(text)
    return subprocess.run([*PROGRAM, "pd.toml", *arguments], capture_output=True, text=True, timeout=300, cwd=folder)


@pytest.mark.slow
def test_the_gains_of_a_slew_are_found_and_written(tmp_path):
    done = run(tmp_path, RECIPE, "--into", "slew.toml", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    mission = load(tmp_path / "slew.toml")
    law, plant = mission.scheme("pd").law, mission.linearised("pd")
    assert found["gains"] == {"k_sigma": law.attitude_gain, "k_omega": law.rate_gain}
    assert found["written"]["keys"] == ["scheme.pd.law.attitude_gain", "scheme.pd.law.rate_gain"]
    K = np.hstack([law.attitude_gain * np.eye(3), law.rate_gain * np.eye(3)])
    values = np.linalg.eigvals(plant.A - plant.B @ K)
    assert np.all(-values.real > 0.7 * np.abs(values))
    assert values.real.max() == pytest.approx(max(pole[0] for pole in found["poles_rad_s"]), rel=1e-9)
    # The largest gain from w = u to (x, 0.1 u) over frequencies is what was promised, to 2 digits of the grid.
    seen = np.vstack([np.eye(6)[:3], -0.1 * K])
    grid = np.concatenate([[0.0], np.geomspace(1e-3, 1e2, 2000)])
    gains = [
        np.linalg.norm(seen @ np.linalg.solve(1j * w * np.eye(6) - plant.A + plant.B @ K, plant.B), 2) for w in grid
    ]
    assert max(gains) <= found["promised_norm"] <= 1.01 * max(gains)


OWN = """
format = 1
kind = "synthesis"
[recipe]
type = "output_feedback"
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 0.0]]
D = [[0.0], [1.0]]
structure = [["k", "d"]]
"""


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (('["k", "d"]', '["k"]'), "structure has 1 rows of 1 entries, expected 1 of 2"),
        (('["k"', "[1.5"), "line 10, recipe.structure[1][1]: is 1.5, expected a whole number or a text in quotes"),
        (('["k"', '[0.0, "k"'), "recipe.structure[1][1]: is 0.0, expected a whole number"),
        (("structure", "tries = 0\nstructure"), "recipe.tries: is 0, expected a number >= 1"),
    ],
)
def test_what_is_wrong_is_told(tmp_path, change, told):
    assert change[0] in OWN
    path = tmp_path / "own.toml"
    path.write_text(OWN.replace(*change, 1))
    with pytest.raises(ProblemError) as raised:
        synthesize(load_synthesis(path))
    assert told in str(raised.value)


@pytest.mark.slow
def test_what_is_not_found_exits_with_1(tmp_path):
    done = run(tmp_path, OWN.replace('["k", "d"]', '["k", 0]'))
    assert done.returncode == 1, done.stderr
    assert (
        "No gains were found, by a search that is local and proves nothing. None of 6 starts led to poles"
        in done.stdout
    )


@pytest.mark.slow
def test_a_name_that_the_law_does_not_have_is_told(tmp_path):
    done = run(tmp_path, RECIPE.replace("k_sigma", "kp"), "--into", "slew.toml")
    assert done.returncode == 2, done.stdout
    assert "flies by AttitudePD, which has no gain kp; its symbols are attitude_gain (k_sigma)" in done.stderr
    assert (tmp_path / "slew.toml").read_text() == read("satellites/slew").text
