"""Split a positive definite matrix into a diagonal one and one of low rank, by plain arithmetic: the same everywhere.

    H = diag(d) + B' B,   d > 0,   B with as few rows as possible

Factor analysis asks for the same split. With r pivots P and the rest Q, the Schur complement of H - diag(d) about P
must vanish. Its diagonal gives d on Q at once; beside it lie (n - r)(n - r - 1) / 2 equations in the r numbers
of d on P, which damped Gauss-Newton steps solve. It need not find a split where there is one; what it finds is one.
"""

from __future__ import annotations

from collections.abc import Sequence

Matrix = Sequence[Sequence[float]]
_STEPS, _STARTS = 40, (0.5, 0.8, 0.3, 1.0, 0.1, 0.9)
#: By how much of the least eigenvalue the split may miss the matrix, and least part of it that d may be.
_MISS, _LEAST = 1e-9, 1e-3


def cholesky(matrix: Matrix) -> list[list[float]] | None:
    """Return the lower triangle L, L L' = matrix; None where the matrix is not positive definite."""
    lower: list[list[float]] = []
    for i, row in enumerate(matrix):
        own: list[float] = []
        for j in range(i + 1):
            left = row[j] - sum([a * b for a, b in zip(own, lower[j] if j < i else own, strict=False)])
            if j < i:
                own.append(left / lower[j][j])
            elif left > 0.0:
                own.append(left**0.5)
            else:
                return None
        lower.append(own)
    return lower


def substitute(lower: Matrix, right: Sequence[float]) -> list[float]:
    """Return the solution x of L x = right."""
    found: list[float] = []
    for row, value in zip(lower, right, strict=True):
        found.append((value - sum([a * b for a, b in zip(row, found, strict=False)])) / row[len(found)])
    return found


def solve(lower: Matrix, right: Sequence[float]) -> list[float]:
    """Return the solution x of L L' x = right."""
    forward, n = substitute(lower, right), len(right)
    found = [0.0] * n
    for i in reversed(range(n)):
        found[i] = (forward[i] - sum([lower[k][i] * found[k] for k in range(i + 1, n)])) / lower[i][i]
    return found


def inverse(matrix: Matrix) -> list[list[float]]:
    """Return the inverse of a positive definite matrix."""
    lower = cholesky(matrix)
    if lower is None:
        raise ValueError("the matrix is not positive definite")
    n = len(matrix)
    rows = [solve(lower, [float(i == k) for i in range(n)]) for k in range(n)]
    return [[0.5 * (rows[i][j] + rows[j][i]) for j in range(n)] for i in range(n)]


def least_eigenvalue(matrix: Matrix) -> float:
    """Return the least eigenvalue of a positive definite matrix, from below; 0 where it is not positive definite."""
    low, high = 0.0, min(row[i] for i, row in enumerate(matrix))
    if cholesky(matrix) is None:
        return 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if cholesky(_less(matrix, [middle] * len(matrix))) is None:
            high = middle
        else:
            low = middle
    return low


def split(matrix: Matrix, most: int) -> tuple[list[float], list[list[float]]] | None:
    """Return d (n,) and B (r, n), r <= most, of a symmetric matrix; None where none was found.

    It misses the matrix by at most 1e-9 of its least eigenvalue, and no d is below 1e-3 of that.
    """
    least = least_eigenvalue(matrix)
    if not least > 0.0:
        return None
    bounds = [1.0 / row[i] for i, row in enumerate(inverse(matrix))]  # no d of any split is larger
    starts = [[least] * len(matrix), *([share * one for one in bounds] for share in _STARTS)]
    for rank in range(min(most, len(matrix) - 1) + 1):
        for start in starts:
            found = _of_rank(matrix, rank, start, least)
            if found is not None:
                return found
    return None


def _less(matrix: Matrix, diagonal: Sequence[float]) -> list[list[float]]:
    return [[value - diagonal[i] * (i == j) for j, value in enumerate(row)] for i, row in enumerate(matrix)]


