"""H2 norms, and state feedback that keeps an H-infinity norm: formulas, Riccati equations, python-control."""

import control
import numpy as np
import pytest
from riccati_equations import riccati
from scipy.optimize import brentq, minimize_scalar

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import GainStatus, h_two_norm, mixed_state_feedback, state_feedback

A = np.array([[0.0, 1.0, 0.0], [-1.0, 0.2, 0.5], [0.0, 0.3, -0.4]])
B, E = np.array([[0.0], [1.0], [0.5]]), np.array([[0.3], [0.0], [1.0]])
C, D = np.eye(4)[:, :3], np.eye(4)[:, 3:]


def system(a, b, c):
    """Return python-control's system, square: its H-infinity norm without Slycot takes no other."""
    size = max(b.shape[1], len(c))
    wide, tall = np.zeros((len(a), size)), np.zeros((size, len(a)))
    wide[:, : b.shape[1]], tall[: len(c)] = b, c
    return control.ss(a, wide, tall, np.zeros((size, size)))


@pytest.mark.parametrize("seed", range(6))
def test_h2_norm_is_that_of_python_control(seed):
    rng = np.random.default_rng(seed)
    n, m, p = (int(each) for each in rng.integers(1, 6, 3))
    a = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-3, 3)
    a -= (np.linalg.eigvals(a).real.max() + 0.1 * np.linalg.norm(a, 2)) * np.eye(n)
    b, c = rng.normal(size=(n, m)), rng.normal(size=(p, n))
    found, theirs = h_two_norm(a, b, c), control.norm(control.ss(a, b, c, np.zeros((p, m))), p=2, print_warning=False)
    assert found.upper == pytest.approx(theirs, rel=1e-9)
    assert found.lower <= theirs * (1 + 1e-12)
    assert found.upper - found.lower < 1e-10 * found.upper
    assert h_two_norm(a + 2 * np.linalg.norm(a, 2) * np.eye(n), b, c).upper == np.inf


@pytest.mark.parametrize("gamma", [1.25, 1.5, 3.0])
def test_one_state_has_the_gains_of_its_formulas(gamma):
    """x' = a x + u + w, z = (x, u): H2 root((1 + K^2)/(2(K - a))), H-infinity root(1 + K^2)/(K - a), both by hand."""
    a, one = 0.7, ([[1.0], [0.0]], [[0.0], [1.0]])
    found = mixed_state_feedback([[a]], [[1.0]], [[1.0]], *one, *one, gamma=gamma)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    least = brentq(lambda K: np.sqrt(1 + K**2) - gamma * (K - a), a + 1e-9, 50.0)  # the norm falls with K up to there
    best = minimize_scalar(lambda K: (1 + K**2) / (2 * (K - a)), bounds=(a + 1e-6, 50.0), method="bounded").x
    K = max(best, least)
    assert found.energy.promised == pytest.approx(np.sqrt((1 + K**2) / (2 * (K - a))), rel=1e-5)  # the margins
    assert found.gains["K"][0, 0] == pytest.approx(K, rel=1e-4)
    assert found.energy.upper <= found.energy.promised
    assert found.energy.least <= found.energy.promised


def test_it_is_the_regulator_where_gamma_is_large_and_costs_where_it_is_small():
    K, P, _ = control.lqr(A, B, np.eye(3), np.eye(1))
    free = mixed_state_feedback(A, B, E, C, D, C, D, gamma=1e3)
    np.testing.assert_allclose(free.gains["K"], K, rtol=1e-3)
    assert free.energy.promised == pytest.approx(np.sqrt((E.T @ P @ E)[0, 0]), rel=1e-5)
    smallest = state_feedback(A, B, E, C, D).smallest[1]
    gamma = 1.1 * smallest
    assert free.norm.lower > gamma  # the regulator does not keep it
    held = mixed_state_feedback(A, B, E, C, D, C, D, gamma=gamma)
    assert held.status is GainStatus.CERTIFIED, held.sentence()
    loop, seen = A - B @ held.gains["K"], C - D @ held.gains["K"]
    norms = system(loop, E, seen)
    assert held.energy.upper == pytest.approx(control.norm(norms, p=2, print_warning=False), rel=1e-6)
    theirs = control.norm(norms, p="inf", tol=1e-9, method="scipy", print_warning=False)
    assert held.norm.upper == pytest.approx(theirs, rel=1e-6)
    assert held.norm.upper <= gamma
    # With s = 1 the least bound is the entropy's, of the stabilising Riccati solution at gamma; no s does worse.
    entropy = np.sqrt((E.T @ riccati(A, B, E, np.eye(3), 1.0, gamma) @ E)[0, 0])
    assert free.energy.promised < held.energy.promised <= entropy * (1 + 1e-6)


def test_regions_and_what_has_no_gains():
    both = {"gamma": 2.0, "decay_1_s": 0.5, "fastest_rad_s": 20.0}
    found = mixed_state_feedback(A, B, E, C, D, C, D, E2=np.eye(3), **both)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.poles[0].real < -0.5
    none = mixed_state_feedback(A, B, E, C, D, C, D, gamma=0.1)
    assert none.status is GainStatus.INFEASIBLE, none.sentence()
    assert "bounded real" in none.lmis.conflict
    for change, words in (
        ({"gamma": -1.0}, "gamma is -1.0, expected a positive number"),
        ({"gamma": 1.0, "E2": np.eye(2)}, r"E2 has shape \(2, 2\), expected \(3, 2\)"),
    ):
        with pytest.raises(SynthesisError, match=words):
            mixed_state_feedback(A, B, E, C, D, C, D, **change)
