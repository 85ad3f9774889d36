"""The missions that a search flies: that which is given, and one for each combination of values of its file."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

from casadi_gnc.errors import CampaignError, GncError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.tuning.broken_case import document_of
from casadi_gnc.tuning.claims import Claimant, claimed
from casadi_gnc.tuning.flights import Build
from casadi_gnc.tuning.objective import Objective

#: Builds that `over` may ask for.
_MOST_BUILDS = 32


def builds_of(
    mission: Mission, scheme: str, requirement: str, over: dict[str, Sequence[Any]],
    claims: Sequence[Claimant] = (), threads: int | None = None,
) -> list[Build]:  # fmt: skip
    """Return the mission and, for each combination of what `over` says, another.

    Parameters
    ----------
    mission, scheme, requirement : what is flown and asked.
    over : values of keys of the mission's file.
    claims : as for `casadi_gnc.tuning.claims.claimed`; the mission has them already, the others are given them.
    threads : all cores by default.

    Raises
    ------
    GncError
        For a mission without file, too many builds, and where no combination can fly.
    """
    builds = [Build(lambda: Objective(mission, scheme, what=requirement, threads=threads))]
    if not over:
        return builds
    document = document_of(mission)
    if document is None or mission.origin is None:
        raise CampaignError(f"{mission.name} was made from objects, and `over` changes a file; load one")
    before = mission.origin.changes
    count = math.prod(len(values) for values in over.values())
    if count > _MOST_BUILDS:
        raise CampaignError(f"`over` asks for {count} builds, expected at most {_MOST_BUILDS}; give fewer values")
    for values in itertools.product(*over.values()):
        changes = dict(zip(over, values, strict=True))

        def make(changes: dict[str, Any] = changes) -> Objective:
            other, _ = claimed(load_document(document, {**before, **changes}), scheme, claims)
            return Objective(other, scheme, what=requirement, threads=threads)

        builds.append(Build(make, changes))
    _refuse_all(builds[1:])
    return builds


def _refuse_all(builds: Sequence[Build]) -> None:
    """Raise why the first build cannot fly where none of several can: then `over` is wrong."""
    first = None
    for one in builds:
        try:
            _ = one.objective
        except GncError as error:
            first = first or error
        else:
            return
    if first is not None:
        raise first
