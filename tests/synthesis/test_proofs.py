"""What is proved holds for the range that is stated: no feasible set is refuted, no bounded one is called unbounded."""

from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from riccati_equations import riccati

from casadi_gnc.errors import SynthesisError
from casadi_gnc.problem_files.synthesis_file import _inequalities
from casadi_gnc.synthesis import GainStatus, Lmis, LmiStatus, block_matrix, h_infinity_norm, observer, state_feedback
from casadi_gnc.synthesis.answer import LmiAnswer
from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.bisection import least
from casadi_gnc.synthesis.proofs import covers, prove_infeasible
from casadi_gnc.synthesis.scaling import scale


def slow(rate, margin):
    """Return the bounded-real inequality of x' = -rate x + w, z = x, which holds for gamma above 1/rate."""
    lmis = Lmis()
    X, gamma = lmis.symmetric("X", 1), lmis.scalar("gamma")
    lmis.psd(X, margin=margin, name="X")
    lmis.nsd(block_matrix([[-2 * rate * X, 1, X], [-gamma, 0], [-gamma]]), margin=margin, name="bounded real")
    lmis.minimize(gamma)
    return lmis


@pytest.mark.parametrize(
    "backend",
    ["clarabel", pytest.param("scs", marks=pytest.mark.slow), pytest.param("barrier", marks=pytest.mark.slow)],
)
def test_a_slow_mode_is_refuted_by_nobody(backend):
    for rate in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12):
        for margin in (1e-9, 1e-7, 1e-5):
            answer = slow(rate, margin).solve(backend)
            assert answer.status is not LmiStatus.INFEASIBLE, (rate, margin, answer.sentence())
            # (2 rate X - m) (gamma - m) > 1 + X^2: the least gamma, and the X that goes with it
            X = (margin + np.hypot(margin, 2 * rate)) / (2 * rate)
            gamma = X / rate + margin
            if answer.infeasibility is not None and not answer.status.holds:  # what is excluded is true
                reach = answer.infeasibility.reach
                assert reach["X"] <= X * (1 + 1e-6) or reach["gamma"] <= gamma * (1 + 1e-6)
            if answer.status.holds:
                assert answer["gamma"][0, 0] >= 1 / rate
                assert answer.least <= 1 / rate * (1 + 1e-9)


