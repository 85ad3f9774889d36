"""Build a mission from a checked problem file: the craft, its funnel, laws and metrics."""

from __future__ import annotations

import dataclasses
import hashlib
from functools import partial
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc import vehicles as crafts
from casadi_gnc.errors import LawError, ProblemError
from casadi_gnc.laws import LAWS, PerformanceFunnel, gains_of
from casadi_gnc.missions import tapes
from casadi_gnc.missions.mission import Funnel, Metric, Mission, Noise, Scheme, Timing
from casadi_gnc.problem_files import schema
from casadi_gnc.problem_files.toml_place import describe
from casadi_gnc.vehicles import Craft, Where


def build(model: Any, path: Path, text: str, *, strict: bool = True) -> Mission:
    """Return the mission that a checked file describes; path and text serve messages.

    Parameters
    ----------
    model : the `MissionFile` of a craft.
    strict : refuse a sample time that a law cannot bear.
    """
    where = partial(describe, path, text)
    craft: Craft = crafts.module(model.spacecraft.model).build(model, where)
    _check_start(craft, where)
    funnels = tuple(_funnel(table, i, craft, where) for i, table in enumerate(model.funnel))
    given = model.timing
    kept = round((given.record_period_s or given.sample_period_s) / given.sample_period_s)
    timing = Timing(given.mode, given.sample_period_s, given.duration_s, given.plant_substeps, kept)
    schemes = (_scheme(scheme, i, craft, funnels, timing, where, strict) for i, scheme in enumerate(model.scheme))
    mission = Mission(
        name=path.stem,
        truth=craft.plant,
        start=craft.start,
        timing=timing,
        schemes=tuple(schemes),
        funnels=funnels,
        noise=_noise(model.noise, timing, where),
        panels=craft.panels,
        target=craft.target,
        checks=craft.checks,
        truths=craft.truths,
        notes=craft.notes,
        title=model.title,
        source=model.source,
        digest=hashlib.sha256(text.encode()).hexdigest(),
    )
    return _with_metrics(mission, model, where)


def _with_metrics(mission: Mission, model: schema.MissionModel, where: Where) -> Mission:
    """Return the mission with its metrics; each must name a signal that every scheme records."""
    metrics = []
    for i, metric in enumerate(model.metric):
        for scheme in mission.schemes:
            row = tapes.row_layout(mission, scheme)
            if metric.signal not in row:
                message = f"{metric.signal!r} is no signal of scheme {scheme.name}; there is {', '.join(row.names)}"
                raise ProblemError(message, where(("metric", i, "signal")))
        unit = (
            "s"
            if metric.kind in ("settling", "reaching")
            else tapes.row_layout(mission, mission.schemes[0]).signal(metric.signal).unit
        )
        norm = metric.norm or ("two" if metric.kind == "sample_sum" else "max")
        until = metric.until_s or float("inf")
        metrics.append(
            Metric(metric.name, metric.kind, metric.signal, metric.threshold or 0.0, metric.after_s, unit, until, norm)
        )
    return dataclasses.replace(mission, metrics=tuple(metrics))


def _check_start(craft: Craft, where: Where) -> None:
    """Refuse a start that the sensors could not measure: a controller has no good value before it."""
    measured = _first_measurement(craft)
    for signal in craft.plant.measurement.signals:
        largest = max(abs(value) for value in measured[craft.plant.measurement.place(signal.name)])
        if largest > signal.limit:
            place = where(("initial", craft.start_keys.get(signal.name, "")))
            raise ProblemError(f"{largest:g} is beyond the largest credible {signal.name}, {signal.limit:g}", place)


def _first_measurement(craft: Craft) -> list[float]:
    quiet = ca.DM.zeros(craft.plant.noise.size)
    return list(np.array(ca.DM(craft.plant.measure(0.0, ca.DM(craft.start), quiet))).ravel())


def _noise(table: schema.NoiseModel, timing: Timing, where: Where) -> Noise:
    """Return how noise is drawn; its period must be a whole number of sample periods."""
    every = 1.0 if table.period_s is None else table.period_s / timing.sample_period
    if every < 0.5 or abs(every - round(every)) > 1e-6 * every:
        raise ProblemError(
            f"period_s is {table.period_s:g}, {every:.6g} times sample_period_s {timing.sample_period:g}; "
            "expected a whole multiple",
            where(("noise", "period_s")),
        )
    return Noise(table.seed, round(every), table.truncation_sigma or float("inf"))


def _funnel(table: schema.FunnelModel, index: int, craft: Craft, where: Where) -> Funnel:
    """Return one of the mission's funnels; the start must lie inside."""
    measured = craft.plant.measurement
    if table.signal not in measured:
        known = ", ".join(measured.names)
        raise ProblemError(f"{table.signal!r} is not measured; there is {known}", where(("funnel", index, "signal")))
    expected = measured.signal(table.signal).size
    if len(table.start) != expected:
        place = where(("funnel", index, "start"))
        raise ProblemError(f"{len(table.start)} axes, but {table.signal} has {expected}", place)
    start = _first_measurement(craft)[measured.place(table.signal)]
    for axis, (s, rho, below, above) in enumerate(zip(start, table.start, table.below, table.above, strict=True), 1):
        if not -below * rho < s < above * rho:
            raise ProblemError(
                f"axis {axis} starts at {s:g}, outside its funnel from {-below * rho:g} to {above * rho:g}; "
                "widen start, below or above",
                where(("funnel", index, "start")),
            )
    columns = (ca.DM(getattr(table, key)) for key in ("start", "floor", "decay_per_s", "below", "above"))
    return Funnel(table.signal, PerformanceFunnel(*columns))


def _scheme(
    model: Any,
    index: int,
    craft: Craft,
    funnels: tuple[Funnel, ...],
    timing: Timing,
    where: Where,
    strict: bool,
) -> Scheme:
    table: Any = model.law
    law: Any = LAWS[table.type]
    named = list(law.errata) if model.as_printed is True else model.as_printed or []
    for name in named:
        if name not in law.errata:
            known = ", ".join(law.errata) or "none"
            message = f"{table.type} has no erratum {name!r}; known: {known}"
            raise ProblemError(message, where(("scheme", index, "as_printed")))
    gains = {key: getattr(table, key) for key in gains_of(law)}
    gains = {key: ca.DM(value) if isinstance(value, list) else value for key, value in gains.items()}
    hold = timing.sample_period if timing.mode == "sampled" else 0.0
    for key, signal in law.funnels.items():
        bounds = next((funnel.bounds for funnel in funnels if funnel.signal == signal), None)
        if bounds is None:
            found = ", ".join(funnel.signal for funnel in funnels) or "none"
            message = f"the law {table.type!r} needs a [[funnel]] on {signal}, and the file has {found}"
            raise ProblemError(message, where(("scheme", index, "law")))
        gains[key] = bounds
    if "body" in {field.name for field in dataclasses.fields(law)}:
        gains["body"] = craft.believed
    try:
        made = law(hold=hold, printed=frozenset(named), **gains)
        if strict:
            made.check_hold()
        return Scheme(model.name, made, craft.actuation(model), model.feedback, model.title)
    except LawError as error:
        raise ProblemError(str(error), where(("scheme", index, "law"))) from None
