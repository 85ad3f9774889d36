"""Recipes against Riccati equations and the published design."""

import mpmath
import numpy as np
import pytest
from riccati_equations import riccati, smallest_gamma

from casadi_gnc.errors import SynthesisError
from casadi_gnc.problem_files.synthesis_file import load_synthesis
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
from casadi_gnc.synthesis.recipes.intermediate_observer import certify_pair, uncoupled
from casadi_gnc.synthesis.recipes.shi2020_theorem1 import theorem1

BACKENDS = ["clarabel", "scs", "barrier"]
A, B = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]])
C, D = np.vstack([np.eye(2), np.zeros((1, 2))]), np.array([[0], [0], [1.0]])


@pytest.mark.parametrize("backend", BACKENDS)
def test_state_feedback_is_the_riccati_equation(backend):
    found = state_feedback(A, B, B, C, D, backend=backend)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    least = smallest_gamma(A, B, B, C.T @ C, 1.0)
    assert found.promised == pytest.approx(1.02 * least, rel=1e-4)
    P = riccati(A, B, B, C.T @ C, 1.0, found.promised)
    np.testing.assert_allclose(found.gains["K"], B.T @ P, rtol=1e-3)  # the margins, near the edge of feasibility
    assert found.norm.upper <= found.promised


def test_observer_is_the_dual_riccati_equation():
    measured, noise = np.eye(1, 2), 0.1
    E, F = np.hstack([B, np.zeros((2, 1))]), np.array([[0, noise]])
    found = observer(A, measured, E, F)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    # The dual plant: A', C', error weights as disturbance, E E' as weight, noise^2 as price.
    least = smallest_gamma(A.T, measured.T, np.eye(2), B @ B.T, noise**2)
    assert found.promised == pytest.approx(1.02 * least, rel=1e-4)
    S = riccati(A.T, measured.T, np.eye(2), B @ B.T, noise**2, found.promised)
    np.testing.assert_allclose(found.gains["L"], S @ measured.T / noise**2, rtol=1e-3)  # the margins


def test_a_gain_that_runs_away_is_named_and_bounded():
    free = state_feedback(A, B, B, np.eye(2), np.zeros((2, 1)))
    assert free.status is GainStatus.RUNS_AWAY
    with pytest.raises(SynthesisError, match="runs to infinity.*z prices 0 of 1 commands.*fastest_rad_s"):
        free.gains  # noqa: B018
    bounded = state_feedback(A, B, B, np.eye(2), np.zeros((2, 1)), fastest_rad_s=5.0)
    assert bounded.status is GainStatus.CERTIFIED, bounded.sentence()
    assert np.abs(bounded.poles).max() <= 5.0
    watcher = observer(A, np.eye(1, 2), B, np.zeros((1, 1)), fastest_rad_s=5.0)
    assert watcher.status is GainStatus.CERTIFIED, watcher.sentence()
    assert np.abs(watcher.poles).max() <= 5.0
    blind = observer(A, np.eye(1, 2), B, np.zeros((1, 1)))
    assert blind.status is GainStatus.RUNS_AWAY
    assert "w disturbs 0 of 1 measurements" in blind.sentence()


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


def test_parts_that_do_not_couple_are_solved_apart():
    """Two axes side by side, in any order of states: gamma is that of one, and gains do not mix them."""
    order = [0, 2, 1, 3]
    both = [np.kron(np.eye(2), matrix)[np.ix_(order, columns)] for matrix, columns in ((A, order), (B, [0, 1]))]
    assert [len(states) for states, _ in uncoupled(*both, np.eye(4))] == [2, 2]
    found, one = intermediate_observer(*both, 200.0), intermediate_observer(A, B, 200.0)
    assert found.status is GainStatus.CERTIFIED
    assert found.promised == pytest.approx(one.promised, rel=2e-4)  # bisected to 1e-4
    assert found.gains["K"][0, 1] == found.gains["K"][1, 0] == 0
    np.testing.assert_allclose(found.gains["K"][0, [0, 2]], one.gains["K"][0], rtol=1e-3)
    # With a coupling of 1e-9 there is one part; nothing else changes.
    joined = both[0] + 1e-9 * np.eye(4)[[1, 0, 3, 2]]
    assert len(uncoupled(joined, both[1], np.eye(4))) == 1
    assert intermediate_observer(joined, both[1], 200.0).promised == pytest.approx(one.promised, rel=2e-4)


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
    answer = theorem1(**load_synthesis("shi2020/as_printed").recipe.arguments(), backend=backend)
    assert answer.status is LmiStatus.INFEASIBLE
    assert answer.conflict == ("(26) input",)
    assert next(iter(answer.infeasibility.shares)) == "(26) input"
    assert "'(26) input' cannot be met by itself" in answer.sentence()


def one_axis(k0, **others):
    """Return Theorem 1 for one axis, with a given k0 = limit^2/(alpha + 1)."""
    data, alpha = load_synthesis("shi2020/as_printed").recipe.arguments(), 7999 / 3
    M0 = data["M0"][::3, ::3]
    given = {name: data[name] for name in ("varpi", "start", "kappa3")}
    return theorem1(A, B, np.eye(2), M0, alpha=alpha, limit=np.sqrt(k0 * (alpha + 1)), **given, **others)