@pytest.mark.parametrize("rate", [1e-2, 1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("margin", [1e-7, 1e-5])
def test_a_slow_uncontrolled_mode_has_its_norm(rate, margin):
    """Its mode x' = -rate x + w, z = x has the norm 1/rate, whatever the feedback of the others."""
    A = np.array([[0, 1, 0], [0, 0, 0], [0, 0, -rate]])
    B, E = np.array([[0], [1.0], [0]]), np.array([[0], [0], [1.0]])
    C, D = np.vstack([np.eye(3), np.zeros((1, 3))]), np.eye(4)[:, 3:]
    found = state_feedback(A, B, E, C, D, margin=margin)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.promised == pytest.approx(1.02 / rate, rel=1e-4)
    assert found.smallest is not None
    assert found.smallest[0] <= 1 / rate * (1 + 1e-9)
    assert 1 / rate * (1 - 1e-9) <= found.smallest[1]


@pytest.mark.parametrize("seed", range(4))
def test_an_unstable_uncontrolled_mode_is_refuted_in_a_stated_range(seed):
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    A, B = turn @ np.diag([0.5, -1, -2]) @ turn.T, turn[:, 1:] @ rng.normal(size=(2, 1))
    C, D = np.vstack([np.eye(3), np.zeros((1, 3))]), np.eye(4)[:, 3:]
    found = state_feedback(A, B, np.eye(3), C, D)
    assert found.status is GainStatus.INFEASIBLE, found.sentence()
    assert found.lmis.infeasibility is not None
    assert min(found.lmis.infeasibility.reach.values()) > 1e7  # the margin over rounding
    assert "The range: entries of" in found.sentence()
    assert "W up to " in found.sentence()
    told = _inequalities(found.lmis)["no_point_with_entries_up_to"]
    assert set(told) == {"gamma", "X", "W"}


def two_rows():
    """Return x/1e9 >= 1 and y >= 0: points have x of 1e9 and more."""
    lmis = Lmis()
    x, y = lmis.scalar("x"), lmis.scalar("y")
    lmis.nonnegative(1e-9 * x - 1 + 0 * y, margin=0, name="far")
    lmis.nonnegative(x + y, margin=0, name="sum")
    lmis.minimize(x + y)
    return lmis


def test_a_proof_reaches_as_far_as_it_says():
    scaled = scale(two_rows().data())
    proof = prove_infeasible(scaled, np.array([1.0, 0.0]))
    assert proof is not None
    assert proof.reach["x"] == pytest.approx(1e9, rel=1e-6)
    assert not proof.exact
    assert covers(proof, 1e8)
    assert not covers(proof, 1e10)
    assert not covers(proof, None)
    told = SimpleNamespace(
        __name__="told", REQUIRES=(), solve=lambda s: Found(np.full(2, np.nan), np.array([1.0, 0.0]), Claim.INFEASIBLE)
    )
    wide, narrow = two_rows().solve(told), two_rows().solve(told, within={"x": 1e6, "y": 1e6})
    assert wide.status is LmiStatus.UNDECIDED
    assert "there is no point with entries of x up to 1e+09" in wide.sentence()
    assert narrow.status is LmiStatus.INFEASIBLE
    assert "The range: entries of x up to 1e+09" in narrow.sentence()
    assert two_rows().solve().status is LmiStatus.CERTIFIED
    for within, words in (({"z": 1.0}, "names 'z'; the unknowns are x, y"), (-1.0, "expected a positive number")):
        with pytest.raises(SynthesisError, match=words):
            two_rows().solve(within=within)


def test_a_bounded_set_is_not_called_unbounded():
    """x <= 1e6 is a bound, whatever a solver says of the ray x."""

    def claims(ray):
        return SimpleNamespace(
            __name__="told",
            REQUIRES=(),
            solve=lambda s: Found(np.resize(ray, len(s.cost)), np.full(len(s.right), np.nan), Claim.UNBOUNDED),
        )

    for slope in (1e-3, 1e-6, 1e-9):
        lmis = Lmis()
        x = lmis.scalar("x")
        lmis.psd(block_matrix([[1 - slope * x, 0], [x + 1]]), margin=0, name="between")
        lmis.minimize(-x)
        assert lmis.solve(claims([1.0])).status is not LmiStatus.UNBOUNDED
        answer = lmis.solve()
        assert answer.status is LmiStatus.CERTIFIED
        assert answer["x"][0, 0] == pytest.approx(1 / slope, rel=1e-6)
    lmis = Lmis()  # the ray lies on the edge of the cone, as the constant row does not grow
    x, y = lmis.scalar("x"), lmis.scalar("y")
    lmis.psd(ca.blockcat([[x, 1], [1, 1]]), margin=0, name="edge")
    lmis.nonnegative(y, margin=0, name="y")
    lmis.minimize(y - x)
    assert lmis.solve(claims([1.0, 1e-10])).status is LmiStatus.UNBOUNDED
    assert lmis.solve().status is LmiStatus.UNBOUNDED


@pytest.mark.parametrize("seed", range(8))
def test_the_smallest_gamma_lies_where_it_is_said_to(seed):
    """Plants from slow to fast in any units: the loop of the Riccati equation reaches what is said to be the least."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, 6)), int(rng.integers(1, 3))
    A = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-4, 2)
    B, E = (rng.normal(size=(n, k)) * 10.0 ** rng.uniform(-2, 1) for k in (m, 2))
    C, D = np.vstack([np.eye(n), np.zeros((m, n))]), np.vstack([np.zeros((n, m)), np.eye(m)])
    found = state_feedback(A, B, E, C, D)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.smallest is not None
    low, high = found.smallest
    assert low <= high <= 1.005 * low  # a quarter of the slack
    P = riccati(A, B, E, np.eye(n), 1.0, 1.005 * high)
    K = B.T @ P
    reached = h_infinity_norm(A - B @ K, E, C - D @ K).upper
    assert reached <= 1.005 * high * (1 + 1e-6)
    assert low <= reached  # nothing below it is reached
    dual = observer(A.T, B.T, C.T, D.T, E.T)  # the same numbers: the dual plant
    assert dual.status is GainStatus.CERTIFIED, dual.sentence()
    assert dual.promised == pytest.approx(found.promised, rel=0.005)


def test_the_sentence_of_gains_that_are_not_there_says_it_once():
    """What kept them away is told of the gains, not told again of the unknowns of the inequalities."""
    for gains in GainStatus:
        for lmis in LmiStatus:
            assert lmis.value not in gains.value
    none = state_feedback([[1.0]], [[0.0]], [[1.0]], [[1.0], [0.0]], [[0.0], [1.0]])
    assert none.status is GainStatus.INFEASIBLE
    assert none.sentence().startswith(GainStatus.INFEASIBLE.value)
    assert LmiStatus.INFEASIBLE.value not in none.sentence()
    assert none.sentence().endswith(none.lmis.details())


def test_the_last_number_of_a_bisection_is_the_largest_that_was_asked_for():
    """Doubled from 1, the last number below 10 would be 8 and the next 16; what holds from 9 on is found."""
    tried = []

    def attempt(number, prove, wanted):
        tried.append(number)
        status = LmiStatus.CERTIFIED if number >= wanted else LmiStatus.INFEASIBLE
        return LmiAnswer(status, np.zeros(1), {}, 0.0, 0.0, (), None, None, "", 0, 0.0, Claim.SOLVED)

    found = least(lambda number, prove: attempt(number, prove, 9.0), 1.0, 1e-6, 10.0)
    assert found.answer.status is LmiStatus.CERTIFIED
    assert found.value == pytest.approx(9.0, rel=1e-6)
    none = least(lambda number, prove: attempt(number, prove, 11.0), 1.0, 1e-6, 10.0)
    assert none.answer.status is LmiStatus.INFEASIBLE
    assert none.value == max(tried) == 10.0
