"""What one panel of a flight's picture shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True)
class Panel:
    """Say what one panel of a flight's picture shows.

    Parameters
    ----------
    kind : "tracked" (a measured signal, in its funnel if it has one), "effort" (limited and achieved,
        with limits), "actuators" (lines, or rows of a map where there are many), "lines".
    signal : its name; of an effort, the name in the craft's `effort`.
    label : what stands at the axis, without unit.
    scale, unit : factor applied, and the unit that it gives.
    logarithmic : of "lines": the magnitude on a logarithmic axis.
    level, level_label : of "lines": a value to draw a line at, in the signal's unit, and what it is.
    """

    kind: Literal["tracked", "effort", "actuators", "lines"]
    signal: str
    label: str
    scale: float = 1.0
    unit: str = ""
    logarithmic: bool = False
    level: float | None = None
    level_label: str = ""
