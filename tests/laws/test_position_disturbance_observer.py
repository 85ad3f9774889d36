"""Truth: the observer as published, the closed form of its sampling limit, the motion of a point mass."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.errors import LawError
from casadi_gnc.laws.position_disturbance_observer import PositionDisturbanceObserver
from casadi_gnc.laws.sampled_loop import longest_hold, spectral_radius
from casadi_gnc.laws.sampling import advance
from casadi_gnc.mechanics.relative_motion import PairModel

M0, GAIN = 20.0, 2519.2
BODY, TRUTH = PairModel(M0, 6.3135e-4), PairModel(4000 / 140, 6.3135e-4)
K = np.hstack([0.4364 * np.eye(3), 4.5657 * np.eye(3)])
FLOWN = replace(BODY, flown=TRUTH.mass)
HELD = frozenset({"held_feed_through"})


def law(**changes) -> PositionDisturbanceObserver:
    gains = {"controller_gain": ca.DM(K), "observer_gain": GAIN}
    return PositionDisturbanceObserver(**{"body": FLOWN, **gains, **changes})


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


def test_it_is_the_published_observer(rng):
    """w^ = p + L v, p' = -L (B w^ + A eta + B u), p(0) = -L v(0), with p = m0 times the memory."""
    of, y, u = law(), rng.normal(size=6), rng.normal(size=3)
    p = rng.normal(size=3)
    disturbance = p + GAIN * y[3:]
    free = values(BODY.acceleration(ca.DM(y[:3]), ca.DM(y[3:])))
    expected = -GAIN * (disturbance / M0 + free + u / M0)
    memory = ca.DM(p / M0)
    assert np.allclose(values(of.disturbance(ca.DM(y), memory)), disturbance, rtol=1e-13)
    assert np.allclose(values(of.rate(0.0, ca.DM(y), memory, u, ca.DM(u))) * M0, expected, rtol=1e-12)
    assert np.allclose(values(of.command(0.0, ca.DM(y), memory)), -K @ y - disturbance, rtol=1e-12)
    assert np.allclose(values(of.start(0.0, ca.DM(y))) * M0, -GAIN * y[3:], rtol=1e-13)


def test_printed_gain_is_a_multiple_of_the_identity():
    """L = 2519.15 I + 0.01255 r0 r0' to 2 in the last printed digit; eigenvalues within 1.5e-4 of each other."""
    start = np.array([2.0, 3.0, 4.0])
    matrix = 2519.15 * np.eye(3) + 0.01255 * np.outer(start, start)
    printed = [[2519.2, 0.0753, 0.1004], [0.0753, 2519.3, 0.1508], [0.1004, 0.1508, 2519.4]]
    assert np.allclose(np.diag(matrix), np.diag(printed), rtol=0, atol=0.051)
    assert np.allclose(matrix - np.diag(np.diag(matrix)), printed - np.diag(np.diag(printed)), rtol=0, atol=2.1e-4)
    eigenvalues = np.linalg.eigvalsh(matrix)
    assert eigenvalues[-1] / eigenvalues[0] - 1 < 1.5e-4


def test_limit_of_the_held_feed_through_is_two_masses_over_the_gain():
    """With K = 0 the loop is v+ = v - (h L/m) v + ..: unstable beyond 2 m/L exactly; K shifts that by 0.2 %."""
    found = longest_hold(law(hold=0.1, printed=HELD), TRUTH)
    assert found == pytest.approx(2 * TRUTH.mass / GAIN, rel=3e-3)
    assert f"{1e3 * found:.1f}" == "22.7"
    assert spectral_radius(law(hold=0.1, printed=HELD), TRUTH) == pytest.approx(7.8, abs=0.05)


def test_long_hold_is_refused_with_the_reason():
    with pytest.raises(LawError, match=r"0\.1 s is too long.*28\.57 kg the longest is 22\.7 ms.*held_feed_through"):
        law(hold=0.1, printed=HELD).check_hold()
    with pytest.raises(LawError, match=r"20 kg the longest is 15\.9 ms"):
        law(hold=0.1, printed=HELD, body=BODY).check_hold()


@pytest.mark.parametrize(("hold", "printed"), [(0.0, HELD), (0.02, HELD), (0.1, frozenset()), (1.0, frozenset())])
def test_what_works_is_not_refused(hold, printed):
    law(hold=hold, printed=printed).check_hold()


def test_symbolic_gains_are_not_judged():
    law(observer_gain=ca.SX.sym("L"), hold=0.1, printed=HELD).check_hold()


@pytest.mark.parametrize(("printed", "right"), [(frozenset(), True), (HELD, False)])
def test_sampled_feed_through_estimates_without_bias(printed, right):
    """A point mass under a constant force, 10 Hz: the estimate is the force; with the held form it is not."""
    push, hold = np.array([0.3, -0.2, 0.1]), 0.1
    of = replace(law(hold=hold, printed=printed), body=PairModel(M0, 0.0))
    y = np.zeros(6)
    m, none = of.start(0.0, ca.DM(y)), ca.DM.zeros(3)
    for _ in range(50):
        m = advance(of, 0.0, ca.DM(y), m, none, none)
        y = np.concatenate([y[:3] + hold * y[3:] + hold**2 / 2 * push / M0, y[3:] + hold * push / M0])
    # The pole e^(-12.6) leaves rounding only.
    assert np.allclose(values(of.disturbance(ca.DM(y), m)), push, atol=1e-10) == right
