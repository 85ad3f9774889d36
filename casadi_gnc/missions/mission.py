"""A mission: a plant, what the flight software believes of it, how it is timed, and one or more
schemes that could fly it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import casadi as ca

from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError
from casadi_gnc.laws import Law, PerformanceFunnel
from casadi_gnc.missions.plant import Plant
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.status import StepStatus

Mode = Literal["sampled", "continuous"]
Feedback = Literal["achieved", "wanted"]
MetricKind = Literal["settling", "reaching", "peak", "least", "final", "mean", "sample_sum"]


@dataclass(frozen=True)
class Timing:
    """Say when things happen.

    Parameters
    ----------
    mode : "sampled" (measure, hold, advance) or "continuous" (the law in every integrator stage).
    sample_period : [s].
    duration : [s].
    substeps : Runge-Kutta steps of the plant in one sample period.
    record_every : one sample of so many is kept.
    """

    mode: Mode
    sample_period: float
    duration: float
    substeps: int = 1
    record_every: int = 1

    def __post_init__(self) -> None:
        if self.mode not in ("sampled", "continuous"):
            raise FlightError(f"mode is {self.mode!r}, expected 'sampled' or 'continuous'")
        for name in ("sample_period", "duration", "substeps", "record_every"):
            value = getattr(self, name)
            if not (value > 0 and value < float("inf")):
                raise FlightError(f"{name} is {value}, expected a positive number")

    @property
    def samples(self) -> int:
        """Number of samples of a flight, both ends included."""
        return round(self.duration / self.sample_period) + 1


@dataclass(frozen=True)
class Noise:
    """Say how the random numbers of a flight are drawn.

    Parameters
    ----------
    seed : 0 to 2^64 - 1; the same seed gives the same flight on every machine.
    every : sample periods from draw to draw; the numbers are held in between.
    truncation : standard deviations beyond which a number is cut off.
    """

    seed: int = 1
    every: int = 1
    truncation: float = float("inf")


#: The effort of a craft that only turns.
TORQUE = Layout((Signal("torque", 3, "N m"),))


@dataclass(frozen=True, eq=False)
class Actuation:
    """Say how a wanted effort becomes actuator commands.

    Parameters
    ----------
    effectiveness : believed A, (R, N), or a function of the measured signals (by name) that returns it.
    lower, upper : (N,), amplitude bounds, unit of the actuators.
    rate : largest change of an actuator per second, `inf` for none.
    limit_below, limit_above : (R,), box of the virtual control, units of `effort`.
    allocator : an object with `report` and either `expression` (CasADi) or `start` (numpy).
    effort : what the actuators make together, one signal a kind; R rows.
    reach : function of the measured signals and the sample period that returns further bounds, lower and
        upper, (N,) each.
    judge : function (measured signals, limited effort, actuators) -> flags by status bit, on board.
    inverse : function (measured signals, limited effort) -> actuators, (N,), that a craft knows better
        than an allocator could: the allocator is then given this in the place of the effort.
    """

    effectiveness: ca.DM | Callable[[Any], Any]
    lower: list[float]
    upper: list[float]
    rate: float
    limit_below: list[float]
    limit_above: list[float]
    allocator: Any
    effort: Layout = TORQUE
    reach: Callable[[Any, float], tuple[Any, Any]] | None = None
    judge: Callable[[Any, Any, Any], dict[StepStatus, Any]] | None = None
    inverse: Callable[[Any, Any], Any] | None = None

    def matrix(self, seen: Any) -> Any:
        """Return the believed effectiveness, (R, N), at the measured signals `seen`."""
        return self.effectiveness(seen) if callable(self.effectiveness) else self.effectiveness

    def named(self, stage: str) -> Layout:
        """Return the signals of an effort at a stage: "wanted", "limited" or "achieved".

        A craft with one kind of effort has them by the stage's name; one with several, by stage and kind.
        """
        alone = len(self.effort.signals) == 1
        return Layout(
            tuple(replace(each, name=stage if alone else f"{stage}_{each.name}") for each in self.effort.signals)
        )

    @property
    def is_symbolic(self) -> bool:
        """Whether the allocation is a CasADi expression, so that the whole loop is one."""
        return hasattr(self.allocator, "expression")


@dataclass(frozen=True, eq=False)
class Scheme:
    """One way to fly a mission: law, actuation and what the law is told was achieved."""

    name: str
    law: Law
    actuation: Actuation
    feedback: Feedback = "achieved"
    title: str = ""

    def __post_init__(self) -> None:
        if self.feedback not in ("achieved", "wanted"):
            raise FlightError(f"feedback is {self.feedback!r}, expected 'achieved' or 'wanted'")


@dataclass(frozen=True, eq=False)
class Funnel:
    """Bounds that a mission sets a measured signal, whichever law flies it."""

    signal: str
    bounds: PerformanceFunnel


@dataclass(frozen=True)
class Metric:
    """One number asked of a flight; kinds are defined in `casadi_gnc.missions.metrics`."""

    name: str
    kind: MetricKind
    signal: str
    threshold: float = 0.0
    after: float = 0.0
    unit: str = ""
    until: float = float("inf")
    norm: Literal["max", "two"] = "max"


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


@dataclass(frozen=True, eq=False)
class Mission:
    """Everything needed to fly; made by `casadi_gnc.load`, changed by `with_timing`, `with_scheme`.

    `casadi.Function`s for analysis come from `plant`, `law`, `step` and `closed_loop`. `notes` are
    what a reader of every flight must know, e.g. that an orbit is no orbit. `target` gives the states that
    the laws regulate, by name, and the values that they bring them to; `checks` are the craft's own, and `truths` names
    the effectivenesses, (R, N), that errors and faults may make true.
    """

    name: str
    truth: Plant
    start: list[float]
    timing: Timing
    schemes: tuple[Scheme, ...]
    metrics: tuple[Metric, ...] = ()
    funnels: tuple[Funnel, ...] = ()
    noise: Noise = Noise()
    panels: tuple[Panel, ...] = ()
    target: Mapping[str, Sequence[float]] = field(default_factory=dict)
    checks: Callable[[Mission, Scheme], Iterable[Check]] = lambda mission, scheme: ()
    truths: Callable[[Mission, Scheme], Mapping[str, Any]] = lambda mission, scheme: {}
    notes: tuple[str, ...] = ()
    title: str = ""
    source: str = ""
    digest: str = ""

    def scheme(self, name: str | None = None) -> Scheme:
        """Return a scheme by name, the first one by default."""
        if name is None:
            return self.schemes[0]
        for scheme in self.schemes:
            if scheme.name == name:
                return scheme
        known = ", ".join(scheme.name for scheme in self.schemes)
        raise FlightError(f"no scheme {name!r} in {self.name}; there is {known}")

    def with_timing(self, **changes: Any) -> Mission:
        """Return the mission with another `mode`, `sample_period`, `duration` or `substeps`.

        Raises `LawError` where a law cannot work at that sample period.
        """
        timing = replace(self.timing, **changes)
        hold = timing.sample_period if timing.mode == "sampled" else 0.0
        schemes = tuple(replace(scheme, law=replace(scheme.law, hold=hold)) for scheme in self.schemes)
        for scheme in schemes:
            scheme.law.check_hold()
        return replace(self, timing=timing, schemes=schemes)

    def with_scheme(self, name: str | None = None, **changes: Any) -> Mission:
        """Return the mission with one scheme only, changed: `feedback`, or gains of its law by name."""
        scheme = self.scheme(name)
        own = {key: changes.pop(key) for key in ("feedback", "actuation", "title") if key in changes}
        known = {own_field.name for own_field in dataclasses.fields(scheme.law)}
        for key in changes:
            if key not in known:
                raise FlightError(f"scheme {scheme.name!r} has no {key!r}; its law has {', '.join(sorted(known))}")
        scheme = replace(scheme, law=replace(scheme.law, **changes), **own)
        return replace(self, schemes=(scheme,))

    def plant(self) -> ca.Function:
        """Return x' as a function (t, x, actuators) -> rate without noise, with the ports of the plant's layouts."""
        from casadi_gnc.missions import functions

        return functions.plant_rate(self)

    def law(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return the law as (t, y, m, achieved, [p]) -> (wanted, rate of memory, shown signals).

        `parameters` are symbols that were put in place of gains by `with_scheme`; where there are
        any, the function has them as its last port, p.
        """
        from casadi_gnc.missions import functions

        return functions.law_function(self, self.scheme(scheme), parameters)

    def step(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return one sample of the controller: (t, y, good, m, actuators, [p]) -> (actuators_next, m_next, ...)."""
        from casadi_gnc.missions import functions

        return functions.step_function(self, self.scheme(scheme), parameters)

    def loop_start(self, scheme: str | None = None) -> dict[str, ca.DM]:
        """Return x, m, actuators and good at t = 0, as `closed_loop` takes them."""
        from casadi_gnc.missions import functions

        return functions.loop_start(self, self.scheme(scheme))

    def closed_loop(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return one sample period of the loop: (t, x, m, actuators, good, [p]) -> the same, later.

        Ports: `t` [s]; `x`, the plant's state in the order of `truth.state`; `m`, the law's memory;
        `actuators`, what they were last told; `good`, the last good measurement. Results: `x_next`,
        `m_next`, `actuators_next`, `good_next`, `wanted`, `limited`. `loop_start` gives the first values.
        Noise is zero. Only schemes whose allocation is an expression have a closed loop.
        """
        from casadi_gnc.missions import functions

        return functions.closed_loop_function(self, self.scheme(scheme), parameters)
