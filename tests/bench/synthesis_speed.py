"""Repaired docking synthesis, gamma bisected, end to end: ours against cvxpy + Clarabel in the same run.

    python tests/bench/synthesis_speed.py

Both bisect gamma over the same 14 values and solve each to ten digits; ours also certifies every one.
cvxpy poses the problem once, with gamma^2 as a parameter, where it can; posing anew is printed too. Medians of 3.
"""

import time
import warnings

import numpy as np

from casadi_gnc.synthesis.recipes.intermediate_observer import _between, _pose

A, B, VARPI, S, MARGIN = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]]), 200.0, 0.3, 1e-6


def bisect(feasible):
    low, high = 1.0, 8.0
    for _ in range(14):
        gamma = np.sqrt(low * high)
        low, high = (low, gamma) if feasible(gamma**2) else (gamma, high)
    return high


def ours():
    lmis, one = (_pose(A, B, np.eye(2), VARPI, S, square, MARGIN) for square in (0.0, 1.0))
    ends = lmis.data(), one.data()
    return bisect(lambda square: lmis.attempt(_between(*ends, square)).status.holds)


def pose_theirs(square):
    import cvxpy as cp

    X1, X3 = cp.Variable((2, 2), symmetric=True), cp.Variable((1, 1), symmetric=True)
    W, H, BB, Z = cp.Variable((1, 2)), cp.Variable((2, 2)), VARPI * B @ B.T, np.zeros
    first, second, third = A @ X1 - B @ W, (A + BB) @ X1 - H, -VARPI * (B.T @ B) @ X3
    p12, p13 = B @ W + BB @ X1, B @ X3
    p23 = B @ X3 - VARPI * X1 @ (A.T @ B) - VARPI * X1 @ (BB @ B)
    noise = -square * (2 * S * X1 - S**2 * np.eye(2))
    rows = [
        [first + first.T, p12, p13, Z((2, 1)), Z((2, 2)), X1],
        [p12.T, second + second.T, p23, Z((2, 1)), -H, Z((2, 2))],
        [p13.T, p23.T, third + third.T, np.eye(1), Z((1, 2)), Z((1, 2))],
        [Z((1, 2)), Z((1, 2)), np.eye(1), -square * np.eye(1), Z((1, 2)), Z((1, 2))],
        [Z((2, 2)), -H.T, Z((2, 1)), Z((2, 1)), noise, Z((2, 2))],
        [X1, Z((2, 2)), Z((2, 1)), Z((2, 1)), Z((2, 2)), -np.eye(2)],
    ]
    whole = cp.bmat(rows)
    constraints = [X1 >> MARGIN * np.eye(2), X3 >> MARGIN * np.eye(1)]
    constraints += [-(whole + whole.T) / 2 >> MARGIN * np.eye(10)]
    return cp.Problem(cp.Minimize(0), constraints)


def solved(problem):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # near the smallest gamma answers are called inaccurate
        problem.solve(solver="CLARABEL", tol_feas=1e-10, tol_gap_abs=1e-10, tol_gap_rel=1e-10)
    return problem.status.startswith("optimal")


def theirs():
    import cvxpy as cp

    square = cp.Parameter(nonneg=True)
    problem = pose_theirs(square)

    def feasible(value):
        square.value = value
        return solved(problem)

    return bisect(feasible)


def theirs_anew():
    return bisect(lambda square: solved(pose_theirs(square)))


def median(call):
    call()
    times = []
    for _ in range(3):
        started = time.perf_counter()
        call()
        times.append(time.perf_counter() - started)
    return float(np.median(times))


if __name__ == "__main__":
    mine, once, anew = median(ours), median(theirs), median(theirs_anew)
    print(f"gamma: ours {ours():.4f}, cvxpy {theirs():.4f}")
    print(f"ours {1e3 * mine:.0f} ms, cvxpy with a parameter {1e3 * once:.0f} ms: {once / mine:.1f} times faster")
    print(f"cvxpy posed anew {1e3 * anew:.0f} ms: {anew / mine:.1f} times faster")
