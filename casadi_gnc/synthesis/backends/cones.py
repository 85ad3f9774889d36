"""The Nesterov-Todd scaling of half-lines and of cones of semidefinite matrices.

Vectors are rows of `Scaled`: plain ones, then lower triangles, row by row, with weights, so that products of vectors
are products of matrices. For s and z inside the cone there is one W with W^-T s = W z = lambda: for matrices it is
s -> R^-1 S R^-T and z -> R'Z R, both diagonal. Y. E. Nesterov, M. J. Todd, 1997, doi:10.1287/moor.22.1.1;
R by the singular values of a product of Cholesky factors as in L. Vandenberghe, The CVXOPT linear and quadratic
cone program solvers, 2010, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from casadi_gnc.synthesis.conic import from_triangle, triangle, triangle_count


@dataclass(frozen=True)
class Cone:
    """Hold a product of `plain` half-lines and of cones of matrices, (m, m) for each of `sizes`."""

    plain: int
    sizes: tuple[int, ...]

    @property
    def degree(self) -> int:
        """Return the degree of the logarithmic barrier."""
        return self.plain + sum(self.sizes)

    def split(self, rows: np.ndarray) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return plain rows and matrices of a vector."""
        matrices, start = [], self.plain
        for size in self.sizes:
            count = triangle_count(size)
            matrices.append(from_triangle(rows[start : start + count] / _weight(size), size))
            start += count
        return rows[: self.plain], matrices

    def joined(self, plain: np.ndarray, matrices: list[np.ndarray]) -> np.ndarray:
        """Return the vector of plain rows and matrices."""
        return np.concatenate([plain, *[one[triangle(len(one))] * _weight(len(one)) for one in matrices]])

    def one(self) -> np.ndarray:
        """Return the vector of ones and identities."""
        return self.joined(np.ones(self.plain), [np.eye(size) for size in self.sizes])

    def tensors(self, matrix: np.ndarray) -> list[np.ndarray]:
        """Return the columns of a matrix, (rows, N), as matrices, (N, m, m) for each size."""
        found, start, count = [], self.plain, matrix.shape[1]
        for size in self.sizes:
            part = matrix[start : start + triangle_count(size)] / _weight(size)[:, None]
            row, column = triangle(size)
            tensor = np.zeros((count, size, size))
            tensor[:, row, column] = tensor[:, column, row] = part.T
            found.append(tensor)
            start += triangle_count(size)
        return found


@lru_cache(maxsize=64)
def _weight(size: int) -> np.ndarray:
    row, column = triangle(size)
    return np.where(row == column, 1.0, np.sqrt(2.0))


@dataclass(frozen=True, eq=False)
class Scaling:
    """Hold the scaling at a pair (s, z).

    Parameters
    ----------
    width : (plain,), roots of s/z. factors : R, (m, m) each. inverses : R^-1.
    level, levels : lambda, (plain,), and its diagonals, (m,) each.
    """

    cone: Cone
    width: np.ndarray
    factors: list[np.ndarray]
    inverses: list[np.ndarray]
    level: np.ndarray
    levels: list[np.ndarray]

    @classmethod
    def unit(cls, cone: Cone) -> Scaling:
        """Return the scaling at s = z = one."""
        units, ones = [np.eye(size) for size in cone.sizes], [np.ones(size) for size in cone.sizes]
        return cls(cone, np.ones(cone.plain), units, units, np.ones(cone.plain), ones)

    def columns(self, matrix: np.ndarray, tensors: list[np.ndarray]) -> np.ndarray:
        """Return W^-T matrix, (rows, N)."""
        found = [matrix[: self.cone.plain] / self.width[:, None]]
        for tensor, inverse in zip(tensors, self.inverses, strict=True):
            count, size = tensor.shape[:2]
            half = (tensor.reshape(-1, size) @ inverse.T).reshape(count, size, size)
            row, column = triangle(size)
            found.append(((inverse @ half)[:, row, column] * _weight(size)).T)
        return np.vstack(found)

    def of_slack(self, s: np.ndarray) -> np.ndarray:
        """Return W^-T s."""
        plain, matrices = self.cone.split(s)
        return self.cone.joined(
            plain / self.width, [R @ one @ R.T for R, one in zip(self.inverses, matrices, strict=True)]
        )

    def slack(self, scaled: np.ndarray) -> np.ndarray:
        """Return s of W^-T s."""
        plain, matrices = self.cone.split(scaled)
        return self.cone.joined(
            plain * self.width, [R @ one @ R.T for R, one in zip(self.factors, matrices, strict=True)]
        )

    def dual(self, scaled: np.ndarray) -> np.ndarray:
        """Return z of W z."""
        plain, matrices = self.cone.split(scaled)
        return self.cone.joined(
            plain / self.width, [R.T @ one @ R for R, one in zip(self.inverses, matrices, strict=True)]
        )

    def here(self) -> np.ndarray:
        """Return lambda as a vector."""
        return self.cone.joined(self.level, [np.diag(one) for one in self.levels])

    def product(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return the symmetric product, (AB + BA)/2 of matrices."""
        (first, firsts), (second, seconds) = self.cone.split(a), self.cone.split(b)
        return self.cone.joined(first * second, [(A @ B + B @ A) / 2 for A, B in zip(firsts, seconds, strict=True)])

    def divided(self, a: np.ndarray) -> np.ndarray:
        """Return what multiplied by lambda gives a."""
        plain, matrices = self.cone.split(a)
        return self.cone.joined(
            plain / self.level,
            [2 * one / (level[:, None] + level) for one, level in zip(matrices, self.levels, strict=True)],
        )

    def furthest(self, step: np.ndarray) -> float:
        """Return the longest step for which lambda + length step stays in the cone."""
        plain, matrices = self.cone.split(step)
        lowest = [float(np.min(plain / self.level, initial=0.0))]
        for one, level in zip(matrices, self.levels, strict=True):
            root = np.sqrt(level)
            lowest.append(float(np.linalg.eigvalsh(one / np.outer(root, root))[0]))
        return -1 / min(lowest) if min(lowest) < 0 else np.inf

    def moved(self, slack: np.ndarray, dual: np.ndarray) -> Scaling:
        """Return the scaling at another pair, given in scaled units; raise `LinAlgError` outside the cone."""
        (s, matrices), (z, duals) = self.cone.split(slack), self.cone.split(dual)
        if not (np.all(s > 0) and np.all(z > 0)):
            raise np.linalg.LinAlgError
        factors, inverses, levels = [], [], []
        for R, inverse, S, Z in zip(self.factors, self.inverses, matrices, duals, strict=True):
            lower, dual_lower = np.linalg.cholesky(S), np.linalg.cholesky(Z)
            left, level, right = np.linalg.svd(dual_lower.T @ lower)
            if not level[-1] > 0:
                raise np.linalg.LinAlgError
            factors.append(R @ lower @ (right.T / np.sqrt(level)))
            inverses.append((left / np.sqrt(level)).T @ dual_lower.T @ inverse)
            levels.append(level)
        return Scaling(self.cone, self.width * np.sqrt(s / z), factors, inverses, np.sqrt(s * z), levels)
