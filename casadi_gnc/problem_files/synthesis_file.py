"""Problem files of kind "synthesis": a recipe, its matrices, and what is asked of the gains.

`[recipe]` names one of `casadi_gnc.problem_files.synthesis_recipes` and gives its keys. `synthesize` runs it; what
failed certification is never returned as gains.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from casadi_gnc.errors import ProblemError, SynthesisError
from casadi_gnc.problem_files.boundary import about
from casadi_gnc.problem_files.document import Complaints, Document, read_kind
from casadi_gnc.problem_files.mission_tables import Format
from casadi_gnc.problem_files.synthesis_recipes import REGISTRY as RECIPES
from casadi_gnc.problem_files.synthesis_recipes import Recipe
from casadi_gnc.synthesis import LmiAnswer, backends
from casadi_gnc.tables.part import Part


class SynthesisModel(Part):
    """A synthesis file."""

    format: Format
    kind: Literal["synthesis"]
    title: str = ""
    source: str = ""
    backend: str | None = Field(
        default=None, description='clarabel, scs, barrier, or "./file.py:NAME"; by size if left out'
    )
    recipe: dict[str, Any] = Field(description="type names the recipe, the other keys are its own")


_SINGULAR = "on the way a matrix of the recipe was singular to rounding; look for inputs, outputs or units far apart"


@dataclass(frozen=True, eq=False)
class SynthesisCase:
    """Hold what a synthesis file describes: the recipe with its matrices, and the back end, None for one by size."""

    document: Document
    name: str
    title: str
    recipe: Recipe
    backend: Any


def load_synthesis(problem: str | Path) -> SynthesisCase:
    """Return the case of a synthesis file, given by path or shipped name; raise `ProblemError`."""
    document = read_kind(problem, "synthesis")
    complaints = Complaints(document)
    model = complaints.checked(SynthesisModel, document.data)
    table = document.data.get("recipe")
    recipe, backend = None, None
    if isinstance(table, dict):
        recipe = _recipe(table, complaints)
    if model is not None:
        with complaints.about("backend"):
            backend = None if model.backend is None else backends.REGISTRY.find(model.backend, document.folder)
    complaints.settle()
    assert model is not None
    assert recipe is not None
    named = model.backend if model.backend in backends.names() else backend
    return SynthesisCase(document, document.path.stem, model.title, recipe, named)


def _recipe(table: dict[str, Any], complaints: Complaints) -> Recipe | None:
    """Return the recipe of a table, None where something is wrong with it."""
    if not isinstance(table.get("type"), str):
        complaints.add(("recipe", "type"), f"is missing; it names the recipe, one of {', '.join(RECIPES.names())}")
        return None
    with complaints.about("recipe", "type"):
        kind = RECIPES.find(table["type"], complaints.folder)
        return complaints.checked(kind, {key: value for key, value in table.items() if key != "type"}, ("recipe",))
    return None


def synthesize(case: SynthesisCase, backend: Any = None) -> dict[str, Any]:
    """Return what a recipe found, as plain data with its certificate.

    Keys: status, sentence, certified, gains (empty unless certified), promised and true norm, poles, peak
    command, tolerated (assumed mass) / (true mass), and every constraint with its smallest eigenvalue.

    Raises
    ------
    ProblemError
        For matrices that do not fit each other, by the recipe's words.
    """
    with about(case.document):
        try:
            found = case.recipe.run(backend or case.backend)
        except SynthesisError as error:
            raise ProblemError(str(error), case.document.place(("recipe",))) from None
        except np.linalg.LinAlgError:
            return _unanswered(case, backend, f"No answer: {_SINGULAR}")
    if isinstance(found, LmiAnswer):
        return {"problem": case.name, **_inequalities(found)}
    data: dict[str, Any] = {"problem": case.name, **_inequalities(found.lmis)}
    data.update(status=found.status.name, sentence=found.sentence(), certified=found.is_certified)
    data["gains"] = {name: gain.tolist() for name, gain in found.gains.items()} if found.is_certified else {}
    data["promised_norm"] = _finite(found.promised)
    if found.smallest is not None:
        data["smallest_gamma"] = [_finite(end) for end in found.smallest]
    data["poles_rad_s"] = [[float(pole.real), float(pole.imag)] for pole in found.poles]
    if found.norm is not None:
        where = _finite(found.norm.frequency_rad_s)
        data["norm"] = {
            "lower": _finite(found.norm.lower),
            "upper": _finite(found.norm.upper),
            "frequency_rad_s": where,
        }
    if found.energy is not None:
        told = {"promised": found.energy.promised, "lower": found.energy.lower, "upper": found.energy.upper}
        data["h2_norm"] = {key: _finite(value) for key, value in told.items()}
    if found.depths:
        data["pole_depths_rad_s"] = dict(found.depths)
    if np.isfinite(found.share):
        over = 1 / (1 - found.share) if found.share < 1 else np.inf
        data["saturation"] = {"share": found.share, "command_over_limit": _finite(over)}
    if found.peak is not None:
        data["peak"] = {
            "value": _finite(found.peak.value),
            "bound": _finite(found.peak.bound),
            "limit": _finite(found.limit),
            "start": found.peak.start.tolist(),
            "time_s": found.peak.time_s,
        }
    if found.ratios is not None:
        data["stable_ratios"] = [_finite(end) for end in found.ratios]
    return data


def answer_of(problem: str | Path, backend: str | None = None) -> dict[str, Any]:
    """Return what `synthesize` returns for a file, given by path or shipped name."""
    return synthesize(load_synthesis(problem), backend)


def out_of_time(case: SynthesisCase, backend: Any, seconds: float) -> dict[str, Any]:
    """Return what is known where the search was ended after some seconds: nothing, in the form of `synthesize`."""
    return _unanswered(
        case,
        backend,
        f"No answer within {seconds:g} s: neither gains nor a proof that there are none. Give more time by "
        "--time-limit, another back end, or a bound on the norm instead of the smallest",
    )


def _unanswered(case: SynthesisCase, backend: Any, sentence: str) -> dict[str, Any]:
    named = backend or case.backend or "by size"
    return {
        "problem": case.name,
        "status": "UNDECIDED",
        "sentence": sentence,
        "certified": False,
        "gains": {},
        "backend": named if isinstance(named, str) else str(getattr(named, "__name__", "")),
        "conflict": [],
        "multipliers": {},
        "constraints": [],
    }


def _inequalities(answer: Any) -> dict[str, Any]:
    """Return the certificate of a set of LMIs as plain data."""
    return {
        "status": answer.status.name,
        "sentence": answer.sentence(),
        "certified": answer.status.holds,
        "gains": {},
        "backend": answer.backend,
        "conflict": list(answer.conflict),
        "multipliers": answer.infeasibility.shares if answer.infeasibility else {},
        "no_point_with_entries_up_to": (
            {name: _finite(reach) for name, reach in answer.infeasibility.reach.items()} if answer.infeasibility else {}
        ),
        "constraints": [
            {
                "name": one.name,
                "smallest": _finite(one.smallest),
                "rounding": _finite(one.allowance),
                "margin": one.margin,
                "holds": bool(one.holds),
            }
            for one in answer.checks
        ],
    }


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
