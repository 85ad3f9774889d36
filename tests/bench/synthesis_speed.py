"""Repaired docking synthesis, modelling and solving end to end: ours against cvxpy + Clarabel in the same run.

    python tests/bench/synthesis_speed.py

For one axis, and for the pair's six states as shipped:

* once, for a given gamma: from the plant's matrices to LMIs to the answer;
* gamma bisected over the same 14 values; cvxpy poses each anew, or once with gamma^2 as a parameter.

Both solve to ten digits; ours also certifies, proves the last value that has no point, and splits what the plant does
not couple. Medians of runs that alternate, so that load hits both.
"""

import time
import warnings

import numpy as np

from casadi_gnc.problem_files.synthesis_file import load_synthesis
from casadi_gnc.synthesis.recipes.intermediate_observer import _pose, uncoupled

A, B, VARPI, S, MARGIN = np.array([[0, 1.0], [0, 0]]), np.array([[0], [0.05]]), 200.0, 0.3, 1e-6
ONE_AXIS = (A, B)
SIX_STATES = tuple(load_synthesis("shi2020/synthesis").recipe.arguments()[name] for name in "AB")
GAMMA = 3.5  # a little above the smallest


def bisect(feasible):
    low, high = 1.0, 8.0
    for _ in range(14):
        gamma = np.sqrt(low * high)
        low, high = (low, gamma) if feasible(gamma**2) else (gamma, high)
    return low, high


def pose_ours(square, plant):
    C = np.eye(len(plant[0]))
    return _pose(*plant, C, uncoupled(*plant, C), VARPI, S, square, MARGIN)


def ours(plant):
    lmis, one = (pose_ours(square, plant) for square in (0.0, 1.0))
    zero, ends = lmis.data(), one.data()
    low, high = bisect(lambda square: lmis.attempt(zero.towards(ends, square), prove=False).status.holds)
    assert not lmis.attempt(zero.towards(ends, low**2)).status.holds  # with its proof
    return high


def ours_once(plant):
    assert pose_ours(GAMMA**2, plant).solve(conflict=False).status.holds


def theirs_once(plant):
    assert solved(pose_theirs(GAMMA**2, plant))


def pose_theirs(square, plant):
    import cvxpy as cp

    A, B = plant
    n, m = B.shape
    X1, X3 = cp.Variable((n, n), symmetric=True), cp.Variable((m, m), symmetric=True)
    W, H, BB, Z = cp.Variable((m, n)), cp.Variable((n, n)), VARPI * B @ B.T, np.zeros
    first, second, third = A @ X1 - B @ W, (A + BB) @ X1 - H, -VARPI * (B.T @ B) @ X3
    p12, p13 = B @ W + BB @ X1, B @ X3
    p23 = B @ X3 - VARPI * X1 @ (A.T @ B) - VARPI * X1 @ (BB @ B)
    noise = -square * (2 * S * X1 - S**2 * np.eye(n))
    rows = [
        [first + first.T, p12, p13, Z((n, m)), Z((n, n)), X1],
        [p12.T, second + second.T, p23, Z((n, m)), -H, Z((n, n))],
        [p13.T, p23.T, third + third.T, np.eye(m), Z((m, n)), Z((m, n))],
        [Z((m, n)), Z((m, n)), np.eye(m), -square * np.eye(m), Z((m, n)), Z((m, n))],
        [Z((n, n)), -H.T, Z((n, m)), Z((n, m)), noise, Z((n, n))],
        [X1, Z((n, n)), Z((n, m)), Z((n, m)), Z((n, n)), -np.eye(n)],
    ]
    whole = cp.bmat(rows)
    constraints = [X1 >> MARGIN * np.eye(n), X3 >> MARGIN * np.eye(m)]
    constraints += [-(whole + whole.T) / 2 >> MARGIN * np.eye(4 * n + 2 * m)]
    return cp.Problem(cp.Minimize(0), constraints)


def solved(problem):
    import cvxpy as cp

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # near the smallest gamma answers are called inaccurate
        try:
            problem.solve(solver="CLARABEL", tol_feas=1e-10, tol_gap_abs=1e-10, tol_gap_rel=1e-10)
        except cp.SolverError:  # it returns nothing near the smallest gamma of the six states
            return False
    return problem.status.startswith("optimal")


def theirs(plant):
    import cvxpy as cp

    square = cp.Parameter(nonneg=True)
    problem = pose_theirs(square, plant)

    def feasible(value):
        square.value = value
        return solved(problem)

    return bisect(feasible)[1]


def theirs_anew(plant):
    return bisect(lambda square: solved(pose_theirs(square, plant)))[1]


def race(plant, runs, *calls):
    """Return the median seconds of each call, over runs in turn, after one to warm up."""
    times = [[] for _ in calls]
    for run in range(runs + 1):
        for call, found in zip(calls, times, strict=True):
            started = time.perf_counter()
            call(plant)
            if run:
                found.append(time.perf_counter() - started)
    return [1e3 * float(np.median(found)) for found in times]


if __name__ == "__main__":
    for name, plant in (("one axis", ONE_AXIS), ("six states", SIX_STATES)):
        mine, other = race(plant, 15, ours_once, theirs_once)
        print(f"{name}, once: ours {mine:.1f} ms, cvxpy {other:.1f} ms: {other / mine:.1f} times faster")
        print(f"{name}, gamma: ours {ours(plant):.4f}, cvxpy {theirs(plant):.4f}")
        mine, anew, once = race(plant, 3, ours, theirs_anew, theirs)
        print(f"{name}, bisected: ours {mine:.0f} ms, cvxpy posed anew {anew:.0f} ms: {anew / mine:.1f} times faster")
        print(f"{name}, bisected: cvxpy with a parameter {once:.0f} ms: {once / mine:.1f} times faster")
