"""Truth: mpmath at 60 digits, rounded to the nearest double."""

import casadi as ca
import mpmath
import numpy as np

from casadi_gnc.mathematics import exact

mpmath.mp.dps = 60


def test_numbers_are_correctly_rounded(rng):
    for x in [*rng.uniform(-30, 30, 200), 1e-17, -1e-9, 0.0, 2.7, np.pi / 7]:
        m = mpmath.mpf(float(x))
        assert exact.phi1(x) == float(mpmath.expm1(m) / m if x else 1)
        assert exact.cos_sin(x) == (float(mpmath.cos(m)), float(mpmath.sin(m)))
        assert exact.angle(*np.sort([x, -2.3])) == float(mpmath.atan2(max(m, -2.3), min(m, -2.3)))
        if x > 0:
            assert exact.log(float(x)) == float(mpmath.log(m))


def test_log_of_a_column():
    assert np.array_equal(np.array(exact.log(ca.DM([1.0, 2.0]))).ravel(), [0.0, float(mpmath.log(2))])


def test_symbolic_phi1_is_smooth_through_zero():
    x = ca.SX.sym("x")
    phi = ca.Function("phi", [x], [exact.phi1(x), ca.gradient(exact.phi1(x), x)])
    for value in (-3.0, -1e-7, -1e-9, 0.0, 1e-9, 1e-7, 2.0):
        m = mpmath.mpf(value)
        slope = (mpmath.exp(m) * (m - 1) + 1) / m**2 if value else mpmath.mpf(1) / 2
        found, found_slope = (float(out) for out in phi(value))
        assert abs(found - exact.phi1(value)) < 3e-16
        # expm1(x)/x differentiated loses eps/x near zero; the switch at 1e-8 bounds the loss.
        assert abs(found_slope - float(slope)) < 5e-8
