"""Thrusters that fire: pulses that begin late, force that rises, impulse and propellant.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
F           force told for a sample: where there are pulses, their mean over it, [N]
t_on        F h/F_max, width of the pulse, [s]; h: sample period
l           delay from the sample to the pulse, [s]
u           force of the open valve, its mean over a step of the integrator, [N]
f, tau      force of the thruster, [N], and the time in which it rises to 63 % and falls to 37 %, [s]
p, m        impulse delivered, [N s], and propellant used, [kg]
==========  ====================================================================================

    tau f' = u - f,    p' = f,    m' = sum f/(I_sp g_0)

A pulse begins and ends within a step of the integrator, whose slopes would have to jump there. So u is the share of the
step in which the valve is open, times F_max: constant over the step, which therefore keeps its order, and exact in
its impulse whatever the widths. Decisions on time are taken in the step's middle (`casadi_gnc.mathematics.jumps`).
A pulse that begins late may end in the next sample, so its width is remembered for one. The mass that leaves is told,
not taken from the body.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca

from casadi_gnc.errors import FlightError
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import array, is_number, is_zero
from casadi_gnc.mechanics.multibody import Action
from casadi_gnc.mechanics.satellite_parts import Thrusters
from casadi_gnc.signals import Layout, Signal

#: Standard gravity, [m/s^2], by definition.
STANDARD_GRAVITY = 9.80665
#: Force [N] that is none.
_NOTHING = 1e-30


@dataclass(frozen=True, eq=False)
class FiringThrusters(Thrusters):
    """N thrusters of which some make pulses, some rise slowly, and some count their propellant.

    Parameters
    ----------
    positions, directions : as for `Thrusters`.
    most : F_max, (N,), [N].
    rise : tau, (N,), [s]; 0: at once.
    specific_impulse : I_sp, (N,), [s]; 0: propellant is not counted.
    pulsed : whether each makes pulses, (N,).
    delay : l, (N,), [s], shorter than h.
    period, step : h and the integrator's step, [s], as a mission sets them.
    mean : whether pulses, delay and rise are left out, for linear analysis: the force is what is told.
    """

    most: Any
    rise: Any
    specific_impulse: Any
    pulsed: tuple[bool, ...]
    delay: Any
    period: float = 0.0
    step: float = 0.0
    mean: bool = False

    def __post_init__(self) -> None:
        for late in array(self.delay).elements():
            if self.period and is_number(late) and not float(late) < self.period:
                raise FlightError(
                    f"a pulse begins {float(late):g} s late, expected less than the sample period, {self.period:g} s"
                )

    def timed(self, period: float, step: float) -> FiringThrusters:
        """Return them with h and the integrator's step; raise `FlightError` for pulses without samples."""
        if any(self.pulsed) and not period:
            raise FlightError('thrusters make one pulse a sample; fly in mode "sampled"')
        return replace(self, period=period, step=step)

    def averaged(self) -> FiringThrusters:
        """Return them without pulses, delay and rise."""
        return replace(self, mean=True)

    @property
    def _slow(self) -> list[int]:
        return [i for i, each in enumerate(array(self.rise).elements()) if not is_zero(each)]

    @property
    def _late(self) -> list[int]:
        late = array(self.delay).elements()
        return [i for i, own in enumerate(self.pulsed) if own and not is_zero(late[i])]

    @property
    def _counts(self) -> bool:
        return any(not is_zero(each) for each in array(self.specific_impulse).elements())

    @property
    def state(self) -> Layout:
        """Forces that rise, widths of pulses that begin late (of this sample so far, of the last), p and m."""
        slow, late, count = len(self._slow), len(self._late), len(self.pulsed)
        return Layout(
            (
                *((Signal("thrust", slow, "N"),) if slow else ()),
                *((Signal("pulse_begun", late, "s"), Signal("pulse_left", late, "s")) if late else ()),
                Signal("impulse", count, "N s"),
                *((Signal("propellant", 1, "kg"),) if self._counts else ()),
            )
        )

    def start(self) -> dict[str, Any]:
        """Return rest."""
        return {signal.name: [0.0] * signal.size for signal in self.state.signals}

    def _opened(self, t: Any, own: Any, told: Any) -> Any:
        """Return u, (N,)."""
        if self.mean or not any(self.pulsed):
            return told.force
        first = self._first(t)
        last, made, late = first + self.step, [], self._late
        delays, most = array(self.delay).elements(), array(self.most).elements()
        for i, pulsed in enumerate(self.pulsed):
            if not pulsed:
                made.append(told.force[i])
                continue
            begun = delays[i] + told.force[i] * self.period / most[i]
            open_for = bounds.clip(begun, first, last) - bounds.clip(delays[i], first, last)
            if i in late:
                rest = delays[i] + own.pulse_left[late.index(i)] - self.period
                open_for = open_for + bounds.clip(rest, first, last) - first
            made.append(most[i] / self.step * open_for)
        return ca.vertcat(*made)

    def _first(self, t: Any) -> Any:
        """Return where the integrator's step begins in its sample, [s]: a whole number of steps."""
        steps = round(self.period / self.step)
        if steps == 1:
            return ca.SX(0)
        count = ca.floor(t / self.step)
        return self.step * (count - steps * ca.floor((count + 0.5) / steps))

    def thrust(self, t: Any, own: Any, told: Any) -> Any:
        """Return f, (N,)."""
        opened, slow = self._opened(t, own, told), self._slow
        if self.mean or not slow:
            return opened
        return ca.vertcat(*(own.thrust[slow.index(i)] if i in slow else opened[i] for i in range(len(self.pulsed))))

    def act(self, t: Any, own: Any, told: Any, around: Any) -> Action:
        """Return force, and torque about the origin."""
        force = self.thrust(t, own, told)
        return Action(ca.mtimes(self.directions, force), ca.mtimes(self.arms(ca.DM.zeros(3)), force))

    def drift(self, t: Any, own: Any, told: Any, around: Any) -> dict[str, Any]:
        """Return the rates of its state."""
        slow, late, force = self._slow, self._late, self.thrust(t, own, told)
        rates: dict[str, Any] = {"impulse": force}
        if slow:
            opened, rise = self._opened(t, own, told), array(self.rise)
            rates["thrust"] = ca.vertcat(*((opened[i] - own.thrust[k]) / rise[i] for k, i in enumerate(slow)))
        if late:
            most = array(self.most)
            # Over a sample the width of its pulse comes together: what remains of it begins the next.
            rates["pulse_begun"] = ca.vertcat(*(told.force[i] / most[i] for i in late))
            rates["pulse_left"] = ca.DM.zeros(len(late))
        if self._counts:
            speeds = [STANDARD_GRAVITY * each for each in array(self.specific_impulse).elements()]
            used = [force[i] / speed for i, speed in enumerate(speeds) if not is_zero(speed)]
            rates["propellant"] = sum(used)
        return rates

    def settle(self, own: Any) -> dict[str, Any]:
        """Return what changes between two samples: the pulse of this one becomes that of the last.

        A force that falls for ever would end among subnormal numbers, where half a slope has other words than the
        slope.
        """
        changed: dict[str, Any] = {}
        if self._slow:
            changed["thrust"] = ca.if_else(ca.fabs(own.thrust) < _NOTHING, 0.0, own.thrust)
        if self._late:
            changed |= {"pulse_begun": ca.DM.zeros(len(self._late)), "pulse_left": own.pulse_begun}
        return changed
