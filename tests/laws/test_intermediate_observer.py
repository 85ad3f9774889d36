"""Truth: the observer as printed, scipy's integrator and matrix exponential, the exact motion of a pair."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from casadi_gnc.laws.approach import Approach
from casadi_gnc.laws.intermediate_observer import IntermediateObserver
from casadi_gnc.laws.sampled_loop import longest_hold, loop_matrix, spectral_radius
from casadi_gnc.laws.sampling import advance
from casadi_gnc.mechanics.relative_motion import PairModel
from casadi_gnc.status import StepStatus

N0, M0, VARPI = 6.3135e-4, 20.0, 200.0
BODY, TRUTH = PairModel(M0, N0), PairModel(4000 / 140, N0)
EYE, ZERO = np.eye(3), np.zeros((3, 3))
TURN = np.array([[0, 0, 0.0028], [0, 0, 0], [-0.0028, 0, 0]])
K = np.hstack([31.1662 * EYE + TURN, 40.7582 * EYE + 9 * TURN])
L = np.block([[3.3049 * EYE, 1.3034 * EYE], [2.5759 * EYE, 4.3737 * EYE]])
A = np.block([[ZERO, EYE], [N0**2 * np.diag([0, -1, 3]), 2 * N0 * np.array([[0, 0, 1], [0, 0, 0], [-1, 0, 0]])]])
B = np.vstack([ZERO, EYE / M0])


def law(**changes) -> IntermediateObserver:
    gains = {"controller_gain": ca.DM(K), "observer_gain": ca.DM(L), "disturbance_gain": VARPI}
    return IntermediateObserver(**{"body": BODY, **gains, **changes})


def values(expression) -> np.ndarray:
    return np.array(ca.DM(expression)).ravel()


def rates(of: IntermediateObserver):
    """Return the memory's rate as a function of (y, m, force), and its slope in m."""
    y, m, force = ca.SX.sym("y", 6), ca.SX.sym("m", 9), ca.SX.sym("force", 3)
    rate = of.rate(0.0, y, m, force, force)
    return ca.Function("rate", [y, m, force], [rate, ca.jacobian(rate, m)])


def printed_rate(y, s, u):
    """(15) to (18) in eta^ and xi^."""
    eta, xi = s[:6], s[6:]
    w = xi + VARPI * B.T @ eta
    return np.concatenate(
        [
            A @ eta + B @ u + B @ w + L @ (y - eta),
            -VARPI * B.T @ (A @ eta + B @ u + B @ xi + VARPI * B @ B.T @ eta),
        ]
    )


def test_poles_are_those_of_the_printed_observer():
    slope = np.array(rates(law())(np.zeros(6), np.zeros(9), np.zeros(3))[1])
    printed = np.column_stack([printed_rate(np.zeros(6), unit, np.zeros(3)) for unit in np.eye(9)])
    found, expected = (np.sort_complex(np.linalg.eigvals(matrix)) for matrix in (slope, printed))
    assert np.allclose(found, expected, rtol=0, atol=1e-12)


def test_estimates_are_those_of_the_printed_observer():
    """Any measurement, any force: the same estimates along the way."""
    of = rates(law())

    def seen(t):
        return np.array([2, 3, 4, 0, 0, 0]) * np.exp(-0.3 * t) + 0.1 * np.sin(t * np.arange(1, 7))

    def force(t):
        return 5 * np.cos(t * np.array([1.0, 0.7, 2.0]))

    times, strict = np.linspace(0, 10, 21), {"rtol": 1e-11, "atol": 1e-12}
    ours = solve_ivp(lambda t, s: values(of(seen(t), s, force(t))[0]), (0, 10), np.zeros(9), t_eval=times, **strict).y
    theirs = solve_ivp(lambda t, s: printed_rate(seen(t), s, force(t)), (0, 10), np.zeros(9), t_eval=times, **strict).y
    assert np.allclose(ours[:6], theirs[:6], atol=1e-8)
    assert np.allclose(ours[6:], theirs[6:] + VARPI * B.T @ theirs[:6], atol=1e-7)


def test_poles_of_the_loop_are_the_known_ones():
    """Computed independently for the design mass: -1.019 +- 0.721i, -4.477, -2.618, -0.583 on each axis."""
    loop = np.log(np.linalg.eigvals(loop_matrix(law(hold=1e-4), BODY)).astype(complex)) / 1e-4
    for pole, count in ((-1.019 + 0.721j, 3), (-4.477, 3), (-2.618, 3), (-0.583, 3)):
        assert (np.abs(loop - pole) < 2e-3).sum() == count


def estimates(of: IntermediateObserver, eta, disturbance, forces) -> np.ndarray:
    """Run the sampled observer beside the exact motion under held forces; return the errors before each force."""
    block = np.zeros((9, 9))
    block[:6, :6], block[:6, 6:] = A, B
    motion = expm(block * of.hold)
    y, m, force = ca.SX.sym("y", 6), ca.SX.sym("m", 9), ca.SX.sym("force", 3)
    corrected = of.jump(0.0, y, m)
    step = ca.Function("step", [y, m, force], [corrected, advance(of, 0.0, y, corrected, force, force)])
    memory, errors = values(of.start(0.0, ca.DM(eta))), []
    for push in forces:
        now, memory = (values(part) for part in step(eta, memory, push))
        errors.append(now - np.concatenate([eta, disturbance]))
        eta = (motion @ np.concatenate([eta, push + disturbance]))[:6]
    return np.array(errors)


