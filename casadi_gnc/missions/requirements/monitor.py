"""Watch formulas sample by sample, with bounded memory: in Python, and the tape of which a package's monitor is made.

A monitor judges an instant as soon as the intervals that begin there have passed. What it says is what the record up to
then says of those instants that can be judged, and it says "met" or "not met" once nothing that may come can change it.
When the flight is over, `finish` judges the instants that are left by what there is, as the whole record is judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import RequirementError
from casadi_gnc.missions.requirements.requirement import Requirement, unbounded
from casadi_gnc.missions.requirements.weaving import MET, NOT_MET, OPEN, Woven, weave
from casadi_gnc.signals import Layout

#: Numbers that the delay lines of one requirement may hold: what a small processor has room for.
MOST_KEPT = 4096
#: Words of a monitor's verdicts.
WORDS = {OPEN: "open", MET: "met", NOT_MET: "not met"}


@dataclass(frozen=True, eq=False)
class MonitorTape:
    """One sample of a monitor of several requirements.

    Parameters
    ----------
    requirements : with formulas, in order.
    layout : the signals that they read.
    step : (row, age, after, past, kept) -> (pushed, later, robustness, verdict): the signals, the number of the sample,
        how many steps ago the last sample was (0 up to it), what the delay lines give back, the registers; what goes
        into the lines, the registers, and what is known of each requirement.
    lines : length of each delay line, in samples.
    initial : the registers before the first sample.
    horizon : number of a sample from which on all are alike.
    delays : samples after which an instant can be judged, of each requirement.
    finish : steps after the last sample until all is known.
    units : of each robustness.
    """

    requirements: tuple[Requirement, ...]
    layout: Layout
    step: ca.Function
    lines: tuple[int, ...]
    initial: tuple[float, ...]
    horizon: int
    delays: tuple[int, ...]
    finish: int
    units: tuple[str, ...]


def monitor_tape(requirements: Sequence[Requirement], signals: Layout, period: float) -> MonitorTape:
    """Return one sample of the monitor of some requirements.

    Parameters
    ----------
    requirements : with formulas.
    signals : what there is to watch.
    period : from sample to sample [s].

    Raises
    ------
    RequirementError
        For a bound on a metric, a signal that is not there, and what no bounded memory can judge: an interval up to the
        end inside another condition over time, intervals that are too long.
    """
    column, age, after = signals.symbol("row"), ca.SX.sym("age"), ca.SX.sym("after")
    bounds, woven = [], []
    for one in requirements:
        if not one.formula:
            raise RequirementError(
                f"{one.id} bounds a metric, which is known when the flight is over; a monitor takes formulas"
            )
        bounds.append(one.bind(signals, column, period))
        woven.append(_woven(one, bounds[-1], age, after, period))
    names = frozenset().union(*(bound.names for bound in bounds))
    layout = Layout(tuple(signal for signal in signals.signals if signal.name in names))
    read = ca.vertcat(*(column[signals.place(name)] for name in layout.names))
    lines = [line for one in woven for line in one.lines]
    registers = [register for one in woven for register in one.registers]
    results = {
        "pushed": [line.value for line in lines],
        "later": [register.later for register in registers],
        "robustness": [one.robustness for one in woven],
        "verdict": [one.verdict for one in woven],
    }
    ports = {
        "row": read,
        "age": age,
        "after": after,
        "past": ca.vertcat(*(line.past for line in lines)) if lines else ca.SX(0, 1),
        "kept": ca.vertcat(*(register.now for register in registers)),
    }
    columns = ca.cse([ca.densify(ca.vertcat(*each)) if each else ca.SX(0, 1) for each in results.values()])
    return MonitorTape(
        requirements=tuple(requirements),
        layout=layout,
        step=ca.Function("monitor", list(ports.values()), columns, list(ports), list(results)),
        lines=tuple(line.samples for line in lines),
        initial=tuple(register.initial for register in registers),
        horizon=max((one.horizon for one in woven), default=0),
        delays=tuple(one.delay for one in woven),
        finish=max((one.finish for one in woven), default=0),
        units=tuple(bound.unit for bound in bounds),
    )


def _woven(requirement: Requirement, bound: Any, age: ca.SX, after: ca.SX, period: float) -> Woven:
    try:
        woven = weave(bound, age, after)
    except RequirementError as error:
        raise RequirementError(f"{requirement.id}: {error}", error.key) from None
    if woven.kept > MOST_KEPT:
        raise RequirementError(
            f"{requirement.id} needs {woven.kept} numbers of what has been, one for each sample of {period:g} s of its "
            f"inner intervals, and a monitor keeps {MOST_KEPT} at most; shorten them, or judge it in flights only",
            "formula",
        )
    return woven


@dataclass(frozen=True)
class Seen:
    """Say what a monitor knows of a requirement.

    Parameters
    ----------
    word : "open", "met" or "not met"; the latter two whatever may come.
    robustness : of the instants that could be judged by now; +-inf before there was one.
    """

    word: str
    robustness: float


class Monitor:
    """Watch requirements sample by sample.

    Parameters
    ----------
    requirements : with formulas.
    signals : layout of what there is to watch.
    period : from sample to sample [s].

    Raises
    ------
    RequirementError
        As `monitor_tape`.

    Examples
    --------
    >>> from casadi_gnc.signals import Signal
    >>> slow = Requirement("ACS-3", formula="always(rate <= 1) and eventually[0, 2](rate <= 0.5)")
    >>> monitor = Monitor([slow], Layout((Signal("rate"),)), 1.0)
    >>> [monitor.step(rate=rate)["ACS-3"].word for rate in (0.9, 0.4, 0.2, 1.5)]
    ['open', 'open', 'open', 'not met']
    """

    def __init__(self, requirements: Sequence[Requirement], signals: Layout, period: float) -> None:
        self._tape = monitor_tape(requirements, signals, period)
        buffer: Any
        buffer, self._run = self._tape.step.buffer()
        self._buffer, step = buffer, self._tape.step  # what runs points into it
        self._in = [np.zeros(step.numel_in(i)) for i in range(step.n_in())]
        self._out = [np.zeros(step.numel_out(i)) for i in range(step.n_out())]
        for columns, point in ((self._in, buffer.set_arg), (self._out, buffer.set_res)):
            for i, column in enumerate(columns):
                if column.size:
                    point(i, memoryview(column.data))
        self._lengths = np.array(self._tape.lines, dtype=int)
        self._firsts = np.cumsum(self._lengths) - self._lengths
        self.reset()

    def reset(self) -> None:
        """Forget everything, as before the first sample."""
        self._age, self._finished = 0, False
        self._in[4][:] = self._tape.initial
        self._line, self._at = np.zeros(self._lengths.sum()), np.zeros(len(self._lengths), dtype=int)

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of what `step` is given."""
        return self._tape.layout.names

    def step(self, **signals: Any) -> dict[str, Seen]:
        """Return what is known of each requirement after a sample, by its id.

        Parameters
        ----------
        signals : those that the formulas read, by name; others are not looked at.

        Raises
        ------
        RequirementError
            For a signal that is missing or of another size.
        """
        if self._finished:
            raise RequirementError("the monitor was told that the flight is over; `reset` begins anew")
        row = []
        for signal in self._tape.layout.signals:
            if signal.name not in signals:
                raise RequirementError(f"the monitor was given no {signal.name}; it reads {', '.join(self.signals)}")
            numbers = np.asarray(signals[signal.name], dtype=float).ravel()
            if numbers.size != signal.size:
                raise RequirementError(f"{signal.name} has {numbers.size} numbers, expected {signal.size}")
            row.extend(numbers)
        return self._seen(self.advance(np.array(row)))

    def finish(self) -> dict[str, Seen]:
        """Return what is known of each requirement when the flight is over: met or not met, as of the whole record.

        Raises
        ------
        RequirementError
            Before the first sample.
        """
        if not self._age:
            raise RequirementError("the monitor has seen no sample; `step` gives it one")
        found, last = np.zeros((2, len(self._tape.requirements))), self._in[0].copy()
        for after in range(1, self._tape.finish + 1):
            found = self.advance(last, after)
        self._finished = True
        return self._seen(found)

    def _seen(self, found: np.ndarray) -> dict[str, Seen]:
        robustness, verdicts = found
        return {
            one.id: Seen(WORDS[int(verdict)], unbounded(value))
            for one, value, verdict in zip(self._tape.requirements, robustness, verdicts, strict=True)
        }

    def advance(self, row: np.ndarray, after: int = 0) -> np.ndarray:
        """Take the next sample of the signals that are read, in order; return robustness and verdict, (2, R).

        `after` is the number of a step after the last sample, whose row does not matter.
        """
        (given, age, past_end, past, kept), (pushed, later, *found) = self._in, self._out
        places = self._firsts + self._at
        given[:], age[:], past[:] = row, min(self._age, self._tape.horizon), self._line[places]
        past_end[:] = after
        self._run()
        kept[:], self._line[places] = later, pushed
        self._at = (self._at + 1) % self._lengths
        self._age += 1
        return np.array(found)
