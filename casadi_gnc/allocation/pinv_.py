"""Pseudo-inverse, then clip: the baseline of Huang, Biggs, Duan (2020).

    F = clip(A'(A A')^-1 u, lower, upper)

Cheap and blind: thrusters push one way only, so the clip loses about half of the torque.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc import bounds
from casadi_gnc.rigid_body import inverse3
from casadi_gnc.signals import Layout


def pseudo_inverse(effectiveness: ca.DM) -> ca.DM:
    """Return A'(A A')^-1, (N, 3), by plain arithmetic (no LAPACK, so constants are portable)."""
    return ca.mtimes(effectiveness.T, inverse3(ca.mtimes(effectiveness, effectiveness.T)))


@dataclass(frozen=True, eq=False)
class PseudoInverse:
    """Allocate by the clipped pseudo-inverse, as a CasADi expression.

    Parameters
    ----------
    effectiveness : A, (3, N), of full row rank.
    """

    effectiveness: ca.DM
    report = Layout()

    def expression(self, command: Any, previous: Any, lower: Any, upper: Any) -> Any:
        """Return F, (N,), as an expression of its arguments."""
        return bounds.clip(ca.mtimes(pseudo_inverse(self.effectiveness), command), lower, upper)
