"""Bounds on mu against formulas of special structures and against published examples."""

import numpy as np
import pytest
from scipy.optimize import linprog

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import Uncertainty, mu_bounds, mu_of_loop

RNG = np.random.default_rng(0)
M = RNG.normal(size=(4, 4)) + 1j * RNG.normal(size=(4, 4))
R = RNG.normal(size=(4, 4))
LEFT, RIGHT = (RNG.normal(size=4) + 1j * RNG.normal(size=4) for _ in range(2))
RANK_ONE = np.outer(LEFT, RIGHT.conj())
FULL, COMPLEX, REAL = (Uncertainty(kind) for kind in ("full", "complex", "real"))


def real_rank_one():
    """Return the largest real sum q_i c_i over -1 <= q <= 1: det(I - u v* Delta) = 1 - sum delta_i c_i."""
    c = RIGHT.conj() * LEFT
    return -linprog(-c.real, A_eq=c.imag[None], b_eq=[0.0], bounds=[(-1, 1)] * 4).fun


def held(found, matrix, structure):
    """Assert both bounds from what is returned with them, by NumPy alone."""
    D, G = found.D, found.G
    assert np.linalg.eigvalsh(D)[0] > 0
    stated = matrix.conj().T @ D @ matrix + 1j * (G @ matrix - matrix.conj().T @ G) - found.upper**2 * D
    assert np.linalg.eigvalsh(stated)[-1] < 0
    assert found.lower <= found.upper
    start, zero = 0, np.ones((len(D), len(D)), dtype=bool)
    for block in structure:
        at = slice(start, start + block.size)
        start += block.size
        zero[at, at] = False
        for scaling in (D, G) if found.perturbation is None else (D, G, found.perturbation):
            part = scaling[at, at]
            if block.kind == "full" and scaling is not found.perturbation:
                np.testing.assert_allclose(part, part[0, 0] * np.eye(block.size), atol=1e-12 * abs(part).max())
        assert block.kind == "real" or not np.any(G[at, at])
        if found.perturbation is not None and block.kind != "full":
            number = found.perturbation[at, at]
            np.testing.assert_array_equal(number, number[0, 0] * np.eye(block.size))
            assert block.kind == "complex" or abs(number[0, 0].imag) <= 1e-12 * abs(number[0, 0])
    assert not np.any(D[zero])
    assert not np.any(G[zero])
    if found.perturbation is not None:
        assert not np.any(found.perturbation[zero])
        assert np.linalg.norm(found.perturbation, 2) <= (1 + 1e-9) / found.lower
        assert np.linalg.svd(np.eye(len(D)) - matrix @ found.perturbation)[1][-1] <= 1e-8


@pytest.mark.parametrize(
    ("matrix", "structure", "exact"),
    [
        (M, [Uncertainty("full", 4)], np.linalg.norm(M, 2)),
        (M, [Uncertainty("complex", 4)], np.abs(np.linalg.eigvals(M)).max()),
        (R, [Uncertainty("real", 4)], max(abs(each.real) for each in np.linalg.eigvals(R) if each.imag == 0)),
        (RANK_ONE, [COMPLEX] * 4, float(np.abs(LEFT) @ np.abs(RIGHT))),
        (RANK_ONE, [REAL] * 4, real_rank_one()),
        (1j * np.eye(2), [REAL, REAL], 0.0),  # 1 - j delta is nowhere zero
        (np.zeros((2, 2)), [FULL, REAL], 0.0),
    ],
)
def test_mu_is_what_a_formula_says(matrix, structure, exact):
    found = mu_bounds(matrix, structure)
    held(found, matrix, structure)
    assert found.lower == pytest.approx(exact, rel=1e-8)
    assert exact <= found.upper <= exact * (1 + 3e-4) + 2e-6  # bisected to 1e-4, and mu below 1e-6 is called zero


def test_mixed_blocks_have_the_published_value():
    """Example program of SLICOT's AB13MD: two real numbers, a full block and two complex numbers, 0.4174753408D+02."""
    first, second = (
        [-1 + 6j, 2 - 3j, 3 + 8j, 3 + 8j, -5 - 9j, -6 + 2j],
        [4 + 2j, -2 + 5j, -6 - 7j, -4 + 11j, 8 - 7j, 12 - 1j],
    )
    third = [5 - 4j, -4 - 8j, 1 - 3j, -6 + 14j, 2 - 5j, 4 + 16j]
    matrix, structure = np.array([first, second, third] * 2), [REAL, REAL, Uncertainty("full", 2), COMPLEX, COMPLEX]
    found = mu_bounds(matrix, structure, relative=1e-7)
    held(found, matrix, structure)
    assert found.upper == pytest.approx(41.74753408, rel=1e-6)
    assert found.lower == pytest.approx(41.74753408, rel=1e-6)


def test_four_blocks_have_the_published_gap():
    """A. Packard, J. Doyle (1993), 9.4: the bound is 1; mu 0.8724 by P. A. Parrilo's sums of squares."""
    gamma, beta = 3 + np.sqrt(3), np.sqrt(3) - 1
    a, b, d, f = np.sqrt(2 / gamma), 1 / np.sqrt(gamma), -np.sqrt(beta / gamma), (1 + 1j) / np.sqrt(gamma * beta)
    U = np.array([[a, 0], [b, b], [b, 1j * b], [d, f]])
    V = np.array([[0, a], [b, -b], [b, -1j * b], [-1j * f, -d]])
    matrix = U @ V.conj().T
    found = mu_bounds(matrix, [COMPLEX] * 4)
    held(found, matrix, [COMPLEX] * 4)
    assert found.upper == pytest.approx(1.0, rel=2e-4)
    assert 0.8723 < found.lower < 0.8724


def test_a_loop_is_bounded_at_its_frequencies():
    """x'' + 0.2 x' + (1 + 0.3 delta) x = 0: with a real delta it is lost at rest, with a complex one at resonance."""
    loop = np.array([[0, 1], [-1, -0.2]]), np.array([[0], [-1.0]]), np.array([[0.3, 0]]), np.zeros((1, 1))
    real = mu_of_loop(*loop, [REAL], [0.0, 0.99])
    assert real[0].upper == pytest.approx(0.3, rel=3e-4)
    assert real[1].upper < 1e-3
    (free,) = mu_of_loop(*loop, [FULL], [0.99])
    assert free.upper == pytest.approx(0.3 / abs(1 - 0.99**2 + 0.2j * 0.99), rel=3e-4)
    with pytest.raises(SynthesisError, match="only of a stable one mu says what it bears"):
        mu_of_loop(-loop[0], *loop[1:], [REAL], [0.0])


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: mu_bounds(np.eye(3), [FULL, FULL]), r"M has shape \(3, 3\) and the blocks of the perturbation 2 rows"),
        (lambda: mu_bounds([[np.nan]], [FULL]), "M has shape .* finite numbers"),
        (lambda: mu_bounds([[1j * np.inf]], [FULL]), "finite numbers"),
        (lambda: mu_bounds([[1.0]], [FULL], relative=0.0), "relative is 0.0, expected a positive number"),
        (lambda: Uncertainty("scalar"), "is 'scalar', expected one of full, complex, real"),
        (lambda: Uncertainty("real", 0), "has the size 0, expected a whole number, at least 1"),
    ],
)
def test_what_is_no_structure_is_refused(call, words):
    with pytest.raises(SynthesisError, match=words):
        call()
