"""One sample of a scheme, composed once: flights, packages, analysis and linearisation are slices of it.

    measure -> accept -> (estimate) -> command -> clip -> allocate -> judge -> (modulate) -> advance

=========  ==================================================================  ==============================
slice      what                                                                name in the code
=========  ==================================================================  ==============================
start      y -> m, the law's memory at the first measurement                   started
sense      t, x, noise -> y                                                    sensed
before     t, y, good, m, actuators -> accepted, memory, wanted, limited,      before
           lower, upper, flags: all that comes before the allocation
allocate   accepted, limited, actuators, lower, upper -> actuators             allocated
judge      accepted, limited, actuators -> flags, once these are known         judged
modulate   asked, memory -> actuators, memory, where actuators make pulses     modulated
after      t, accepted, memory, wanted, limited, actuators -> memory           remembered
plant      t, x, actuators, noise -> x, one Runge-Kutta step                   stepped
=========  ==================================================================  ==============================

`wanted` is the law's command, `limited` the same inside the virtual-control box, `actuators` what they are
told, `good` the last accepted measurement. Of these, before, allocate, judge, modulate and after fly. Every law and
every plant fits: what one leaves out is empty.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import casadi as ca

from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array, is_number
from casadi_gnc.mathematics.integrators import runge_kutta
from casadi_gnc.mathematics.jumps import Timed
from casadi_gnc.missions import asking
from casadi_gnc.missions.modulated import Modulated
from casadi_gnc.missions.scheme import Scheme
from casadi_gnc.missions.wrapped import advanced
from casadi_gnc.status import StepStatus

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission

#: Share of the virtual-control limit that may be missing before a step reports EFFORT_SHORT.
SHORTAGE = 0.05
#: Magnitude beyond which no state of a craft is true; false for NaN too.
CREDIBLE = 1e12


class Symbols:
    """The columns of one sample, an SX each, by the name that ports have."""

    def __init__(self, mission: Mission, scheme: Scheme) -> None:
        plant, rows = mission.truth, scheme.actuation.effort.size
        self.t = ca.SX.sym("t")
        self.x = plant.state.symbol("x")
        self.y = plant.measurement.symbol("y")
        self.good = plant.measurement.symbol("good")
        self.m = scheme.flown.memory.symbol("m")
        self.actuators = plant.inputs.symbol("actuators")
        self.noise = plant.noise.symbol("noise")
        self.wanted, self.limited = ca.SX.sym("wanted", rows), ca.SX.sym("limited", rows)
        self.lower, self.upper = plant.inputs.symbol("lower"), plant.inputs.symbol("upper")

    def ports(self, *names: str) -> dict[str, ca.SX]:
        """Return some of the columns by name, in order."""
        return {name: getattr(self, name) for name in names}


class Loop:
    """Compose one sample of a mission's scheme out of plant, law and actuation.

    `averaged` takes the plant as linear analysis does. The methods take CasADi columns and return expressions. An
    answer of a plant or a law that does not fit is
    a `LawError` naming class and method.
    """

    def __init__(self, mission: Mission, scheme: Scheme, *, averaged: bool = False) -> None:
        self.mission, self.scheme = mission, scheme
        self.plant, self.law, self.actuation = mission.truth, scheme.flown, scheme.actuation
        if averaged:
            self.plant = self.plant.averaged()

    def symbols(self) -> Symbols:
        """Return fresh columns of one sample."""
        return Symbols(self.mission, self.scheme)

    # What the craft does.

    def sensed(self, t: Any, x: Any, noise: Any) -> Any:
        """Return what the sensors say, a column of the plant's measurement."""
        y = asking.ask(self.plant, "measure", t, x, noise)
        return asking.column(self.plant, "measure", y, self.plant.measurement)

    def moved(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x'."""
        rate = asking.ask(self.plant, "rate", t, x, actuators, noise)
        return asking.column(self.plant, "rate", rate, self.plant.state)

    def stepped(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x one substep later, by one Runge-Kutta step under held actuators and noise.

        All stages are on the same side of what jumps in time: that of the middle.
        """
        step = self.mission.timing.sample_period / self.mission.timing.substeps
        timed, middle = self._rate, t + step / 2

        def rate(at: Any, state: Any) -> Any:
            return timed.at(at, middle, {"x": state, "actuators": actuators, "noise": noise})

        return runge_kutta(rate, t, x, step)

    @cached_property
    def _rate(self) -> Timed:
        s = self.symbols()
        return Timed(self.moved(s.t, s.x, s.actuators, s.noise), s.t, s.ports("x", "actuators", "noise"))

    def decisions(self, t: Any) -> ca.SX:
        """Return what plant and law decide on time within an integration step, at a time [s], (K, 1)."""
        if self.mission.timing.mode == "sampled":
            return self._rate.decisions(t)
        s = self.symbols()
        memory, wanted = self.commanded(s.t, self.seen(s.y), s.m)
        made = ca.SX.sym("made", self.actuation.effort.size)
        flowing = self.flowing(s.t, self.seen(s.y), memory, wanted, made)
        slope = ca.vertcat(self.sensed(s.t, s.x, s.noise), wanted, self.moved(s.t, s.x, s.actuators, s.noise), flowing)
        columns = {**s.ports("x", "y", "m", "actuators", "noise"), "made": made}
        return Timed(slope, s.t, columns).decisions(t)

    def held(self, t: Any, x: Any, actuators: Any, noise: Any) -> Any:
        """Return x one sample period later, its representation as it comes."""
        h = self.mission.timing.sample_period / self.mission.timing.substeps
        for i in range(self.mission.timing.substeps):
            x = self.stepped(t + i * h, x, actuators, noise)
        return x

    def settled(self, x: Any) -> Any:
        """Return the same physical state in the representation kept between steps."""
        return asking.column(self.plant, "settle", asking.ask(self.plant, "settle", x), self.plant.state)

    # What the flight software does.

    def seen(self, y: Any) -> Any:
        """Return those rows of the measurement that the law reads, in its order."""
        parts = self.plant.measurement.split(y)
        return ca.vertcat(*(getattr(parts, name) for name in self.law.inputs.names))

    def started(self, t: Any, y: Any) -> Any:
        """Return the law's memory at the first measurement."""
        return asking.column(self.law, "start", asking.ask(self.law, "start", t, self.seen(y)), self.law.memory)

    def accepted(self, y: Any, good: Any) -> tuple[Any, Any]:
        """Return the measurement with each incredible signal replaced by its last good value, and a flag.

        The comparison |y| <= limit is false for NaN, whatever the limit.
        """
        layout, accepted, flag = self.plant.measurement, [], ca.SX(0)
        for signal in layout.signals:
            rows = layout.place(signal.name)
            limit = min(signal.limit, 1e150) if is_number(signal.limit) else signal.limit
            credible = bounds.all_of(ca.fabs(y[rows]) <= limit)
            # Before there is a good value, or if it was lost, zero is the last resort.
            last = ca.if_else(ca.fabs(good[rows]) <= limit, good[rows], 0.0)
            accepted.append(ca.if_else(credible, y[rows], last))
            flag = ca.logic_or(flag, ca.logic_not(credible))
        return ca.vertcat(*accepted), flag

    def _sound_memory(self, t: Any, seen: Any, m: Any) -> tuple[Any, Any]:
        """Return the memory, or a fresh one where some of it is not credible, and a flag for that."""
        law = self.law
        if not law.memory.size:
            return m, ca.SX(0)
        sound = bounds.all_of(ca.fabs(m) <= CREDIBLE)
        fresh = asking.column(law, "start", asking.ask(law, "start", t, seen), law.memory)
        return ca.if_else(sound, m, ca.SX(fresh)), ca.logic_not(sound)

    def commanded(self, t: Any, seen: Any, m: Any) -> tuple[Any, Any]:
        """Return the memory after what changes at once at a sample, and the law's command."""
        law = self.law
        memory = asking.column(law, "jump", asking.ask(law, "jump", t, seen, m), law.memory)
        asked = asking.ask(law, "command", t, seen, memory)
        return memory, asking.column(law, "command", asked, self.actuation.effort)

    def before(self, t: Any, y: Any, good: Any, m: Any, actuators: Any) -> dict[str, Any]:
        """Return what one sample computes before the allocation."""
        law, actuation = self.law, self.actuation
        accepted, replaced = self.accepted(y, good)
        seen = self.seen(accepted)
        kept, lost = self._sound_memory(t, seen, m)
        memory, asked = self.commanded(t, seen, kept)
        wanted = ca.if_else(ca.fabs(asked) <= CREDIBLE, asked, 0.0)
        below, above = array(actuation.limit_below), array(actuation.limit_above)
        limited = bounds.clip(wanted, below, above)
        flags = {
            StepStatus.MEASUREMENT_REPLACED: replaced,
            StepStatus.COMMAND_LIMITED: bounds.outside(wanted, below, above),
            StepStatus.MEMORY_RESET: lost,
            StepStatus.COMMAND_REPLACED: ca.logic_not(bounds.all_of(ca.fabs(asked) <= CREDIBLE)),
            **asking.flags(law, "status", asking.ask(law, "status", t, seen, memory)),
        }
        lower, upper = self.box(accepted, actuators)
        return {
            "accepted": accepted,
            "memory": memory,
            "wanted": wanted,
            "limited": limited,
            "lower": lower,
            "upper": upper,
            "flags": weighed(flags),
        }

    def box(self, y: Any, previous: Any) -> tuple[Any, Any]:
        """Return the bounds of the actuators in this sample; the amplitude box wins over all others."""
        actuation, period = self.actuation, self.mission.timing.sample_period
        lower, upper = ca.SX(array(actuation.lower)), ca.SX(array(actuation.upper))
        if actuation.reach is not None:
            least, most = actuation.reach(self.plant.measurement.split(y), period)
            lower, upper = bounds.clip(least, lower, upper), bounds.clip(most, lower, upper)
        if actuation.rate < float("inf"):
            reach = actuation.rate * period
            least, most = bounds.clip(previous - reach, lower, upper), bounds.clip(previous + reach, lower, upper)
            lower, upper = least, most
        return lower, upper

    def allocated(self, y: Any, limited: Any, previous: Any, lower: Any, upper: Any) -> Any:
        """Return what the actuators are told, (N,), where the allocation is an expression."""
        actuation, seen = self.actuation, self.plant.measurement.split(y)
        asked = limited if actuation.inverse is None else actuation.inverse(seen, limited)
        return actuation.allocator.expression(asked, previous, lower, upper, actuation.matrix(seen))

    def modulated(self, asked: Any, memory: Any) -> tuple[Any, Any]:
        """Return what the actuators are told, (N,), and the memory, for what the allocation asks of them."""
        if not isinstance(self.law, Modulated):
            return asked, memory
        own, carried = self.law.split(memory)
        modulation, period = self.law.modulation, self.mission.timing.sample_period
        told, left = modulation(asked, modulation.memory.split(carried), period)
        return told, ca.vertcat(own, left)

    def made(self, y: Any, actuators: Any) -> Any:
        """Return the effort that the actuators make as far as the flight software knows, (R,)."""
        return ca.mtimes(self.actuation.matrix(self.plant.measurement.split(y)), actuators)

    def achieved(self, y: Any, limited: Any, actuators: Any) -> Any:
        """Return the effort that the law is told was made, (R,)."""
        return limited if self.scheme.feedback == "wanted" else self.made(y, actuators)

    def judgement(self, y: Any, limited: Any, actuators: Any) -> dict[StepStatus, Any]:
        """Return the flags that the flight software raises once it knows what the actuators will do, by bit."""
        actuation = self.actuation
        limits = bounds.maximum(-array(actuation.limit_below), array(actuation.limit_above))
        missing = ca.fabs(limited - self.made(y, actuators))
        flags = {StepStatus.EFFORT_SHORT: bounds.any_of(missing > SHORTAGE * limits)}
        if actuation.judge is not None:
            flags.update(actuation.judge(self.plant.measurement.split(y), limited, actuators))
        return flags

    def judged(self, y: Any, limited: Any, actuators: Any) -> Any:
        """Return the sum of those flags."""
        return weighed(self.judgement(y, limited, actuators))

    def remembered(self, t: Any, y: Any, memory: Any, wanted: Any, limited: Any, actuators: Any) -> Any:
        """Return the memory one sample later."""
        return self.advanced(t, self.seen(y), memory, wanted, self.achieved(y, limited, actuators))

    def advanced(self, t: Any, seen: Any, memory: Any, wanted: Any, achieved: Any) -> Any:
        """Return the memory one sample later, told what was achieved."""
        self.flowing(t, seen, memory, wanted, achieved)
        return advanced(self.law, t, seen, memory, wanted, achieved)

    def flowing(self, t: Any, seen: Any, memory: Any, wanted: Any, achieved: Any) -> Any:
        """Return d(memory)/dt."""
        rate = asking.ask(self.law, "rate", t, seen, memory, wanted, achieved)
        return asking.column(self.law, "rate", rate, self.law.memory)

    def controller(self, s: Symbols) -> dict[str, Any]:
        """Return all of one sample on board where the allocation is an expression."""
        first = self.before(s.t, s.y, s.good, s.m, s.actuators)
        y, limited = first["accepted"], first["limited"]
        asked = self.allocated(y, limited, s.actuators, first["lower"], first["upper"])
        told, memory = self.modulated(asked, first["memory"])
        later = self.remembered(s.t, y, memory, first["wanted"], limited, told)
        flags = first["flags"] + self.judged(y, limited, asked)
        return {**first, "actuators": told, "memory_next": later, "flags": flags}

    def raised(self) -> list[StepStatus]:
        """Return the bits that the controller can raise on board, in their order."""
        s, law = self.symbols(), self.law
        bits = {
            StepStatus.MEASUREMENT_REPLACED,
            StepStatus.COMMAND_LIMITED,
            StepStatus.COMMAND_REPLACED,
            *law.status(s.t, self.seen(s.y), s.m),
            *self.judgement(s.y, s.limited, s.actuators),
        }
        if law.memory.size:
            bits.add(StepStatus.MEMORY_RESET)
        if not self.actuation.is_symbolic:
            bits |= {StepStatus.ALLOCATION_INEXACT, StepStatus.ALLOCATION_FAILED}
        return [bit for bit in StepStatus if bit in bits]


def weighed(flags: dict[StepStatus, Any]) -> Any:
    """Return the sum of flags, each by the value of its bit."""
    return sum(bit.value * flag for bit, flag in flags.items())
