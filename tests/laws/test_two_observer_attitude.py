"""Truth: the paper's equations in its own form and sign, finite differences, and closed forms."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
import wheels_numpy as oracle

from casadi_gnc.laws import advance
from casadi_gnc.laws.finite_time_fault_tolerant import FiniteTimeFaultTolerant
from casadi_gnc.laws.two_observer_attitude import TwoObserverAttitude
from casadi_gnc.mechanics import attitude
from casadi_gnc.mechanics import reaction_wheels as wheels
from casadi_gnc.mechanics.rigid_body import RigidBody

C0 = oracle.R_PRINTED @ (oracle.C_BAR - 2.0)
BODY = wheels.Gyrostat(ca.DM(oracle.J0), orbit_rate=oracle.W0, wheels=wheels.WheelArray(ca.DM(C0), oracle.JW))
GAINS = {
    "attitude_gain": oracle.K1, "rate_gain": oracle.K2, "compensator_gain": oracle.K3, "compensator_decay": oracle.K4,
    "attitude_observer_gain": oracle.GAM, "observer_gain": oracle.LAM, "filter_time_constant": oracle.TAU,
}  # fmt: skip
LAW = TwoObserverAttitude(body=BODY, **GAINS)


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


def paper(y: np.ndarray, m: np.ndarray, uc: np.ndarray | None = None):
    """u_0 and the rates of s, x2d, zeta, eta in the paper's form and sign (eqs 26 to 38, corrected)."""
    sh, wh, speed = y[:3], y[3:6], y[6:]
    s, x2d, zeta, eta = m.reshape(4, 3)
    g = oracle.g_matrix(sh)
    d1, inverse = s + oracle.GAM * sh, np.linalg.inv(oracle.J0)
    y2 = x2d + np.linalg.solve(g, oracle.K1 * sh + d1)
    s2 = wh - x2d
    d2 = eta + oracle.LAM * s2
    f = inverse @ (-np.cross(wh, oracle.J0 @ wh + C0 @ speed * oracle.JW) + oracle.gravity(sh, oracle.J0))
    u0 = oracle.J0 @ (g.T @ sh + f + oracle.K2 * s2 + d2 + y2 / oracle.TAU) + oracle.K3 * zeta
    uc = u0 if uc is None else uc
    rates = (
        -oracle.GAM * s - oracle.GAM * (g @ wh + oracle.GAM * sh),
        -y2 / oracle.TAU,
        -oracle.K4 * zeta + uc - u0,
        -oracle.LAM * eta - oracle.LAM * (f - inverse @ uc + y2 / oracle.TAU + oracle.LAM * s2),
    )
    return u0, rates


def ours_of(m: np.ndarray) -> ca.DM:
    """The paper's memory as this law keeps it: zeta changes its sign, eta is on omega^ and not on S2."""
    s, x2d, zeta, eta = m.reshape(4, 3)
    return ca.DM(
        LAW.memory.pack(
            rate_command=ca.DM(x2d),
            attitude_observer=ca.DM(s),
            observer=ca.DM(eta - oracle.LAM * x2d),
            missing=ca.DM(-zeta),
            last_mrp=ca.DM.zeros(3),
        )
    )


