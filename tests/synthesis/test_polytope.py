"""Gains for plants between others: formulas of one state, the circle criterion, and drawn plants in between."""

import json
import subprocess
import sys

import numpy as np
import pytest

from casadi_gnc.errors import ProblemError, SynthesisError
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load
from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize
from casadi_gnc.synthesis import GainStatus, h_infinity_norm, polytope_state_feedback, state_feedback

ONE = ([[1.0], [0.0]], [[0.0], [1.0]])  # z = (x, u)
A = [np.array([[0.0, 1.0], [k, 0.0]]) for k in (-1.0, 1.0)]
B = [np.array([[0.0], [b]]) for b in (1.0, 2.0)]
E, C, D = np.array([[0.0], [1.0]]), np.eye(3)[:, :2], np.eye(3)[:, 2:]


@pytest.mark.parametrize("asked", [{}, {"scheduled": True}, {"dependent": True}])
def test_one_state_has_the_norm_of_its_worst_plant(asked):
    """x' = a x + u + w: root(1 + K^2)/(K - a) is least at K = -1/a, 1/root(1 + a^2), and worst at the largest a."""
    found = polytope_state_feedback([[[-1.0]], [[-0.7]], [[-0.5]]], [[[1.0]]], [[1.0]], *ONE, **asked)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.smallest[1] == pytest.approx(1 / np.sqrt(1.25), rel=1e-4)
    assert set(found.gains) == ({"K1", "K2", "K3"} if asked == {"scheduled": True} else {"K"})


@pytest.mark.slow
def test_one_lyapunov_matrix_is_the_circle_criterion_and_one_a_vertex_is_more():
    """x'' + 2 z x' + (1 + d) x: for |d| that changes, 2 z root(1 - z^2); for one that stays, 1."""
    z = 0.2
    most = 2 * z * np.sqrt(1 - z**2)
    for share, dependent, status in (
        (0.98, False, GainStatus.CERTIFIED),
        (1.02, False, GainStatus.INFEASIBLE),
        (1.5, True, GainStatus.CERTIFIED),
    ):
        plants = [[[0.0, 1.0], [-1 - sign * share * most, -2 * z]] for sign in (1, -1)]
        still = [[[0.0], [0.0]]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]]
        found = polytope_state_feedback(plants, *still, gamma=1e3, dependent=dependent)
        assert found.status is status, (share, found.sentence())


@pytest.mark.slow
def test_gains_hold_for_plants_drawn_in_between():
    region = {"damping": 0.8, "fastest_rad_s": 6.0}
    bounds = []
    for asked in ({**region}, {**region, "scheduled": True}, {"dependent": True}):
        found = polytope_state_feedback(A, B, E, C, D, **asked)
        assert found.status is GainStatus.CERTIFIED, found.sentence()
        bounds.append(found.promised)
        for t in np.random.default_rng(2).uniform(size=25):
            a, b = ((1 - t) * first + t * second for first, second in (A, B))
            K = found.gains["K"] if "K" in found.gains else (1 - t) * found.gains["K1"] + t * found.gains["K2"]
            assert h_infinity_norm(a - b @ K, E, C - D @ K).upper <= found.promised
            if "damping" in asked:
                values = np.linalg.eigvals(a - b @ K)
                assert np.all(-values.real > 0.8 * np.abs(values))
                assert np.all(np.abs(values) < 6)
    assert bounds[1] < bounds[0]  # what is known in flight is worth something
    alone = [state_feedback(a, b, E, C, D, **region).smallest[1] for a, b in zip(A, B, strict=True)]
    assert bounds[1] >= max(alone)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"A": []}, "A has 0 vertices, expected 1 to 64"),
        ({"B": [B[0]] * 3}, "B has 3 vertices and A 2; expected as many, or one B for all"),
        ({"B": [B[0], np.eye(2)]}, r"D has shape \(3, 1\), expected \(3, 2\)"),
        ({"scheduled": True, "dependent": True}, "dependent and scheduled are asked together"),
        ({"damping": 0.5, "dependent": True}, "dependent and a region of poles are asked together"),
    ],
)
def test_bad_input(change, words):
    given = {"A": A, "B": B, "E": E, "C": C, "D": D, **change}
    with pytest.raises(SynthesisError, match=words):
        polytope_state_feedback(**given)


ROWS = f"C = {np.eye(9)[:, :6].tolist()}\nD = {np.eye(9)[:, 6:].tolist()}\n"
FILE = 'format = 1\nkind = "synthesis"\n[recipe]\ntype = "polytope_state_feedback"\n'
PAIR = FILE + ROWS + 'missions = ["light.toml", "docking.toml"]\nscheme = "iobc"\n'


@pytest.mark.slow
def test_a_gain_for_two_missions_is_written_into_one(tmp_path):
    text = read("shi2020/docking").text
    (tmp_path / "docking.toml").write_text(text)
    assert "chaser_mass_kg = 40.0" in text
    (tmp_path / "light.toml").write_text(text.replace("chaser_mass_kg = 40.0", "chaser_mass_kg = 30.0", 1))
    (tmp_path / "both.toml").write_text(PAIR)
    run = [sys.executable, "-m", "casadi_gnc.cli.main", "synthesize", "both.toml", "--into", "docking.toml", "--json"]
    done = subprocess.run([*run, "--scheme", "iobc"], capture_output=True, text=True, timeout=300, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    mission = load(tmp_path / "docking.toml")
    assert mission.scheme("iobc").law.controller_gain.full().tolist() == found["gains"]["K"]
    K, light = np.array(found["gains"]["K"]), load(tmp_path / "light.toml").linearised("iobc")
    for plant in (mission.linearised("iobc"), light):
        norm = h_infinity_norm(plant.A - plant.B @ K, light.B, np.eye(9)[:, :6] - np.eye(9)[:, 6:] @ K)
        assert norm.upper <= found["promised_norm"]
    assert not np.array_equal(light.B, mission.linearised("iobc").B)


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (ROWS, "recipe.A: is missing; give A and B, or missions"),
        (ROWS + "A = [[[1.0]]]\n", "recipe.B: is missing beside A"),
        (ROWS + 'A = [[[1.0]]]\nmissions = ["x"]\n', "recipe.missions: is given beside A"),
        (
            ROWS + 'A = [[[1.0]]]\nB = [[[1.0]]]\nscheme = "x"\n',
            "recipe.scheme: names one of what the key missions names",
        ),
        (ROWS + 'missions = ["nowhere.toml"]\n', "recipe.missions: cannot be read"),
        (ROWS + "missions = []\n", "recipe.missions"),
        (ROWS + "A = [[1.0]]\nB = [[[1.0]]]\n", "recipe.A"),
    ],
)
def test_bad_files_are_told(tmp_path, lines, told):
    path = tmp_path / "both.toml"
    path.write_text(FILE + lines)
    with pytest.raises(ProblemError) as raised:
        synthesize(load_synthesis(path))
    assert told in str(raised.value)
