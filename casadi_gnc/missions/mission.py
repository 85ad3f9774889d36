"""A mission: a plant, what the flight software believes of it, how it is timed, and one or more
schemes that could fly it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, Protocol

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.laws import Law, PerformanceFunnel
from casadi_gnc.signals import Layout

Mode = Literal["sampled", "continuous"]
Feedback = Literal["achieved", "wanted"]


class Plant(Protocol):
    """What a mission needs of a plant (see `casadi_gnc.plants`)."""

    @property
    def state(self) -> Layout: ...
    @property
    def measurement(self) -> Layout: ...
    @property
    def inputs(self) -> Layout: ...
    def measure(self, t: Any, x: Any) -> Any: ...
    def rate(self, t: Any, x: Any, force: Any) -> Any: ...
    def settle(self, x: Any) -> Any: ...


@dataclass(frozen=True)
class Timing:
    """Say when things happen.

    Parameters
    ----------
    mode : "sampled" (measure, hold, advance) or "continuous" (the law in every integrator stage).
    sample_period : [s].
    duration : [s].
    substeps : Runge-Kutta steps of the plant in one sample period.
    """

    mode: Mode
    sample_period: float
    duration: float
    substeps: int = 1

    def __post_init__(self) -> None:
        if self.mode not in ("sampled", "continuous"):
            raise FlightError(f"mode is {self.mode!r}, expected 'sampled' or 'continuous'")
        for name in ("sample_period", "duration", "substeps"):
            value = getattr(self, name)
            if not (value > 0 and value < float("inf")):
                raise FlightError(f"{name} is {value}, expected a positive number")

    @property
    def samples(self) -> int:
        """Number of samples of a flight, both ends included."""
        return round(self.duration / self.sample_period) + 1


@dataclass(frozen=True, eq=False)
class Actuation:
    """Say how a wanted effort becomes actuator commands.

    Parameters
    ----------
    effectiveness : believed A, (R, N).
    lower, upper : (N,), amplitude bounds, [N].
    rate : largest change [N/s], `inf` for none.
    limit_below, limit_above : (R,), box of the virtual control, [N m].
    allocator : an object with `report` and either `expression` (CasADi) or `start` (numpy).
    """

    effectiveness: ca.DM
    lower: list[float]
    upper: list[float]
    rate: float
    limit_below: list[float]
    limit_above: list[float]
    allocator: Any

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
    kind: Literal["settling", "peak", "sample_sum"]
    signal: str
    threshold: float = 0.0
    after: float = 0.0
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Mission:
    """Everything needed to fly; made by `casadi_gnc.load`, changed by `with_timing`, `with_scheme`.

    `casadi.Function`s for analysis come from `plant`, `law`, `step` and `closed_loop`.
    """

    name: str
    truth: Plant
    start: list[float]
    timing: Timing
    schemes: tuple[Scheme, ...]
    metrics: tuple[Metric, ...] = ()
    funnel: Funnel | None = None
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
        """Return the mission with another `mode`, `sample_period`, `duration` or `substeps`."""
        timing = replace(self.timing, **changes)
        hold = timing.sample_period if timing.mode == "sampled" else 0.0
        schemes = tuple(replace(scheme, law=replace(scheme.law, hold=hold)) for scheme in self.schemes)
        return replace(self, timing=timing, schemes=schemes)

    def with_scheme(self, name: str | None = None, **changes: Any) -> Mission:
        """Return the mission with one scheme only, changed: `feedback`, or gains of its law by name."""
        scheme = self.scheme(name)
        own = {key: changes.pop(key) for key in ("feedback", "actuation", "title") if key in changes}
        known = {field.name for field in dataclasses.fields(scheme.law)}
        for key in changes:
            if key not in known:
                raise FlightError(f"scheme {scheme.name!r} has no {key!r}; its law has {', '.join(sorted(known))}")
        scheme = replace(scheme, law=replace(scheme.law, **changes), **own)
        return replace(self, schemes=(scheme,))

    def plant(self) -> ca.Function:
        """Return x' as a function (t, x, force) -> rate, with the ports of the plant's layouts."""
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
        """Return one sample of the controller: (t, y, good, m, force, [p]) -> (force_next, m_next, ...)."""
        from casadi_gnc.missions import functions

        return functions.step_function(self, self.scheme(scheme), parameters)

    def loop_start(self, scheme: str | None = None) -> dict[str, ca.DM]:
        """Return x, m, force and good at t = 0, as `closed_loop` takes them."""
        from casadi_gnc.missions import functions

        return functions.loop_start(self, self.scheme(scheme))

    def closed_loop(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return one sample period of the loop: (t, x, m, force, good, [p]) -> the same, later.

        Ports: `t` [s]; `x`, the plant's state in the order of `truth.state`; `m`, the law's memory;
        `force`, the previous forces; `good`, the last good measurement. Results: `x_next`, `m_next`,
        `force_next`, `good_next`, `wanted`, `limited`. `loop_start` gives the first values. Only schemes
        whose allocation is an expression ("pinv") have a closed loop.
        """
        from casadi_gnc.missions import functions

        return functions.closed_loop_function(self, self.scheme(scheme), parameters)
