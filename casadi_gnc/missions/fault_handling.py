"""What flight software does with faults beside telling them, as a mission asks for it: `[fault_handling]`.

Of packages alone: simulated flights tell faults by the same bits and do nothing further.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from casadi_gnc.embedded.faults import STALE, Faults
from casadi_gnc.embedded.flight_function import HELD, TAKEN, FlightFunction
from casadi_gnc.errors import FaultHandlingError, offer
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus

#: Bits that say that a limit was met or that an answer is not certified: no failures where nobody said so.
_NO_FAILURES = (
    StepStatus.COMMAND_LIMITED | StepStatus.EFFORT_SHORT | StepStatus.ALLOCATION_INEXACT | StepStatus.WHEEL_SATURATED
)
#: Bits of the package itself that can be a failure.
_OF_PACKAGES = {"TIME_SHIFTED": 1 << 27, "MEASUREMENT_STALE": STALE}
#: Most steps that are counted to.
_MOST = 2**31


@dataclass(frozen=True)
class FaultHandling:
    """Say what a flight package does with faults; what is left out is off and costs nothing.

    Parameters
    ----------
    failures : names of those bits of the status that make a step a failure; by default all but those that say that a
        limit was met or an answer not certified.
    count : count steps, replaced measurements and steps in a row with each bit.
    latch_first : keep time, step and status of the first failure until it is acknowledged.
    measurement_age_s : how long a measurement may be held, one for all or by signal.
    safe_output : "zero", "hold" or a number for each actuator: what they are told in safe mode; "" for no such mode.
    safe_after : failures in a row that begin safe mode.
    release_after : steps without failure that end it; 0: only an acknowledgement does.
    gain_change_s : how long the effort moves from that of old gains to that of new ones; 0: at once.
    state_image : the state can be exported as octets and imported.

    Raises
    ------
    FaultHandlingError
        For options that need others.
    """

    failures: Sequence[str] = ()
    count: bool = False
    latch_first: bool = False
    measurement_age_s: float | Mapping[str, float] = 0.0
    safe_output: str | Sequence[float] = ""
    safe_after: int = 0
    release_after: int = 0
    gain_change_s: float = 0.0
    state_image: bool = False

    def __post_init__(self) -> None:
        has_safe = not (isinstance(self.safe_output, str) and self.safe_output == "")
        if isinstance(self.safe_output, str) and self.safe_output not in ("", "zero", "hold"):
            raise FaultHandlingError(
                "safe_output", f'is {self.safe_output!r}, expected "zero", "hold" or a number an actuator'
            )
        if has_safe and not (self.safe_after or self.measurement_age_s):
            raise FaultHandlingError("safe_output", "needs safe_after or measurement_age_s, which say when it is used")
        for key in ("safe_after", "release_after"):
            if getattr(self, key) and not has_safe:
                raise FaultHandlingError(key, "needs safe_output, which says what the actuators are told")
            if not 0 <= getattr(self, key) < _MOST:
                raise FaultHandlingError(key, f"is {getattr(self, key)}, expected from 1 to {_MOST - 1}")
        if self.failures and not (self.safe_after or self.latch_first):
            raise FaultHandlingError("failures", "needs latch_first or safe_after, which do something with them")

    def faults(self, scheme: Scheme, measured: Layout, raised: Sequence[StepStatus], period: float) -> Faults:
        """Return the same in steps, bits and numbers for a scheme.

        Parameters
        ----------
        measured : layout of the measurement.
        raised : bits that the scheme can raise.
        period : between two steps [s].

        Raises
        ------
        FaultHandlingError
            For what the scheme does not have, and times shorter than a period.
        """
        return Faults(
            failures=self._failures(scheme, raised),
            count=self.count,
            latch=self.latch_first,
            ages=self._ages(measured, period),
            safe=self._safe(scheme),
            safe_after=self.safe_after,
            release_after=self.release_after,
            fade=_steps("gain_change_s", self.gain_change_s, period) if self.gain_change_s else 0,
            image=self.state_image,
        )

    def of_function(self, own: FlightFunction) -> Faults:
        """Return the same for the package of a function: a failure is a refused step, and all outputs are held at once.

        Parameters
        ----------
        own : the function as it is packed, with its ports and period.

        Raises
        ------
        FaultHandlingError
            For what a function does not have, and times where it has no period or that are shorter.
        """
        if self.gain_change_s:
            raise FaultHandlingError("gain_change_s", "is for gains of a mission that can change; leave it out")
        age = self.measurement_age_s
        if isinstance(age, Mapping):
            raise FaultHandlingError(
                "measurement_age_s", "names signals; a refused step holds all outputs, expected one number"
            )
        if age and not own.period:
            raise FaultHandlingError("measurement_age_s", "needs the period of the function; give its rate")
        possible = (TAKEN if own.is_clocked else HELD) | (STALE if age else 0)
        bits = {name: bit for bit, (name, _) in own.statuses.items() if bit & TAKEN}
        return Faults(
            failures=self._chosen(bits | {"MEASUREMENT_STALE": STALE}, possible, possible, own.function.name()),
            count=self.count,
            latch=self.latch_first,
            ages=(("outputs", _steps("measurement_age_s", age, own.period)),) if age else (),
            safe=self._safe_outputs(own.outputs.size),
            safe_after=self.safe_after,
            release_after=self.release_after,
            image=self.state_image,
        )

    def _safe_outputs(self, count: int) -> tuple[float, ...] | None:
        if isinstance(self.safe_output, str):
            if self.safe_output == "hold":
                raise FaultHandlingError(
                    "safe_output", 'is "hold", which refused steps do anyway; expected "zero" or a number an output'
                )
            return (0.0,) * count if self.safe_output else None
        given = tuple(float(value) for value in self.safe_output)
        if len(given) != count or not all(math.isfinite(value) for value in given):
            raise FaultHandlingError(
                "safe_output", f"has {len(given)} numbers, expected a finite one for each of {count} outputs"
            )
        return given

    def _failures(self, scheme: Scheme, raised: Sequence[StepStatus]) -> int:
        known = {str(bit.name): bit.value for bit in StepStatus} | _OF_PACKAGES
        possible = sum(bit.value for bit in raised) | _OF_PACKAGES["TIME_SHIFTED"]
        possible |= STALE if self.measurement_age_s else 0
        return self._chosen(known, possible, possible & ~_NO_FAILURES.value, f"scheme {scheme.name}")

    def _chosen(self, known: Mapping[str, int], possible: int, default: int, whose: str) -> int:
        """Return the bits of failures: those asked for that are possible, `default` where none was."""
        for name in self.failures:
            if name not in known:
                raise FaultHandlingError("failures", f"has {name!r}, which is no bit of a status; {offer(name, known)}")
        if "MEASUREMENT_STALE" in self.failures and not self.measurement_age_s:
            raise FaultHandlingError("failures", "has 'MEASUREMENT_STALE', which needs measurement_age_s")
        asked = sum(known[name] for name in set(self.failures)) if self.failures else default
        if not possible & asked:
            raise FaultHandlingError("failures", f"has no bit that {whose} raises")
        return possible & asked

    def _ages(self, measured: Layout, period: float) -> tuple[tuple[str, int], ...]:
        asked = self.measurement_age_s
        if not asked:
            return ()
        by_signal = asked if isinstance(asked, Mapping) else dict.fromkeys(measured.names, asked)
        for name in by_signal:
            if name not in measured:
                raise FaultHandlingError(
                    "measurement_age_s", f"has {name!r}, which is not measured; {offer(name, measured.names)}"
                )
        return tuple(
            (name, _steps("measurement_age_s", by_signal[name], period)) for name in measured.names if name in by_signal
        )

    def _safe(self, scheme: Scheme) -> tuple[float, ...] | None:
        lower, upper = ([float(v) for v in each] for each in (scheme.actuation.lower, scheme.actuation.upper))
        if isinstance(self.safe_output, str):
            return {"": None, "hold": (), "zero": (0.0,) * len(lower)}[self.safe_output]
        given = [float(value) for value in self.safe_output]
        if len(given) != len(lower):
            raise FaultHandlingError(
                "safe_output", f"has {len(given)} numbers, expected one for each of {len(lower)} actuators"
            )
        for i, (low, value, high) in enumerate(zip(lower, given, upper, strict=True), 1):
            if not low <= value <= high:
                raise FaultHandlingError(
                    "safe_output", f"tells actuator {i} {value:g}, outside its bounds, {low:g} to {high:g}"
                )
        return tuple(given)


def _steps(key: str, time: float, period: float) -> int:
    """Return how many whole periods a time has."""
    count = time / period * (1.0 + 1e-9)
    if not (math.isfinite(count) and 1.0 <= count < _MOST):
        raise FaultHandlingError(key, f"is {time:g} s, expected at least one sample period, {period:g} s")
    return int(count)
