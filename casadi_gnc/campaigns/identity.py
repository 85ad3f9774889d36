"""What a folder says of its campaign, and the campaign that it says."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path
from typing import Any

from casadi_gnc.campaigns.cases import Cases, cases_of
from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.campaigns.ledger import IDENTITY, read_identity
from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.campaigns.result import Campaign
from casadi_gnc.campaigns.store import has_arrow
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.origin import Origin


def identity_of(
    cases: Cases, flights: int, dispersions: Sequence[Any], plan: str | Plan, maths: Math, shard: int
) -> dict[str, Any]:
    """Return what tells a campaign from another, as data; `shard` is the number of cases in a file."""
    mission = cases.varied.nominal
    return {
        "format": 1,
        "mission": mission.name,
        "problem_sha256": mission.digest,
        "changes": dict(mission.origin.changes) if mission.origin else None,
        "scheme": cases.varied.scheme.name,
        "mode": mission.timing.mode,
        "maths": maths,
        "seed": cases.seed,
        "plan": repr(cases.plan),
        "plan_name": plan if isinstance(plan, str) else None,
        "parameters": list(cases.varied.parameters.keys),
        "dispersions": _tables(dispersions),
        "distributions": [_told(each) for each in cases.distributions],
        "cases": flights,
        "shard": shard,
        "table": "parquet" if has_arrow() else "npz",
        "casadi_gnc": metadata.version("casadi-gnc"),
        "casadi": metadata.version("casadi"),
    }


def _tables(dispersions: Sequence[Any]) -> list[dict[str, Any]] | None:
    """Return what varies as a file says it; None where it is an object of another kind."""
    if not all(isinstance(each, DispersionTable) for each in dispersions):
        return None
    return [each.model_dump(exclude_none=True, exclude_defaults=True) for each in dispersions]


def _told(distribution: Any) -> str:
    return repr(distribution) if dataclasses.is_dataclass(distribution) else type(distribution).__qualname__


def texts_of(origin: Origin, dispersions: Sequence[Any]) -> dict[str, str]:
    """Return the files that the mission was read from, and the tables of what varies."""
    files = [each.table.file for each in dispersions if getattr(each, "table", None) is not None]
    tables = {name: (origin.folder / name).read_text(encoding="utf-8") for name in files}
    return {"problem.toml": origin.text, **{file.path: file.text for file in origin.guests}, **tables}


def opened(mission: Mission, folder: Path) -> Campaign:
    """Return the campaign of a mission that is kept in a folder, with its cases; nothing is flown.

    Raises
    ------
    CampaignError
        Where its plan or what varies was an object of Python's, so that the folder does not say what it was.
    """
    identity = read_identity(folder)
    if identity["dispersions"] is None or identity["plan_name"] is None:
        what = "plan" if identity["plan_name"] is None else "dispersions"
        raise CampaignError(f"{folder}: its {what} came from Python and not from a file; run it again there to open it")
    try:
        varying = [DispersionTable(**table) for table in identity["dispersions"]]
    except (TypeError, ValueError) as error:
        raise CampaignError(f"{folder / IDENTITY} is damaged: its dispersions are none") from error
    origin = mission.origin
    here = mission if origin is None else mission.read_from(dataclasses.replace(origin, folder=folder))
    cases = cases_of(here, varying, identity["plan_name"], identity["cases"], identity["seed"], identity["scheme"])
    if cases.varied.nominal.digest != identity["problem_sha256"]:
        raise CampaignError(f"{folder / 'problem.toml'} is not what was flown: it was changed since")
    return Campaign(folder, cases)
