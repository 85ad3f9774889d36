"""A number of a flight as a function of what varies: many flights side by side, from one build.

What varies is told as dispersions are (`casadi_gnc.campaigns.DispersionTable`): any key that a campaign may disperse,
any gain, the start. Points are in standard units (`casadi_gnc.tuning.space`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from casadi_gnc.campaigns.cases import Cases, Dispersion, Drawn, cases_of
from casadi_gnc.campaigns.engines import CompiledBatch
from casadi_gnc.campaigns.rows import rows_of
from casadi_gnc.campaigns.store import Columns
from casadi_gnc.campaigns.whole_records import margins_of_records
from casadi_gnc.embedded.printer import Math
from casadi_gnc.errors import CampaignError
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.sensitivities import Sensitivities
from casadi_gnc.tuning.space import Space

#: Step of differences, in standard units.
STEP = 1e-3


class Objective:
    """Fly a scheme at points, and say what one number of each flight is.

    Parameters
    ----------
    mission : what is flown; every flight draws the same noise, that of its seed.
    scheme : its name; the first by default.
    parameters : what varies, each with its distribution; the mission's dispersions by default.
    what : a requirement or the id of one, whose robustness is told; or the name of a metric.
    seed : of the noise; the mission's own by default.
    maths, vectors, threads : as for `casadi_gnc.campaigns.engines.CompiledBatch`.

    Raises
    ------
    GncError
        For a key that cannot be a column, a distribution that does not fit it, a requirement or a metric that is not
        there.
    """

    def __init__(
        self,
        mission: Mission,
        scheme: str | None = None,
        *,
        parameters: Sequence[Dispersion] | None = None,
        what: str | Requirement,
        seed: int | None = None,
        maths: Math = "gnc",
        vectors: str | None = None,
        threads: int | None = None,
    ) -> None:
        if isinstance(what, Requirement) and what not in mission.requirements:
            others = [one for one in mission.requirements if one.id != what.id]
            mission = dataclasses.replace(mission, requirements=(*others, what)).read_from(mission.origin)
        varying = mission.dispersions if parameters is None else parameters
        self.cases: Cases = cases_of(mission, varying, "sobol", 1, 0, scheme)
        self.seed = mission.noise.seed if seed is None else seed
        known = self.cases.varied.parameters
        self.space = Space(known.keys, self.cases.parts.given, self.cases.distributions, known.nominal)
        self.column = _column(self.cases.varied.nominal, what.id if isinstance(what, Requirement) else what)
        #: Flights that were flown so far.
        self.flights = 0
        self._maths: Math = maths
        self._vectors, self._threads = vectors, threads
        self._engine: CompiledBatch | None = None

    @property
    def size(self) -> int:
        """p, the number of coordinates of a point."""
        return self.space.size

    def values(self, points: Any) -> np.ndarray:
        """Return the number at each point, (n,), -inf or inf where a flight has none, NaN where it cannot fly.

        Parameters
        ----------
        points : (n, p), in standard units.
        """
        return self.at(self.space.rows(np.asarray(points, dtype=float)))

    def at(self, rows: np.ndarray) -> np.ndarray:
        """Return the same for numbers as a file has them, (n, P)."""
        return self._told(self.table(rows))

    def table(self, rows: np.ndarray, seeds: np.ndarray | None = None) -> Columns:
        """Return all that the flights of rows, (n, P), came to: the columns of a campaign's table, (n,) each.

        See `casadi_gnc.campaigns.result.Campaign` for their names. A row that cannot fly says why in `refused`.

        Parameters
        ----------
        seeds : (n,), of the noise of each; by default all draw that of `seed`.
        """
        rows = np.ascontiguousarray(rows, dtype=float)
        count = len(rows)
        refused = self.cases.varied.refusals(rows)
        seeds = np.full(count, self.seed, dtype=np.uint64) if seeds is None else np.asarray(seeds, dtype=np.uint64)
        drawn = Drawn(np.arange(count), rows, seeds, np.ones(count), refused)
        good = np.array([not why for why in refused], dtype=bool)
        if self._engine is None:
            self._engine = CompiledBatch(self.cases.varied, self._maths, vectors=self._vectors, threads=self._threads)
        flown = self._engine.fly(rows[good], seeds[good])
        self.flights += int(good.sum())
        margins = margins_of_records(self.cases, drawn, good, flown, self._maths, self._threads)
        return rows_of(self.cases, drawn, good, flown, margins)

    def gradient(self, point: Any, step: float = STEP) -> np.ndarray:
        """Return the slope at a point by central differences, (p,), 2 p flights side by side; as `differences`.

        Parameters
        ----------
        point : (p,), in standard units.
        step : in standard units.
        """
        return differences(self.space, self.values, point, step)

    @cached_property
    def sensitivities(self) -> Sensitivities:
        """Flights with derivatives of the same number, built when first asked for."""
        return Sensitivities(self.cases.varied, self.column.partition(".")[2])

    def derivatives(self, point: Any, temperature: float = 0.0) -> tuple[float, np.ndarray]:
        """Return the number at a point, or its smooth companion, and its slope, (p,), from one flight there and back.

        The slope is that of the flight as it decided (`casadi_gnc.missions.sensitivities`), 0 of choices and of
        coordinates that are NaN, and costs a few flights whatever p; NaN where the flight has no number.

        Parameters
        ----------
        point : (p,), in standard units.
        temperature : of the companion, unit of the number.

        Raises
        ------
        GncError
            For a scheme or a number without derivatives, as `casadi_gnc.sensitivities`.
        """
        point = np.asarray(point, dtype=float)
        (row,) = self.space.rows(point[None, :])
        found = self.sensitivities.at_row(row, temperature=temperature, seed=self.seed)
        return found.value, self.space.slope(point, found.gradient)

    def _told(self, table: Columns) -> np.ndarray:
        found = np.asarray(table[self.column], dtype=float)
        if self.column.startswith("requirement."):
            return found
        metric = next(one for one in self.cases.varied.nominal.metrics if f"metric.{one.name}" == self.column)
        worst = -math.inf if metric.kind == "least" else math.inf
        flew = np.array([not why for why in table["refused"]], dtype=bool)
        return np.where(np.isnan(found) & flew, worst, found)


def _column(mission: Mission, name: str) -> str:
    """Return the column of a campaign's table that has a requirement's robustness, or a metric."""
    ids, metrics = [one.id for one in mission.requirements], [one.name for one in mission.metrics]
    if name in ids:
        return f"requirement.{name}"
    if name in metrics:
        return f"metric.{name}"
    raise CampaignError(
        f"the mission has no requirement and no metric {name!r}; there is {', '.join([*ids, *metrics]) or 'none'}"
    )


def differences(
    space: Space,
    values: Callable[[np.ndarray], np.ndarray],
    point: Any,
    step: float = STEP,
    value: float | None = None,
    only: np.ndarray | None = None,
) -> np.ndarray:
    """Return the slope of a number of flights at a point, (p,); NaN where a flight has no number.

    A choice has no slope: 0. A coordinate that is NaN stays the file's, with slope 0.

    Parameters
    ----------
    space : of the points.
    values : from points, (n, p), to numbers, (n,).
    point : (p,), in standard units.
    step : in standard units.
    value : the number at the point; where it is given, p differences of one side, towards 0; else 2 p flights, of one
        side at the end of a coordinate.
    only : (p,), which coordinates are asked for, the others 0; all by default.
    """
    point = np.asarray(point, dtype=float)
    moved = np.flatnonzero(~(space.discrete | np.isnan(point)) & (True if only is None else only))
    found = np.zeros(space.size)
    if not len(moved):
        return found
    places = np.arange(len(moved))
    ahead = np.tile(point, (len(moved), 1))
    behind = ahead.copy()
    if value is None:
        ahead[places, moved] = np.minimum(point[moved] + step, space.high[moved])
        behind[places, moved] = np.maximum(point[moved] - step, space.low[moved])
        told = values(np.vstack([ahead, behind]))
        above, below = told[: len(moved)], told[len(moved) :]
    else:  # towards the middle, which no set that is searched leaves
        ahead[places, moved] += np.where(point[moved] > 0, -step, step)
        above, below = values(ahead), np.full(len(moved), value)
    with np.errstate(invalid="ignore"):  # the difference of two numbers without end is none
        slope = (above - below) / (ahead - behind)[places, moved]
    found[moved] = np.where(np.isfinite(slope), slope, math.nan)
    return found
