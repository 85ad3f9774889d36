"""All pictures of a campaign into one folder: what each metric is like, how far it is known, and what drives it.

=======================  ============================================================================================
picture                  shows
=======================  ============================================================================================
METRIC_histogram         how a metric is spread, its percentiles with bounds, the limits that requirements set
METRIC_convergence       its 95th percentile (of a least value the 5th) as flights were added
METRIC_scatter           the metric over what drives it, the worst five marked
METRIC_correlations      rank correlations with bounds
METRIC_sensitivity       shares of its variance: first order; and total, where the plan is `pick_freeze`
ID_convergence           share of flights that meet a requirement as flights were added, and the share that is asked
=======================  ============================================================================================
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_gnc.campaigns import PickFreeze, statistics
from casadi_gnc.campaigns.statistics import Estimate, Percentile
from casadi_gnc.campaigns.summary import badness
from casadi_gnc.errors import CampaignError
from casadi_gnc.reports.campaign_pictures import plot_convergence, plot_drivers, plot_histogram, plot_scatter
from casadi_gnc.system.files import prepare_folder

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign
    from casadi_gnc.missions.requirements import Requirement
    from casadi_gnc.missions.scheme import Metric

#: Numbers of an estimate.
_NUMBERS = ("value", "low", "high")
#: Worst flights that are marked.
_MARKED = 5


def draw_campaign(campaign: Campaign, folder: Path, *, confidence: float = 0.9, ending: str = "png") -> list[Path]:
    """Draw what the flights of a campaign say, and return the paths of the pictures.

    Parameters
    ----------
    campaign : of which one case flew at least.
    folder : made if it does not exist.
    confidence : of the bounds.
    ending : "png", "svg" or "pdf".

    Raises
    ------
    CampaignError
        Where no case flew.
    """
    if not campaign.flew.any():
        raise CampaignError("no case flew, so there is nothing to draw")
    gallery = _Gallery(campaign, prepare_folder(folder), confidence, ending)
    drawn = [path for metric in campaign.metrics for path in gallery.metric(metric)]
    if gallery.sample:
        drawn += [gallery.requirement(one) for one in campaign.cases.varied.nominal.requirements]
    return drawn


class _Gallery:
    def __init__(self, campaign: Campaign, folder: Path, confidence: float, ending: str) -> None:
        self._campaign, self._folder, self._ending = campaign, folder, ending
        self._confidence = confidence
        self._told = campaign.summary(confidence)
        self._flew = campaign.flew
        self._names = list(campaign.identity["parameters"])
        self._inputs = campaign.columns(self._names)[self._flew]
        #: Whether the flights are a sample of what happens, so that shares of them mean something.
        self.sample = campaign.cases.plan.representative
        weights = campaign.column("weight")[self._flew]
        self._weights = weights if (weights != 1.0).any() else None

    def metric(self, metric: Metric) -> list[Path]:
        """Draw all pictures of a metric."""
        values = self._campaign.column(f"metric.{metric.name}")[self._flew]
        lowest = metric.kind == "least"
        known = np.where(np.isnan(values), -math.inf if lowest else math.inf, values)
        told, title = self._told["metrics"][metric.name], metric.name.replace("_", " ")
        label = title + (f" [{metric.unit}]" if metric.unit not in ("", "-") else "")
        shares = [0.05 if lowest else 0.95, 0.0027 if lowest else 0.9973] if self.sample else []
        found = [self._percentile(known, share) for share in shares]
        drawn = [
            plot_histogram(
                known,
                self._place(metric.name, "histogram"),
                label=label,
                percentiles=found,
                limit=self._limit(metric),
                weights=self._weights,
            )
        ]
        if self.sample:
            share = shares[0]
            grown = statistics.convergence(len(known), lambda n: self._percentile(known[:n], share, n))
            where, name = self._place(metric.name, "convergence"), f"{title}: {100 * share:g} % stay below"
            drawn.append(plot_convergence(grown, where, label=label, title=name))
        order = self._order(told)
        if order:
            worst = np.argsort(-badness(metric, values), kind="stable")[:_MARKED]
            columns, names = self._inputs[:, order], [self._names[i] for i in order]
            where = self._place(metric.name, "scatter")
            drawn.append(plot_scatter(columns, known, names, where, label=label, worst=list(worst), title=title))
        return drawn + self._drivers(metric, told, title)

    def requirement(self, one: Requirement) -> Path:
        """Draw the share of flights that meet a requirement as flights were added."""
        met = self._campaign.column(f"requirement.{one.id}")[self._flew] >= 0

        def estimate(count: int) -> Estimate:
            if self._weights is not None:
                return statistics.weighted_share(met[:count], self._weights[:count], one.confidence)
            return statistics.share_bounds(int(met[:count].sum()), count, one.confidence)

        return plot_convergence(
            statistics.convergence(len(met), estimate),
            self._place(one.id, "convergence"),
            label="share of flights that meet it [-]",
            level=one.share,
            level_label=f"asked: {one.share:g}",
            title=f"{one.id}: {one.asked}",
        )

    def _drivers(self, metric: Metric, told: dict[str, Any], title: str) -> list[Path]:
        drivers, drawn = told.get("drivers") or [], []
        if drivers:
            names, found = (
                [each["key"] for each in drivers],
                [self._estimate(each["rank_correlation"]) for each in drivers],
            )
            where = self._place(metric.name, "correlations")
            drawn.append(plot_drivers(names, where, label="rank correlation [-]", first=found, title=title))
        indices = [each for each in drivers if each["first_order"]] or told.get("sensitivity") or []
        if indices:
            names, first = [each["key"] for each in indices], [self._estimate(each["first_order"]) for each in indices]
            both = isinstance(self._campaign.cases.plan, PickFreeze)
            total = [self._estimate(each["total"]) for each in indices] if both else []
            where = self._place(metric.name, "sensitivity")
            label = "share of the variance [-]" if both else "share of the variance, first order [-]"
            drawn.append(plot_drivers(names, where, label=label, first=first, total=total, title=title))
        return drawn

    def _order(self, told: dict[str, Any]) -> list[int]:
        """Return the parameters, those that drive a metric first."""
        keys = [each["key"] for each in told.get("drivers") or told.get("sensitivity") or []]
        first = [self._names.index(key) for key in keys if key in self._names]
        varied = np.ptp(self._inputs, axis=0) > 0
        return first + [i for i in range(len(self._names)) if i not in first and varied[i]]

    def _percentile(self, values: np.ndarray, share: float, count: int | None = None) -> Percentile:
        if self._weights is None:
            return statistics.percentile(values, share, self._confidence)
        return statistics.weighted_percentile(values, self._weights[: count or len(values)], share, self._confidence)

    def _limit(self, metric: Metric) -> float | None:
        """Return the limit that a requirement sets the metric, the tightest of several."""
        asked = [one for one in self._campaign.cases.varied.nominal.requirements if one.metric == metric.name]
        above = [one.at_most for one in asked if one.at_most is not None]
        below = [one.at_least for one in asked if one.at_least is not None]
        return min(above) if above else max(below) if below else None

    def _estimate(self, told: dict[str, float | None]) -> Estimate:
        value, low, high = (math.nan if told[name] is None else float(told[name] or 0.0) for name in _NUMBERS)
        return Estimate(value, low, high, self._confidence)

    def _place(self, name: str, what: str) -> Path:
        return self._folder / f"{name}_{what}.{self._ending}"
