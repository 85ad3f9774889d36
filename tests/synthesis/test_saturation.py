"""Margins for saturation: closed forms, and the criteria of circle and Popov by sweeps over frequency."""

import json
import subprocess
import sys

import numpy as np
import pytest

from casadi_gnc.errors import ProblemError, SynthesisError
from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize
from casadi_gnc.synthesis import GainStatus, saturation_margin

CHAIN, END = np.diag([-1.0] * 3) + np.diag([1.0] * 2, 1), np.array([[0.0], [0.0], [1.0]])


def chain(gain):
    """Return A, B, K of a loop with the response gain/(s + 1)^3 from what the limit takes away to the command."""
    K = gain * np.array([[1.0, 0.0, 0.0]])
    return CHAIN + END @ K, END, K


@pytest.mark.parametrize(
    ("gain", "criterion", "share"),
    [
        (-10.0, "circle", 0.4),  # the real part of 1/(1 + jw)^3 is at least -1/4
        (-10.0, "popov", 0.8),  # Routh: (s + 1)^3 + g is Hurwitz for -1 < g < 8, and Popov reaches both ends
        (10.0, "popov", 0.1),
        (-3.0, "circle", 1.0),
    ],
)
def test_three_equal_lags_have_their_closed_form(gain, criterion, share):
    found = saturation_margin(*chain(gain), criterion=criterion)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.share == pytest.approx(share, rel=3e-4)  # bisected to 1e-4; margins
    assert found.share <= share


def swept(A, B, K, popov):
    """Return the largest share, up to 1, for which Re(1/s - (1 + jw q) W(jw)) > 0 on a grid of w, for some q."""
    w = np.concatenate([[0.0], np.geomspace(1e-3, 1e3, 4000)])
    W = np.array([(K @ np.linalg.solve(1j * x * np.eye(len(A)) - A + B @ K, B))[0, 0] for x in w])
    slopes = np.geomspace(1e-3, 1e2, 300) if popov else np.zeros(0)
    least = min(((1 + 1j * w * q) * W).real.max() for q in np.concatenate([-slopes, [0.0], slopes]))
    return 1.0 if least <= 1 else 1 / least


@pytest.mark.slow
@pytest.mark.parametrize("seed", [4, 5, 9, 10])
def test_one_command_has_the_share_of_a_sweep_by_hand(seed):
    rng = np.random.default_rng(seed)
    loop, B, K = rng.normal(size=(3, 3)), rng.normal(size=(3, 1)), rng.normal(size=(1, 3))
    loop -= (np.linalg.eigvals(loop).real.max() + 0.15) * np.eye(3)
    K *= 3 / max(abs((K @ np.linalg.solve(1j * x * np.eye(3) - loop, B))[0, 0]) for x in np.linspace(0, 10, 2000))
    shares = []
    for criterion in ("circle", "popov"):
        found = saturation_margin(loop + B @ K, B, K, criterion=criterion)
        assert found.is_certified, found.sentence()
        assert found.share == pytest.approx(swept(loop + B @ K, B, K, criterion == "popov"), rel=1e-3)
        shares.append(found.share)
    assert shares[0] <= shares[1] * (1 + 1e-4)


@pytest.mark.slow
def test_commands_that_are_not_coupled_have_the_least_share():
    one, two = chain(-10.0), chain(-9.0)
    A, B, K = (np.kron(np.diag([1.0, 0.0]), a) + np.kron(np.diag([0.0, 1.0]), b) for a, b in zip(one, two, strict=True))
    found = saturation_margin(A, B, K)
    assert found.share == pytest.approx(0.8, rel=3e-4)


def test_what_is_not_stable_is_refuted():
    found = saturation_margin([[0.0, 1.0], [0.0, 0.0]], [[0.0], [1.0]], [[-1.0, 1.5]])
    assert found.status is GainStatus.INFEASIBLE, found.sentence()
    for change, words in (
        ({"criterion": "nyquist"}, "criterion is 'nyquist', expected one of circle, popov"),
        ({"relative": 0.0}, "relative is 0.0, expected a positive number"),
        ({"K": [[1.0]]}, r"K has shape \(1, 1\), expected \(1, 3\)"),
    ):
        with pytest.raises(SynthesisError, match=words):
            saturation_margin(**{**dict(zip("ABK", chain(-1.0), strict=True)), **change})


FILE = """
format = 1
kind = "synthesis"
[recipe]
type = "saturation_margin"
A = [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [-10.0, 0.0, -1.0]]
B = [[0.0], [0.0], [1.0]]
K = [[-10.0, 0.0, 0.0]]
"""


@pytest.mark.slow
def test_the_command_line_tells_it(tmp_path):
    path = tmp_path / "loop.toml"
    path.write_text(FILE + 'criterion = "circle"\n')
    run = [sys.executable, "-m", "casadi_gnc.cli.main", "synthesize", str(path)]
    done = subprocess.run(run, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "saturation: stable with commands up to 1.667 times their limits" in done.stdout
    path.write_text(FILE)
    found = json.loads(subprocess.run([*run, "--json"], capture_output=True, text=True, timeout=300).stdout)
    assert found["certified"]
    assert found["saturation"]["share"] == pytest.approx(0.8, rel=3e-4)
    assert found["saturation"]["command_over_limit"] == pytest.approx(5.0, rel=2e-3)
    assert found["gains"] == {"K": [[-10.0, 0.0, 0.0]]}


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("K = [[-10.0, 0.0, 0.0]]", ""), "recipe.K: is missing"),
        (("K = [[-10.0, 0.0, 0.0]]", "K = [[-10.0, 0.0]]"), "K has shape (1, 2), expected (1, 3)"),
        (("K =", 'criterion = "nyquist"\nK ='), "recipe.criterion"),
    ],
)
def test_bad_files_are_told(tmp_path, change, told):
    path = tmp_path / "loop.toml"
    path.write_text(FILE.replace(*change, 1))
    with pytest.raises(ProblemError) as raised:
        synthesize(load_synthesis(path))
    assert told in str(raised.value)