@pytest.mark.parametrize("backend", BACKENDS)
def test_theorem_1_with_a_price_has_one_solution(backend):
    """Derived independently, for k0 = 160 and 1e-3 |W, H|^2: every back end finds it, SCS thanks to scaling."""
    answer = one_axis(160.0, price=1e-3, backend=backend)
    assert answer.status is LmiStatus.CERTIFIED, answer.sentence()
    assert answer["gamma_2"][0, 0] == pytest.approx(1.05734, abs=2e-5)
    np.testing.assert_allclose(answer["X1"], [[0.03228, -0.01143], [-0.01143, 0.03910]], atol=1e-5)
    assert answer["X3"][0, 0] == pytest.approx(1.8675, abs=2e-4)  # flat
    np.testing.assert_allclose(answer["W"] @ np.linalg.inv(answer["X1"]), [[20.26, 16.885]], rtol=3e-4)
    np.testing.assert_allclose(answer["H"] @ np.linalg.inv(answer["X1"]), [[36.80, 10.13], [8.23, 25.38]], rtol=3e-4)
    assert answer.iterations < 2000  # SCS without scaling needs more than 50 000 and is then wrong in the third digit


def test_theorem_1_without_a_price_runs_away():
    """The smallest gamma_2 is not attained: H is a thousand times what a small price makes it, and that is said."""
    found = {backend: one_axis(160.0, backend=backend) for backend in ("clarabel", "barrier")}
    assert [one["gamma_2"][0, 0] for one in found.values()] == pytest.approx([1.0535] * 2, abs=1e-4)
    for one in found.values():  # how far depends on where a solver stops
        assert np.abs(one["H"]).max() > 1e3 * np.abs(one_axis(160.0, price=1e-3)["H"]).max()
    assert "H" in found["clarabel"].far
    assert "H may run to infinity: add a constraint that bounds" in found["clarabel"].sentence()


def test_certificate_holds_the_mass_ratio_and_the_peak():
    """The printed gains tolerate m0/m_CT above 0.178, a reduced mass below 112 kg, and command 117 N."""
    K, L = np.array([[31.1662, 40.7582]]), np.array([[3.3049, 1.3034], [2.5759, 4.3737]])
    wide = intermediate_observer(A, B, 200.0)
    start = np.array([[np.sqrt(29.0), 0.0]])  # axes are alike: along eta0 = (2, 3, 4) m
    printed = certify_pair(A, B, np.eye(2), K, L, 200.0, wide.lmis, promised=np.sqrt(1.031), vertices=start, limit=30.0)
    assert printed.status is GainStatus.NORM_EXCEEDED  # promised 1.015, true 1.8885
    assert printed.ratios[0] == pytest.approx(0.178, abs=5e-4)
    assert printed.ratios[1] == np.inf
    assert 20.0 / printed.ratios[0] == pytest.approx(112.2, abs=0.5)  # 0.178 has three digits
    assert printed.peak.value == pytest.approx(117, abs=0.5)
    loose = certify_pair(A, B, np.eye(2), K, L, 200.0, wide.lmis, promised=10.0, vertices=start, limit=30.0)
    assert loose.status is GainStatus.INPUT_EXCEEDED
    assert "limit 30" in loose.sentence()
    # A double integrator under u = -K x is stable whatever its mass.
    assert state_feedback(A, B, B, C, D).ratios == pytest.approx((0.0, np.inf), abs=1e-9)
    assert observer(A, np.eye(2), B, np.zeros((2, 1)), fastest_rad_s=5.0).ratios is None


def test_peak_belongs_to_every_feedback():
    free = state_feedback(A, B, B, C, D, vertices=box_vertices([-4, 0], [4, 0]))
    assert free.status is GainStatus.CERTIFIED
    assert free.peak.bound >= 4 * free.gains["K"][0, 0]  # at the start already
    short = state_feedback(A, B, B, C, D, vertices=box_vertices([-4, 0], [4, 0]), limit=0.5 * free.peak.value)
    assert short.status is GainStatus.INPUT_EXCEEDED
    with pytest.raises(SynthesisError, match="needs vertices to start from"):
        state_feedback(A, B, B, C, D, limit=1.0)


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


@pytest.mark.slow
def test_a_weak_input_has_its_gains_and_the_peak_of_its_command():
    """An observer whose pole is 5e-13 rad/s beside gains of 1e10: what is told is so with fifty digits.

    Of a disturbance that grows by one a second the position keeps an offset; the command follows from its start.
    """
    A, B, start = np.array([[0, 1.0], [-3.986e-7, 0]]), np.array([[0], [5e-8]]), np.array([3.0, 0, 0, 0, 0])
    found = intermediate_observer(A, B, 200.0, vertices=[start[:2], -start[:2]])
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    K, L = found.gains["K"], found.gains["L"]
    with mpmath.workdps(50):
        matrix = mpmath.matrix(5, 5)
        a, b, k, gain = (mpmath.matrix(each.tolist()) for each in (A, B, K, L))
        matrix[0:2, 0:2], matrix[0:2, 2:4], matrix[0:2, 4] = a, -b * k, -b
        matrix[2:4, 0:2], matrix[2:4, 2:4] = gain, a - gain - b * k
        matrix[4, 0:2], matrix[4, 2:4] = 200 * b.T * gain, -200 * b.T * gain
        push = mpmath.matrix([0, b[1], 0, 0, 0])
        growing = mpmath.lu_solve(matrix, -push)
        offset = mpmath.lu_solve(matrix, growing)
        assert abs(growing[0]) < 1e-20  # the disturbance itself is made good
        assert float(mpmath.norm(offset[0:2])) <= found.norm.upper * (1 + 1e-6)
        assert float(mpmath.norm(offset[0:2])) >= 0.99 * found.norm.lower
        there = mpmath.expm(matrix * found.peak.time_s) * mpmath.matrix(start.tolist())
        command = float(abs((k * there[2:4])[0] + there[4]))
    assert command == pytest.approx(found.peak.value, rel=1e-6)
    assert found.peak.value <= found.peak.bound <= 1.01 * found.peak.value
    assert found.norm.upper <= found.promised
