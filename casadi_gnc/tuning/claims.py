"""What an allocation is set up against, or the theorem of a law covers, as dispersions over all of that set."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal, get_args

from casadi_gnc.campaigns import DispersionTable
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.paths import numbers_of

#: Who claims a set.
Claimant = Literal["allocation", "theorem"]


def claimed(mission: Mission, scheme: str, by: Sequence[Claimant]) -> tuple[Mission, list[str]]:
    """Return a mission whose numbers range over the sets that are claimed, and a sentence on each.

    A dispersion of the file whose numbers all lie in a claimed range gives way to it; the others stay.

    Parameters
    ----------
    mission, scheme : what is flown.
    by : who claims: the allocation of the scheme, the theorem of its law.

    Raises
    ------
    CampaignError
        Where nothing is claimed, or a dispersion shares some of its numbers with a claimed range and not all.
    """
    chosen, ranges, told = mission.scheme(scheme), {}, []
    for one in by:
        if one not in get_args(Claimant):
            raise CampaignError(f"{one!r} claims no set; expected one of {', '.join(get_args(Claimant))}")
        found = dict(mission.craft.claimed(mission, chosen, one))
        if not found:
            lacking = {
                "allocation": f"the allocation of {scheme} is set up against no error of its actuators; take robust "
                "allocation with centre_of_mass_error_m or the like",
                "theorem": f"{type(chosen.law).__name__} names no bounds of the craft within which its theorem holds; "
                "take a law that does",
            }[one]
            raise CampaignError(f"{lacking}, or say by [[dispersion]]s what may vary")
        ranges |= found
        said = ", ".join(f"{key} from {low:.6g} to {high:.6g}" for key, (low, high) in found.items())
        told.append(f"over the set that the {one} claims: {said}")
    if not ranges:
        return mission, []
    numbers = {number for key in ranges for number in numbers_of(mission, key)}
    kept = []
    for one in mission.dispersions:
        own = set(numbers_of(mission, one.key))
        if own & numbers and not own <= numbers:
            raise CampaignError(
                f"the dispersion of {one.key!r} has {', '.join(sorted(own & numbers))}, which a claimed set has too, "
                "and others; disperse the others by themselves"
            )
        kept += [] if own & numbers else [one]
    made = [DispersionTable(key=key, uniform=list(ends)) for key, ends in ranges.items()]
    return dataclasses.replace(mission, dispersions=[*kept, *made]).read_from(mission.origin), told
