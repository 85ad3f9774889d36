"""Do the parts of a mission fit each other? Each misfit is one sentence.

A law fits a craft when the signals it reads are measured (name, size, unit, frame), what the software believes
of the craft is of the kind that the law models, and the effort it commands is what the craft makes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from casadi_gnc.errors import FlightError, RequirementError, offer
from casadi_gnc.laws import Law
from casadi_gnc.missions import asking
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.fault_handling import FaultHandling
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.recording import row_of
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.scheme import Metric, Scheme
from casadi_gnc.missions.timing import Timing
from casadi_gnc.signals import Layout, Signal

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


def misfits(law: type[Law], measured: Layout, believed: Any, effort: Layout) -> Iterator[str]:
    """Yield why a law does not fit a craft: nothing where it does.

    Parameters
    ----------
    law : its class.
    measured : what the law may read: what the craft's sensors give, or its navigation.
    believed : what its flight software believes of it.
    effort : what its actuators make.
    """
    kind = law.belief_kind()
    if kind is not None and not isinstance(believed, kind):
        given = "nothing" if believed is None else f"a {type(believed).__name__}"
        yield f"it models a {kind.__name__}, and the craft's software believes in {given}"
        return
    read = law.reads(believed).signals
    absent = [signal.name for signal in read if signal.name not in measured]
    if absent:
        are = "is" if len(absent) == 1 else "are"
        known = ", ".join(measured.names) or "nothing"
        yield f"it reads {' and '.join(absent)}, which {are} not measured; there is {known}"
    for signal in read:
        if signal.name in measured:
            yield from _apart(signal, measured.signal(signal.name), f"it reads {signal.name}", "measured")
    if law.effort is None:
        return
    if law.effort.names != effort.names:
        yield f"it commands {', '.join(law.effort.names)}, and the craft makes {', '.join(effort.names)}"
    else:
        for signal, made in zip(law.effort.signals, effort.signals, strict=True):
            yield from _apart(signal, made, f"it commands {signal.name}", "made")


def read_by(scheme: Scheme, plant: Plant) -> Layout:
    """Return the signals that the law of a scheme may read: those of its navigation, or the measured ones."""
    return plant.measurement if scheme.navigation is None else scheme.navigation.signals


def _apart(own: Signal, other: Signal, what: str, how: str) -> Iterator[str]:
    if own.size != other.size:
        yield f"{what} with {own.size} elements, and {other.size} are {how}"
    elif (own.unit or "-") != (other.unit or "-"):
        yield f"{what} in {own.unit or '-'}, and it is {how} in {other.unit or '-'}"
    elif own.frame and other.frame and own.frame != other.frame:
        yield f"{what} in the frame {own.frame!r}, and it is {how} in {other.frame!r}"


def refuse_strangers(mission: Mission) -> None:
    """Raise `FlightError` where a part of a mission is of another kind: a class in the place of an object."""
    if not isinstance(mission.schemes, (list, tuple)):
        raise FlightError(f"schemes is {_given(mission.schemes)}, expected a list of casadi_gnc.Scheme")
    expected = [("craft", mission.craft, Craft), ("timing", mission.timing, Timing)]
    expected += [(f"schemes[{i}]", scheme, Scheme) for i, scheme in enumerate(mission.schemes)]
    laws = [(f"the law of {one.name!r}", one.law, Law) for one in mission.schemes if isinstance(one, Scheme)]
    for name, value, kind in [*expected, *laws]:
        if not isinstance(value, kind):
            raise FlightError(f"{name} is {_given(value)}, expected an object of a casadi_gnc.{kind.__name__}")


def _given(value: Any) -> str:
    return f"the class {value.__name__}" if isinstance(value, type) else f"an object of type {type(value).__name__}"


def goals(mission: Mission, hook: str = "regulated") -> Mapping[str, Sequence[float]]:
    """Return what a craft says is regulated, or swings; raise `FlightError` where that is no state of its plant."""
    state, craft = mission.truth.state, type(mission.craft).__name__
    found: Mapping[str, Sequence[float]] = asking.ask(mission.craft, hook, mission)
    for name, goal in found.items():
        if name not in state:
            raise FlightError(f"{craft}.{hook} names {name!r}, which is no state; {offer(name, state.names)}")
        if len(goal) != state.signal(name).size:
            raise FlightError(f"{craft}.{hook} gives {len(goal)} numbers of {name}, not {state.signal(name).size}")
    return found


def refuse(mission: Mission) -> None:
    """Raise `FlightError` for parts of a mission that do not fit each other."""
    if not mission.schemes:
        raise FlightError(f"{mission.name} has no scheme; give at least one")
    names = [scheme.name for scheme in mission.schemes]
    for name in names:
        if names.count(name) > 1:
            raise FlightError(f"two schemes of {mission.name} are named {name!r}")
    plant, craft = mission.truth, type(mission.craft).__name__
    unknown = [name for name in mission.start_from if name not in plant.state]
    if unknown:
        raise FlightError(f"start_from names {unknown[0]!r}, which is no state; {offer(unknown[0], plant.state.names)}")
    if len(mission.start) != plant.state.size:
        raise FlightError(f"start_from gives {len(mission.start)} numbers in all, expected {plant.state.size}")
    for scheme in mission.schemes:
        actuation, law = scheme.actuation, type(scheme.law)
        if len(actuation.lower) != plant.inputs.size:
            raise FlightError(
                f"scheme {scheme.name!r} has bounds for {len(actuation.lower)} actuators, and the plant is told "
                f"{plant.inputs.size} numbers ({', '.join(plant.inputs.names)})"
            )
        why = list(misfits(law, read_by(scheme, plant), scheme.law.belief, actuation.effort))
        if why:
            raise FlightError(
                f"the law {law.__name__} of scheme {scheme.name!r} does not fit {craft}: {'; '.join(why)}"
            )
    for funnel in mission.funnels:
        if funnel.signal not in plant.measurement:
            told = offer(funnel.signal, plant.measurement.names)
            raise FlightError(f"there is a funnel of {funnel.signal!r}, which is not measured; {told}")
        for scheme in mission.schemes:
            if scheme.navigation is not None and funnel.signal in scheme.navigation.changed:
                raise FlightError(
                    f"the funnel bounds {funnel.signal!r} as it is measured, and the law of scheme {scheme.name!r} "
                    "reads it from the reference; leave out the funnel, or the reference"
                )


def refuse_requirements(mission: Mission) -> None:
    """Raise `RequirementError` for two requirements of one id, and for one that asks for what no flight has."""
    ids: list[str] = []
    for one in mission.requirements:
        if not isinstance(one, Requirement):
            raise FlightError(f"a requirement is {_given(one)}, expected an object of a casadi_gnc.Requirement")
        if one.id in ids:
            raise RequirementError(f"the id {one.id!r} is given to two requirements", "id")
        ids.append(one.id)
        refuse_requirement(mission, one)


def refuse_requirement(mission: Mission, asked: Requirement) -> None:
    """Raise `RequirementError` where a requirement asks for a metric or a signal that a scheme does not have."""
    if asked.metric:
        known = [metric.name for metric in mission.metrics]
        if asked.metric not in known:
            told = offer(asked.metric, known)
            raise RequirementError(f"{asked.id} bounds {asked.metric!r}, which is no metric; {told}", "metric")
        return
    for scheme in mission.schemes:
        row = row_of(Loop(mission, scheme))
        try:
            asked.bind(row, row.symbol("row"), mission.timing.sample_period)
        except RequirementError as error:
            raise RequirementError(f"{error} (scheme {scheme.name})", error.key) from None


def refuse_fault_handling(mission: Mission, asked: FaultHandling | None) -> None:
    """Raise `FaultHandlingError` where what is asked for does not fit a scheme."""
    for scheme in mission.schemes if asked is not None else ():
        assert asked is not None
        raised = Loop(mission, scheme).raised()
        asked.faults(scheme, mission.truth.measurement, raised, mission.timing.sample_period)


def complete(mission: Mission, metric: Metric) -> Metric:
    """Return a metric with its unit; raise `FlightError` where a scheme does not record its signal."""
    unit = ""
    for scheme in mission.schemes:
        row = row_of(Loop(mission, scheme))
        if metric.signal not in row:
            raise FlightError(
                f"{metric.signal!r} of the metric {metric.name!r} is no signal of scheme {scheme.name}; "
                f"{offer(metric.signal, row.names)}"
            )
        unit = row.signal(metric.signal).unit
    return replace(metric, unit="s" if metric.kind in ("settling", "reaching") else unit)
