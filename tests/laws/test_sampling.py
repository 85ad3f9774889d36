"""Truth: scipy's matrix exponential, and scipy's integrator for what is not affine."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from casadi_gnc.laws import Law, advance
from casadi_gnc.signals import Layout, Signal

COUPLED = np.array([[0.0, 1.0, 0.0], [-9.0, -1.2, 0.5], [0.0, 0.0, -30.0]])


@dataclass(frozen=True, eq=False)
class Linear(Law):
    """m' = A m + y, one signal of three elements."""

    matrix: np.ndarray

    memory = Layout((Signal("state", 3),))

    def rate(self, t, y, m, wanted, achieved):
        return ca.mtimes(ca.DM(self.matrix), m) + y


@dataclass(frozen=True, eq=False)
class Mixed(Law):
    """An affine signal, one that leans on it, and one that is not affine."""

    memory = Layout((Signal("lag"), Signal("cubic"), Signal("leaning")))

    def rate(self, t, y, m, wanted, achieved):
        now = self.memory.split(m)
        return ca.vertcat(-40 * now.lag + y, -(now.cubic**3) + y, -now.leaning + now.cubic)


def advanced(law: Law, m: np.ndarray, y: float) -> np.ndarray:
    return np.array(ca.DM(advance(law, 0.0, ca.DM(y), ca.DM(m), ca.DM.zeros(3), ca.DM.zeros(3)))).ravel()


@pytest.mark.parametrize("matrix", [COUPLED, np.diag([-0.5, 0.0, -27.0]), np.zeros((3, 3))])
@pytest.mark.parametrize("hold", [0.01, 0.1, 1.0])
def test_affine_memory_is_exact(matrix, hold, rng):
    m, y = rng.normal(size=3), rng.normal()
    block = np.zeros((4, 4))
    block[:3, :3], block[:3, 3] = matrix, y
    expected = (expm(block * hold) @ np.append(m, 1))[:3]
    assert np.allclose(advanced(Linear(matrix, hold=hold), m, y), expected, rtol=1e-12, atol=1e-13)


def test_what_is_not_affine_does_not_spoil_what_is():
    """beta h = 4 would blow up a Runge-Kutta step; the affine lag stays exact beside the cubic."""
    law, m = Mixed(hold=0.1), np.array([1.0, 0.5, 0.2])
    found = advanced(law, m, 0.3)
    truth = solve_ivp(
        lambda t, s: [-40 * s[0] + 0.3, -(s[1] ** 3) + 0.3, -s[2] + s[1]], (0, 0.1), m, rtol=1e-12, atol=1e-14
    )
    assert found[0] == pytest.approx(truth.y[0, -1], abs=1e-11)
    # One RK4 step of 0.1 s: the local error is of order h^5.
    assert np.allclose(found[1:], truth.y[1:, -1], atol=1e-7)


def test_gains_may_be_symbols():
    """The gradient by a gain agrees with a central difference, through gain zero too."""

    @dataclass(frozen=True, eq=False)
    class Lag(Law):
        gain: ca.SX

        memory = Layout((Signal("state"),))

        def rate(self, t, y, m, wanted, achieved):
            return self.gain * (y - m)

    gain = ca.SX.sym("gain")
    moved = advance(Lag(gain, hold=0.5), 0.0, 2.0, ca.DM(1.0), 0.0, 0.0)
    f = ca.Function("f", [gain], [moved, ca.gradient(moved, gain)])
    for value in (0.0, 0.4, 3.0):
        quotient = (float(f(value + 1e-5)[0]) - float(f(value - 1e-5)[0])) / 2e-5
        assert float(f(value)[1]) == pytest.approx(quotient, abs=1e-6)
        assert float(f(value)[0]) == pytest.approx(2 - np.exp(-value * 0.5), abs=1e-12)
