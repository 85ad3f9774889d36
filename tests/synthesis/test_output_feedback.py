"""Static output feedback: a published optimum, the convex case, and python-control's norm searched by hand."""

import control
import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import GainStatus, output_feedback, state_feedback
from casadi_gnc.synthesis.output_loop import OutputLoop
from casadi_gnc.synthesis.pattern import pattern_of
from casadi_gnc.synthesis.performance import performance
from casadi_gnc.synthesis.regions import sector

A, B = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]])
C, D = np.vstack([np.eye(2), np.zeros((1, 2))]), np.array([[0], [0], [1.0]])
ONE = ([[0.0]], [[1.0]], [[1.0]], [[1.0], [0.0]], [[0.0], [1.0]])  # x' = u + w, z = (x, u)
#: A helicopter's longitudinal motion (S. N. Singh, A. A. R. Coelho, 1984), HE1 of the COMPleib collection.
HELICOPTER = (
    [
        [-0.0366, 0.0271, 0.0188, -0.4555],
        [0.0482, -1.01, 0.0024, -4.0208],
        [0.1002, 0.3681, -0.707, 1.42],
        [0, 0, 1, 0],
    ],
    [[0.4422, 0.1761], [3.5446, -7.5922], [-5.52, 4.49], [0, 0]],
    [[0.04678, 0], [0.04572, 0.00988], [0.04369, 0.00111], [-0.02179, 0]],
    np.sqrt(0.5) * np.array([[2.0, 0, 0, 0], [0, 1, 0, 0]]),
    np.sqrt(0.5) * np.eye(2),
    [[0, 1.0, 0, 0]],
)


def their_norm(a, e, c, f=0.0):
    """Return python-control's H-infinity norm, of a square system: without Slycot it takes no other."""
    size = max(e.shape[1], len(c))
    wide, tall = np.zeros((len(a), size)), np.zeros((size, len(a)))
    through = np.zeros((size, size))
    wide[:, : e.shape[1]], tall[: len(c)], through[: len(c), : e.shape[1]] = e, c, f
    system = control.ss(a, wide, tall, through)
    return control.norm(system, p="inf", tol=1e-9, method="scipy", print_warning=False)


@pytest.mark.slow
def test_the_helicopter_has_the_published_norm():
    """0.154 by P. Apkarian and D. Noll (2006, doi:10.1109/TAC.2005.860290), with every digit 0.1538 since."""
    found = output_feedback(*HELICOPTER)
    assert found.status is GainStatus.CERTIFIED, found.sentence()
    assert found.smallest[1] == pytest.approx(0.1538, abs=5e-5)
    a, b, e, c, d, m = (np.asarray(one) for one in HELICOPTER)
    K = found.gains["K"]
    theirs = their_norm(a - b @ K @ m, e, c - d @ K @ m)
    assert found.norm.upper == pytest.approx(theirs, rel=1e-6)
    assert theirs <= found.promised <= 1.0201 * found.smallest[1]
    assert found.smallest[0] < 0.08  # a controller of any order reaches 0.0737 by the same publication


@pytest.mark.slow
def test_with_all_states_it_is_state_feedback():
    """There the problem is convex: its optimum, and the finite gain a little above, are those of the inequalities."""
    convex, found = (recipe(A, B, B, C, D) for recipe in (state_feedback, output_feedback))
    assert found.smallest[1] == pytest.approx(convex.smallest[1], rel=1e-4)
    assert found.smallest[0] == pytest.approx(convex.smallest[1], rel=1e-4)
    np.testing.assert_allclose(found.gains["K"], convex.gains["K"], rtol=0.03)


@pytest.mark.slow
def test_plants_that_are_not_coupled_have_the_norm_of_the_worse():
    other = 3.0 * A + [[0, 0], [0.5, 0]]
    both = [np.kron(np.diag([1.0, 0.0]), one) + np.kron(np.diag([0.0, 1.0]), two)
            for one, two in ((A, other), (B, B), (B, B), (C, C), (D, D))]  # fmt: skip
    worse = max(state_feedback(each, B, B, C, D).smallest[1] for each in (A, other))
    found = output_feedback(*both, structure=[[1, 2, 0, 0], [0, 0, 3, 4]])
    assert found.is_certified, found.sentence()
    assert found.smallest[1] == pytest.approx(worse, rel=1e-3)
    assert np.array_equal(found.gains["K"] == 0, [[0, 0, 1, 1], [1, 1, 0, 0]])


