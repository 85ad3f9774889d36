"""Truth: the same steps on the covariance itself, in extended precision where digits are lost."""

import casadi as ca
import mpmath
import numpy as np
import pytest

from casadi_gnc.navigation.square_root import Factors

N = 6


def packed(p: np.ndarray) -> np.ndarray:
    """Return D and U of P = U D U', by elimination from the last row."""
    d, u, rest = np.zeros(N), np.eye(N), p.copy()
    for j in reversed(range(N)):
        d[j] = rest[j, j]
        u[:j, j] = rest[:j, j] / d[j]
        rest[:j, :j] -= d[j] * np.outer(u[:j, j], u[:j, j])
    return np.r_[d, u[np.triu_indices(N, 1)]]


def whole(column: np.ndarray) -> np.ndarray:
    u = np.eye(N)
    u[np.triu_indices(N, 1)] = column[N:]
    return u @ np.diag(column[:N]) @ u.T


@pytest.fixture(scope="module")
def steps():
    column, f, q = ca.SX.sym("p", N * (N + 1) // 2), ca.SX.sym("f", N, N), ca.SX.sym("q", N)
    h, r = ca.SX.sym("h", N), ca.SX.sym("r")
    factors = Factors.unpacked(column, N)
    told, gain = factors.told(ca.vertsplit(h), r)
    return {
        "moved": ca.Function("moved", [column, f, q], [factors.moved(f, ca.vertsplit(q)).packed()]),
        "told": ca.Function("told", [column, h, r], [told.packed(), ca.vertcat(*gain)]),
        "variances": ca.Function("variances", [column], [ca.vertcat(*(factors.variance(i) for i in range(N)))]),
    }


def test_both_steps_are_kalmans(steps, rng):
    for _ in range(20):
        a, f = rng.standard_normal((N, N)), rng.standard_normal((N, N))
        p, q, h, r = a @ a.T + 0.1 * np.eye(N), rng.uniform(0, 1, N), rng.standard_normal(N), 0.3
        column = packed(p)
        assert np.allclose(whole(column), p, rtol=1e-11, atol=1e-12)
        assert np.allclose(np.array(steps["variances"](column)).ravel(), np.diag(p))
        moved = whole(np.array(steps["moved"](column, f, q)).ravel())
        assert np.allclose(moved, f @ p @ f.T + np.diag(q), rtol=1e-9, atol=1e-9)
        later, gain = (np.array(each).ravel() for each in steps["told"](column, h, r))
        k = p @ h / (h @ p @ h + r)
        assert np.allclose(gain, k, rtol=1e-9, atol=1e-10)
        assert np.allclose(whole(later), p - np.outer(k, h @ p), rtol=1e-9, atol=1e-9)


def test_no_row_no_change(steps, rng):
    a = rng.standard_normal((N, N))
    column = packed(a @ a.T + np.eye(N))
    later, gain = (np.array(each).ravel() for each in steps["told"](column, np.zeros(N), 0.1))
    assert np.array_equal(later, column)
    assert not gain.any()


def test_digits_survive_a_sure_measurement(steps):
    """P = I, told to a millionth of a digit's half: P - k h' P loses all in double, the factors keep nine digits."""
    h, r = np.array([1.0, 1, 0, 0, 1e-3, 0]), 1e-18
    later, _ = (np.array(each).ravel() for each in steps["told"](packed(np.eye(N)), h, r))
    with mpmath.workdps(60):
        mh, total = mpmath.matrix(h.tolist()), mpmath.mpf(r)
        total += (mh.T * mh)[0]
        p = mpmath.eye(N) - mh * mh.T / total
        along = (mh.T * p * mh)[0]
    u = np.eye(N)
    u[np.triu_indices(N, 1)] = later[N:]
    found = float(np.sum((u.T @ h) ** 2 * later[:N]))
    assert found == pytest.approx(float(along), rel=1e-9)
    assert np.all(later[:N] > 0)
