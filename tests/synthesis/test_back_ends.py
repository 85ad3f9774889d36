"""Three solvers, one verdict; and no lie survives the certificate."""

import os
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from casadi_gnc.synthesis import Lmis, LmiStatus, backends
from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.certificate import MARGIN_KEPT, check

BACKENDS = ["clarabel", "scs", "barrier"]
MARGIN = 1e-3


def random_lmis(seed, feasible):
    """Return LMIs whose verdict is known by construction.

    Feasible: the constants are chosen so that a random point leaves each block 0.3 I at least.
    Infeasible: the last block is -T1 F1 T1' - T2 F2 T2' - 0.3 I, which cannot be semidefinite where F1
    and F2 are.
    """
    rng = np.random.default_rng(seed)
    lmis, n, m = Lmis(), int(rng.integers(2, 5)), int(rng.integers(1, 4))
    X, W, D = lmis.symmetric("X", n), lmis.rectangular("W", m, n), lmis.diagonal("D", 2)
    g = lmis.scalar("g")
    scale = 10.0 ** rng.uniform(-2, 2)  # of the data: the verdict must not depend on it
    symbols = ca.symvar(ca.vertcat(ca.vec(X), ca.vec(W), ca.vec(D), g))
    point = rng.normal(size=len(symbols))
    blocks = []
    for _ in range(3 if feasible else 2):
        k = int(rng.integers(2, 5))
        part = ca.SX(rng.normal(size=(k, n))) @ X @ rng.normal(size=(n, k)) + g * rng.normal(size=(k, k))
        part += ca.SX(rng.normal(size=(k, m))) @ W @ rng.normal(size=(n, k))
        part += ca.SX(rng.normal(size=(k, 2))) @ D @ rng.normal(size=(2, k))
        linear = (part + part.T) / 2
        at = np.array(ca.evalf(ca.substitute(linear, ca.vertcat(*symbols), ca.DM(point))))
        root = rng.normal(size=(k, k))
        blocks.append(linear - (at + at.T) / 2 + root @ root.T + 0.3 * np.eye(k))
    if not feasible:
        k = int(rng.integers(2, 4))
        turned = [ca.SX(t) @ block @ t.T for block in blocks for t in [rng.normal(size=(k, block.shape[0]))]]
        blocks.append(-turned[0] - turned[1] - 0.3 * np.eye(k))
    for number, block in enumerate(blocks):
        lmis.psd(scale * (block + block.T) / 2, margin=MARGIN * scale, name=f"block {number}")
    return lmis


@pytest.mark.parametrize("backend", BACKENDS)
def test_verdicts_are_those_of_the_construction(backend):
    for seed in range(30):
        for feasible in (True, False):
            answer = random_lmis(seed, feasible).solve(backend, conflict=False)
            expected = LmiStatus.CERTIFIED if feasible else LmiStatus.INFEASIBLE
            assert answer.status is expected, f"seed {seed}, {'' if feasible else 'in'}feasible: {answer.sentence()}"
            if feasible:
                assert all(one.smallest >= MARGIN_KEPT * one.margin > 0 for one in answer.checks)
            else:
                assert sum(answer.infeasibility.shares.values()) == pytest.approx(1)


def lying(backend, tell):
    """Return a back end that solves and then tells something else."""
    honest = backends.module(backend)
    return SimpleNamespace(
        __name__="lying", REQUIRES=(), solve=lambda scaled, **o: tell(scaled, honest.solve(scaled, **o))
    )


def holds(scaled, y, block):
    return next(one for one in check(scaled.data, scaled.original(y)) if one.name == block).holds


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("block", ["block 0", "block 1", "block 2"])
def test_a_perturbed_block_is_caught(backend, block, rng):
    """Walk from the true answer until one block has lost just over half its margin, and claim it solved."""

    def tell(scaled, found):
        size, length = 1 + np.max(np.abs(found.point)), 1.0
        direction = size * rng.normal(size=len(found.point))
        for _ in range(200):
            if not holds(scaled, found.point + length * direction, block):
                break
            length *= 2
            if length > 1e6:  # the block's set has no end there
                direction, length = size * rng.normal(size=len(found.point)), 1.0
        low = 0.0
        for _ in range(60):
            middle = (low + length) / 2
            low, length = (middle, length) if holds(scaled, found.point + middle * direction, block) else (low, middle)
        return Found(found.point + length * direction, found.dual, Claim.SOLVED)

    for seed in range(4):
        answer = random_lmis(seed, feasible=True).solve(lying(backend, tell))
        assert answer.status is LmiStatus.NOT_CERTIFIED
        assert not next(one for one in answer.checks if one.name == block).holds


