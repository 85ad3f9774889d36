"""Rows many decades apart in one block: the same answer, certified in original units; what is hopeless is refused."""

import casadi as ca
import mpmath
import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import Lmis, LmiStatus, state_feedback
from casadi_gnc.synthesis.backends import scs_
from casadi_gnc.synthesis.certificate import check, values
from casadi_gnc.synthesis.conic import ConicData
from casadi_gnc.synthesis.scaling import Scaled, scale

BACKENDS = ["clarabel", "scs", "barrier"]
A, B = np.array([[0, 1.0], [-1, -2]]), np.array([[0], [1.0]])


def riccati(decades, margin):
    """Return the regulator's inequality under a congruence with rows from 10^-decades to 10^decades.

    The margin is a share of the smallest row, whose entry is 10^(-2 decades).
    """
    rows, lmis = np.diag(10.0 ** np.array([-decades, 0, decades])), Lmis()
    P = lmis.symmetric("P", 2)
    whole = ca.blockcat([[A.T @ P + P @ A + np.eye(2), P @ B], [(P @ B).T, 1]])
    lmis.psd(rows @ whole @ rows, margin=margin * 10.0 ** (-2 * decades), name="Riccati")
    lmis.minimize(-ca.trace(P))
    return lmis


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(("decades", "margin"), [(0, 1e-7), (2, 1e-7), (6, 1e-9), (30, 1e-7), (70, 1e-12)])
def test_rows_apart_change_nothing(backend, decades, margin):
    """Entries from 1e-140 to 1e140 in one block: the trace of the Riccati equation, to the margin and SCS's digits."""
    answer = riccati(decades, margin).solve(backend)
    assert answer.status is LmiStatus.CERTIFIED, answer.sentence()
    truth = solve_continuous_are(A, B, np.eye(2), np.eye(1))
    assert np.trace(answer["P"]) == pytest.approx(np.trace(truth), rel=1e-4)
    (found,) = answer.checks
    assert found.smallest - found.allowance >= 0.5 * margin * 10.0 ** (-2 * decades)


@pytest.mark.parametrize("backend", ["clarabel", "barrier"])
def test_units_of_states_change_no_norm(backend):
    """A cart with a pendulum, its states in other units: the same loop, so the same certified norm.

    Two of its states are integrals of the others, so its matrix alone does not tell their units.
    """
    whole = np.array([[0, 0, 1, 0], [0, 0, 0, 1], [0, -0.7, 0, 0], [0, 15.8, 0, 0.0]])
    push = np.array([[0.0], [0], [0.98], [-1.46]])
    norms = []
    for spread in (1.0, 1e8, 1e18):
        units = spread ** np.array([-0.5, 0.5, -0.25, 0.25])  # x = units * x of the cart
        found = state_feedback(
            whole * units[:, None] / units, push * units[:, None], np.diag(units), np.eye(5, 4) / units,
            np.eye(5)[:, 4:], margin=1e-7, backend=backend,
        )  # fmt: skip
        assert found.is_certified, (spread, found.status)
        norms.append(found.promised)
    assert norms == pytest.approx([norms[0]] * 3, rel=1e-5)


def test_the_certificate_of_rows_apart_is_that_of_many_digits():
    """The smallest eigenvalue of graded blocks, and its allowance, against fifty digits."""
    rng = np.random.default_rng(1)
    lmis = Lmis()
    X = lmis.symmetric("X", 4)
    lmis.psd(X, margin=1e-30, name="X")
    data = lmis.data()
    row, column = np.tril_indices(4)
    with mpmath.workdps(50):
        for decades in (0, 3, 8, 12):
            for share in (1.0, 1e-6):  # well inside, and near the edge
                root = rng.normal(size=(4, 4))
                core = root @ root.T
                core -= (1 - share) * np.linalg.eigvalsh(core)[0] * np.eye(4)
                scale_ = np.diag(10.0 ** rng.permutation(np.linspace(-decades, decades, 4)))
                matrix = scale_ @ core @ scale_
                point = matrix[row, column]
                exact = min(mpmath.eigsy(mpmath.matrix(values(data, point)["X"].tolist()), eigvals_only=True))
                (found,) = check(data, point)
                assert abs(found.smallest - float(exact)) <= found.allowance
                assert found.allowance <= 1e-6 * found.smallest  # rounding, in the unit of the smallest row


def test_a_small_row_that_fails_is_seen_beside_a_large_one():
    """-1e-5 in a row of size 1e-5 is no rounding, though it is beside 1e12."""
    lmis = Lmis()
    X = lmis.diagonal("X", 2)
    lmis.psd(X, margin=0, name="X")
    (found,) = check(lmis.data(), np.array([-1e-5, 1e12]))
    assert not found.holds
    assert found.smallest == pytest.approx(-1e-5)
    (found,) = check(lmis.data(), np.array([0.0, 1e12]))
    assert found.holds


def test_a_margin_lost_in_every_row_is_refused_with_numbers():
    words = "'Riccati' is hopelessly scaled: its margin 1e-16 is 1e-16 of the smallest of its rows, and below 1e-13"
    with pytest.raises(SynthesisError, match=words):
        riccati(0, 1e-16).solve()
    assert riccati(0, 1e-12).solve().status is LmiStatus.CERTIFIED


def unscaled(data: ConicData) -> Scaled:
    ones = np.ones(len(data.cost))
    matrix = data.matrix.multiply(data.weight[:, None]).tocsr()
    return Scaled(data, matrix, data.right * data.weight, data.cost, ones, np.ones(len(data.offset)), 1.0)


def test_scaling_is_what_makes_scs_converge():
    data = riccati(2, 1e-7).data()
    truth = -np.trace(solve_continuous_are(A, B, np.eye(2), np.eye(1)))
    raw, ours = scs_.solve(unscaled(data), max_iterations=5000), scale(data)
    assert not abs(data.cost @ raw.point - truth) < 1e-3
    scaled = scs_.solve(ours, max_iterations=5000)
    assert data.cost @ ours.original(scaled.point) == pytest.approx(truth, rel=1e-4)