START = np.array([5.0, -3.0, 2.0, -0.8, 0.5, 0.3])


@pytest.mark.parametrize("hold", [0.02, 0.1, 0.2, 0.4])
def test_sampled_estimate_is_unbiased_whatever_the_pair_does(hold, rng):
    """Closing, pushed and disturbed, the error shrinks with the slowest pole to rounding of numbers up to 1e4."""
    disturbance = np.array([0.7, -1.2, 0.4])
    count = round(80 / hold)
    errors = estimates(law(hold=hold), START, disturbance, rng.uniform(-5, 5, (count, 3)))
    assert np.abs(errors[0, 6:]).max() == pytest.approx(1.2)
    assert np.abs(errors[-1]).max() < 1e-8


def test_right_estimate_stays_right(rng):
    errors = estimates(law(hold=0.1), START, np.zeros(3), rng.uniform(-5, 5, (200, 3)))
    assert np.abs(errors).max() < 1e-9


def test_held_measurement_would_be_biased():
    """Why the innovation is taken at the sample: the continuous form under a held, ramping measurement errs by cm."""
    of, hold, velocity = rates(law()), 0.1, np.array([1.0, 0.0, 0.0])
    memory, eta = np.concatenate([START[:3], velocity, np.zeros(3)]), np.concatenate([START[:3], velocity])
    for _ in range(60):
        memory = solve_ivp(lambda t, s: values(of(eta, s, np.zeros(3))[0]), (0, hold), memory, rtol=1e-8).y[:, -1]  # noqa: B023
        eta = expm(A * hold) @ eta
    assert np.abs(memory[:3] - eta[:3]).max() > 0.01


@pytest.mark.parametrize(("hold", "tolerance"), [(0.01, 0.01), (0.1, 0.1)])
def test_sampled_poles_are_the_continuous_ones_to_first_order(hold, tolerance):
    """At 10 Hz the fastest pole, -4.48, is off by 8 %, the slowest by 0.4 %; ten times less at 100 Hz."""
    slope = np.array(rates(law())(np.zeros(6), np.zeros(9), np.zeros(3))[1])
    expected = np.sort(np.linalg.eigvals(slope).real)
    of = law(hold=hold)
    y, m = ca.SX.sym("y", 6), ca.SX.sym("m", 9)
    later = advance(of, 0.0, y, of.jump(0.0, y, m), ca.SX.zeros(3), ca.SX.zeros(3))
    step = np.array(ca.Function("step", [y, m], [ca.jacobian(later, m)])(0, 0))
    found = np.sort(np.log(np.linalg.eigvals(step).astype(complex)).real / hold)
    assert np.allclose(found, expected, rtol=tolerance)


def test_matrix_symbols_give_the_same_step():
    """MX in the place of SX, for who builds larger graphs: the same memory and command."""
    of, y, m = law(hold=0.1, approach_speed=0.3), ca.MX.sym("y", 6), ca.MX.sym("m", 9)
    step = ca.Function("step", [y, m], [of.jump(0.0, y, m), of.command(0.0, y, m), of.rate(0.0, y, m, y[:3], y[:3])])
    at = ca.DM(START), ca.DM(np.arange(9.0))
    expected = of.jump(0.0, *at), of.command(0.0, *at), of.rate(0.0, *at, at[0][:3], at[0][:3])
    for found, right in zip(step(*at), expected, strict=True):
        assert np.allclose(values(found), values(right), rtol=1e-14)


def test_jump_is_nothing_in_continuous_mode():
    y, m = ca.DM(START), ca.DM(np.arange(9.0))
    assert np.array_equal(values(law().jump(0.0, y, m)), values(m))


def test_observer_may_be_told_the_uncut_command():
    of, m, y = law(printed=frozenset({"observer_input"})), ca.DM.zeros(9), ca.DM(START)
    cut, asked = ca.DM([1.0, 1.0, 1.0]), ca.DM([9.0, 9.0, 9.0])
    assert np.allclose(values(of.rate(0.0, y, m, asked, cut) - law().rate(0.0, y, m, asked, cut))[3:6], 8 / M0)


@pytest.mark.parametrize("printed", [frozenset(), frozenset({"observer_start"})])
def test_start(printed):
    m = law(printed=printed).memory.split(law(printed=printed).start(0.0, ca.DM(START)))
    expected = np.zeros(6) if printed else START
    assert np.array_equal(np.append(values(m.position_estimate), values(m.velocity_estimate)), expected)
    assert not np.any(values(m.disturbance_estimate))


def test_pair_rests_exactly_at_the_point_it_is_held():
    """No force is left over at the stand-off point beyond what the orbit asks."""
    point = np.array([0.0, 0.0, 50.0])
    of = law(body=replace(BODY, port=tuple(point)))
    eta = np.concatenate([point, np.zeros(3)])
    force = values(of.command(0.0, ca.DM(eta), of.start(0.0, ca.DM(eta))))
    assert np.allclose(A @ eta + B @ force, 0, atol=1e-18)
    assert abs(force[2]) > 1e-4