@pytest.mark.parametrize("backend", BACKENDS)
def test_false_claims_are_caught(backend, rng):
    for seed in range(4):
        for tell in (
            lambda scaled, found: Found(found.point, found.dual, Claim.INFEASIBLE),
            lambda scaled, found: Found(found.point, rng.normal(size=len(scaled.right)), Claim.INFEASIBLE),
            lambda scaled, found: Found(found.point, np.zeros(len(scaled.right)), Claim.INFEASIBLE),
            lambda scaled, found: Found(found.point, found.dual, Claim.UNBOUNDED),
            lambda scaled, found: Found(found.point * np.nan, found.dual * np.nan, Claim.SOLVED),
            lambda scaled, found: Found(np.full(len(scaled.cost), 1e305), found.dual, Claim.SOLVED),
            lambda scaled, found: Found(found.point[:-1], found.dual[:-1], Claim.SOLVED),
        ):
            answer = random_lmis(seed, feasible=True).solve(lying(backend, tell))
            assert answer.status in (LmiStatus.UNDECIDED, LmiStatus.CERTIFIED)  # certified: the point is true
        wrong = random_lmis(seed, feasible=False).solve(
            lying(backend, lambda scaled, found: Found(np.zeros(len(scaled.cost)), found.dual * 0, Claim.SOLVED))
        )
        assert wrong.status is LmiStatus.NOT_CERTIFIED


@pytest.mark.parametrize("backend", BACKENDS)
def test_no_minimum_is_named(backend):
    lmis = Lmis()
    X, g, h = lmis.symmetric("X", 2), lmis.scalar("g"), lmis.scalar("h")
    lmis.psd(X, margin=1e-3, name="positive")
    lmis.psd(ca.blockcat([[h, 1], [1, 2]]), margin=1e-3, name="bounded")
    lmis.nonnegative(g, margin=1e-3, name="g")
    lmis.minimize(g + h - X[0, 0] - X[1, 1])
    answer = lmis.solve(backend)
    assert answer.status is LmiStatus.UNBOUNDED
    assert "X" in answer.sentence()
    assert {"X[0,0]", "X[1,1]"} & set(answer.ray.direction)


@pytest.mark.parametrize("backend", BACKENDS)
def test_contradicting_equalities(backend):
    lmis = Lmis()
    x, y = lmis.scalar("x"), lmis.scalar("y")
    lmis.equal(ca.vertcat(x + y - 1, 2 * x + 2 * y - 3), name="sums")
    lmis.psd(x + 100, margin=1, name="idle")
    answer = lmis.solve(backend)
    assert answer.status is LmiStatus.INFEASIBLE
    assert answer.conflict == ("sums",)


@pytest.mark.parametrize("backend", BACKENDS)
def test_bad_units_are_scaled_away(backend):
    """Rows of 1e-2 to 1e2, squared in the matrix, and unknowns of 1e-3: the optimum stays."""
    rows = np.diag([1e-2, 1.0, 1e2])
    lmis = Lmis()
    P = lmis.symmetric("P", 2)
    A, B = np.array([[0, 1.0], [-1, -2]]), np.array([[0], [1.0]])
    Q = 1e3 * P  # P in other units
    whole = ca.blockcat([[A.T @ Q + Q @ A + np.eye(2), Q @ B], [(Q @ B).T, 1]])
    lmis.psd(rows @ whole @ rows, margin=1e-9, name="Riccati")
    lmis.minimize(-ca.trace(P))
    answer = lmis.solve(backend)
    assert answer.status is LmiStatus.CERTIFIED, answer.sentence()
    # [[sqrt 2, sqrt 2 - 1], [., sqrt 2 - 1]] solves A'P + PA + I = PBB'P
    truth = 1e-3 * (2 * 2**0.5 - 1)
    assert np.trace(answer["P"]) == pytest.approx(truth, rel=1e-4)


class PanicException(BaseException):
    pass


@pytest.mark.parametrize("panics", [True, False])
def test_the_words_of_a_panic_are_nobodys(panics, monkeypatch, capfd):
    """Rust prints them beside Python; what else was printed meanwhile is not lost."""

    def solve():
        os.write(2, b"thread panicked\n")
        if panics:
            raise PanicException
        return SimpleNamespace(x=[0.0], z=[0.0], status="Unsolved", iterations=0, solve_time=0.0)

    monkeypatch.setattr("clarabel.DefaultSolver", lambda *_: SimpleNamespace(solve=solve))
    lmis = Lmis()
    lmis.psd(lmis.scalar("g"), margin=1.0)
    assert lmis.solve("clarabel").status is LmiStatus.UNDECIDED
    told = capfd.readouterr()
    assert told.out == ""
    assert ("thread panicked" in told.err) is not panics


def test_a_back_end_is_taken_by_size():
    """Of x' = A x + B u with many unknowns the one whose work grows least, else the one that is seldom undecided."""
    small, large = Lmis(), Lmis()
    for lmis, size in ((small, 19), (large, 20)):  # 190 and 210 unknowns
        X = lmis.symmetric("X", size)
        lmis.psd(X - np.eye(size), margin=1e-6)
        lmis.minimize(ca.trace(X))
    assert small.attempt(small.data(), max_iterations=1).backend == "clarabel"
    assert large.attempt(large.data(), max_iterations=1).backend == "barrier"
