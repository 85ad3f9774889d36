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


class Family:
    """Hold random LMIs in all kinds of unknowns whose optimum is known by construction.

    At a random point x each block is Q diag(0, 0, d) Q' + margin I, and its multiplier Q diag(e, e, 0) Q',
    with d and e between 0.5 and 2: strictly complementary. The cost is what the multipliers make stationary,
    so x is optimal. Two zeros in each of three blocks of size 4 or 5 make point and multipliers unique.
    """

    margin = 1e-5

    def __init__(self, seed):
        rng = np.random.default_rng(seed)
        n, m = self.n, self.m = int(rng.integers(2, 4)), int(rng.integers(1, 3))
        self.sizes = rng.integers(4, 6, size=3).tolist()
        shapes = [(n, n), (m, n), (n, n), (n, n), (1, 1)]
        self.factors = [
            [(rng.normal(size=(k, a)) / np.sqrt(k * a), rng.normal(size=(b, k))) for a, b in shapes] for k in self.sizes
        ]
        self.best = rng.normal(size=n * (n + 1) // 2 + m * n + n + 2)
        self.offsets, self.multipliers = [], []
        for k, linear in zip(self.sizes, self.linear(*self.split(self.best)), strict=True):
            q = np.linalg.qr(rng.normal(size=(k, k)))[0]
            block = (q[:, 2:] * rng.uniform(0.5, 2, k - 2)) @ q[:, 2:].T + self.margin * np.eye(k) - linear
            self.offsets.append((block + block.T) / 2)
            self.multipliers.append((q[:, :2] * rng.uniform(0.5, 2, 2)) @ q[:, :2].T)
        images = [self.linear(*self.split(unit)) for unit in np.eye(len(self.best))]
        self.cost = np.array(
            [sum(np.sum(z * f) for z, f in zip(self.multipliers, image, strict=True)) for image in images]
        )

    def split(self, x):
        """Return X, W, D, S and g of the scalar unknowns."""
        n, m, X = self.n, self.m, np.zeros((self.n, self.n))
        row, column = np.tril_indices(n)
        X[row, column] = X[column, row] = x[: len(row)]
        rest = x[len(row) :]
        return X, rest[: m * n].reshape(m, n), np.diag(rest[m * n : -2]), rest[-2] * np.eye(n), rest[-1:].reshape(1, 1)

    def linear(self, *unknowns):
        """Return the linear part of each block, of arrays, of CasADi or of cvxpy expressions alike."""
        sums = [sum(a @ x @ b for (a, b), x in zip(f, unknowns, strict=True)) for f in self.factors]
        return [part + part.T for part in sums]

    def ours(self):
        lmis, n = Lmis(), self.n
        X, W, D = lmis.symmetric("X", n), lmis.rectangular("W", self.m, n), lmis.diagonal("D", n)
        S, g = lmis.scaled_identity("S", n), lmis.scalar("g")
        for i, (linear, offset) in enumerate(zip(self.linear(X, W, D, S, g), self.offsets, strict=True)):
            lmis.psd(linear + offset, margin=self.margin, name=f"block {i}")
        row, column = np.tril_indices(n)
        triangle = [X[int(i), int(j)] for i, j in zip(row, column, strict=True)]
        lmis.minimize(ca.dot(self.cost, ca.vertcat(*triangle, ca.vec(W.T), ca.diag(D), S[0, 0], g)))
        return lmis

    def theirs(self, cp):
        n = self.n
        X, W, d = cp.Variable((n, n), symmetric=True), cp.Variable((self.m, n)), cp.Variable(n)
        s, g = cp.Variable(), cp.Variable((1, 1))
        blocks = [f + o for f, o in zip(self.linear(X, W, cp.diag(d), s * np.eye(n), g), self.offsets, strict=True)]
        row, column = np.tril_indices(n)
        triangle = [X[i, j] for i, j in zip(row, column, strict=True)]
        cost = self.cost @ cp.hstack([*triangle, cp.vec(W, order="C"), d, s, g[0, 0]])
        constraints = [block >> self.margin * np.eye(block.shape[0]) for block in blocks]
        return cp.Problem(cp.Minimize(cost), constraints), (X, W, d, s, g), blocks


@pytest.mark.parametrize("seed", range(20))
def test_agrees_with_cvxpy(seed):
    """The same matrices at any point, and the same optimum, which is also that of the construction.

    The construction's point and multipliers meet the optimality conditions of our conic data, and cvxpy's
    blocks and cost are the same there: both optima are the same number to rounding. The solvers' own
    last digits are another matter: at eleven digits asked for, Clarabel leaves up to 1.5e-9 of the terms, by
    BLAS kernel, whoever poses the problem.
    """
    import cvxpy as cp

    family = Family(seed)
    lmis, (problem, variables, blocks) = family.ours(), family.theirs(cp)
    data = lmis.data()
    point = np.random.default_rng(seed).normal(size=len(data.cost))
    X, W, D, S, g = family.split(point)
    for variable, value in zip(variables, (X, W, np.diag(D), S[0, 0], g), strict=True):
        variable.value = value
    for i, block in enumerate(blocks):
        np.testing.assert_allclose(values(data, point)[f"block {i}"], block.value, atol=1e-12)  # rounded products
    assert data.cost @ point == pytest.approx(problem.objective.value, abs=1e-12)
    best, zero = values(data, family.best), values(data, np.zeros_like(point))
    images = [values(data, unit) for unit in np.eye(len(point))]
    for i, multiplier in enumerate(family.multipliers):
        block = best[f"block {i}"] - family.margin * np.eye(len(multiplier))
        assert np.linalg.eigvalsh(block).min() > -1e-12  # feasible
        assert abs(np.sum(block * multiplier)) < 1e-12  # complementary
    priced = [
        sum(np.sum(z * (image[f"block {i}"] - zero[f"block {i}"])) for i, z in enumerate(family.multipliers))
        for image in images
    ]
    np.testing.assert_allclose(priced, data.cost, atol=1e-11)  # stationary
    settings = dict.fromkeys(("tol_gap_abs", "tol_gap_rel", "tol_feas"), 1e-11)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that eleven digits are too many
        problem.solve(solver="CLARABEL", **settings)
    answer = lmis.solve(tolerance=1e-11)
    assert answer.status is LmiStatus.CERTIFIED
    size = np.abs(family.cost) @ np.abs(family.best)  # of the objective's terms, which cancel in part
    assert abs(answer.objective - problem.value) <= 1e-8 * size
    assert abs(answer.objective - family.cost @ family.best) <= 1e-8 * size


@pytest.mark.parametrize("backend", BACKENDS)
def test_riccati_limit(backend):
    """The largest P of the linear-quadratic inequality is the stabilising solution of the Riccati equation."""
    rng, n, m = np.random.default_rng(3), 4, 2
    A, B = rng.normal(size=(n, n)) - 3 * np.eye(n), rng.normal(size=(n, m))
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
        (
            lambda p, X, W, g: p.psd(g * X, margin=1, name="a"),
            r"'a' is not affine: entry \(0, 0\) holds the term \(g.*X\[0,0\]\), whose slope by X\[0,0\] depends on g",
        ),
        (
            lambda p, X, W, g: p.psd(X + X[1, 0] * W @ ca.DM([[0, 0], [0, 1]]) - X @ W, margin=1, name="a"),
            r"entry \(0, 0\) holds the term \(X\[0,0\]\*W\[0,0\]\).*substitute a product of unknowns",
        ),
        (
            lambda p, X, W, g: p.psd(X + 2 * g + ca.diag(ca.vertcat(0, -ca.sin(g))), margin=1, name="a"),
            r"entry \(1, 1\) holds the term sin\(g\[0,0\]\), whose slope by g\[0,0\] depends on g\[0,0\]",
        ),
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
