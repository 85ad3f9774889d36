"""The gains that a tuning may change: where they stand, between which bounds, and on which scale they are moved."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from casadi_gnc.errors import TuningError
from casadi_gnc.laws import gains_of
from casadi_gnc.missions.paths import number_at, numbers_of
from casadi_gnc.tables.complaints import near_key

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

#: Without bounds of its own, a gain may become so many times smaller or larger.
REACH = 10.0
#: Length of a linear scale from end to end, as that of a logarithm over two decades.
_LINEAR = math.log(100.0)


@dataclass(frozen=True)
class Gain:
    """Hold one number of a law that is free.

    Parameters
    ----------
    key : its whole path in a problem file.
    name : below the law, `rate_gain` or `rate_gain.2`.
    unit : as the law declares it.
    value : before the tuning.
    low, high : bounds, both allowed.
    """

    key: str
    name: str
    unit: str
    value: float
    low: float
    high: float

    @property
    def logarithmic(self) -> bool:
        """Whether it is moved on the scale of its logarithm: both bounds are above zero."""
        return self.low > 0


@dataclass(frozen=True)
class Gains:
    """Map coordinates, which a search moves, to gains: logarithms, or shares of the range where a bound is zero."""

    each: tuple[Gain, ...]

    @property
    def size(self) -> int:
        """P."""
        return len(self.each)

    @cached_property
    def low(self) -> np.ndarray:
        """Smallest coordinates, (P,)."""
        return self.coordinates(np.array([one.low for one in self.each]))

    @cached_property
    def high(self) -> np.ndarray:
        """Largest coordinates, (P,)."""
        return self.coordinates(np.array([one.high for one in self.each]))

    @cached_property
    def start(self) -> np.ndarray:
        """Coordinates of the gains before the tuning, (P,)."""
        return self.coordinates(np.array([one.value for one in self.each]))

    def coordinates(self, values: np.ndarray) -> np.ndarray:
        """Return the coordinates, (P,), of gains."""
        return np.array(
            [
                math.log(value) if one.logarithmic else _LINEAR * (value - one.low) / (one.high - one.low)
                for one, value in zip(self.each, values, strict=True)
            ]
        )

    def values(self, points: np.ndarray) -> np.ndarray:
        """Return the gains, (n, P), at coordinates, (n, P), within their bounds."""
        columns = [
            np.clip(np.exp(z) if one.logarithmic else one.low + z / _LINEAR * (one.high - one.low), one.low, one.high)
            for one, z in zip(self.each, np.asarray(points, dtype=float).reshape(-1, self.size).T, strict=True)
        ]
        return np.column_stack(columns)

    def rounded(self, values: np.ndarray, digits: int) -> np.ndarray:
        """Return gains of so many digits, (n, P), n up to 2^P: down and up of each, those within the bounds.

        At most 64 are returned; with more than 6 gains each of the others is rounded to the nearest.
        """
        ends: list[list[float]] = []
        for i, (one, value) in enumerate(zip(self.each, values, strict=True)):
            unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits) if value else 1.0
            down, up = (float(f"{r(value / unit) * unit:.{digits}g}") for r in (math.floor, math.ceil))
            near = float(f"{value:.{digits}g}")
            choice = [near, *({down, up} - {near})] if i < 6 else [near]
            ends.append([v for v in choice if one.low <= v <= one.high] or [float(value)])
        grids = np.meshgrid(*ends, indexing="ij")
        return np.column_stack([grid.ravel() for grid in grids])


def gains_free(mission: Mission, scheme: str, free: Sequence[str]) -> Gains:
    """Return the gains that are free.

    Parameters
    ----------
    mission, scheme : whose law has them.
    free : names of gains; one of several numbers stands for all of them, `gain.2` for its second. Bounds may follow,
        `rate_gain=0.1:5`; without them a gain may become 10 times smaller or larger.

    Raises
    ------
    TuningError
        For what is no gain of the law, or bounds that do not fit it.
    """
    if not free:
        raise TuningError("no gain is free; name at least one of the law's")
    alone = mission.with_scheme(scheme) if len(mission.schemes) > 1 else mission
    found: list[Gain] = []
    for text in free:
        name, _, bounds = text.strip().partition("=")
        for one in _gains(alone, scheme, name.strip(), bounds.strip()):
            if any(one.key == other.key for other in found):
                raise TuningError(f"the gain {one.name} is named twice; name each once")
            found.append(one)
    return Gains(tuple(found))


def _gains(mission: Mission, scheme: str, name: str, bounds: str) -> list[Gain]:
    law = mission.scheme(scheme).law
    declared, head = gains_of(type(law)), name.split(".")[0]
    numbers = [each for each, known in declared.items() if "choices" not in known.metadata]
    if head not in numbers:
        told = "makes a choice and has no scale" if head in declared else f"is no gain of it{near_key(head, numbers)}"
        raise TuningError(f"scheme {scheme!r} flies by {type(law).__name__}, and {head!r} {told}")
    about, start = declared[head].metadata, f"scheme.{scheme}.law."
    ends = _bounds(name, bounds)
    made = []
    for key in numbers_of(mission, start + name):
        value, own = number_at(mission, key), key.removeprefix(start)
        least = about["minimum"] if about["above"] is None else about["above"]
        low, high = ends or _around(own, value)
        if least is not None and (low < least or (about["above"] is not None and low <= least)):
            if ends is not None:
                than = "above" if about["above"] is not None else "at least"
                raise TuningError(f"the bounds of {own} begin at {low:g}; the law asks for {than} {least:g}")
            low = least if about["above"] is None else math.nextafter(least, math.inf)
        if not low <= value <= high:
            raise TuningError(
                f"{own} is {value:g}, outside its bounds from {low:g} to {high:g}; begin inside, or widen them"
            )
        made.append(Gain(key, own, about["unit"], value, low, high))
    return made


def _bounds(name: str, text: str) -> tuple[float, float] | None:
    if not text:
        return None
    try:
        low, high = map(float, text.split(":"))
    except ValueError:
        low = high = math.nan
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        raise TuningError(f"the bounds of {name} are {text!r}, expected LOW:HIGH with LOW below HIGH, such as 0.1:5")
    return low, high


def _around(name: str, value: float) -> tuple[float, float]:
    if value == 0:
        raise TuningError(f"{name} is 0, from which no scale follows; give its bounds, such as {name}=0:1")
    return tuple(sorted((value / REACH, value * REACH)))  # type: ignore[return-value]
