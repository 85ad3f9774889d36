"""How a contract says that it is not kept."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np


class ContractError(AssertionError):
    """Report what is not kept, in one sentence."""


def must(kept: Any, sentence: str) -> None:
    """Raise `ContractError` with a sentence unless something is kept."""
    if not kept:
        raise ContractError(sentence)


def numbers(expression: Any) -> np.ndarray:
    """Return a CasADi expression of numbers as one column."""
    return np.array(ca.DM(expression)).ravel()
