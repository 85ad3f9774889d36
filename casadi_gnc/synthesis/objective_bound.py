"""Lower bounds on the objective of a set of LMIs, from multipliers."""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from casadi_gnc.synthesis.conic import into_cone
from casadi_gnc.synthesis.scaling import Scaled


def bound(scaled: Scaled, dual: np.ndarray, y: np.ndarray, *, margins: bool = True) -> float:
    """Return a lower bound on the objective, in original units, from scaled multipliers (weights included).

    It holds for every point whose scaled unknowns are within ten times the largest at hand (or ten).

    Parameters
    ----------
    margins : whether the margins are asked for; without them the bound is one on what any margins cost.
    """
    if np.shape(dual) != np.shape(scaled.right) or not np.all(np.isfinite(dual)):
        return -np.inf
    right = scaled.right if margins else scaled.data.offset * scaled.row * scaled.data.weight
    reach, matrix, best = 10 * max(1.0, float(np.max(np.abs(y), initial=0.0))), scaled.matrix, -np.inf
    gram = (matrix.T @ matrix).toarray()
    gram[np.diag_indices_from(gram)] += 1e-13 * (1.0 + np.max(np.diag(gram), initial=0.0))
    factor = cho_factor(gram)
    for _ in range(4):  # towards matrix'z = cost and back into the cone
        dual = into_cone(scaled.data, dual / scaled.data.weight) * scaled.data.weight
        residual = scaled.cost - matrix.T @ dual
        value, doubt = -float(right @ dual), reach * float(np.sum(np.abs(residual)))
        best = max(best, value - doubt)
        if doubt <= 1e-6 * abs(value):
            break
        dual = dual + matrix @ cho_solve(factor, residual)
    return best / scaled.price + scaled.data.constant
