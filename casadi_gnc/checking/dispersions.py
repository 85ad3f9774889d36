"""Whether what differs from case to case can: numbers that shape the flight itself are no columns of it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.scheme import Scheme


def checks(mission: Mission, scheme: Scheme) -> Iterator[Check]:
    """Yield a finding for each dispersion that a campaign of the scheme could not fly; those of other schemes pass."""
    keys = [each.key for each in mission.dispersions if _is_of(each.key, scheme)]
    if not keys:
        return
    try:
        vary(mission, keys, scheme.name)
    except FlightError:
        for key in keys:
            try:
                vary(mission, [key], scheme.name)
            except FlightError as error:
                yield Check(
                    f"dispersion.{key}",
                    math.nan,
                    0.0,
                    "-",
                    "fail",
                    f"A campaign cannot fly: {error}.",
                    "Disperse another number, or fly a mission for each value (a [[sweep]]).",
                    "the flight's C, in which a dispersed number is a column",
                )


def _is_of(key: str, scheme: Scheme) -> bool:
    root, _, rest = key.partition(".")
    return root != "scheme" or rest.split(".")[0] in ("*", scheme.name)
