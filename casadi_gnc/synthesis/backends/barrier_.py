"""LMIs by a log-det barrier and damped Newton steps: no solver beyond this file.

Phase I minimises s subject to F_k(y) + s I >= 0 until s < 0; a lower bound s - nu/t > 0 on the
central path proves that there is no such y, and the barrier's multipliers are the certificate.
Phase II minimises cost'y from there. Equalities are eliminated by a basis of their null space. A
wide box around y keeps both phases bounded; an answer near its walls is a ray.
S. Boyd, L. Vandenberghe, Convex Optimization, 2004, sections 11.3 to 11.5.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from casadi_gnc.synthesis.backends import Claim, Found
from casadi_gnc.synthesis.conic import Kind, from_triangle, to_triangle
from casadi_gnc.synthesis.scaling import Scaled

REQUIRES = ()
_BOX = 1e7  # walls of the box, in scaled units, where data and usual answers are near one
_GROWTH = 20.0  # of the weight t of the objective from one centre to the next


@dataclass(frozen=True, eq=False)
class _Cone:
    """Hold matrices base_k + sum v_i slope_k,i and rows base + slope v, both to stay positive."""

    bases: list[np.ndarray]  # (m, m)
    slopes: list[np.ndarray]  # (n, m, m)
    base: np.ndarray  # (r,)
    slope: np.ndarray  # (r, n)

    @property
    def degree(self) -> int:
        return len(self.base) + sum(len(base) for base in self.bases)

    def values(self, v: np.ndarray) -> tuple[list[np.ndarray], np.ndarray]:
        matrices = [base + np.tensordot(v, slope, 1) for base, slope in zip(self.bases, self.slopes, strict=True)]
        return matrices, self.base + self.slope @ v

    def barrier(self, v: np.ndarray) -> float:
        """Return -sum log det, infinite outside."""
        matrices, rows = self.values(v)
        if not (np.all(rows > 0) and np.all(np.isfinite(v))):
            return np.inf
        total = -float(np.sum(np.log(rows)))
        for matrix in matrices:
            try:
                total -= 2 * float(np.sum(np.log(np.diag(np.linalg.cholesky(matrix)))))
            except np.linalg.LinAlgError:
                return np.inf
        return total

    def derivatives(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return gradient, (n,), and Hessian, (n, n), of the barrier inside."""
        matrices, rows = self.values(v)
        share = self.slope / rows[:, None]
        gradient, hessian = -share.sum(axis=0), share.T @ share
        for matrix, slope in zip(matrices, self.slopes, strict=True):
            inverse = np.linalg.inv(np.linalg.cholesky(matrix))
            relative = inverse @ slope @ inverse.T
            gradient -= np.trace(relative, axis1=1, axis2=2)
            flat = relative.reshape(len(slope), -1)
            hessian += flat @ flat.T
        return gradient, hessian


def _newton(cone: _Cone, v: np.ndarray, objective: np.ndarray) -> tuple[np.ndarray, float]:
    """Return Newton's step for objective'v + barrier, and the square of its decrement."""
    gradient, hessian = cone.derivatives(v)
    gradient = gradient + objective
    ridge = 1 / np.sqrt(np.maximum(np.diag(hessian), 1e-300))
    direction = -ridge * np.linalg.lstsq(hessian * np.outer(ridge, ridge), ridge * gradient, rcond=1e-15)[0]
    return direction, -float(gradient @ direction)


def _centre(cone: _Cone, v: np.ndarray, objective: np.ndarray, budget: int) -> tuple[np.ndarray, int, bool]:
    """Return the minimiser of objective'v + barrier from an interior point, Newton steps, and success."""
    last = np.inf
    for step in range(budget):
        direction, decrement = _newton(cone, v, objective)
        if not decrement > 1e-9:
            return v, step, decrement > -1e-9
        if last < 0.1 and decrement > last / 2:  # Newton's method squares it there: rounding has taken over
            return v, step, decrement < 1e-6
        last = decrement
        length = 1.0 if decrement < 0.1 else 1 / (1 + np.sqrt(decrement))
        here = cone.barrier(v)
        while length > 1e-12:
            trial = v + length * direction
            change = cone.barrier(trial) - here + length * float(objective @ direction)
            if change <= -0.1 * length * decrement + 1e-12 * abs(here):
                break
            length /= 2
        else:
            return v, step, decrement < 1e-4
        v = trial
    return v, budget, False


