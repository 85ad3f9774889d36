"""What every family of checks keeps, whoever wrote it."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from casadi_gnc.checks import VERDICTS, Check
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.testing.asserting import must


def check_family(family: Callable[[Mission, Scheme], Iterable[Check]], mission: Mission) -> list[Check]:
    """Test a family of checks on every scheme of a mission; return what it found.

    Tested: it yields checks (`Check`) with distinct names, a limit that is a number, and a consequence, a remedy and a
    source that are sentences; asked again it says the same.

    Raises
    ------
    ContractError
        Saying what is not kept.
    """
    name, everything = getattr(family, "__qualname__", repr(family)), []
    for scheme in mission.schemes:
        found = list(family(mission, scheme))
        for each in found:
            must(isinstance(each, Check), f"{name} yielded a {type(each).__name__}, expected casadi_gnc.Check")
            must("." in each.name, f"the check {each.name!r} of {name} needs a family before a dot: 'pointing.error'")
            must(not np.isnan(each.limit), f"the limit of {each.name} is no number")
            must(each.otherwise in VERDICTS, f"{each.name} has the verdict {each.otherwise!r}, expected {VERDICTS}")
            for part in ("consequence", "remedy"):
                must(getattr(each, part).endswith("."), f"the {part} of {each.name} is no sentence")
            must(each.source, f"{each.name} does not say where its limit comes from")
        names = [each.name for each in found]
        must(len(set(names)) == len(names), f"{name} yields two checks of one name: {', '.join(names)}")
        again = [(each.name, each.value) for each in family(mission, scheme)]
        same = [(a[0] == b.name and (a[1] == b.value or a[1] != a[1])) for a, b in zip(again, found, strict=True)]
        must(all(same), f"{name} says something else when asked again")
        everything += found
    return everything
