"""What a mission is made of besides its craft: schemes that could fly it, funnels, metrics."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from casadi_gnc.errors import FlightError
from casadi_gnc.laws import Law, PerformanceFunnel
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.modulated import made_of
from casadi_gnc.missions.navigated import Navigated
from casadi_gnc.navigation import Navigation
from casadi_gnc.tables.part import NAME, Part

Feedback = Literal["achieved", "wanted"]
MetricKind = Literal["settling", "reaching", "peak", "least", "final", "mean", "sample_sum"]


@dataclass(frozen=True, eq=False)
class Scheme:
    """One way to fly a mission.

    Parameters
    ----------
    name : letters, digits and _; of files that are written.
    law : what commands an effort.
    actuation : how it becomes actuator commands; `Craft.actuation` makes one.
    feedback : what observers and anti-windup are told was done: "achieved" by the actuators, or "wanted".
    title : for whoever reads the results.
    keys : the keys that `Craft.actuation` was given, if it was.
    navigation : what the law reads, where that is not the measurement; `Craft.navigation` makes one.
    """

    name: str
    law: Law
    actuation: Actuation
    feedback: Feedback = "achieved"
    title: str = ""
    keys: Part | None = None
    navigation: Navigation | None = None

    def __post_init__(self) -> None:
        if not re.fullmatch(NAME, str(self.name)):
            raise FlightError(f"a scheme is named {self.name!r}, expected letters, digits and _, the first a letter")
        if self.feedback not in ("achieved", "wanted"):
            raise FlightError(f"feedback is {self.feedback!r}, expected 'achieved' or 'wanted'")

    @cached_property
    def flown(self) -> Law:
        """The law as it flies: behind its navigation, and before its modulation, where it has them."""
        law = self.law
        if self.navigation is not None:
            law = Navigated(hold=law.hold, printed=law.printed, law=law, navigation=self.navigation)
        return made_of(law, self.actuation.modulation)


@dataclass(frozen=True, eq=False)
class Funnel:
    """Bounds that a mission sets a measured signal, whichever law flies it.

    Parameters
    ----------
    signal : its name.
    bounds : walls over time, in the signal's unit.
    """

    signal: str
    bounds: PerformanceFunnel


@dataclass(frozen=True)
class Metric:
    """One number asked of a flight; kinds are defined in `casadi_gnc.missions.metrics`.

    Parameters
    ----------
    name : of the number.
    kind : what is made of the signal.
    signal : a recorded one, by name.
    threshold : below which the signal counts as settled or reached, in its unit.
    after, until : time from which and to which samples count, [s]; times of settling and reaching count from `after`.
    unit : of the number.
    norm : of a signal of several elements: the largest magnitude, "max", or the Euclidean length, "two".
    """

    name: str
    kind: MetricKind
    signal: str
    threshold: float = 0.0
    after: float = 0.0
    unit: str = ""
    until: float = float("inf")
    norm: Literal["max", "two"] = "max"