def solve(scaled: Scaled, *, tolerance: float = 1e-9, max_iterations: int = 600, centre: bool = False) -> Found:
    """Return the barrier method's answer.

    Parameters
    ----------
    scaled : what to solve.
    tolerance : gap, in scaled units, at which phase II stops.
    max_iterations : Newton steps in all.
    centre : whether, without an objective, the analytic centre is returned: it is unique and does
        not depend on the scaling, but far out where the set is unbounded.
    """
    started = time.perf_counter()
    equal = np.zeros(len(scaled.right), dtype=bool)
    for block in scaled.data.blocks:
        equal[block.rows] = block.kind is Kind.EQUAL
    dense = scaled.matrix.toarray()
    rows, values = dense[equal], scaled.right[equal]
    particular = np.linalg.lstsq(rows, -values, rcond=None)[0]
    residual = rows @ particular + values
    dual = np.zeros(len(equal))
    if np.linalg.norm(residual) > 1e-9 * (1 + np.linalg.norm(values)):
        dual[equal] = -residual  # orthogonal to the range: a certificate as it stands
        return Found(particular, dual, Claim.INFEASIBLE, 0, time.perf_counter() - started)
    basis = _null_space(rows, dense.shape[1])
    cone = _restrict(scaled, dense @ basis, dense @ particular + scaled.right)
    v, steps, t, claim = _first_phase(cone, max_iterations)
    price = basis.T @ scaled.cost
    if claim is Claim.SOLVED and np.any(price):
        v, more, t, claim = _second_phase(cone, v[:-1], price, tolerance, max_iterations - steps)
        steps, level, inner = steps + more, 0.0, v
    else:
        level, inner = v[-1], v[:-1]
        if centre and claim is Claim.SOLVED:
            inner, more, _ = _centre(cone, inner, np.zeros(len(inner)), max_iterations - steps)
            steps += more
    if t > 0:
        step = _newton(cone, inner, t * price)[0] if claim is Claim.SOLVED and np.any(price) else None
        dual = _multipliers(scaled, cone, inner, level, t, step)
        wanted = scaled.cost if claim is Claim.SOLVED and np.any(price) else np.zeros(dense.shape[1])
        dual[equal] = np.linalg.lstsq(rows.T, wanted - dense.T @ dual, rcond=None)[0]
    point = basis @ inner / np.max(np.abs(inner)) if claim is Claim.UNBOUNDED else particular + basis @ inner
    return Found(point, dual, claim, steps, time.perf_counter() - started)


def _null_space(rows: np.ndarray, count: int) -> np.ndarray:
    if not len(rows):
        return np.eye(count)
    _, singular, right = np.linalg.svd(rows)
    rank = int(np.sum(singular > 1e-12 * singular[0])) if singular[0] > 0 else 0
    return right[rank:].T


def _restrict(scaled: Scaled, slopes: np.ndarray, right: np.ndarray) -> _Cone:
    """Return the cone in the coordinates of the null space, the box included as its last rows."""
    bases, tensors, count = [], [], slopes.shape[1]
    plain, plain_base = [np.zeros((0, count))], [np.zeros(0)]
    for block in scaled.data.blocks:
        weight = scaled.data.weight[block.rows]
        if block.kind is Kind.SEMIDEFINITE:
            bases.append(from_triangle(right[block.rows] / weight, block.size))
            part = slopes[block.rows] / weight[:, None]
            row, column = np.tril_indices(block.size)
            tensor = np.zeros((count, block.size, block.size))
            tensor[:, row, column] = tensor[:, column, row] = part.T
            tensors.append(tensor)
        elif block.kind is Kind.NONNEGATIVE:
            plain.append(slopes[block.rows])
            plain_base.append(right[block.rows])
    walls = np.vstack([np.eye(count), -np.eye(count)])
    return _Cone(bases, tensors, np.concatenate([*plain_base, np.full(2 * count, _BOX)]), np.vstack([*plain, walls]))


