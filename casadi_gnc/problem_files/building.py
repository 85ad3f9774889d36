"""Build a mission from the checked tables of a file: funnels, timing, noise, schemes, metrics."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import casadi as ca

from casadi_gnc.campaigns.dispersions import DispersionTable
from casadi_gnc.errors import FaultHandlingError, FlightError, GncError, LawError, ProblemError, RequirementError, offer
from casadi_gnc.laws import Law, PerformanceFunnel, gains_of
from casadi_gnc.missions import fitting
from casadi_gnc.missions.actuation import Actuation
from casadi_gnc.missions.checks import REGISTRY as CHECKS
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.parts import Parts
from casadi_gnc.missions.paths import number_at, numbers_of
from casadi_gnc.missions.scheme import Funnel, Metric, Scheme
from casadi_gnc.missions.timing import Noise, Timing
from casadi_gnc.problem_files.document import Complaints
from casadi_gnc.problem_files.mission_tables import FunnelTable, MetricTable, NoiseTable
from casadi_gnc.tables.part import MisfitError, Part

if TYPE_CHECKING:
    from casadi_gnc.problem_files.loading import Checked


def mission(checked: Checked, *, strict: bool = True) -> Mission:
    """Return the mission that checked tables describe.

    Parameters
    ----------
    checked : from `casadi_gnc.problem_files.loading`.
    strict : refuse what cannot fly.

    Raises
    ------
    ProblemError
        With all that does not fit together.
    """
    document, common, craft = checked.document, checked.common, checked.craft
    complaints = Complaints(document)
    parts = Parts(craft)
    with complaints.about("spacecraft", "model"):
        _ = parts.measured, parts.belief, parts.navigation
    complaints.settle()
    for misfit in (*parts.incredible(), *(craft.flaws() if strict else ())):
        complaints.add(misfit.path, str(misfit))
    timing = common.timing.timing()
    for misfit in craft.untimely(timing, strict=strict):
        complaints.add(misfit.path, str(misfit))
    funnels = []
    for i, table in enumerate(common.funnel):
        with complaints.about("funnel", i):
            funnels.append(_funnel(table, parts))
    wrong = {table.signal for table in common.funnel} - {funnel.signal for funnel in funnels}
    noise = Noise()
    with complaints.about("noise"):
        noise = _noise(common.noise, timing)
    schemes = []
    for i, (table, law, gains) in enumerate(checked.schemes):
        if wrong.intersection(law.funnels.values()):
            continue  # what is wrong with its funnel was said
        with complaints.about("scheme", i):
            schemes.append(_scheme(table, law, gains, parts, funnels, timing, strict))
    further = []
    for i, name in enumerate(common.checks):
        with complaints.about("checks", i):
            further.append(CHECKS.find(name, document.folder))
    complaints.settle()
    made = None
    with _about_parts(complaints, [table.name for table, _, _ in checked.schemes]):
        made = Mission(
            craft,
            schemes,
            timing,
            name=document.path.stem,
            funnels=funnels,
            noise=noise,
            title=common.title,
            source=common.source,
            checks=further,
            dispersions=common.dispersion,
            parts=parts,
        )
    complaints.settle()
    assert made is not None
    metrics = []
    for i, table in enumerate(common.metric):
        with complaints.about("metric", i, "signal"):
            metrics.append(fitting.complete(made, _metric(table)))
    complaints.settle()
    made = made.measured_by(metrics)
    for i, table in enumerate(common.requirement):
        try:
            fitting.refuse_requirement(made, table.requirement())
        except RequirementError as error:
            complaints.add(("requirement", i, *filter(None, [error.key])), str(error))
    complaints.settle()
    _look_at_dispersions(made, common.dispersion, complaints)
    if common.fault_handling is not None:
        try:
            fitting.refuse_fault_handling(made, common.fault_handling.handling())
        except FaultHandlingError as error:
            complaints.add(("fault_handling", error.key), str(error))
        made = made.handling(common.fault_handling.handling())
    complaints.settle()
    return made.held_to([table.requirement() for table in common.requirement])


def _look_at_dispersions(made: Mission, tables: list[DispersionTable], complaints: Complaints) -> None:
    """Note dispersions whose key leads nowhere or is taken, and distributions that do not fit their keys."""
    taken: dict[str, str] = {}
    for i, table in enumerate(tables):
        try:
            keys = numbers_of(made, table.key)
        except FlightError as error:
            complaints.add(("dispersion", i, "key"), str(error))
            continue
        twice = next((key for key in keys if key in taken), None)
        if twice:
            why = f"gives {twice}, as {taken[twice]!r} does; each number can follow one distribution only"
            complaints.add(("dispersion", i, "key"), why)
        taken |= dict.fromkeys(keys, table.key)
        with complaints.about("dispersion", i):
            table.distribution(len(keys), complaints.folder, [number_at(made, key) for key in keys])


@contextmanager
def _about_parts(complaints: Complaints, schemes: list[str]) -> Iterator[None]:
    """Note what a mission refuses: of a scheme's law at that scheme, all else at the craft."""
    try:
        yield
    except LawError as error:
        place = ("scheme", schemes.index(error.scheme), "law", "type") if error.scheme else ("spacecraft", "model")
        complaints.add(place, str(error))
    except GncError as error:
        complaints.add(("spacecraft", "model"), str(error))


