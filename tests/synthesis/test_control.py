"""Norms and gains against python-control and against bisection over Riccati equations."""

import control
import numpy as np
import pytest
from riccati_equations import smallest_gamma

from casadi_gnc.synthesis import GainStatus, h_infinity_norm, observer, state_feedback
from casadi_gnc.synthesis.recipes.intermediate_observer import closed_loop, intermediate_observer

A, B = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]])


def plant(seed):
    """Return a random plant with m inputs, q disturbances and r measurements."""
    rng = np.random.default_rng(seed)
    n, m, q, r = (int(rng.integers(*span)) for span in ((2, 5), (1, 3), (1, 3), (1, 3)))
    return [rng.normal(size=shape) for shape in ((n, n), (n, m), (n, q), (r, n))]


def theirs(a, b, c, d):
    """Return python-control's norm; its method without Slycot takes square systems, hence rows and columns of zeros."""
    size = max(d.shape)
    wide, tall, both = np.zeros((len(a), size)), np.zeros((size, len(a))), np.zeros((size, size))
    wide[:, : b.shape[1]], tall[: len(c)], both[: d.shape[0], : d.shape[1]] = b, c, d
    return control.norm(control.ss(a, wide, tall, both), p="inf", tol=1e-9, method="scipy", print_warning=False)


@pytest.mark.parametrize("seed", range(6))
def test_norm_is_that_of_python_control(seed):
    a, b, _, c = plant(seed)
    a -= (np.linalg.eigvals(a).real.max() + 0.1) * np.eye(len(a))
    d = np.random.default_rng(seed).normal(size=(len(c), b.shape[1])) * (seed % 2)
    # It takes real parts below 1e-8 for zero: the root of that is what its bisection may be off.
    assert h_infinity_norm(a, b, c, d).upper == pytest.approx(theirs(a, b, c, d), rel=1e-6)


def test_norm_of_the_docking_pair_is_that_of_python_control():
    found = intermediate_observer(A, B, 200.0)
    loop, inputs = closed_loop(A, B, np.eye(2), found.gains["K"], found.gains["L"], 200.0)
    norm = theirs(loop, inputs, np.eye(2, 5), np.zeros((2, 3)))
    assert found.norm.upper == pytest.approx(norm, rel=1e-6)
    assert norm <= found.promised


@pytest.mark.parametrize("seed", range(4))
def test_state_feedback_tends_to_the_regulator(seed):
    """Where gamma is large, disturbance does not matter: u = -R^-1 B'P x of the Riccati equation."""
    a, b, e, _ = plant(seed)
    n, m = b.shape
    C, D = np.vstack([np.eye(n), np.zeros((m, n))]), np.vstack([np.zeros((n, m)), np.eye(m)])
    least = state_feedback(a, b, e, C, D).promised
    found = state_feedback(a, b, e, C, D, gamma=1e3 * least)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    K, _, _ = control.lqr(a, b, np.eye(n), np.eye(m))
    np.testing.assert_allclose(found.gains["K"], K, atol=1e-4 * np.abs(K).max())  # 1/gamma^2 and the margins


@pytest.mark.parametrize("seed", range(4))
def test_observer_tends_to_the_kalman_filter(seed):
    a, _, e, c = plant(seed)
    r, q = len(c), e.shape[1]
    E, F = np.hstack([e, np.zeros((len(a), r))]), np.hstack([np.zeros((r, q)), 0.3 * np.eye(r)])
    found = observer(a, c, E, F, gamma=1e3 * observer(a, c, E, F).promised)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    L, _, _ = control.lqe(a, e, c, np.eye(q), 0.09 * np.eye(r))
    np.testing.assert_allclose(found.gains["L"], L, atol=1e-3 * np.abs(L).max())  # 1/gamma^2 and the margins


@pytest.mark.parametrize("seed", range(6))
def test_smallest_gamma_of_state_feedback_is_that_of_riccati(seed):
    a, b, e, _ = plant(seed)
    n, m = b.shape
    C, D = np.vstack([np.eye(n), np.zeros((m, n))]), np.vstack([np.zeros((n, m)), np.eye(m)])
    found = state_feedback(a, b, e, C, D)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.promised / 1.02 == pytest.approx(smallest_gamma(a, b, e, np.eye(n), 1.0), rel=1e-4)  # margins


@pytest.mark.parametrize("seed", range(6))
def test_smallest_gamma_of_the_observer_is_that_of_the_dual_riccati(seed):
    a, _, e, c = plant(seed)
    r, q = len(c), e.shape[1]
    E, F = np.hstack([e, np.zeros((len(a), r))]), np.hstack([np.zeros((r, q)), 0.3 * np.eye(r)])
    found = observer(a, c, E, F)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    least = smallest_gamma(a.T, c.T, np.eye(len(a)), e @ e.T, 0.09)
    assert found.promised / 1.02 == pytest.approx(least, rel=1e-4)
