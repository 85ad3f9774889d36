"""LMIs in symbols: the data are those of the mathematics, and what cannot be posed is refused with a sentence."""

import warnings

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import Lmis, LmiStatus, block_matrix
from casadi_gnc.synthesis.certificate import values

BACKENDS = ["clarabel", "scs", "barrier"]


def family(seed):
    """Return numbers of a random LMI in a symmetric, a full, a diagonal, a scaled-identity and a scalar unknown."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, 5)), int(rng.integers(1, 3))
    return n, m, rng.normal(size=(n, n)) - 1.5 * n**0.5 * np.eye(n), rng.normal(size=(n, m)), rng.normal(size=(n, n))


def ours(seed, margin):
    n, m, A, B, E = family(seed)
    lmis = Lmis()
    X, W, D = lmis.symmetric("X", n), lmis.rectangular("W", m, n), lmis.diagonal("D", n)
    s, g = lmis.scaled_identity("s", n), lmis.scalar("g")
    moved = A @ X + B @ W
    lmis.psd(X, margin=margin, name="X")
    lmis.nsd(block_matrix([[moved + moved.T + D, E, X], [-g * np.eye(n), 0], [-s]]), margin=margin, name="bounded")
    lmis.nonnegative(ca.vertcat(10 - s[0, 0], ca.diag(D)), margin=margin, name="box")
    lmis.equal(ca.trace(X) - n, name="trace")
    lmis.minimize(g + 0.1 * ca.trace(D) + 0.1 * s[0, 0])
    return lmis


def theirs(cp, seed, margin):
    n, m, A, B, E = family(seed)
    X, W, d = cp.Variable((n, n), symmetric=True), cp.Variable((m, n)), cp.Variable(n)
    s, g = cp.Variable(), cp.Variable()
    moved = A @ X + B @ W
    zero = np.zeros((n, n))
    block = cp.bmat([[moved + moved.T + cp.diag(d), E, X], [E.T, -g * np.eye(n), zero], [X, zero, -s * np.eye(n)]])
    constraints = [X >> margin * np.eye(n), -(block + block.T) / 2 >> margin * np.eye(3 * n)]
    constraints += [10 - s >= margin, d >= margin, cp.trace(X) == n]
    problem = cp.Problem(cp.Minimize(g + 0.1 * cp.sum(d) + 0.1 * s), constraints)
    return problem, (X, W, d, s, g), block


@pytest.mark.parametrize("seed", range(8))
def test_agrees_with_cvxpy(seed):
    """The same matrices at any point, and the same optimum of a strictly feasible problem."""
    cp = pytest.importorskip("cvxpy")
    lmis, (problem, variables, block) = ours(seed, 1e-4), theirs(cp, seed, 1e-4)
    X, W, d, s, g = variables
    n, data, rng = X.shape[0], lmis.data(), np.random.default_rng(seed)
    point = rng.normal(size=len(data.cost))
    here = lmis._matrices(point)
    X.value, W.value, d.value = here["X"], here["W"], np.diag(here["D"])
    s.value, g.value = here["s"][0, 0], here["g"][0, 0]
    mine = values(data, point)
    np.testing.assert_allclose(mine["bounded"], -block.value, atol=1e-12)  # sums of a few rounded products
    np.testing.assert_allclose(mine["X"], here["X"], atol=0)
    assert mine["trace"] == pytest.approx(np.trace(here["X"]) - n, abs=1e-12)
    settings = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-10)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that ten digits are many
        problem.solve(solver="CLARABEL", **settings)
    answer = lmis.solve(tolerance=1e-10)
    assert answer.status is LmiStatus.CERTIFIED
    # Two interior points asked for ten digits, on the same matrices to rounding
    assert answer.objective == pytest.approx(problem.value, rel=1e-8)


@pytest.mark.parametrize("backend", BACKENDS)
def test_riccati_limit(backend):
    """The largest P of the linear-quadratic inequality is the stabilising solution of the Riccati equation."""
    n, m, A, B, _ = family(3)
    lmis = Lmis()
    P = lmis.symmetric("P", n)
    lmis.psd(block_matrix([[A.T @ P + P @ A + np.eye(n), P @ B], [np.eye(m)]]), margin=1e-8, name="Riccati")
    lmis.minimize(-ca.trace(P))
    answer = lmis.solve(backend)
    truth = solve_continuous_are(A, B, np.eye(n), np.eye(m))
    assert answer.status is LmiStatus.CERTIFIED, answer.sentence()
    np.testing.assert_allclose(answer["P"], truth, atol=1e-5)  # the margin, and the root of SCS's tolerance
    assert 0 <= np.trace(truth) - np.trace(answer["P"]) < 1e-5
    assert answer.gap < 1e-4 * np.trace(truth)


def test_unknowns_have_their_structure():
    lmis = Lmis()
    lmis.symmetric("X", 3), lmis.rectangular("W", 2, 3), lmis.diagonal("D", 2), lmis.scaled_identity("S", 2)
    found = lmis._matrices(np.arange(1.0, 16.0))
    assert np.array_equal(found["X"], [[1, 2, 4], [2, 3, 5], [4, 5, 6]])
    assert np.array_equal(found["W"], [[7, 8, 9], [10, 11, 12]])
    assert np.array_equal(found["D"], [[13, 0], [0, 14]])
    assert np.array_equal(found["S"], [[15, 0], [0, 15]])


def test_blocks_are_mirrored():
    X = ca.SX.sym("X", 2, 2)
    whole = block_matrix([[X + X.T, np.array([[1.0], [2.0]])], [3]])
    assert ca.is_equal(ca.simplify(whole), ca.simplify(whole.T), 3)
    for rows, words in (
        ([[X, X], [3]], r"block \(0, 1\) has shape \(2, 2\), expected \(2, 1\)"),
        ([[X[:1, :], 0], [3]], r"block \(0, 0\) has shape \(1, 2\), expected a square"),
        ([[X, 0], [X, X]], r"block \(1, 0\) lies below the diagonal"),
    ):
        with pytest.raises(SynthesisError, match=words):
            block_matrix(rows)


def bad(build, words):
    lmis = Lmis()
    X, W, g = lmis.symmetric("X", 2), lmis.rectangular("W", 2, 2), lmis.scalar("g")

    def whole():
        build(lmis, X, W, g)
        lmis.solve()

    with pytest.raises(SynthesisError, match=words):
        whole()


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda p, X, W, g: p.psd(g * X, margin=1, name="a"), r"'a' is not affine: entry \(0, 0\) multiplies"),
        (lambda p, X, W, g: p.psd(X @ X, margin=1, name="a"), r"multiplies X\[0,0\] by X\[0,0\].*substitute a product"),
        (lambda p, X, W, g: (p.psd(X, margin=1), p.minimize(g**2)), "the objective is not affine"),
        (lambda p, X, W, g: p.psd(W, margin=1, name="a"), r"'a' is not symmetric: entries .* coefficient of W\["),
        (lambda p, X, W, g: p.psd(X + np.array([[0, 1], [0, 0]]), margin=1, name="a"), "differ in the constant term"),
        (lambda p, X, W, g: p.psd(X[:1, :], margin=1, name="a"), r"'a' has shape \(1, 2\), expected a square"),
        (lambda p, X, W, g: p.psd(X, name="a"), "'a' has no margin; give margin="),
        (lambda p, X, W, g: p.psd(X, margin=-1.0), "margin -1.0, expected a finite number, at least 0"),
        (lambda p, X, W, g: (p.psd(X, margin=1, name="a"), p.psd(X, margin=1, name="a")), "stated twice"),
        (lambda p, X, W, g: p.scalar("g"), "'g' is declared twice"),
        (lambda p, X, W, g: p.diagonal("D", 0), "size 0, expected a whole number"),
        (lambda p, X, W, g: p.psd(X * ca.SX.sym("q"), margin=1), "holds q, which no unknown"),
        (lambda p, X, W, g: p.psd(X + np.nan, margin=1), "not finite"),
        (lambda p, X, W, g: p.minimize(X), r"objective has shape \(2, 2\)"),
        (lambda p, X, W, g: p.nonnegative(ca.SX(0, 1), margin=1), "is empty"),
        (lambda p, X, W, g: p.solve(), "no LMIs yet"),
        (lambda p, X, W, g: (p.psd(X, margin=1), p.solve("mosek")), "no LMI back end 'mosek'; there is clarabel"),
        (lambda p, X, W, g: (p.psd(X, margin=1), p.solve("clarabel", tol=1)), "unexpected keyword argument 'tol'"),
        (lambda p, X, W, g: p.psd(X + 1e20, margin=1e-3, name="a"), "'a' is hopelessly scaled: its margin"),
        (lambda p, X, W, g: p.nonnegative(g + 1e-17 * X[0, 0] + X[1, 1], margin=1e-3, name="a"), None),
    ],
)
def test_bad_input_gives_a_sentence(build, words):
    if words is not None:
        bad(build, words)
        return
    lmis = Lmis()  # a coefficient of 1e-17 beside 1 is harmless where its unknown occurs nowhere else
    X, g = lmis.symmetric("X", 2), lmis.scalar("g")
    build(lmis, X, None, g)
    assert lmis.solve().status.holds


def test_an_answer_without_certificate_gives_no_numbers():
    lmis = Lmis()
    x = lmis.scalar("x")
    lmis.nonnegative(x - 1, margin=0, name="above one")
    lmis.nonnegative(-x, margin=0, name="below zero")
    lmis.psd(x + 5, margin=0, name="idle")
    answer = lmis.solve()
    assert answer.conflict == ("above one", "below zero")
    with pytest.raises(SynthesisError, match="'above one' and 'below zero' cannot be met together"):
        answer["x"]
