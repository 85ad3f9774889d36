"""Recipes against Riccati equations and the published design."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import (
    GainStatus,
    LmiStatus,
    box_vertices,
    input_ellipsoid,
    intermediate_observer,
    observer,
    sample_s,
    state_feedback,
)
from casadi_gnc.synthesis.gains import certify_gains
from casadi_gnc.synthesis.recipes.shi2020_theorem1 import printed_data, theorem1

BACKENDS = ["clarabel", "scs", "barrier"]
A, B = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]])
C, D = np.vstack([np.eye(2), np.zeros((1, 2))]), np.array([[0], [0], [1.0]])


def riccati(a, b, e, q, r, gamma):
    """Return the stabilising solution of the H-infinity Riccati equation, or None."""
    weights = np.diag(np.concatenate([np.full(b.shape[1], r), np.full(e.shape[1], -(gamma**2))]))
    try:
        P = solve_continuous_are(a, np.hstack([b, e]), q, weights)
    except (np.linalg.LinAlgError, ValueError):
        return None
    loop = a - b @ b.T @ P / r + e @ e.T @ P / gamma**2
    positive = np.linalg.eigvalsh(P)[0] > -1e-9 * np.linalg.norm(P)
    return P if positive and np.linalg.eigvals(loop).real.max() < 0 else None


def smallest_gamma(a, b, e, q, r):
    low, high = 1e-3, 1e3
    for _ in range(60):
        middle = np.sqrt(low * high)
        low, high = (low, middle) if riccati(a, b, e, q, r, middle) is not None else (middle, high)
    return high


@pytest.mark.parametrize("backend", BACKENDS)
def test_state_feedback_is_the_riccati_equation(backend):
    found = state_feedback(A, B, B, C, D, backend=backend)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    least = smallest_gamma(A, B, B, C.T @ C, 1.0)
    assert found.promised == pytest.approx(1.02 * least, rel=1e-4)
    P = riccati(A, B, B, C.T @ C, 1.0, found.promised)
    np.testing.assert_allclose(found.gains["K"], B.T @ P, rtol=1e-3)  # the margins, near the edge of feasibility
    assert found.norm.upper <= found.promised


def test_state_feedback_tends_to_the_regulator():
    found = state_feedback(A, B, B, C, D, gamma=1e4)
    P = solve_continuous_are(A, B, np.eye(2), np.eye(1))
    np.testing.assert_allclose(found.gains["K"], B.T @ P, rtol=1e-3)


def test_observer_is_the_dual_riccati_equation():
    measured, noise = np.eye(1, 2), 0.1
    E, F = np.hstack([B, np.zeros((2, 1))]), np.array([[0, noise]])
    found = observer(A, measured, E, F)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    # The dual plant: A', C', error weights as disturbance, E E' as weight, noise^2 as price.
    least = smallest_gamma(A.T, measured.T, np.eye(2), B @ B.T, noise**2)
    assert found.promised == pytest.approx(1.02 * least, rel=1e-4)
    kalman = observer(A, measured, E, F, gamma=10.0)  # a hundred times the smallest
    S = solve_continuous_are(A.T, measured.T, B @ B.T, noise**2 * np.eye(1))
    np.testing.assert_allclose(kalman.gains["L"], S @ measured.T / noise**2, rtol=1e-3)


def test_a_gain_that_runs_away_is_named_and_bounded():
    free = state_feedback(A, B, B, np.eye(2), np.zeros((2, 1)))
    assert free.status is GainStatus.RUNS_AWAY
    with pytest.raises(SynthesisError, match="gain runs to infinity; give fastest_rad_s"):
        free.gains  # noqa: B018
    bounded = state_feedback(A, B, B, np.eye(2), np.zeros((2, 1)), fastest_rad_s=5.0)
    assert bounded.status is GainStatus.CERTIFIED, bounded.sentence()
    assert bounded.poles.real.min() >= -5.0
    watcher = observer(A, np.eye(1, 2), B, np.zeros((1, 1)), fastest_rad_s=5.0)
    assert watcher.status is GainStatus.CERTIFIED, watcher.sentence()
    assert watcher.poles.real.min() >= -5.0


@pytest.mark.parametrize("backend", BACKENDS)
def test_input_ellipsoid(backend):
    vertices = box_vertices([-4, -0.1], [4, 0.1])
    found = input_ellipsoid(A, B, vertices, 17.0, 0.1, backend=backend)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.poles[0].real <= -0.1
    used = 17.0 * np.sqrt(found.lmis["share"][0, 0])
    assert found.peak.bound <= used * 1.01 <= 17.0  # the ellipsoid bounds the true peak
    if backend == "clarabel":
        each = input_ellipsoid(A, B, vertices, 17.0, 0.1, per_channel=True)
        np.testing.assert_allclose(each.gains["K"], found.gains["K"], rtol=1e-3)  # one channel: the same problem
        fast = input_ellipsoid(A, B, vertices, 17.0, 0.3)
        assert fast.status is GainStatus.INFEASIBLE
        assert {"decay", "limit", "share of the limit"} < set(fast.lmis.conflict)
        assert "'decay'" in fast.sentence()


@pytest.mark.parametrize("backend", ["clarabel", "barrier"])
def test_intermediate_observer_as_repaired(backend):
    """Derived independently, at s = 0.3: gamma 3.21, true norm 2.30, K = (30.9, 42.0)."""
    found = intermediate_observer(A, B, 200.0, s=0.3, backend=backend)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.promised == pytest.approx(3.21, abs=0.005)  # three digits
    assert found.norm.upper == pytest.approx(2.30, abs=0.005)
    np.testing.assert_allclose(found.gains["K"], [[30.9, 42.0]], rtol=3e-3)


def test_intermediate_observer_sampled():
    found = sample_s(A, B, 200.0, [0.1, 1.0])
    assert found[0.1].promised == pytest.approx(4.68, abs=0.005)
    assert found[0.1].norm.upper == pytest.approx(2.74, rel=0.01)  # L is flat at the optimum, hence a percent
    assert found[1.0].promised == pytest.approx(2.57, abs=0.005)
    assert found[1.0].norm.upper == pytest.approx(1.89, rel=0.01)
    np.testing.assert_allclose(found[0.1].gains["K"], [[17.2, 27.8]], rtol=5e-3)
    np.testing.assert_allclose(found[1.0].gains["K"], [[78.8, 94.1]], rtol=5e-3)


@pytest.mark.parametrize("backend", BACKENDS)
def test_theorem_1_as_printed_is_infeasible(backend):
    answer = theorem1(**printed_data(), backend=backend)
    assert answer.status is LmiStatus.INFEASIBLE
    assert answer.conflict == ("(26) input",)
    assert next(iter(answer.infeasibility.shares)) == "(26) input"
    assert "'(26) input' cannot be met by itself" in answer.sentence()


def test_gains_that_fail_are_no_success():
    good = state_feedback(A, B, B, C, D)
    K = good.gains["K"]
    cases = [
        (A + B @ K, {}, GainStatus.UNSTABLE),
        (A - B @ K * 1e9, {}, GainStatus.RUNS_AWAY),
        (A - B @ K, {"promised": 0.5, "norm": good.norm}, GainStatus.NORM_EXCEEDED),
        (np.full((2, 2), np.nan), {}, GainStatus.UNSTABLE),
    ]
    for loop, extra, status in cases:
        found = certify_gains({"K": K}, good.lmis, loop, 1.0, **extra)
        assert found.status is status
        with pytest.raises(SynthesisError):
            found.gains  # noqa: B018
        assert len(found.sentence()) > 40
    wide = input_ellipsoid(A, B, box_vertices([-4, -0.1], [4, 0.1]), 17.0, 0.1)
    small = certify_gains(wide.gains, wide.lmis, A - B @ wide.gains["K"], 1.0, peak=wide.peak, limit=1.0)
    assert small.status is GainStatus.INPUT_EXCEEDED
    assert "limit 1" in small.sentence()


def test_bad_plants_are_refused():
    for call, words in (
        (lambda: state_feedback(A, B.T, B, C, D), r"B has shape \(1, 2\), expected \(2, 2\)"),
        (lambda: state_feedback(A, B, B, C, D, slack=0.0), "slack 0.0; expected positive"),
        (lambda: observer(A, np.eye(1, 2), B, np.eye(3)), r"F has shape \(3, 3\), expected \(1, 1\)"),
        (lambda: input_ellipsoid(A, B, np.eye(2), -1.0, 0.1), "limit is -1.0"),
        (lambda: intermediate_observer(A, B, -1.0), "varpi is -1.0, expected a positive number"),
        (lambda: intermediate_observer(A, B, 1.0, C=np.ones((2, 2))), "C is singular"),
        (lambda: state_feedback([[np.nan]], [[1]], [[1]], [[1]], [[1]]), "A has shape .* finite numbers"),
    ):
        with pytest.raises(SynthesisError, match=words):
            call()
    stuck = state_feedback([[1.0]], [[0.0]], [[1.0]], [[1.0]], [[0.0]])
    assert stuck.status in (GainStatus.INFEASIBLE, GainStatus.UNDECIDED)
    assert not stuck.is_certified