class TestApproach:
    """The speed limit."""

    GAIN = ca.DM(K)

    def test_terminal_speed_is_nine_tenths_of_the_limit_and_its_direction_straight(self):
        """Far away the velocity that needs no force is 0.9 of the limit, towards the port."""
        approach = Approach(self.GAIN, replace(BODY, port=(1.0, 0.0, 0.0)), 0.3)
        position = np.array([400.0, -300.0, 1200.0])
        ahead = np.array([1.0, 0, 0]) - position
        straight = np.linalg.solve(K[:, 3:], K[:, :3] @ ahead)
        velocity = 0.27 * straight / np.linalg.norm(straight)
        # sqrt(1 + (s/|v_d|)^2) - 1 is 5e-8 of 12 N at this distance.
        assert np.abs(values(approach.pull(ca.DM(position), ca.DM(velocity)))).max() < 1e-5

    def test_force_from_rest_is_bounded_whatever_the_distance(self):
        approach = Approach(self.GAIN, BODY, 0.3)
        for distance in (1.0, 1e2, 1e6):
            force = values(approach.pull(ca.DM([distance, 0, 0]), ca.DM.zeros(3)))
            assert np.linalg.norm(force) < 1.0001 * 0.27 * np.linalg.norm(K[:, 3:], 2)

    def test_near_the_point_it_is_the_gain(self):
        position, velocity = ca.DM([1e-4, -2e-4, 1e-4]), ca.DM([1e-3, 0, 0])
        limited = Approach(self.GAIN, BODY, 0.3).pull(position, velocity)
        expected = -K @ np.concatenate([values(position), values(velocity)])
        # |v_d|^2/(2 s^2) is 2e-7 here.
        assert np.allclose(values(limited), expected, rtol=1e-5, atol=1e-9)

    @pytest.mark.parametrize(("velocity", "fast"), [(-0.31, 1), (-0.29, 0), (0.5, 0)])
    def test_status_looks_at_the_closing_speed(self, velocity, fast):
        of = law(approach_speed=0.3)
        y = ca.DM([3.0, 0, 0, velocity, 0, 0])
        assert int(of.status(0.0, y, of.start(0.0, y))[StepStatus.APPROACH_TOO_FAST]) == fast
        assert law().status(0.0, y, of.start(0.0, y)) == {}


def test_sample_period_limit_is_where_the_loop_becomes_unstable():
    """Independent of the search: simulate the sampled loop on either side of the limit."""
    of = law(hold=3.0)
    limit = longest_hold(of, TRUTH)
    for share, grows in ((0.98, False), (1.02, True)):
        matrix = loop_matrix(replace(of, hold=share * limit), TRUTH)
        end = np.linalg.norm(np.linalg.matrix_power(matrix, 2000) @ np.ones(15))
        assert (end > 1) == grows
    assert spectral_radius(law(hold=0.1), TRUTH) < 1
    law(hold=0.1, body=replace(BODY, flown=TRUTH.mass)).check_hold()


def test_loop_matrix_is_the_exact_pair_and_the_law():
    """Step the law and the pair by hand once."""
    of = law(hold=0.1)
    matrix = loop_matrix(of, TRUTH)
    eta, m = START, np.arange(9.0) / 10
    memory = of.jump(0.0, ca.DM(eta), ca.DM(m))
    force = of.command(0.0, ca.DM(eta), memory)
    block = np.zeros((9, 9))
    block[:6, :6], block[:6, 6:] = A, np.vstack([ZERO, EYE / TRUTH.mass])
    later = (expm(0.1 * block) @ np.concatenate([eta, values(force)]))[:6]
    expected = np.concatenate([later, values(advance(of, 0.0, ca.DM(eta), memory, force, force))])
    assert np.allclose(matrix @ np.concatenate([eta, m]), expected, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("hold", [0.0, 0.1])
def test_everything_is_differentiable_by_every_gain(hold):
    symbols = [ca.SX.sym("K", 3, 6), ca.SX.sym("L", 6, 6), ca.SX.sym("varpi"), ca.SX.sym("speed")]
    names = ("controller_gain", "observer_gain", "disturbance_gain", "approach_speed")
    of = law(hold=hold, **dict(zip(names, symbols, strict=True)))
    of.check_hold()
    y, m = ca.SX.sym("y", 6), ca.SX.sym("m", 9)
    memory = of.jump(0.0, y, m)
    wanted = of.command(0.0, y, memory)
    later = advance(of, 0.0, y, memory, wanted, wanted / 2) if hold else of.rate(0.0, y, m, wanted, wanted / 2)
    gains = ca.vertcat(*(ca.vec(symbol) for symbol in symbols))
    slope = ca.Function("slope", [y, m, *symbols], [ca.jacobian(ca.vertcat(wanted, later), gains)])
    assert np.all(np.isfinite(np.array(slope(START, np.arange(9.0), K, L, VARPI, 0.3))))
