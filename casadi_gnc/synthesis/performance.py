"""The plant that recipes of feedback share: x' = A x + B u + E w with what is to stay small, z = C x + D u + F w."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from casadi_gnc.synthesis.analysis import fits, matrices


@dataclass(frozen=True, eq=False)
class Performance:
    """Hold the plant x' = A x + B u + E w, z = C x + D u + F w.

    Parameters
    ----------
    A : (n, n). B : (n, m). E : (n, q). C : (p, n). D : (p, m). F : (p, q).
    suffix : of the names of E, C, D and z, where a plant has several.
    """

    A: np.ndarray
    B: np.ndarray
    E: np.ndarray
    C: np.ndarray
    D: np.ndarray
    F: np.ndarray
    suffix: str = ""

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """Return n, m, q and p: of state, command, disturbance and z."""
        return len(self.A), self.B.shape[1], self.E.shape[1], len(self.C)

    @property
    def priced(self) -> int:
        """Return how many commands z tells apart."""
        return int(np.linalg.matrix_rank(self.D))

    @property
    def missing(self) -> str:
        """Return what would bound gains that run away."""
        if self.priced == self.B.shape[1]:
            return "Give fastest_rad_s."
        return (
            f"z{self.suffix} prices {self.priced} of {self.B.shape[1]} commands: add rows with the others to "
            f"D{self.suffix}, or give fastest_rad_s."
        )


def performance(A: Any, B: Any, E: Any, C: Any, D: Any, F: Any = None, *, suffix: str = "") -> Performance:
    """Return the plant, F zero by default; raise `SynthesisError` where shapes do not fit each other."""
    of_w, of_z, of_u = (f"{name}{suffix}" for name in "ECD")
    A, B, E, C, D = matrices(**{"A": A, "B": B, of_w: E, of_z: C, of_u: D})
    n, m, q, p = len(A), B.shape[1], E.shape[1], len(C)
    (F,) = matrices(F=np.zeros((p, q)) if F is None else F)
    for name, matrix, rows, columns in (
        ("A", A, n, n),
        ("B", B, n, m),
        (of_w, E, n, q),
        (of_z, C, p, n),
        (of_u, D, p, m),
        ("F", F, p, q),
    ):
        fits(name, matrix, rows, columns)
    return Performance(A, B, E, C, D, F, suffix)
