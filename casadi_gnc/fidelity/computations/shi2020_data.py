"""What Shi, Liu, Biggs, Sun, Yue (2020), doi:10.1016/j.ast.2020.105759, print in section 4."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import casadi_gnc
from casadi_gnc.problem_files.synthesis_file import load_synthesis

#: The docking as printed.
DOCKING = "shi2020/docking_as_printed"


def _axis(matrix: list[list[float]]) -> np.ndarray:
    """Return a matrix that acts on every axis alike, from its entries for position and velocity."""
    return np.kron(np.array(matrix), np.eye(3))


def printed_matrices() -> dict[str, Any]:
    """Return X1, X3, W and H of section 4.A."""
    across = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    return {
        "X1": _axis([[0.0084, -0.0033], [-0.0033, 0.0100]]),
        "X3": 1.5547 * np.eye(3),
        "W": _axis([[0.1293, 0.3067]]) + np.kron([[-0.0001, 0.0003]], across),
        "H": _axis([[0.0236, 0.0023], [0.0074, 0.0354]]),
    }


@cache
def problem_data() -> dict[str, Any]:
    """Return what (24) to (26) are given."""
    given = load_synthesis("shi2020/as_printed").recipe.arguments()
    return {name: value for name, value in given.items() if name not in ("price", "margin")}


def printed_gains() -> tuple[np.ndarray, np.ndarray]:
    """Return the printed K, (3, 6), and L, (6, 6)."""
    law: Any = casadi_gnc.load(DOCKING).scheme("iobc").law
    return np.array(law.controller_gain), np.array(law.observer_gain)
