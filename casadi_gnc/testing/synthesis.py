"""What every back end for LMIs and every recipe keep, whoever wrote them."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.problem_files.synthesis_recipes import Recipe
from casadi_gnc.synthesis import LmiAnswer, Lmis, LmiStatus, Synthesis
from casadi_gnc.testing.asserting import must

_SYSTEM = np.array([[0.0, 1.0], [-1.0, -1.0]])


def check_lmi_backend(backend: Any) -> None:
    """Test a back end: a Lyapunov inequality of a stable system is certified, that of an unstable one never is.

    The least trace of P >= I with A'P + P A <= 0 is known: it is found to 1e-4, and the certificate is ours.

    Raises
    ------
    ContractError
        Saying what is not kept.
    """
    answer = _lyapunov(_SYSTEM).solve(backend)
    must(answer.status is LmiStatus.CERTIFIED, f"a feasible problem ends {answer.status.name}: {answer.sentence()}")
    reference = _lyapunov(_SYSTEM).solve("clarabel").objective
    near = abs(answer.objective - reference) <= 1e-4 * abs(reference)
    must(near, f"the objective is {answer.objective:.8g}, Clarabel's is {reference:.8g}")
    unstable = _lyapunov(-_SYSTEM).solve(backend)
    must(not unstable.status.holds, f"a problem without a solution ends {unstable.status.name}")


def _lyapunov(system: np.ndarray) -> Lmis:
    lmis, a = Lmis(), ca.DM(system)
    p = lmis.symmetric("P", 2)
    lmis.psd(p, margin=1, name="positive")
    lmis.nsd(a.T @ p + p @ a, margin=1e-3, name="decay")
    lmis.minimize(ca.trace(p))
    return lmis


def check_recipe(recipe: Recipe, backend: Any = "clarabel") -> Synthesis | LmiAnswer:
    """Test that a recipe returns an answer with its certificate; return it.

    Raises
    ------
    ContractError
        Saying what is not kept.
    """
    found = recipe.run(backend)
    name = type(recipe).__name__
    must(isinstance(found, (Synthesis, LmiAnswer)), f"{name}.run returned a {type(found).__name__}")
    must(recipe.__doc__, f"{name} has no docstring")
    if isinstance(found, Synthesis) and found.is_certified:
        finite = all(np.isfinite(gain).all() for gain in found.gains.values())
        must(found.gains and finite, f"{name} is certified and returns no finite gain")
    return found