def _metric(table: MetricTable) -> Metric:
    norm = table.norm or ("two" if table.kind == "sample_sum" else "max")
    until = table.until_s or float("inf")
    return Metric(table.name, table.kind, table.signal, table.threshold or 0.0, table.after_s, "", until, norm)


def _noise(table: NoiseTable, timing: Timing) -> Noise:
    """Return how noise is drawn; its period must be a whole number of sample periods."""
    every = 1.0 if table.period_s is None else table.period_s / timing.sample_period
    if every < 0.5 or abs(every - round(every)) > 1e-6 * every:
        raise MisfitError(
            f"period_s is {table.period_s:g}, {every:.6g} times sample_period_s {timing.sample_period:g}; "
            "expected a whole multiple",
            "period_s",
        )
    return Noise(table.seed, round(every), table.truncation_sigma or float("inf"))


def _funnel(table: FunnelTable, parts: Parts) -> Funnel:
    """Return one of the mission's funnels; the start must lie inside."""
    measured = parts.plant.measurement
    if table.signal not in measured:
        raise MisfitError(f"{table.signal!r} is not measured; {offer(table.signal, measured.names)}", "signal")
    expected = measured.signal(table.signal).size
    if len(table.start) != expected:
        raise MisfitError(f"{len(table.start)} axes, but {table.signal} has {expected}", "start")
    start = parts.measured[measured.place(table.signal)]
    for axis, (s, rho, below, above) in enumerate(zip(start, table.start, table.below, table.above, strict=True), 1):
        if not -below * rho < s < above * rho:
            raise MisfitError(
                f"axis {axis} starts at {s:g}, outside its funnel from {-below * rho:g} to {above * rho:g}; "
                "widen start, below or above",
                "start",
            )
    columns = (ca.DM(getattr(table, key)) for key in ("start", "floor", "decay_per_s", "below", "above"))
    return Funnel(table.signal, PerformanceFunnel(*columns))


def _scheme(
    table: Any, law: type[Law], gains: Part, parts: Parts, funnels: list[Funnel], timing: Timing, strict: bool
) -> Scheme:
    """Return a scheme; a `MisfitError` or a `GncError` says what does not fit."""
    keys = _keys_of(table, parts.craft)
    actuation = parts.actuation(keys)
    why = _misfit(table, law, parts, actuation)
    if why:
        raise MisfitError(why, "law", "type")
    named = list(law.errata) if table.as_printed is True else table.as_printed or []
    for name in named:
        if name not in law.errata:
            known = ", ".join(law.errata) or "none"
            raise MisfitError(f"{table.law['type']} has no erratum {name!r}; known: {known}", "as_printed")
    given: dict[str, Any] = {key: getattr(gains, key) for key in gains_of(law)}
    given = {key: ca.DM(value) if isinstance(value, list) else value for key, value in given.items()}
    for key, signal in law.funnels.items():
        bounds = next((funnel.bounds for funnel in funnels if funnel.signal == signal), None)
        if bounds is None:
            found = ", ".join(funnel.signal for funnel in funnels) or "none"
            raise MisfitError(
                f"the law {table.law['type']!r} needs a [[funnel]] on {signal}, and the file has {found}", "law"
            )
        given[key] = bounds
    if law.belief_kind() is not None:
        given["body"] = parts.belief
    try:
        made = law(hold=timing.sample_period if timing.mode == "sampled" else 0.0, printed=frozenset(named), **given)
        if strict:
            made.check_hold()
            if made.hold and actuation.modulation is not None:
                actuation.modulation.check(made.hold)
    except ProblemError:
        raise
    except Exception as error:
        raise _about_law(error, law) from error
    return Scheme(table.name, made, actuation, table.feedback, table.title, keys, parts.navigation)


def _keys_of(table: Any, craft: Craft) -> Part:
    """Return those keys of a scheme's table that its craft's actuation takes."""
    own = type(craft).scheme_keys
    return own.model_construct(**{name: getattr(table, name) for name in own.model_fields})


def _misfit(table: Any, law: type[Law], parts: Parts, actuation: Actuation) -> str:
    """Return why a scheme's law cannot fly the craft whatever its gains, "" where it can."""
    why = list(fitting.misfits(law, parts.readable, parts.belief, actuation.effort))
    told = f"the law {table.law['type']!r} does not fit {type(parts.craft).__name__}: {'; '.join(why)}"
    return f"{told}; `casadi-gnc laws` says which fits what" if why else ""


def misfit(table: Any, law: type[Law], craft: Craft) -> str:
    """Return why the law of a checked scheme's table cannot fly a craft; "" where it can, or the craft is not sound."""
    parts = Parts(craft)
    try:
        return _misfit(table, law, parts, parts.actuation(_keys_of(table, craft)))
    except (GncError, MisfitError):
        return ""


def _about_law(error: Exception, law: type[Law]) -> MisfitError:
    """Return what a law refuses when it is made, in one sentence."""
    from casadi_gnc import guests
    from casadi_gnc.errors import GncError

    if isinstance(error, GncError):
        told = str(error)
    elif law.__module__.startswith("casadi_gnc."):
        told = f"{law.__name__} cannot be made of these gains: they overflow, or leave a matrix without an inverse"
    else:
        told = f"{law.__name__} cannot be made: {guests.told(error)}"
    return MisfitError(told, "law")
