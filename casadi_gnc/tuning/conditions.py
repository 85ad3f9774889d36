"""What tuned gains must keep: the conditions of the law's theorems, and checks that did not fail or warn before."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc import checking
from casadi_gnc.campaigns.plans import Sobol
from casadi_gnc.checks import VERDICTS, Check, Verdict
from casadi_gnc.errors import GncError, TuningError
from casadi_gnc.missions.paths import changed
from casadi_gnc.tuning.gains import Gains

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

#: Points at which conditions that do not hold at first are looked at.
_LOOKED_AT = 1024


@dataclass(frozen=True, eq=False)
class Conditions:
    """Hold which conditions of a law count, as functions of the free gains.

    Parameters
    ----------
    names : of the conditions that must hold.
    margins : gains (P,) -> (C,), what is left to each limit, in units of that limit at first.
    """

    names: tuple[str, ...]
    margins: Callable[[np.ndarray], np.ndarray]


def conditions_of(mission: Mission, scheme: str, gains: Gains, *, every: bool = False) -> Conditions:
    """Return the conditions that a tuning keeps.

    Parameters
    ----------
    mission, scheme : whose law has the gains.
    every : ask for all conditions of the law, not only for those that hold at first.

    Raises
    ------
    TuningError
        Where some cannot hold together within the bounds of the gains; it names them.
    """
    keys = [one.key for one in gains.each]

    def checks(values: np.ndarray) -> dict[str, Check]:
        _, laws, _ = changed(mission, dict(zip(keys, map(float, values), strict=True)))
        return {each.name: each for each in laws[scheme].checks()}

    first = checks(np.array([one.value for one in gains.each]))
    names = tuple(name for name, each in first.items() if every or each.holds)
    scales = {name: max(abs(first[name].limit), abs(first[name].value), 1e-300) for name in names}

    @lru_cache(maxsize=4096)
    def known(values: tuple[float, ...]) -> np.ndarray:
        try:
            found = checks(np.array(values))
        except GncError:  # gains that no such law can have
            return np.full(len(names), -math.inf)
        margins = [_margin(found[name]) / scales[name] if name in found else -math.inf for name in names]
        return np.array(margins)

    made = Conditions(names, lambda values: known(tuple(map(float, values))))
    if not all(first[name].holds for name in names):
        _refuse_conflict(made, gains)
    return made


def _margin(check: Check) -> float:
    return check.margin if math.isfinite(check.margin) else -math.inf


def _refuse_conflict(conditions: Conditions, gains: Gains) -> None:
    """Raise `TuningError` where no point within the bounds keeps all conditions."""
    cube = Sobol(gains.size).points(0, 0, _LOOKED_AT)
    ends = np.array(list(itertools.islice(itertools.product((0.0, 1.0), repeat=gains.size), _LOOKED_AT)))
    points = gains.low + np.vstack([ends, cube]) * (gains.high - gains.low)
    kept = np.array([conditions.margins(values) >= 0 for values in gains.values(points)])
    if kept.all(axis=1).any():
        return
    bounds = ", ".join(f"{one.name} from {one.low:.4g} to {one.high:.4g}" for one in gains.each)
    for name, column in zip(conditions.names, kept.T, strict=True):
        if not column.any():
            raise TuningError(f"{name} cannot hold with {bounds}; widen the bounds, or free more gains")
    for (one, a), (other, b) in itertools.combinations(zip(conditions.names, kept.T, strict=True), 2):
        if not (a & b).any():
            raise TuningError(f"{one} and {other} cannot both hold with {bounds}; widen the bounds, or free more gains")
    raise TuningError(
        f"{', '.join(conditions.names)} hold in pairs and not all together with {bounds}; widen the bounds, or free "
        "more gains"
    )


def gravest(checks: Iterable[Check]) -> dict[str, Verdict]:
    """Return the gravest verdict of each name."""
    found: dict[str, Verdict] = {}
    for each in checks:
        known: Verdict = found.get(each.name, "ok")
        found[each.name] = each.verdict if VERDICTS.index(each.verdict) > VERDICTS.index(known) else known
    return found


def new_troubles(before: dict[str, Verdict], after: dict[str, Verdict]) -> list[str]:
    """Return the names that warn or fail now and were less grave before."""
    return [
        name
        for name, verdict in after.items()
        if verdict in ("warn", "fail") and VERDICTS.index(verdict) > VERDICTS.index(before.get(name, "ok"))
    ]


def verdicts_of(mission: Mission, scheme: str) -> dict[str, Verdict]:
    """Return the gravest verdict of each check of a scheme."""
    return gravest(checking.check(mission, scheme))