def _first_phase(cone: _Cone, budget: int) -> tuple[np.ndarray, int, float, Claim]:
    """Return (y, s), Newton steps, weight t and what was found."""
    count, walls = cone.slope.shape[1], 2 * cone.slope.shape[1]
    lifted = np.concatenate([np.ones(len(cone.base) - walls), np.zeros(walls)])
    slope = np.vstack([np.column_stack([cone.slope, lifted]), np.eye(count + 1)[-1:]])
    slopes = [np.concatenate([part, np.eye(part.shape[1])[None]]) for part in cone.slopes]
    bigger = _Cone(cone.bases, slopes, np.append(cone.base, 10.0), slope)  # s > -10
    smallest = min(
        [np.min(cone.base), *[np.linalg.eigvalsh(base)[0] for base in cone.bases]],
    )
    v, steps, t = np.append(np.zeros(count), 1.0 + max(-smallest, 0.0)), 0, 1.0
    objective = np.append(np.zeros(count), 1.0)
    while steps < budget:
        v, more, good = _centre(bigger, v, t * objective, budget - steps)
        steps += more + 1
        if v[-1] < -1e-9 and np.isfinite(cone.barrier(v[:-1])):
            return v, steps, 0.0, Claim.SOLVED
        if not good:
            break
        if v[-1] - bigger.degree / t > 0:
            return v, steps, t, Claim.INFEASIBLE
        if t > 1e12:
            break
        t *= _GROWTH
    return v, steps, t, Claim.NOTHING


def _second_phase(
    cone: _Cone, y: np.ndarray, price: np.ndarray, tolerance: float, budget: int
) -> tuple[np.ndarray, int, float, Claim]:
    steps, t, reached = 0, 1.0, 0.0
    while steps < budget:
        trial, more, good = _centre(cone, y, t * price, budget - steps)
        steps += more + 1
        if not good and reached > 0:  # the last centre has the better multipliers
            return y, steps, reached, Claim.SOLVED
        y, reached = trial, t
        if np.max(np.abs(y)) > 1e-3 * _BOX and abs(price @ y) > 1e-6 * _BOX:
            if cone.degree / t < 1e-6 * _BOX:
                return y, steps, reached, Claim.UNBOUNDED
        elif cone.degree / t <= tolerance * (1 + abs(price @ y)) or not good:
            return y, steps, reached, Claim.SOLVED
        t *= _GROWTH
    return y, steps, reached, Claim.NOTHING


def _multipliers(
    scaled: Scaled, cone: _Cone, y: np.ndarray, level: float, t: float, step: np.ndarray | None = None
) -> np.ndarray:
    """Return the barrier's multipliers 1/(t F), (M,), triangles with weights; equalities zero.

    With Newton's step they are 1/t (F^-1 - F^-1 dF F^-1), which keep matrix'dual = cost where the point is
    no exact centre.
    """
    matrices, rows = cone.values(y)
    changes = [
        np.zeros_like(base) if step is None else np.tensordot(step, s, 1)
        for base, s in zip(cone.bases, cone.slopes, strict=True)
    ]
    change = np.zeros_like(rows) if step is None else cone.slope @ step
    dual, semidefinite, plain = np.zeros(len(scaled.right)), zip(matrices, changes, strict=True), 0
    for block in scaled.data.blocks:
        if block.kind is Kind.SEMIDEFINITE:
            matrix, moved = next(semidefinite)
            inverse = np.linalg.inv(matrix + level * np.eye(block.size))
            dual[block.rows] = to_triangle(inverse - inverse @ moved @ inverse) / t * scaled.data.weight[block.rows]
        elif block.kind is Kind.NONNEGATIVE:
            here = slice(plain, plain + block.size)
            inverse = 1 / (rows[here] + level)
            dual[block.rows] = (inverse - inverse**2 * change[here]) / t
            plain += block.size
    return dual
