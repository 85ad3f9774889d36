"""The paper's semidefinite program, through Clarabel ("sdp") and SCS ("sdp_scs").

    minimise Y   subject to   Y1 + Y2 + Y3 <= Y,   lower <= F <= upper,

    [ I              M1^(1/2) (F - Fs) ]        [ I              M2^(1/2) (F - Fp) ]
    [ (...)'         Y1                ] >= 0,  [ (...)'         Y2                ] >= 0,

    [ I              h^(1/2) (u - B_v F) ]
    [ (...)'         Y3                  ] >= 0    for every vertex v.

As printed the inequalities are strict, which no solver has; their closure has the same optimal value.
The diagonal matrix inequalities (66)-(67) are the bounds themselves. Each Schur complement says that Y
is at least a squared norm, so this is the cone program of `conic` at many times the cost: it is here to
compare with. The multiplier of Y3 in block v is the vertex weight. The lengths are scaled as in `scaling`.

Source: Huang, Biggs, Duan (2020), Theorem 3, eqs (63)-(67), doi:10.1016/j.ast.2019.105572.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy import sparse

from casadi_gnc.allocation.backends import BackEnd, Capability
from casadi_gnc.allocation.backends.clarabel_ import ClarabelSolver
from casadi_gnc.allocation.backends.scaling import Sample, ScaledSolver
from casadi_gnc.allocation.backends.scs_ import ScsSolver
from casadi_gnc.allocation.problem import AllocationProblem

CAPABILITIES = Capability.ROBUST | Capability.EXACT | Capability.SDP
REQUIRES = ("clarabel",)
ACCURACY = (1e-6, 1e-10)


class TheoremForm:
    """Theorem 3 in the variables (x, Y1, Y2, Y3, Y); see `conic.ConicForm`.

    Parameters
    ----------
    scaled : the scaled problem.
    lower : whether triangles are lower ones, column by column (SCS), or upper ones (Clarabel).
    """

    def __init__(self, scaled: ScaledSolver, *, lower: bool) -> None:
        count = scaled.matrices.shape[2]
        self._count = count
        self._effort, self._change = np.sqrt(scaled.effort_quadratic / 2), np.sqrt(scaled.change_quadratic / 2)
        box = np.zeros((2 * count + 1, count + 4))
        box[:count, :count], box[count:-1, :count] = np.eye(count), -np.eye(count)
        box[-1, count:] = [1.0, 1.0, 1.0, -1.0]
        # Each block: the linear map of its last column, and which Y is its corner.
        self._blocks = [(np.diag(self._effort), 0), (np.diag(self._change), 1)]
        self._blocks += [(matrix / np.sqrt(2), 2) for matrix in scaled.matrices]
        self._orders = [_order(len(linear) + 1, lower=lower) for linear, _ in self._blocks]
        parts = [box]
        for (linear, corner), order in zip(self._blocks, self._orders, strict=True):
            size = len(linear)
            part = np.zeros((len(order), count + 4))
            part[-size - 1 : -1, :count] = -np.sqrt(2) * linear
            part[-1, count + corner] = -1.0
            parts.append(part[order])
        self.matrix = sparse.csc_matrix(np.vstack(parts))
        self.quadratic = sparse.csc_matrix((count + 4, count + 4))
        self.nonnegative = 2 * count + 1
        self.second_order: list[int] = []
        self.semidefinite = [len(linear) + 1 for linear, _ in self._blocks]
        ends = self.nonnegative + np.cumsum([len(order) for order in self._orders])
        self._corners = ends[2:] - 1  # the last entry of either triangle
        self._units = [_unit(size) for size in self.semidefinite]

    def linear(self, sample: Sample) -> np.ndarray:
        """Return c: minimise Y."""
        return np.append(np.zeros(self._count + 3), 1.0)

    def right(self, sample: Sample) -> np.ndarray:
        """Return b: the bounds, and the constant parts of the blocks."""
        offsets = [self._effort * sample.preferred, self._change * sample.previous]
        offsets += [sample.target / np.sqrt(2)] * (len(self._blocks) - 2)
        parts = [sample.upper, -sample.lower, np.zeros(1)]
        for unit, offset, order in zip(self._units, offsets, self._orders, strict=True):
            triangle = unit.copy()
            triangle[-len(offset) - 1 : -1] = -np.sqrt(2) * offset
            parts.append(triangle[order])
        return np.concatenate(parts)

    def weights(self, multipliers: np.ndarray) -> np.ndarray:
        """Return the vertex weights, (V,), of the multipliers of all rows."""
        return multipliers[self._corners]


def _order(size: int, *, lower: bool) -> np.ndarray:
    """Return where the entries of the wanted triangle are in the upper one, column by column."""
    place = {pair: k for k, pair in enumerate((i, j) for j in range(size) for i in range(j + 1))}
    if not lower:
        return np.arange(len(place))
    return np.array([place[column, row] for column in range(size) for row in range(column, size)])


def _unit(size: int) -> np.ndarray:
    """Return the upper triangle of diag(1, ..., 1, 0)."""
    matrix = np.diag(np.append(np.ones(size - 1), 0.0))
    return np.concatenate([matrix[: j + 1, j] for j in range(size)])


def set_up(problem: AllocationProblem, *, tolerance: float = 1e-10, max_iterations: int = 100) -> ClarabelSolver:
    """Return Theorem 3 for a problem, for Clarabel, whose own the options are."""
    return ClarabelSolver(problem, partial(TheoremForm, lower=False), tolerance, max_iterations)


def set_up_scs(problem: AllocationProblem, *, tolerance: float = 1e-6, max_iterations: int = 5000) -> ScsSolver:
    """Return Theorem 3 for a problem, for SCS, whose own the options are."""
    return ScsSolver(problem, partial(TheoremForm, lower=True), tolerance, max_iterations)


SCS = BackEnd(CAPABILITIES | Capability.WARM_START, ("scs",), (2e-2, 1e-8), set_up_scs)
