"""What many flights tell, as data: each number with its bounds."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_gnc.campaigns import statistics
from casadi_gnc.campaigns.pick_freeze import PickFreeze
from casadi_gnc.campaigns.statistics import Estimate
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.campaigns.result import Campaign
    from casadi_gnc.missions.requirements import Requirement
    from casadi_gnc.missions.scheme import Metric

#: Shares of all flights whose percentiles are told: the median, and what reviews ask for.
SHARES = (0.5, 0.95, 0.99, 0.9973)
#: Worst cases of a metric that are named.
_WORST = 5


def summarised(campaign: Campaign, confidence: float) -> dict[str, Any]:
    """Return what a campaign tells; see `casadi_gnc.campaigns.result.Campaign.summary`."""
    flew = campaign.flew
    weights = campaign.column("weight")[flew]
    weighted = bool((weights != 1.0).any())
    counted = weights if weighted else None
    told = {
        "mission": campaign.identity["mission"],
        "scheme": campaign.identity["scheme"],
        "cases": len(flew),
        "asked": campaign.identity["cases"],
        "refused": int((~flew).sum()),
        "why": _reasons(campaign),
        "damaged": campaign.damaged,
        "confidence": confidence,
        "weighted": weighted,
        "representative": campaign.cases.plan.representative,
        "effective_flights": statistics.effective_flights(weights) if weighted else int(flew.sum()),
        "metrics": {},
        "requirements": {},
        "statuses": {},
    }
    if not flew.any():
        return told
    if not campaign.cases.plan.representative:  # chosen cases say what is possible, not how often
        for one in campaign.metrics:
            told["metrics"][one.name] = _extremes(campaign, one, flew)
            if isinstance(campaign.cases.plan, PickFreeze):
                told["metrics"][one.name]["sensitivity"] = _sensitivity(campaign, one, confidence)
        return told
    inputs = campaign.columns(campaign.identity["parameters"])[flew]
    for metric in campaign.metrics:
        told["metrics"][metric.name] = _metric(campaign, metric, flew, inputs, counted, confidence)
    for one in campaign.cases.varied.nominal.requirements:
        told["requirements"][one.id] = _requirement(campaign, one, flew, counted)
    for bit in StepStatus:
        raised = campaign.column(f"samples.{bit.name}")[flew] > 0
        if raised.any():
            share = _share(raised, counted, confidence)
            told["statuses"][bit.name] = {"sentence": bit.sentences[0], "flights": int(raised.sum()), "share": share}
    return told


def _metric(
    campaign: Campaign,
    metric: Metric,
    flew: np.ndarray,
    inputs: np.ndarray,
    weights: np.ndarray | None,
    confidence: float,
) -> dict[str, Any]:
    values = campaign.column(f"metric.{metric.name}")[flew]
    none, lowest = np.isnan(values), metric.kind == "least"
    known = np.where(none, -math.inf if lowest else math.inf, values)
    told: dict[str, Any] = {"unit": metric.unit, "kind": metric.kind, "without": int(none.sum()), "percentiles": {}}
    for share in SHARES:
        asked = 1.0 - share if lowest else share
        found = (
            statistics.percentile(known, asked, confidence)
            if weights is None
            else statistics.weighted_percentile(known, weights, asked, confidence)
        )
        told["percentiles"][f"{100 * asked:.6g}"] = _plain(found)
    if weights is None:
        low, high = statistics.limits(known, 0.9973, confidence, "lower" if lowest else "upper")
        told["tolerance_limit"] = _number(low if lowest else high)
        told["drivers"] = _drivers(campaign, inputs, badness(metric, values), confidence)
    return told | {"worst": _worst(campaign, metric, flew)}


def _extremes(campaign: Campaign, metric: Metric, flew: np.ndarray) -> dict[str, Any]:
    """Return the range of a metric over cases that are no sample of anything."""
    values = campaign.column(f"metric.{metric.name}")[flew]
    known = values[~np.isnan(values)]
    told: dict[str, Any] = {"unit": metric.unit, "kind": metric.kind, "without": int(np.isnan(values).sum())}
    told["range"] = [float(known.min()), float(known.max())] if len(known) else None
    return told | {"percentiles": {}, "worst": _worst(campaign, metric, flew)}


def _sensitivity(campaign: Campaign, metric: Metric, confidence: float) -> list[dict[str, Any]] | None:
    """Return both indices of each input from the blocks that are whole, strongest first; None where a value lacks."""
    plan, numbers = campaign.cases.plan, campaign.column("case")
    assert isinstance(plan, PickFreeze)
    blocks, counts = np.unique(numbers // plan.block, return_counts=True)
    whole = np.isin(numbers // plan.block, blocks[counts == plan.block])
    values = campaign.column(f"metric.{metric.name}")[whole]
    if len(values) < 2 * plan.block or not np.isfinite(values).all() or (values == values[0]).all():
        return None
    found = statistics.indices(values, len(plan.groups), confidence)
    told = [
        {"key": name, "first_order": _plain(first), "total": _plain(total)}
        for (name, _), first, total in zip(campaign.cases.parts.groups, found.first, found.total, strict=True)
    ]
    return sorted(told, key=lambda each: -(each["total"]["value"] or 0.0))


def _worst(campaign: Campaign, metric: Metric, flew: np.ndarray) -> list[dict[str, Any]]:
    values = campaign.column(f"metric.{metric.name}")[flew]
    order = np.argsort(-badness(metric, values), kind="stable")[:_WORST]
    return [{"case": int(campaign.column("case")[flew][i]), "value": _number(float(values[i]))} for i in order]


def _requirement(campaign: Campaign, one: Requirement, flew: np.ndarray, weights: np.ndarray | None) -> dict[str, Any]:
    """Return the verdict on the share of flights that meet a requirement, and the case that is farthest from it."""
    margins = campaign.column(f"requirement.{one.id}")[flew]
    met, worst = margins >= 0, int(np.argmin(margins))
    told: dict[str, Any] = {"asked": one.asked, "text": one.text, "share": one.share, "confidence": one.confidence}
    told |= {"met_by": int(met.sum()), "of": len(met)}
    told["worst"] = {"case": int(campaign.column("case")[flew][worst]), "margin": _number(float(margins[worst]))}
    if weights is None:
        shown = statistics.share_bounds(int(met.sum()), len(met), one.confidence)
    else:
        shown = statistics.weighted_share(met, weights, one.confidence)
    told["shown"] = _plain(shown)
    if one.share == 1.0:  # one flight that fails decides; no number of flights shows that every one passes
        return told | {"verdict": "undecided" if met.all() else "not met", "more_if_all_pass": None}
    if weights is None:
        found = statistics.judge(int(met.sum()), len(met), one.share, one.confidence)
        told |= {"verdict": str(found.verdict), "shown": _plain(found.share)}
        return told | {"more_if_all_pass": found.more_if_all_pass, "more_at_this_rate": found.more_at_this_rate}
    return told | {"verdict": "met" if shown.low >= one.share else "not met" if shown.high < one.share else "undecided"}


def _drivers(campaign: Campaign, inputs: np.ndarray, output: np.ndarray, confidence: float) -> list[dict[str, Any]]:
    """Return rank correlation, and first-order index where every flight has a value, by parameter, strongest first."""
    names = campaign.identity["parameters"]
    if len(output) < 10 or not names or (output == output[0]).all():
        return []
    correlations = statistics.rank_correlations(inputs, output, confidence)
    finite = bool(np.isfinite(output).all())
    shares = statistics.first_order(inputs, output, confidence) if finite else [None] * len(names)
    found = [
        {"key": name, "rank_correlation": _plain(one), "first_order": None if share is None else _plain(share)}
        for name, one, share in zip(names, correlations, shares, strict=True)
        if not math.isnan(one.value)
    ]
    return sorted(found, key=lambda each: -abs(each["rank_correlation"]["value"] or 0.0))


def _share(chosen: np.ndarray, weights: np.ndarray | None, confidence: float) -> dict[str, Any]:
    if weights is not None:
        return _plain(statistics.weighted_share(chosen, weights, confidence))
    return _plain(statistics.share_bounds(int(chosen.sum()), len(chosen), confidence))


def _reasons(campaign: Campaign) -> dict[str, int]:
    """Return how many cases were refused for each kind of reason: their sentences without the numbers."""
    import re

    told = (re.sub(r"-?\d[\d.e+-]*", "#", text) for text in campaign.column("refused") if text)
    found: dict[str, int] = {}
    for text in told:
        found[text] = found.get(text, 0) + 1
    return found


def _plain(found: Estimate) -> dict[str, float | None]:
    return {name: _number(getattr(found, name)) for name in ("value", "low", "high")}


def _number(value: float) -> float | None:
    """Return a number that JSON can hold; None for none and for one without end."""
    return float(value) if math.isfinite(value) else None


def badness(metric: Metric, values: np.ndarray) -> np.ndarray:
    """Return values of a metric that grow the worse they are, infinite where there is none."""
    signed = -values if metric.kind == "least" else values
    return np.where(np.isnan(signed), math.inf, signed)
