"""Numbers of Shi et al. (2020) that no flight answers, against equations written out by hand."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from casadi_gnc.errors import FlightError
from casadi_gnc.fidelity.computations import shi2020, shi2020_docking

# One axis of (24) to (26): the orbit's terms, 1e-6 and below, and the printed entries between axes, 3e-4 and below,
# are left out here.
A, B, VARPI, ALPHA = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [0.05]]), 200.0, 7999.0
X1, X3 = np.array([[0.0084, -0.0033], [-0.0033, 0.0100]]), 1.5547
W, H = np.array([[0.1293, 0.3067]]), np.array([[0.0236, 0.0023], [0.0074, 0.0354]])
M0 = np.array([[3.5321, 1.8781], [1.8895, 4.1465]])
K, L = np.array([[31.1662, 40.7582]]), np.array([[3.3049, 1.3034], [2.5759, 4.3737]])
#: Of numbers that the parts left out move.
AXIS = 1e-3


def performance(gamma2):
    """(24) as printed, block by block."""
    I, O, BB = np.eye(2), np.zeros((2, 2)), VARPI * B @ B.T  # noqa: E741
    o = np.zeros((2, 1))
    P11 = X1 @ A.T - W.T @ B.T + A @ X1 - B @ W
    P22 = X1 @ A.T - H.T + A @ X1 - H + BB @ X1 + X1 @ BB
    P23 = B * X3 - VARPI * X1 @ A.T @ B - VARPI**2 * X1 @ B @ B.T @ B
    P33 = -2 * VARPI * B.T @ B * X3
    one = np.ones((1, 1))
    upper = [
        [P11, B @ W + BB @ X1, B * X3, o, X1, X1],
        [O, P22, P23, o, -X1 @ M0, O],
        [o.T, o.T, P33, one, o.T, o.T],
        [o.T, o.T, 0 * one, -gamma2 * one, o.T, o.T],
        [O, O, o, o, (1 - gamma2) * I, O],
        [O, O, o, o, O, -I],
    ]
    full = np.triu(np.block(upper))
    return full + np.triu(full, 1).T


def loop(ratio):
    """(eta, eta_hat, w_hat) of one axis under u = -K eta_hat - w_hat, true input matrix `ratio` B."""
    u = np.hstack([np.zeros((1, 2)), -K, -np.ones((1, 1))])
    w = np.array([[0.0, 0.0, 0.0, 0.0, 1.0]])
    eta, hat = np.eye(5)[:2], np.eye(5)[2:4]
    innovation = eta - hat
    return np.vstack([A @ eta + ratio * B @ u, A @ hat + B @ (u + w) + L @ innovation, VARPI * B.T @ L @ innovation])


def root(function, low, high) -> float:
    return np.asarray(brentq(function, low, high)).item()


def least_gamma2() -> float:
    """Of (24) at the printed matrices of one axis."""
    return root(lambda gamma2: np.linalg.eigvalsh(performance(gamma2))[-1], 1.001, 2.0)


@pytest.mark.parametrize("gamma2", [1.0, 1.02, 1.04, 2.0])
def test_performance_is_that_of_the_printed_blocks(gamma2):
    by_hand = np.linalg.eigvalsh(performance(gamma2))[-1]
    assert shi2020.performance_eigenvalue(gamma2) == pytest.approx(by_hand, rel=AXIS, abs=1e-5)


def test_start_level_in_closed_form_and_its_bound_over_roundings(rng):
    """1'P 1 of a 2 x 2 matrix is (x11 + x22 - 2 x12)/det; three axes alike."""
    quadratic = (X1[0, 0] + X1[1, 1] - 2 * X1[0, 1]) / np.linalg.det(X1)
    by_hand = 3 * (2 * 4.0012**2 * quadratic + 0.032**2 / X3)
    assert shi2020.start_level() == pytest.approx(by_hand, rel=1e-9)
    bound = shi2020.start_level_bound()
    assert 7999 < bound < by_hand
    full = np.kron(X1, np.eye(3))
    for _ in range(200):
        off = rng.choice([-5e-5, 5e-5], (6, 6))
        off = np.triu(off) + np.triu(off, 1).T
        assert 2 * 4.0012**2 * np.ones(6) @ np.linalg.solve(full + off, np.ones(6)) >= bound - 0.01


def test_no_unknowns_bring_26_below_its_bound(rng):
    bound = shi2020.input_eigenvalue_bound()
    assert bound == pytest.approx(np.linalg.eigvalsh([[-0.1125 / 100, 1.0], [1.0, -1.0]])[-1], rel=1e-12)
    assert shi2020.input_eigenvalue() >= bound > 0
    for _ in range(50):
        X, Y, Z = rng.normal(size=(2, 2)), rng.normal(size=(1, 2)), rng.uniform(0, 3)
        X, k0, o = X @ X.T, 0.1125, np.zeros((2, 1))
        E = Y.T + VARPI * X @ B
        sides = np.block(
            [
                [-k0 * X, np.zeros((2, 2)), o, o, E],
                [np.zeros((2, 2)), -k0 * X, o, o, -E],
                [o.T, o.T, np.array([[-k0 * Z, 0.0, -Z]])],
                [o.T, o.T, np.array([[0.0, -k0 / 100, 1.0]])],
                [E.T, -E.T, np.array([[-Z, 1.0, -1.0]])],
            ]
        )
        assert np.linalg.eigvalsh(sides)[-1] >= bound - 1e-12


def test_theorem_1_has_no_solution_and_would_need_30_times_the_force():
    """An independent solver: the least k0 is 104.5, which is a limit of 914 N."""
    assert (shi2020.has_solution(), shi2020.may_have_solution()) == (0.0, 0.0)
    assert shi2020.guaranteed_limit() == pytest.approx(np.sqrt(104.5 * 8000), rel=2e-3)
    assert shi2020.guaranteed_limit_bound() == pytest.approx(10 * np.sqrt(8000))