def test_one_number_of_a_structure_is_the_best_one():
    """u = -k (x1 + 2 x2 + noise) with z = (x1, x2, u): searched by python-control's norm."""
    E, M, N = np.array([[0.0, 0.0], [0.05, 0.0]]), np.array([[1.0, 2.0]]), np.array([[0.0, 0.3]])

    def norm(k):
        return their_norm(A - k * B @ M, E - k * B @ N, C - k * D @ M, -k * D @ N)

    best = minimize_scalar(norm, bounds=(0.1, 30.0), method="bounded", options={"xatol": 1e-6})
    assert 1 < best.x < 29
    found = output_feedback(A, B, E, C, D, M, N=N, structure=[["k"]], tries=2, slack=1e-3)
    assert found.is_certified, found.sentence()
    assert set(found.gains) == {"k"}
    assert found.smallest[1] == pytest.approx(best.fun, rel=1e-4)
    assert found.smallest[0] <= best.fun
    assert norm(float(found.gains["k"])) == pytest.approx(found.norm.upper, rel=1e-6)


def test_slopes_of_norm_and_poles_are_those_of_differences():
    rng = np.random.default_rng(4)
    plant = performance(*(rng.normal(size=size) for size in ((4, 4), (4, 2), (4, 3), (3, 4), (3, 2), (3, 3))))
    plant.A[...] -= 5 * np.eye(4)
    M, N = rng.normal(size=(2, 4)), rng.normal(size=(2, 3))
    loop = OutputLoop(plant, M, N, pattern_of([[1, 2], [-2, 3]], 2, 2).entries, [sector(0.9)], 1.0)
    at = np.array([0.1, -0.2, 0.15])
    np.testing.assert_array_equal(loop.gain(at), [[0.1, -0.2], [0.2, 0.15]])
    for sloped in (loop.norm, loop.outside):
        step = 1e-5
        slopes = [(sloped(at + step * one)[0] - sloped(at - step * one)[0]) / (2 * step) for one in np.eye(3)]
        np.testing.assert_allclose(sloped(at)[1], slopes, rtol=1e-4, atol=1e-6)


def test_what_is_not_found_and_what_cannot_be():
    none = output_feedback(A, B, B, C, D, [[1.0, 0.0]], tries=2)  # poles k position alone are +-sqrt(-0.05 k)
    assert none.status is GainStatus.NOT_FOUND
    assert none.sentence().startswith(
        "No gains were found, by a search that is local and proves nothing. None of 2 starts"
    )
    with pytest.raises(SynthesisError, match="No gains were found"):
        none.gains  # noqa: B018
    below = output_feedback(*ONE, gamma=0.9, tries=1)  # root(1 + K^2)/K is above 1
    assert below.status is GainStatus.NOT_FOUND
    assert "a norm below gamma; the smallest is 1. Give more tries" in below.sentence()
    unmoved = output_feedback(A, 0 * B, B, C, D, tries=1)
    assert unmoved.status is GainStatus.INFEASIBLE


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"structure": [[1]]}, "structure has 1 rows of 1 entries, expected 1 of 2: a row a command"),
        ({"structure": [[0, 0]]}, "structure holds zeros only"),
        ({"structure": [["k", 1]]}, "names entries by words and by numbers"),
        ({"structure": [["k p", 0]]}, "structure holds 'k p', expected 0, a whole number or a name"),
        ({"structure": [[1.5, 0]]}, "structure holds 1.5, expected 0"),
        ({"M": [[1.0]]}, r"M has shape \(1, 1\), expected \(1, 2\)"),
        ({"N": [[1.0]]}, r"N has shape \(1, 1\), expected \(2, 1\)"),
        ({"tries": 0}, "tries is 0, expected a whole number of at least 1"),
        ({"slack": -1.0}, "slack is -1.0, expected a positive number"),
        ({"gamma": np.nan}, "gamma is nan, expected a positive number"),
    ],
)
def test_bad_input(change, words):
    with pytest.raises(SynthesisError, match=words):
        output_feedback(A, B, B, C, D, **change)
