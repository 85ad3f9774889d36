"""A covariance kept as P = U D U', which stays positive whatever is rounded: half the digits suffice.

U is unit upper triangular, D diagonal and positive. Both steps of a Kalman filter work on the factors alone:
a scalar measurement by Bierman's update, a step of time by Thornton's (weighted Gram-Schmidt). Columns of numbers
hold D first, then U above its diagonal row by row.

Source: Bierman, Factorization Methods for Discrete Sequential Estimation (1977), chapters V and VI.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, eq=False)
class Factors:
    """Hold a covariance by its factors.

    Parameters
    ----------
    d : D, a list of n numbers.
    u : U, n rows of n numbers; below the diagonal zeros.
    """

    d: list[Any]
    u: list[list[Any]]

    @classmethod
    def diagonal(cls, variances: list[Any]) -> Factors:
        """Return the factors of a diagonal covariance."""
        n = len(variances)
        return cls(list(variances), [[ca.SX(1.0 if i == j else 0.0) for j in range(n)] for i in range(n)])

    @classmethod
    def unpacked(cls, column: Any, n: int) -> Factors:
        """Return the factors that a column, (n (n + 1)/2,), holds."""
        rows = cls.diagonal([column[i] for i in range(n)])
        place = n
        for i in range(n):
            for j in range(i + 1, n):
                rows.u[i][j] = column[place]
                place += 1
        return rows

    def packed(self) -> Any:
        """Return the column of the factors."""
        n = len(self.d)
        return ca.vertcat(*self.d, *(self.u[i][j] for i in range(n) for j in range(i + 1, n)))

    def variance(self, i: int) -> Any:
        """Return P_ii."""
        return sum(self.u[i][k] ** 2 * self.d[k] for k in range(i, len(self.d)))

    def moved(self, transition: Any, noise: list[Any]) -> Factors:
        """Return the factors of F P F' + diag(noise).

        Parameters
        ----------
        transition : F, (n, n).
        noise : variances added, n numbers.
        """
        n = len(self.d)
        f: Any = ca.SX(transition)
        turned = [[_sum(f[i, k] * self.u[k][j] for k in range(j + 1)) for j in range(n)] for i in range(n)]
        rows = [[*turned[i], *(ca.SX(1.0 if i == j else 0.0) for j in range(n))] for i in range(n)]
        weights = [*self.d, *noise]
        found = Factors.diagonal([ca.SX(0)] * n)
        for j in reversed(range(n)):
            weighted = [weight * entry for weight, entry in zip(weights, rows[j], strict=True)]
            found.d[j] = _sum(a * b for a, b in zip(weighted, rows[j], strict=True))
            inverse = 1 / found.d[j]
            for i in range(j):
                share = _sum(a * b for a, b in zip(rows[i], weighted, strict=True)) * inverse
                found.u[i][j] = share
                rows[i] = [a - share * b for a, b in zip(rows[i], rows[j], strict=True)]
        return found

    def told(self, row: list[Any], variance: Any) -> tuple[Factors, list[Any]]:
        """Return the factors after a measurement h x + noise, and the gain, n numbers.

        Parameters
        ----------
        row : h, n numbers; where all are zero nothing changes.
        variance : of the noise, positive.
        """
        n = len(self.d)
        f = [_sum(self.u[k][j] * row[k] for k in range(j + 1)) for j in range(n)]
        v = [self.d[j] * f[j] for j in range(n)]
        found = Factors.diagonal([ca.SX(0)] * n)
        total, gain = ca.SX(variance), [ca.SX(0)] * n
        for j in range(n):
            before, total = total, total + f[j] * v[j]
            found.d[j] = self.d[j] * (before / total)
            share = -f[j] / before
            for i in range(j):
                found.u[i][j] = self.u[i][j] + share * gain[i]
                gain[i] = gain[i] + self.u[i][j] * v[j]
            gain[j] = v[j]
        inverse = 1 / total
        return found, [each * inverse for each in gain]


def _sum(terms: Any) -> Any:
    total = ca.SX(0)
    for term in terms:
        total = total + term
    return total
