"""Truth: the definition of the transform, and CasADi's derivatives."""

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.laws import PerformanceFunnel
from casadi_gnc.laws.performance_funnel import GUARD

FUNNEL = PerformanceFunnel(
    ca.DM([0.25, 0.28, 0.095]),
    ca.DM([3e-5, 1.4e-5, 5e-5]),
    ca.DM([0.025, 0.03, 0.02]),
    ca.DM([1, 1, 0.2]),
    ca.DM([0.1, 0.1, 1]),
)


@pytest.fixture(scope="module")
def parts():
    t, s = ca.SX.sym("t"), ca.SX.sym("s", 3)
    error = FUNNEL.error(t, s)
    return ca.Function(
        "parts",
        [t, s],
        [error, FUNNEL.width(t), FUNNEL.width_rate(t), FUNNEL.spread(t, s), ca.diag(ca.jacobian(error, s)),
         ca.jacobian(FUNNEL.width(t), t), FUNNEL.left(t, s), FUNNEL.use(t, s)],
    )  # fmt: skip


def test_transform_inverts_the_papers_s(parts, rng):
    """(25)-(26): sigma = rho S(eps), S = (max e^eps - min e^-eps)/(e^eps + e^-eps)."""
    low, high = np.array([1, 1, 0.2]), np.array([0.1, 0.1, 1.0])
    for t in (0.0, 30.0, 300.0):
        eps = rng.uniform(-2, 2, 3)
        s_of = (high * np.exp(eps) - low * np.exp(-eps)) / (np.exp(eps) + np.exp(-eps))
        width = np.array(parts(t, np.zeros(3))[1]).ravel()
        error = np.array(parts(t, width * s_of)[0]).ravel()
        assert np.allclose(error, eps - 0.5 * np.log(low / high), atol=1e-11)


def test_slopes_are_derivatives(parts, rng):
    for t in (0.0, 50.0):
        s = np.array(parts(t, np.zeros(3))[1]).ravel() * rng.uniform(-0.15, 0.09, 3)
        _, _, width_rate, spread, slope, expected_rate, left, use = (np.array(out).ravel() for out in parts(t, s))
        assert np.allclose(1 / spread, slope, rtol=1e-10)
        assert np.allclose(width_rate, expected_rate, rtol=1e-12)
        assert not left[0]
        assert 0 < use[0] < 1


def test_zero_error_at_zero(parts):
    assert np.allclose(np.array(parts(10.0, np.zeros(3))[0]), 0, atol=1e-16)


def test_outside_is_told_and_finite(parts):
    for s in ([0.03, 0, 0], [-0.3, 0, 0], [0, 0, -0.02], [np.nan, 0, 0], [1e3, -1e3, 1e3]):
        outputs = [np.array(out) for out in parts(0.0, s)]
        assert outputs[6][0] == 1
        if np.all(np.isfinite(s)):
            assert all(np.all(np.isfinite(out)) for out in outputs[:4])
            assert np.all(outputs[3] > 0.1 * GUARD * 1e-5)