def test_law_is_the_papers_in_another_form(rng):
    for _ in range(5):
        y = np.concatenate([rng.uniform(-0.6, 0.6, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(-90, 90, 4)])
        m, uc = rng.uniform(-1, 1, 12), rng.uniform(-1, 1, 3)
        u0, _ = paper(y, m)
        column = ours_of(m)
        wanted = LAW.command(0.0, ca.DM(y), column)
        assert np.allclose(values(wanted), -u0, rtol=1e-12, atol=1e-10)
        _, (s, x2d, zeta, eta) = paper(y, m, uc)
        rate = LAW.memory.split(ca.DM(LAW.rate(0.0, ca.DM(y), column, wanted, ca.DM(-uc))))
        assert np.allclose(values(rate.attitude_observer), s)
        assert np.allclose(values(rate.rate_command), x2d)
        assert np.allclose(values(rate.missing), -zeta)
        assert np.allclose(values(rate.observer), eta - oracle.LAM * x2d)


def test_first_memory_claims_nothing():
    y = ca.DM([*oracle.SIGMA0, *oracle.OMEGA0, 0, 0, 0, 0])
    for law in (LAW, replace(LAW, hold=0.1)):
        m = law.start(0.0, y)
        shown = law.show(0.0, y, m)
        assert np.allclose(values(shown["attitude_drift"]), 0, atol=1e-15)
        assert np.allclose(values(shown["disturbance_estimate"]), 0, atol=1e-15)
        # The filter starts on its target, -4 G'(k1 sigma)/... = -G^-1 k1 sigma.
        target = -np.linalg.solve(oracle.g_matrix(oracle.SIGMA0), oracle.K1 * oracle.SIGMA0)
        assert np.allclose(values(law.memory.split(ca.DM(m)).rate_command), target)


def saturated_slope(law: TwoObserverAttitude) -> float:
    """Return d(zeta')/d(zeta) while the achieved torque is cut to a constant."""
    y, m = ca.SX.sym("y", 10), law.memory.symbol("m")
    rate = law.rate(0.0, y, m, law.command(0.0, y, m), ca.DM([0.5, 0, 0]))
    rows = law.memory.place("missing")
    slope = ca.Function("slope", [y, m], [ca.jacobian(rate, m)[rows, rows]])
    return float(slope(np.full(10, 0.1), np.zeros(15))[0, 0])


def test_printed_anti_windup_runs_away():
    """k3 = 22, k4 = 20 satisfy Theorem 1 (16 >= 14.52) and give zeta' = +2 zeta when saturated."""
    margin = 2 * oracle.K2 * 20.0 - 3 * (22.0 / 10.0) ** 2
    assert margin > 0
    law = replace(LAW, compensator_gain=22.0)
    assert saturated_slope(law) == pytest.approx(-42.0)
    assert saturated_slope(replace(law, printed=frozenset({"anti_windup_sign"}))) == pytest.approx(+2.0)


def test_printed_bracket_leaves_the_inertia_out(rng):
    """As (36) closes it, f, u_g, k2 S2, delta2 and y2/tau are accelerations added to a torque."""
    printed = replace(LAW, printed=frozenset({"inertia_bracket"}))
    y = np.concatenate([rng.uniform(-0.6, 0.6, 3), rng.uniform(-0.3, 0.3, 3), rng.uniform(-90, 90, 4)])
    m = rng.uniform(-1, 1, 12)
    u0, _ = paper(y, m)
    cross = oracle.g_matrix(y[:3]).T @ y[:3]
    rest = np.linalg.solve(oracle.J0, u0 - oracle.K3 * m[6:9]) - cross
    expected = oracle.J0 @ cross + oracle.K3 * m[6:9] + rest
    assert np.allclose(values(printed.command(0.0, ca.DM(y), ours_of(m))), -expected)


def test_vertical_has_length_one_and_turns_with_the_body(rng):
    """c' = -w x c, by a central difference along the kinematics; printed, R3 is 1 + s's times too long."""
    for _ in range(5):
        s, w, h = rng.uniform(-0.8, 0.8, 3), rng.uniform(-1, 1, 3), 1e-6
        rate = values(attitude.mrp_rate(ca.DM(s), ca.DM(w)))
        c = values(attitude.reference_z(ca.DM(s)))
        ahead, behind = (values(attitude.reference_z(ca.DM(s + sign * h * rate))) for sign in (1, -1))
        assert np.linalg.norm(c) == pytest.approx(1, abs=1e-14)
        assert np.allclose((ahead - behind) / (2 * h), -np.cross(w, c), atol=1e-9)
    # The printed torque is (1 + s's)^2 = 1.67 times too large at the paper's start.
    y, m = ca.DM([*oracle.SIGMA0, 0, 0, 0, 0, 0, 0, 0]), ca.DM.zeros(15)
    torques = [
        values(law.command(0.0, y, m)) for law in (LAW, replace(LAW, printed=frozenset({"gravity_denominator"})))
    ]
    ratio = 1.2925**2
    expected = -(ratio - 1) * oracle.gravity(oracle.SIGMA0, oracle.J0)
    assert np.allclose(torques[1] - torques[0], expected, rtol=1e-3)


def test_drift_of_the_measured_attitude_needs_the_factor_two(rng):
    """delta_1 of (16), what the first observer sees: s^' - G(s^) w^; without the factor 2 it is 1e-3 off."""

    def g(s):
        return oracle.g_matrix(s)

    for _ in range(5):
        s, w = rng.uniform(-0.4, 0.4, 3), rng.uniform(-0.1, 0.1, 3)
        v1, v2, v1_rate = (0.02 * rng.uniform(-1, 1, 3) for _ in range(3))
        sh, wh, eye = s + v1, w + v2, np.eye(3)
        vx = np.array([[0, -v1[2], v1[1]], [v1[2], 0, -v1[0]], [-v1[1], v1[0], 0]])

        def bracket(factor, sh=sh, v1=v1, vx=vx, eye=eye):
            outer = factor * (np.outer(sh, v1) + np.outer(v1, sh))
            return ((2 * sh @ v1 - v1 @ v1) * eye - 2 * vx - outer + 2 * np.outer(v1, v1)) / 4

        truth = g(s) @ w + v1_rate - g(sh) @ wh
        assert np.allclose(bracket(2) @ wh - g(s) @ v2 + v1_rate, truth, atol=1e-15)
        assert not np.allclose(bracket(1) @ wh - g(s) @ v2 + v1_rate, truth, atol=1e-6)


@pytest.mark.parametrize("gamma_h", [0.1, 1.0, 3.0])
def test_sampled_drift_estimate_has_its_exact_pole(gamma_h):
    """A constant drift of the measured attitude at rest, seen every 0.1 s: the error shrinks by e^(-gamma h)."""
    h, drift = 0.1, np.array([2e-3, -1e-3, 3e-3])
    law = replace(LAW, hold=h, attitude_observer_gain=gamma_h / h)
    found, m = [], None
    for k in range(20):
        y = ca.DM([*(k * h * drift), *np.zeros(7)])  # omega^ = 0: all of the motion is drift
        m = ca.DM(law.start(0.0, y)) if m is None else m
        found.append(values(law.show(0.0, y, m)["attitude_drift"]))
        m = ca.DM(advance(law, 0.0, y, m, ca.DM.zeros(3), ca.DM.zeros(3)))
    expected = np.outer(1 - np.exp(-gamma_h * np.arange(20)), drift)
    assert np.allclose(found, expected, atol=1e-12)


def test_change_to_the_shadow_set_claims_no_drift():
    before = np.array([0.8, -0.5, 0.4])
    after = -before / (before @ before)
    speeds = [0.02, 0.01, -0.03, 0, 0, 0, 0]
    y0, y1 = ca.DM([*before, *speeds]), ca.DM([*after, *speeds])
    m = LAW.jump(0.0, y0, LAW.start(0.0, y0))
    kept = ca.DM(LAW.jump(0.1, y0, m))
    assert np.array_equal(values(kept), values(m))
    jumped = ca.DM(LAW.jump(0.1, y1, m))
    assert np.allclose(values(LAW.show(0.1, y1, jumped)["attitude_drift"]), 0, atol=1e-14)
    assert np.abs(values(LAW.show(0.1, y1, ca.DM(m))["attitude_drift"])).max() > 10  # what it would have claimed
    same = LAW.memory.split(jumped)
    assert np.array_equal(values(same.rate_command), values(LAW.memory.split(ca.DM(m)).rate_command))
    # Small attitudes that change sign are no change of the set.
    y2, y3 = ca.DM([0.01, 0, 0, *speeds]), ca.DM([-0.01, 0, 0, *speeds])
    m = ca.DM(LAW.jump(0.0, y2, LAW.start(0.0, y2)))
    observer = LAW.memory.place("attitude_observer")
    assert np.array_equal(values(ca.DM(LAW.jump(0.1, y3, m))[observer]), values(m[observer]))


def test_a_body_without_wheels_needs_no_wheel_speeds():
    law = replace(LAW, body=RigidBody(ca.DM(oracle.J0), orbit_rate=oracle.W0))
    assert law.inputs.names == ("mrp", "rate")
    y, m = np.array([0.1, -0.2, 0.3, 0.01, 0.02, -0.03]), ca.DM(np.linspace(-1, 1, 15))
    still = np.append(y, np.zeros(4))
    assert np.allclose(values(law.command(0.0, ca.DM(y), m)), values(LAW.command(0.0, ca.DM(still), m)))


def test_finite_time_law_reaches_its_surface_and_then_zero():
    """On the surface s_i' = -Gamma |s|^gamma sign(s) for one axis (G = I/4): zero after a known time."""
    law = FiniteTimeFaultTolerant(
        body=RigidBody(ca.DM(oracle.J0)),
        surface_gain=0.5, surface_power=0.7, linear_gain=10.0, power_gain=4.0, power=0.4, floor=1e-4,
    )  # fmt: skip
    s0, h = 0.1, 0.02
    s, w = s0, -0.5 * s0**0.7
    for _ in range(round(20 / h)):
        torque = values(law.command(0.0, ca.DM([s, 0, 0, w, 0, 0]), ca.DM()))
        assert np.allclose(torque[1:], 0)
        w += h * torque[0] / 10.0
        s += h * (1 + s * s) / 4 * w
    # ds/dt = -(1 + s^2)/4 Gamma s^0.7 gives s^0.3 = s0^0.3 - 0.3 Gamma t/4: zero at 13.4 s.
    reached = s0**0.3 / (0.3 * 0.5 / 4)
    assert reached < 20
    assert abs(s) < 1e-4
    assert abs(w) < 1e-3


def test_finite_time_law_opposes_what_it_sees():
    law = FiniteTimeFaultTolerant(
        body=BODY, surface_gain=0.5, surface_power=0.7, linear_gain=1.0, power_gain=4.0, power=0.4
    )
    sh, wh, speed = np.array([0.3, -0.2, 0.004]), np.array([-0.1, 0.2, 0.3]), np.array([50.0, -20, 30, 10])
    surface = wh + 0.5 * np.sign(sh) * np.abs(sh) ** 0.7
    slope = 0.5 * 0.7 * np.maximum(np.abs(sh), 0.01) ** -0.3
    u0 = -np.cross(wh, oracle.J0 @ wh + C0 @ speed * oracle.JW)
    u0 += oracle.J0 @ (slope * (oracle.g_matrix(sh) @ wh)) + surface + 4 * np.sign(surface) * np.abs(surface) ** 0.4
    found = values(law.command(0.0, ca.DM([*sh, *wh, *speed]), ca.DM()))
    assert np.allclose(found, -u0)
