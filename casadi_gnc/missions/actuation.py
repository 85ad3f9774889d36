"""What a craft's actuators can make, and how a scheme shares a wanted effort out among them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from casadi_gnc.allocation import Direct
from casadi_gnc.errors import FlightError
from casadi_gnc.laws.efforts import TORQUE
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.missions.modulated import Modulation
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus

#: Why what a robust allocation knows of its actuators stays a number.
SET_UP = "robust allocation is set up for one effectiveness and one range; take method pinv to vary them"


@dataclass(frozen=True, eq=False)
class Actuators:
    """Describe the actuators of a craft as the flight software believes them.

    Functions given here are methods of the craft or of small classes, not lambdas, where a mission is to go to
    another process.

    Parameters
    ----------
    effectiveness : A, (R, N), effort per command, or a function of the measured signals (by name) that returns it.
    lower, upper : (N,), amplitude bounds, unit of the actuators; numbers, or symbols where they vary from case to case.
    rate : largest change of an actuator per second, `inf` for none.
    effort : what the actuators make together, one signal a kind; R rows.
    reach : function of the measured signals and the sample period that returns further bounds, lower and upper,
        (N,) each.
    judge : function (measured signals, limited effort, actuators) -> flags by status bit, on board.
    inverse : function (measured signals, limited effort) -> actuators, (N,), that a craft knows better than an
        allocator could: the allocator is then given this in the place of the effort.
    modulation : what makes pulses of what the allocation asks, where actuators know on and off alone.
    """

    effectiveness: ca.DM | Callable[[Any], Any]
    lower: Sequence[Any]
    upper: Sequence[Any]
    rate: float = float("inf")
    effort: Layout = TORQUE
    reach: Callable[[Any, float], tuple[Any, Any]] | None = None
    judge: Callable[[Any, Any, Any], dict[StepStatus, Any]] | None = None
    inverse: Callable[[Any, Any], Any] | None = None
    modulation: Modulation | None = None

    def __post_init__(self) -> None:
        if not callable(self.effectiveness):
            matrix = array(self.effectiveness)
            object.__setattr__(self, "effectiveness", matrix)
            if matrix.shape != (self.effort.size, len(self.lower)):
                raise FlightError(
                    f"the effectiveness has shape {matrix.shape[0]} x {matrix.shape[1]}, expected {self.effort.size} "
                    f"({', '.join(self.effort.names)}) x {len(self.lower)} (actuators)"
                )
        for name in ("lower", "upper"):
            object.__setattr__(self, name, list(map(_plain, getattr(self, name))))
        if len(self.lower) != len(self.upper):
            raise FlightError(f"{len(self.lower)} lower bounds of actuators, but {len(self.upper)} upper ones")
        pairs = list(zip(self.lower, self.upper, strict=True))
        known = [i for i, pair in enumerate(pairs, 1) if all(map(is_number, pair))]
        crossed = [i for i in known if not self.lower[i - 1] <= self.upper[i - 1]]
        if crossed:
            low, high = self.lower[crossed[0] - 1], self.upper[crossed[0] - 1]
            raise FlightError(f"actuator {crossed[0]}: its lower bound {low:g} exceeds the upper, {high:g}")

    def matrix(self, seen: Any) -> Any:
        """Return the believed effectiveness, (R, N), at the measured signals `seen`."""
        return self.effectiveness(seen) if callable(self.effectiveness) else self.effectiveness

    @property
    def fixed(self) -> Any:
        """The effectiveness of an allocator that is set up before the flight, (R, N).

        Raises
        ------
        FlightError
            Where effectiveness or bounds follow the measurement, or vary from case to case.
        """
        if callable(self.effectiveness):
            raise FlightError("the effectiveness follows the measurement; robust allocation needs one that stays")
        if not all(map(is_number, [self.effectiveness, *self.lower, *self.upper])):
            raise FlightError(SET_UP)
        return self.effectiveness

    def most(self) -> list[Any]:
        """Return the largest magnitude of each row of effort that the bounds allow, (R,); of a fixed effectiveness."""
        if callable(self.effectiveness):
            raise FlightError("the effectiveness follows the measurement, so no largest effort follows: give limits")
        bound = bounds.maximum(ca.fabs(array(self.lower)), ca.fabs(array(self.upper)))
        return list(map(_plain, ca.mtimes(ca.fabs(self.effectiveness), bound).elements()))


def _plain(value: Any) -> Any:
    """Return a number as Python's own; a symbol as it is."""
    return float(value) if is_number(value) else value


@dataclass(frozen=True, eq=False)
class Actuation(Actuators):
    """Say how a wanted effort becomes actuator commands.

    Parameters
    ----------
    limit_below, limit_above : (R,), box of the virtual control, units of `effort`.
    allocator : an object with `report` and either `expression` (CasADi) or `start` (numpy), see
        `casadi_gnc.allocation`.
    """

    limit_below: Sequence[Any] = ()
    limit_above: Sequence[Any] = ()
    allocator: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("limit_below", "limit_above"):
            object.__setattr__(self, name, list(map(_plain, getattr(self, name))))
            if len(getattr(self, name)) != self.effort.size:
                raise FlightError(
                    f"{name} has {len(getattr(self, name))} numbers, expected {self.effort.size}, one for each row of "
                    f"{', '.join(self.effort.names)}"
                )
        if not hasattr(self.allocator, "report") or not (self.is_symbolic or hasattr(self.allocator, "start")):
            raise FlightError(
                f"the allocator is an object of type {type(self.allocator).__name__}; expected one with `report` and "
                "`expression` or `start`, such as casadi_gnc.allocation.PseudoInverse()"
            )

    @classmethod
    def of(cls, actuators: Actuators, limit: Sequence[Any], allocator: Any) -> Actuation:
        """Return the actuation of some actuators, with limits of the same magnitude on both sides.

        Parameters
        ----------
        actuators : what makes the effort.
        limit : largest magnitude of each row of the effort, (R,), in its unit.
        allocator : who shares the effort out.
        """
        if len(limit) != actuators.effort.size:
            raise FlightError(
                f"{len(limit)} limits of the effort, expected {actuators.effort.size}, one for each row of "
                f"{', '.join(actuators.effort.names)}"
            )
        own = {name: getattr(actuators, name) for name in Actuators.__dataclass_fields__}
        return cls(**own, limit_below=[-value for value in limit], limit_above=list(limit), allocator=allocator)

    @classmethod
    def direct(cls, effort: Layout, limit: Sequence[float]) -> Actuation:
        """Return an actuator for each row of effort that makes just that row, clipped to a limit of the same unit."""
        most = list(limit)
        own = Actuators(ca.DM.eye(effort.size), [-value for value in most], most, effort=effort)
        return cls.of(own, most, Direct())

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
