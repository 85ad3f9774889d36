"""Numbers of Shi, Liu, Biggs, Sun, Yue (2020), doi:10.1016/j.ast.2020.105759, that no flight answers alone."""

from __future__ import annotations

import math
from functools import cache

import casadi as ca
import numpy as np
from scipy.optimize import linprog

from casadi_gnc.fidelity.computations.shi2020_data import printed_gains, printed_matrices, problem_data
from casadi_gnc.synthesis import Lmis, LmiStatus, Norm, h_infinity_norm, peak_command, poles, stable_ratios
from casadi_gnc.synthesis.analysis import gain_at
from casadi_gnc.synthesis.recipes.intermediate_observer import by_mass_ratio, closed_loop
from casadi_gnc.synthesis.recipes.shi2020_theorem1 import left_sides, theorem1

#: Half a unit of the last printed digit of X1, X3, W and H.
_HALF_DIGIT = 5e-5


def _left(name: str, gamma2: float = 1.0) -> np.ndarray:
    """Return the left side of an inequality at the printed matrices."""
    sides = left_sides(**problem_data(), **printed_matrices(), gamma2=gamma2)
    return np.array(ca.evalf(sides[name]))


def _largest(matrix: np.ndarray) -> float:
    return float(np.linalg.eigvalsh(matrix)[-1])


# Theorem 1.


def input_square(limit: float, alpha: float) -> float:
    """Return k0 = lambda^2/(alpha + 1), [N^2]."""
    return limit**2 / (alpha + 1)


def axis_limit(limit: float) -> float:
    """Return the force of each of three axes at which their norm is a limit, [N]."""
    return limit / math.sqrt(3)


def performance_eigenvalue(gamma2: float) -> float:
    """Return the largest eigenvalue of (24) at the printed matrices."""
    return _largest(_left("(24) performance", gamma2))


@cache
def _least_gamma2() -> float:
    """Return the least gamma_2 for which (24) holds at the printed matrices."""
    low, high = 1.0, 100.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if performance_eigenvalue(middle) < 0 else (middle, high)
    return high


def start_level() -> float:
    """Return the left side of (33), kappa_1^2 1'P1 1 + kappa_2^2 1'P2 1 + kappa_3^2 1'P3 1, at the printed matrices."""
    return _level(0.0)


def start_level_bound() -> float:
    """Return what the left side of (33) is at least for any X1, X3 that round to the printed ones.

    Entries off by at most e make X1 at most X1 + 6 e I, and P1 = X1^-1 at least its inverse.
    """
    return _level(_HALF_DIGIT)


def _level(doubt: float) -> float:
    one, two, three = problem_data()["start"]
    total = 0.0
    for name, weight in (("X1", one**2 + two**2), ("X3", three**2)):
        X = printed_matrices()[name]
        ones = np.ones(len(X))
        total += weight * float(ones @ np.linalg.solve(X + len(X) * doubt * np.eye(len(X)), ones))
    return total


def input_eigenvalue() -> float:
    """Return the largest eigenvalue of (26) at the printed matrices."""
    return _largest(_left("(26) input"))


def input_eigenvalue_bound() -> float:
    """Return what the largest eigenvalue of (26) is at least, whatever the unknowns: that of a block without any."""
    return _largest(_left("(26) input")[-6:, -6:])


@cache
def _solved() -> LmiStatus:
    return theorem1(**problem_data(), conflict=False).status


def has_solution() -> float:
    """Return 1 if certified matrices meet (24) to (26) with the printed data, else 0."""
    return float(_solved().holds)


def may_have_solution() -> float:
    """Return 0 if multipliers prove that no matrices meet (24) to (26) with the printed data, else 1."""
    return float(_solved() is not LmiStatus.INFEASIBLE)


def guaranteed_limit() -> float:
    """Return the least force limit, [N], for which (24) to (26) have a certified solution, to 0.1 %.

    One axis of the double integrator stands for the three: the orbit's terms are 1e-6.
    """
    data, mass = problem_data(), 1 / problem_data()["B"][3, 0]
    alpha = data["alpha"] / 3
    axis = {
        "A": np.array([[0.0, 1.0], [0.0, 0.0]]),
        "B": np.array([[0.0], [1 / mass]]),
        "C": np.eye(2),
        "M0": data["M0"][::3, ::3],
        "alpha": alpha,
    }
    low, high = guaranteed_limit_bound(), 2 * guaranteed_limit_bound()
    while high > 1.001 * low:
        middle = math.sqrt(low * high)
        limit = math.sqrt(input_square(middle, data["alpha"]) * (alpha + 1))
        answer = theorem1(**{**data, **axis, "limit": limit}, price=1e-6, conflict=False)
        low, high = (low, middle) if answer.status.holds else (middle, high)
    return high


def guaranteed_limit_bound() -> float:
    """Return the force limit, [N], below which (26) has no solution: k0 must exceed kappa_3^2."""
    return float(problem_data()["kappa3"] * math.sqrt(problem_data()["alpha"] + 1))


def gain_from_matrices(gain: str, row: int, column: int) -> float:
    """Return an entry of K = W X1^-1 or L = H (C X1)^-1 of the printed matrices; rows and columns from 1."""
    matrix = np.linalg.solve(printed_matrices()["X1"], printed_matrices()["W" if gain == "K" else "H"].T).T
    return float(matrix[row - 1, column - 1])


