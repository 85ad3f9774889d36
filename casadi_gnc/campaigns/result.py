"""What a campaign came to: its table, its worst cases, and each case flown again on demand."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.campaigns.cases import Cases
from casadi_gnc.campaigns.ledger import read_identity
from casadi_gnc.campaigns.store import MISSING, SHORT, WHOLE, Columns, Store
from casadi_gnc.campaigns.summary import badness, summarised
from casadi_gnc.errors import CampaignError, offer
from casadi_gnc.missions.flight import Flight
from casadi_gnc.missions.one_build import OneBuild, fly_case
from casadi_gnc.missions.scheme import Metric
from casadi_gnc.status import StepStatus


@dataclass(frozen=True, eq=False)
class Case:
    """Name one case of a campaign, and fly it again: word for word what was flown."""

    number: int
    row: dict[str, Any] = field(repr=False)
    cases: Cases = field(repr=False)

    def fly(self, *, build: OneBuild | None = None, **options: Any) -> Flight:
        """Fly the case with its whole record.

        Parameters
        ----------
        build : that flies several cases; one for this case by default.
        options : as for `casadi_gnc.missions.one_build.fly_case`.
        """
        drawn = self.cases.draw(self.number, self.number + 1)
        if drawn.refused[0]:
            raise CampaignError(f"case {self.number} is refused: {drawn.refused[0]}")
        if build is not None:
            return build.fly_row(drawn.values[0], int(drawn.seeds[0]), **options)
        return fly_case(self.cases.varied, drawn.values[0], int(drawn.seeds[0]), **options)


class Campaign:
    """Read what is kept of a campaign.

    Columns of the table: `case`, `noise_seed`, `weight`, each parameter by its key, `refused` (why, "" for a case
    that flew), `metric.NAME` (NaN for none), `requirement.ID` (the
    margin, below 0 where it is not met), `samples.STATUS` and `first.STATUS` (how many samples raised a status and
    when first [s]).
    """

    def __init__(self, folder: Path, cases: Cases, *, temporary: bool = False) -> None:
        self.folder, self.cases = folder, cases
        if temporary:
            weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        self.identity = read_identity(folder)
        self._store = Store(folder, self.identity)
        self._kept: Columns = {}

    def __len__(self) -> int:
        return len(self.column("case"))

    def __repr__(self) -> str:
        told = f"{len(self)} of {self.identity['cases']} cases"
        return f"Campaign({self.identity['mission']}, {self.identity['scheme']}: {told})"

    @property
    def metrics(self) -> tuple[Metric, ...]:
        """What was asked of every flight."""
        return tuple(self.cases.varied.nominal.metrics)

    @property
    def names(self) -> list[str]:
        """The names of all columns."""
        return list(self._store.read(self._readable()[0], None))

    @cached_property
    def _states(self) -> dict[int, str]:
        """The state of each shard that is begun, when it was first asked for."""
        return {number: self._store.state(number) for number in self._store.begun()}

    @property
    def damaged(self) -> list[str]:
        """A sentence for each shard that cannot be trusted and is left out; running the campaign flies it again."""
        return [state for state in self._states.values() if state not in (WHOLE, MISSING, SHORT)]

    @property
    def is_empty(self) -> bool:
        """Whether no case is kept yet."""
        return not any(state in (WHOLE, SHORT) for state in self._states.values())

    def _readable(self) -> list[int]:
        found = [number for number, state in self._states.items() if state in (WHOLE, SHORT)]
        if not found:
            why = f": {self.damaged[0]}" if self.damaged else ""
            raise CampaignError(f"{str(self.folder)!r} holds no finished shard yet{why}; run the campaign")
        return found

    def column(self, name: str) -> np.ndarray:
        """Return a column of all cases that are kept, in their order."""
        if name not in self._kept:
            known = self.names
            if name not in known:
                raise CampaignError(f"the table has no column {name!r}; it has {', '.join(known)}")
            self._kept[name] = np.concatenate([self._store.read(number, [name])[name] for number in self._readable()])
        return self._kept[name]

    def columns(self, names: Sequence[str]) -> np.ndarray:
        """Return some columns side by side, (cases, columns)."""
        return np.column_stack([self.column(name) for name in names]) if names else np.empty((len(self), 0))

    @property
    def table(self) -> Any:
        """The whole table: of pyarrow where it is installed, else columns by name."""
        columns = {name: self.column(name) for name in self.names}
        if self._store.suffix == "npz":
            return columns
        import pyarrow as pa

        return pa.table(columns)

    def to_pandas(self) -> Any:
        """Return the table as a pandas data frame; pandas must be installed."""
        import pandas as pd  # type: ignore[import-not-found]

        return pd.DataFrame({name: self.column(name) for name in self.names})

    def ranked(self, metric: str) -> np.ndarray:
        """Return the numbers of the cases that flew, the worst first.

        The worst is the largest value, of a `least` the smallest; a flight without a value (it never settled, it
        diverged) is worse than all that have one.
        """
        asked = self._metric(metric)
        flew = self.flew
        values = badness(asked, self.column(f"metric.{metric}")[flew])
        return self.column("case")[flew][np.argsort(-values, kind="stable")]

    @property
    def flew(self) -> np.ndarray:
        """Which cases were not refused, (cases,)."""
        return self.column("refused") == ""

    def _metric(self, name: str) -> Metric:
        for metric in self.metrics:
            if metric.name == name:
                return metric
        known = [metric.name for metric in self.metrics]
        raise CampaignError(f"the mission has no metric {name!r}; {offer(name, known)}")

    def worst(self, metric: str) -> Case:
        """Return the worst case of a metric."""
        return self.case(f"worst:{metric}")

    def case(self, told: int | str) -> Case:
        """Return a case by its number, or as "worst:METRIC", "best:METRIC", "median:METRIC", "failed:REQUIREMENT".

        The last is the case that is farthest from meeting the requirement; "failed:1" the first that fails any, or
        diverged, "failed:2" the second.
        """
        number = self._number(str(told))
        place = np.flatnonzero(self.column("case") == number)
        if not len(place):
            raise CampaignError(f"case {number} is not kept: {self._why_not(number)}")
        row = {name: self.column(name)[place[0]].item() for name in self.names if name != "refused"}
        return Case(number, row, self.cases)

    def _why_not(self, number: int) -> str:
        """Return why a case has no row."""
        if number >= self.identity["cases"]:
            return f"there are cases 0 to {self.identity['cases'] - 1}"
        state = self._states.get(number // self.identity["shard"], MISSING)
        return f"{'it is not flown yet' if state in (WHOLE, MISSING, SHORT) else state}; run the campaign again"

    def _number(self, told: str) -> int:
        if told.isdecimal():
            return int(told)
        how, _, metric = told.partition(":")
        if how == "failed" and metric.isdecimal():
            return self._failing(int(metric))
        if how == "failed" and metric:
            return self._farthest(metric)
        if how not in ("worst", "best", "median") or not metric:
            raise CampaignError(
                f"no case {told!r}; expected its number, worst:METRIC, best:METRIC, median:METRIC, failed:REQUIREMENT "
                "or failed:1"
            )
        ranked = self.ranked(metric)
        if not len(ranked):
            raise CampaignError("no case flew: all are refused")
        place = {"worst": 0, "best": len(ranked) - 1, "median": len(ranked) // 2}[how]
        return int(ranked[place])

    def _failing(self, place: int) -> int:
        """Return the case that is the `place`-th of those that diverged or fail a requirement, by their numbers."""
        bad = self.column(f"samples.{StepStatus.DIVERGED.name}") > 0
        for one in self.cases.varied.nominal.requirements:
            bad |= self.column(f"requirement.{one.id}") < 0
        numbers = self.column("case")[bad & self.flew]
        if not 1 <= place <= len(numbers):
            raise CampaignError(f"no case failed:{place}; {len(numbers)} flights fail a requirement or diverged")
        return int(numbers[place - 1])

    def _farthest(self, requirement: str) -> int:
        known = [one.id for one in self.cases.varied.nominal.requirements]
        if requirement not in known:
            raise CampaignError(f"the mission has no requirement {requirement!r}; {offer(requirement, known)}")
        flew = self.flew
        margins = self.column(f"requirement.{requirement}")[flew]
        if not (margins < 0).any():
            raise CampaignError(f"no flight fails {requirement}")
        return int(self.column("case")[flew][np.argmin(margins)])

    def summary(self, confidence: float = 0.9) -> dict[str, Any]:
        """Return what the flights tell, with bounds: metrics, statuses, what drives them, the worst cases."""
        return summarised(self, confidence)