def test_gains_fit_matrices_that_round_to_the_printed_ones():
    """Those of least squares do; the least largest misfit is not above theirs."""
    products = np.vstack([np.eye(2), K, L])
    rows = [np.kron(products[i], np.eye(2)) for i in range(5)]
    entries = np.array([[1.0, 0, 0], [0, 1, 0], [0, 1, 0], [0, 0, 1]])  # of a symmetric matrix, column by column
    system = np.vstack(rows) @ entries
    right = np.vstack([X1, W, H]).ravel()
    x11, x12, x22 = np.linalg.lstsq(system, right, rcond=None)[0]
    misfit = np.abs(products @ np.array([[x11, x12], [x12, x22]]) - np.vstack([X1, W, H])).max() / 5e-5
    assert shi2020.gains_misfit() <= misfit <= 1
    assert shi2020.gain_from_matrices("K", 1, 4) == pytest.approx(np.linalg.solve(X1, W[0])[1], rel=AXIS)
    assert shi2020.gain_from_matrices("L", 4, 1) == pytest.approx((H @ np.linalg.inv(X1))[1, 0], rel=AXIS)


def test_another_h_has_a_smaller_gamma():
    """So the printed L is no minimum; and no gamma_2 is below 1."""
    assert 1.01 < shi2020.optimality() <= least_gamma2()


def test_norm_is_that_of_a_sweep():
    """Largest singular value from (v, w') to y = eta + v, of the loop with the true w as a sixth state."""
    n = 5
    true = np.zeros((n + 1, n + 1))
    true[:n, :n], true[1, n] = loop(1.0), 0.05
    noise = np.vstack([np.zeros((2, 2)), L, VARPI * B.T @ L, np.zeros((1, 2))])
    into, out = np.hstack([noise, np.eye(n + 1)[:, n:]]), np.eye(n + 1)[:2]
    D = np.hstack([np.eye(2), np.zeros((2, 1))])

    def gain(frequency):
        return np.linalg.norm(out @ np.linalg.solve(1j * frequency * np.eye(n + 1) - true, into) + D, 2)

    by_hand = max(gain(frequency) for frequency in np.linspace(0.3, 1.0, 701))
    assert shi2020.norm_ratio() == pytest.approx(by_hand / np.sqrt(least_gamma2()), rel=AXIS)
    assert shi2020.norm_ratio_bound() <= shi2020.norm_ratio()


def test_poles_and_the_least_mass_ratio():
    def slowest(ratio):
        return np.linalg.eigvals(loop(ratio)).real.max()

    assert shi2020.slowest_pole(0.7) == pytest.approx(slowest(0.7), rel=AXIS)
    assert shi2020.slowest_pole(1.0) == pytest.approx(slowest(1.0), rel=AXIS)
    assert shi2020.least_mass_ratio() == pytest.approx(root(slowest, 0.1, 0.3), rel=3 * AXIS)
    assert shi2020.unstable_mass_ratio(0.15) == 0.15
    assert shi2020.unstable_mass_ratio(0.2) == 0.0


def test_linear_peak_is_that_of_an_integrator():
    """One axis and unit start, scaled: the three axes are alike."""
    start = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    flown = solve_ivp(lambda _, x: loop(1.0) @ x, (0, 15), start, rtol=1e-9, atol=1e-12, max_step=0.01)
    peak = np.abs(-K @ flown.y[2:4] - flown.y[4]).max() * np.sqrt(29)
    assert shi2020.linear_peak([2.0, 3.0, 4.0]) == pytest.approx(peak, rel=AXIS)


def test_command_over_the_level_is_met_by_no_state_within(rng):
    largest = shi2020.command_at_level()
    reach = np.kron(K + VARPI * B.T, np.eye(3))
    half = np.linalg.cholesky(np.kron(X1, np.eye(3)))
    command = np.hstack([-reach @ half, reach @ half, np.sqrt(X3) * np.eye(3)])  # of a unit vector
    for _ in range(500):
        z = rng.normal(size=15)
        assert np.sqrt(ALPHA) * np.linalg.norm(command @ z) / np.linalg.norm(z) + 10 <= largest
    worst = np.linalg.svd(command)[2][0]
    assert np.sqrt(ALPHA) * np.linalg.norm(command @ worst) + 10 == pytest.approx(largest, rel=AXIS)
    eta = np.array([2.0, 3.0, 4.0])
    known = shi2020.command_at_start(eta.tolist())
    assert 30 < known <= largest
    assert known == pytest.approx(K[0, 0] * np.linalg.norm(eta), rel=AXIS)
    assert shi2020.command_at_start([20.0, 30.0, 40.0]) == 0.0  # beyond the level nothing is promised


def test_flight_numbers_follow_from_the_start():
    """V(0) = 2 eta0'P1 eta0 is its largest; xi = w - 10 v reaches ten times the speed of 2 m/s and more."""
    assert shi2020_docking.lyapunov_peak() == pytest.approx(2 * 29 * np.linalg.inv(X1)[0, 0], rel=AXIS)
    assert 20 < shi2020_docking.intermediate_peak() < 30
    assert shi2020_docking.distance_ratio() == pytest.approx(100 / 40)
    assert shi2020_docking.mean_utilisation("iobc") == pytest.approx(100 * shi2020_docking.utilisation("iobc") / 60)
    assert shi2020_docking.estimate_settling("position", 10.0) == 0.0
    with pytest.raises(FlightError, match="does not settle below"):
        shi2020_docking.estimate_settling("disturbance", 1e-6)
