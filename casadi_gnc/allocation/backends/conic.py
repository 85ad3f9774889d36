"""The allocation problem as a second-order cone program, in the form that cone solvers take.

    minimise z'Pz/2 + c'z   subject to   b - A z in a product of cones,     z = (x, t).

The rotated cone |B_v x - b|^2/2 <= t becomes the ordinary one by |(sqrt2 r_v, t - 1)| <= t + 1. The
multipliers of t in the cones sum to one: they are the vertex weights of the certificate.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from scipy import sparse

from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver


class ConicForm(Protocol):
    """A cone program whose P and A stay; the first N variables are the scaled forces.

    Attributes
    ----------
    quadratic, matrix : P and A, sparse.
    nonnegative : number of leading rows in the non-negative cone.
    second_order, semidefinite : dimensions of the cones that follow.
    """

    quadratic: Any
    matrix: Any
    nonnegative: int
    second_order: list[int]
    semidefinite: list[int]

    def linear(self, sample: Sample) -> np.ndarray:
        """Return c."""
        ...

    def right(self, sample: Sample) -> np.ndarray:
        """Return b."""
        ...

    def weights(self, multipliers: np.ndarray) -> np.ndarray | None:
        """Return the vertex weights, (V,), of the multipliers of all rows; None where there are none."""
        ...


class SecondOrderForm:
    """The robust problem with one second-order cone a vertex; see `ConicForm`."""

    def __init__(self, scaled: ScaledSolver) -> None:
        vertices, rows, count = scaled.matrices.shape
        box = np.hstack([np.vstack([np.eye(count), -np.eye(count)]), np.zeros((2 * count, 1))])
        cones = np.zeros((vertices, rows + 2, count + 1))
        cones[:, 0, count] = cones[:, -1, count] = -1.0
        cones[:, 1:-1, :count] = np.sqrt(2) * scaled.matrices
        self.quadratic = sparse.csc_matrix(np.diag(np.append(scaled.quadratic, 0.0)))
        self.matrix = sparse.csc_matrix(np.vstack([box, cones.reshape(-1, count + 1)]))
        self.nonnegative, self.second_order = 2 * count, [rows + 2] * vertices
        self.semidefinite: list[int] = []
        self._shape = vertices, rows + 2

    def linear(self, sample: Sample) -> np.ndarray:
        """Return c."""
        return np.append(sample.linear, 1.0)

    def right(self, sample: Sample) -> np.ndarray:
        """Return b."""
        cone = np.concatenate([[1.0], np.sqrt(2) * sample.target, [-1.0]])
        return np.concatenate([sample.upper, -sample.lower, np.tile(cone, self._shape[0])])

    def weights(self, multipliers: np.ndarray) -> np.ndarray:
        """Return the vertex weights, (V,), of the multipliers of all rows."""
        each = multipliers[self.nonnegative :].reshape(self._shape)
        return each[:, 0] + each[:, -1]
