"""Linear equations written out as plain arithmetic: the same words everywhere, constants folded, zeros left out."""

from __future__ import annotations

from typing import Any

import casadi as ca


def solve_symmetric(matrix: Any, right: Any) -> ca.SX:
    """Return x of A x = b for a symmetric positive definite A, (n, n), by A = L D L'.

    Unknowns are eliminated from the first to the last, and entries that are structurally zero cost nothing: put
    unknowns first that touch few others.

    Parameters
    ----------
    matrix : A; its lower triangle is read.
    right : b, (n,).
    """
    a, x = ca.SX(matrix), ca.SX(right)
    n = a.shape[0]
    entries = [[a[i, j] for j in range(i + 1)] for i in range(n)]
    solution = [x[i] for i in range(n)]
    for k in range(n):
        pivot = entries[k][k]
        for i in range(k + 1, n):
            if _nothing(entries[i][k]):
                continue
            factor = entries[i][k] / pivot
            for j in range(k + 1, i + 1):
                if not _nothing(entries[j][k]):
                    entries[i][j] = entries[i][j] - factor * entries[j][k]
            solution[i] = solution[i] - factor * solution[k]
    for k in reversed(range(n)):
        for i in range(k + 1, n):
            if not _nothing(entries[i][k]):
                solution[k] = solution[k] - entries[i][k] * solution[i]
        solution[k] = solution[k] / entries[k][k]
    return ca.vertcat(*solution) if n else ca.SX(0, 1)


def _nothing(entry: ca.SX) -> bool:
    return bool(entry.is_zero())