def gains_misfit() -> float:
    """Return the least largest misfit of K X1 = W, L X1 = H over all X1 of one axis, in half printed digits.

    At most 1: some X1, W and H that round to the printed ones give the printed gains.
    """
    (K, L), printed = printed_gains(), printed_matrices()
    X1, W, H = (printed[name] for name in ("X1", "W", "H"))
    near = X1[0, 0], X1[0, 3], X1[3, 3]
    rows, right = list(np.eye(3)), list(near)  # unknowns: the entries (1,1), (1,2) and (2,2) of X1
    wanted = [(K[0, 0], K[0, 3], W[0]), *((L[i, 0], L[i, 3], H[i]) for i in (0, 3))]
    for position, velocity, product in wanted:
        rows += [np.array([position, velocity, 0.0]), np.array([0.0, position, velocity])]
        right += [product[0], product[3]]
    A, b = np.array(rows) / _HALF_DIGIT, np.array(right) / _HALF_DIGIT
    ones = np.ones((len(b), 1))
    found = linprog([0, 0, 0, 1], np.block([[A, -ones], [-A, -ones]]), np.concatenate([b, -b]), bounds=(None, None))
    return float(found.fun)


def optimality() -> float:
    """Return the least gamma_2 at the printed matrices over a certified one at another H; 1 at the minimum.

    X1, X3 and W stay, so (25) and (26), which do not hold H, are as they were.
    """
    lmis = Lmis()
    H, gamma2 = lmis.rectangular("H", 6, 6), lmis.scalar("gamma_2")
    sides = left_sides(**problem_data(), **{**printed_matrices(), "H": H}, gamma2=gamma2)
    lmis.nsd(sides["(24) performance"], margin=1e-6, name="performance")
    lmis.minimize(gamma2)
    return _least_gamma2() / float(lmis.solve()["gamma_2"][0, 0])


def noise_matrix_entry(row: int, column: int) -> float:
    """Return an entry of P2 L, which M0 must equal if e'P2 L v >= e'M0 v for all e and v; from 1."""
    _, L = printed_gains()
    return float(np.linalg.solve(printed_matrices()["X1"], L)[row - 1, column - 1])


# The loop (23) without a clip.


def _plant() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    data = problem_data()
    return data["A"], data["B"], data["C"], *printed_gains(), data["varpi"]


def slowest_pole(mass_ratio: float) -> float:
    """Return the largest real part of the loop's poles, [rad/s], for a ratio m0/m_CT."""
    if mass_ratio == 1.0:
        return float(poles(closed_loop(*_plant())[0])[0].real)
    fixed, scaled = by_mass_ratio(*_plant())
    return float(poles(fixed + mass_ratio * scaled)[0].real)


def least_mass_ratio() -> float:
    """Return the m0/m_CT below which the loop is unstable."""
    return stable_ratios(*by_mass_ratio(*_plant()))[0]


def unstable_mass_ratio(mass_ratio: float) -> float:
    """Return a ratio m0/m_CT if the loop has a growing mode there, else 0."""
    return mass_ratio if slowest_pole(mass_ratio) > 0 else 0.0


@cache
def _norm() -> tuple[Norm, float]:
    """Return the norm from (v, w') to y = C eta + v, and the singular value attained at its frequency."""
    loop, inputs = closed_loop(*_plant())
    C = np.hstack([problem_data()["C"], np.zeros((6, 9))])
    D = np.hstack([np.eye(6), np.zeros((6, 3))])
    norm = h_infinity_norm(loop, inputs, C, D)
    return norm, gain_at(loop, inputs, C, D, norm.frequency_rad_s)


def norm_ratio() -> float:
    """Return the H-infinity norm from (v, w') to y over the root of the least gamma_2 of (24)."""
    return _norm()[0].upper / math.sqrt(_least_gamma2())


def norm_ratio_bound() -> float:
    """Return the singular value attained at one frequency over the root of the least gamma_2 of (24)."""
    return _norm()[1] / math.sqrt(_least_gamma2())


def linear_peak(position_m: list[float]) -> float:
    """Return the largest norm of u, [N], at the mass m0 from rest at a position, both estimates from zero."""
    (K, _), (fixed, scaled) = printed_gains(), by_mass_ratio(*_plant())
    start = np.concatenate([position_m, np.zeros(12)])
    return peak_command(fixed + scaled, np.hstack([np.zeros((3, 6)), -K, -np.eye(3)]), start[None]).value


def command_at_level() -> float:
    """Return the largest norm of u, [N], where V <= alpha and |xi| <= kappa_3, at the printed matrices."""
    (K, _), data, printed = printed_gains(), problem_data(), printed_matrices()
    reach = K + data["varpi"] * data["B"].T  # u = -reach (eta - e_eta) - xi + e_xi
    X1, X3 = printed["X1"], printed["X3"]
    return math.sqrt(data["alpha"] * _largest(2 * reach @ X1 @ reach.T + X3)) + data["kappa3"]


def command_at_start(position_m: list[float]) -> float:
    """Return the norm of u, [N], at rest at a position that is known, w = 0: a state with V <= alpha and xi = 0."""
    eta = np.concatenate([position_m, np.zeros(3)])
    if eta @ np.linalg.solve(printed_matrices()["X1"], eta) > problem_data()["alpha"]:
        return 0.0
    return float(np.linalg.norm(printed_gains()[0] @ eta))