def _pivots(matrix: Matrix, rank: int) -> list[int]:
    """Return the rows that elimination with the largest pivots takes first."""
    rest, chosen = [list(row) for row in matrix], []
    n = len(matrix)
    for _ in range(rank):
        p = max((i for i in range(n) if i not in chosen), key=lambda i: rest[i][i])
        if not rest[p][p] > 0.0:
            break
        chosen.append(p)
        rest = [[rest[i][j] - rest[i][p] * rest[p][j] / rest[p][p] for j in range(n)] for i in range(n)]
    return chosen


def _of_rank(
    matrix: Matrix, rank: int, start: Sequence[float], least: float
) -> tuple[list[float], list[list[float]]] | None:
    n = len(matrix)
    pivots = _pivots(_less(matrix, start), rank)
    if len(pivots) < rank:
        return None
    others = [i for i in range(n) if i not in pivots]
    pairs = [(a, b) for b in range(len(others)) for a in range(b)]
    d = [start[p] for p in pivots]
    damping, best, kept = 1e-3, float("inf"), d
    normal, right = [[0.0] * rank] * rank, [0.0] * rank
    for _ in range(_STEPS):
        lower = cholesky([[matrix[p][q] - d[i] * (i == j) for j, q in enumerate(pivots)] for i, p in enumerate(pivots)])
        y = [] if lower is None else [solve(lower, [matrix[p][i] for p in pivots]) for i in others]
        missed = [
            matrix[others[a]][others[b]] - sum([matrix[p][others[a]] * y[b][k] for k, p in enumerate(pivots)])
            for a, b in pairs
            if y
        ]
        size = sum([one * one for one in missed]) if y and min([*d, 1.0]) > 0.0 else float("inf")
        if size < best:
            best, kept, damping = size, d, 0.1 * damping
            slopes = [[-y[a][k] * y[b][k] for k in range(rank)] for a, b in pairs]
            normal = [[sum([s[i] * s[j] for s in slopes]) for j in range(rank)] for i in range(rank)]
            right = [-sum([s[i] * one for s, one in zip(slopes, missed, strict=True)]) for i in range(rank)]
        else:
            damping *= 10.0
        if best == 0.0 or best == float("inf") or damping > 1e12 or not rank:
            break
        most = max([normal[i][i] for i in range(rank)])
        factor = cholesky(_less(normal, [-(damping + 1e-14) * most - 1e-300] * rank))
        if factor is None:
            break
        d = [one + change for one, change in zip(kept, solve(factor, right), strict=True)]
    return _checked(matrix, pivots, others, kept, least)


def _checked(
    matrix: Matrix, pivots: list[int], others: list[int], d: list[float], least: float
) -> tuple[list[float], list[list[float]]] | None:
    """Return the split that d on the pivots makes; None where it is none."""
    n = len(matrix)
    lower = cholesky([[matrix[p][q] - d[i] * (i == j) for j, q in enumerate(pivots)] for i, p in enumerate(pivots)])
    if lower is None:
        return None
    whole = dict(zip(pivots, d, strict=True))
    columns = {p: [*lower[i], *([0.0] * (len(pivots) - i - 1))] for i, p in enumerate(pivots)}
    for i in others:
        columns[i] = substitute(lower, [matrix[p][i] for p in pivots])
        whole[i] = matrix[i][i] - sum([one * one for one in columns[i]])
    for i in range(n):
        for j in range(i + 1):
            made = whole[i] * (i == j) + sum([a * b for a, b in zip(columns[i], columns[j], strict=True)])
            if not n * abs(matrix[i][j] - made) <= _MISS * least:
                return None
    diagonal = [whole[i] for i in range(n)]
    if min(diagonal) < _LEAST * least:
        return None
    return diagonal, [[columns[i][k] for i in range(n)] for k in range(len(pivots))]
