"""Pulses that are chosen together: the cheapest three thrusters make the effort of a sample, their widths by one merit.

==========  ====================================================================================
symbol      meaning
==========  ====================================================================================
A           effort of each thruster per force, (3, N)
p           price of a thruster's impulse, 1 for the dearest
U           effort impulse that is wanted of a sample, with what was not delivered before
v           impulses of three thrusters that make U, [N s]
l           their dual prices (`thruster_triples`)
I, e        impulses of the pulses, [N s], and the effort impulse that they leave, U - A I
b_i         least bit of a thruster: F_max max(least width, quantum), [N s]
==========  ====================================================================================

**Relaxation.** Without least widths the cheapest impulses that make U solve a linear program; of its triples that may
be open together the one of least cost p' v with v >= 0 is taken.

**Rounding.** Each of the three widths goes down or up to the next one there is; of the eight the one of least

    p' I + K |e|_1,    K the largest |l|_inf of all triples,

is made. Were it the least of all pulses there are, it would be a mixed-integer optimum: what spends less leaves more.

**Half a least bit.** The nearest widths leave e = sum A_i d_i with |d_i| <= b_i/2: e is in the zonotope of the half
least bits of all thrusters. The best of the eight is asked whether it is, by every facet; if not, the nearest widths
are made. So e stays in the zonotope whatever valves forbid, as long as no thruster of the triple is asked for more than
a whole sample. Where one is, pulses are made one by one of what each thruster is asked for (`PulseModulation`).

**Bound.** Any pulses that the valves allow, of an error of |e|_1 or less, cost at least p' v - K |e|_1, by the duals,
and at least the cheapest pulse where |e|_1 < |U|_1. `pulse_surplus` is what was spent above that.

What is carried over, c = v - I, is kept thruster by thruster, but stands for its effort: U = A (F h + c) next time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import casadi as ca

from casadi_gnc.allocation.pulses import Pulse, PulseModulation, Valves
from casadi_gnc.allocation.thruster_triples import Column, Triple, dot, facets, triples
from casadi_gnc.errors import AllocationError
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import is_number
from casadi_gnc.signals import Layout, Signal

#: Triples that are looked at on board at most: the code grows with their number.
MOST_TRIPLES = 128
_ZERO = 1e-9  # of a least bit, or of the zonotope: rounding


@dataclass(frozen=True, eq=False, kw_only=True)
class JointPulses(PulseModulation):
    """Make pulses that are chosen together.

    Parameters
    ----------
    columns : of A, of each actuator that makes pulses, three numbers each.
    prices : p, of each of them, positive.

    Raises
    ------
    AllocationError
        For numbers that vary, pulses without a least bit or that carry nothing over, fewer than three open valves,
        thrusters that cannot push along every axis, or more triples than `MOST_TRIPLES`.
    """

    columns: Sequence[Column]
    prices: Sequence[float]

    def __post_init__(self) -> None:
        widths = [value for pulse in self._made.values() for value in (pulse.least_on, pulse.quantum)]
        numbers = [*(value for column in self.columns for value in column), *self.prices, *self.most, *widths]
        if not all(map(is_number, numbers)):
            raise AllocationError("pulses chosen together are set up for fixed numbers; choose each to vary them")
        for i, pulse in self._made.items():
            if not pulse.carries or max(pulse.least_on, pulse.quantum) <= 0:
                lack = "least bit" if pulse.carries else "carry"
                raise AllocationError(f"actuator {i + 1} makes pulses without {lack}; chosen together they need one")
        opened, found = self.valves.open_at_most, self._triples
        if opened is not None and opened < 3:
            raise AllocationError(f"at most {opened} valves open, expected 3 or more for pulses chosen together")
        if not found:
            raise AllocationError("no three thrusters that may be open together make an effort along every axis")
        if len(found) > MOST_TRIPLES:
            told = f"{len(found)} triples of thrusters, expected {MOST_TRIPLES} at most"
            raise AllocationError(f"pulses chosen together would look at {told}; choose each")

    @property
    def _made(self) -> dict[int, Pulse]:
        return {i: pulse for i, pulse in enumerate(self.pulses) if pulse is not None}

    @cached_property
    def _triples(self) -> list[Triple]:
        places = list(self._made)
        pairs = tuple((places.index(i), places.index(j)) for i, j in self.valves.never_together)
        return triples(self.columns, self.prices, Valves(pairs))

    @property
    def _bits(self) -> list[float]:
        """Least bits, [N s]."""
        return [self.most[i] * max(pulse.least_on, pulse.quantum) for i, pulse in self._made.items()]

    @property
    def memory(self) -> Layout:
        """Return c of each actuator that makes pulses, and what was spent above the bound, by price."""
        return Layout((*super().memory.signals, Signal("pulse_surplus", 1, "N s")))

    def __call__(self, asked: Any, carried: Any, period: float) -> tuple[Any, Any]:
        """Return what the actuators are told, (N,), c' and the surplus, for what is asked of them, (N,)."""
        told, left = super().__call__(asked, carried, period)
        told, places = told.elements(), list(self._made)
        wanted = [asked[i] * period + carried.impulse_carry[k] for k, i in enumerate(places)]
        effort = self._effort(wanted)
        chosen, v, exists = self._cheapest(effort)
        ours = [[number == k for k in range(len(places))] for number in chosen]
        most = [_of(own, [self.most[i] * period for i in places]) for own in ours]
        fits = bounds.all_of(ca.vertcat(exists, *(a <= b for a, b in zip(v, most, strict=True))))
        impulses = self._rounded(effort, v, ours, period)
        rest, made = [a - b for a, b in zip(v, impulses, strict=True)], []
        for k, i in enumerate(places):
            told[i] = ca.if_else(fits, _sum(ours, impulses, k) / period, told[i])
            made.append(told[i] * period)
        carry = [ca.if_else(fits, _sum(ours, rest, k), left[k]) for k in range(len(places))]
        prices = [_of(own, self.prices) for own in ours]
        least = ca.if_else(exists, dot(prices, v), 0)
        return ca.vertcat(*told), ca.vertcat(*carry, self._surplus(effort, made, least))

    def _effort(self, impulses: Sequence[Any]) -> list[Any]:
        return [sum(a[r] * x for a, x in zip(self.columns, impulses, strict=True)) for r in range(3)]

    @cached_property
    def _error_price(self) -> float:
        """K."""
        return max(abs(value) for triple in self._triples for value in triple.dual)

    def _cheapest(self, effort: list[Any]) -> tuple[list[Any], list[Any], Any]:
        """Return the triple's thrusters, v, and whether there is one."""
        chosen, v, least, exists = [ca.SX(0)] * 3, [ca.SX(0)] * 3, ca.SX(0), ca.SX(0)
        near = -_ZERO * min(self._bits)
        for triple in self._triples:
            own = [dot(row, effort) for row in triple.inverse]
            cost = dot([self.prices[i] for i in triple.thrusters], own)
            better = ca.logic_or(ca.logic_not(exists), cost < least)
            for value in own:
                better = ca.logic_and(better, value >= near)
            chosen = [ca.if_else(better, new, old) for new, old in zip(triple.thrusters, chosen, strict=True)]
            v = [ca.if_else(better, new, old) for new, old in zip(own, v, strict=True)]
            least, exists = ca.if_else(better, cost, least), ca.logic_or(exists, better)
        return chosen, [bounds.maximum(value, 0) for value in v], exists

    def _rounded(self, effort: list[Any], v: list[Any], ours: list[list[Any]], period: float) -> list[Any]:
        """Return the impulses of the triple's pulses."""
        columns = [[_of(own, [column[r] for column in self.columns]) for r in range(3)] for own in ours]
        prices, options, nearest = [_of(own, self.prices) for own in ours], [], []
        for own, impulse in zip(ours, v, strict=True):
            low, high = self._neighbours(impulse, own, period)
            options.append((low, high))
            nearest.append(ca.if_else(impulse - low < high - impulse, low, high))
        best, least, left = nearest, ca.SX(0), effort
        for number, impulses in enumerate(product(*options)):
            e = [effort[r] - dot([column[r] for column in columns], impulses) for r in range(3)]
            merit = dot(prices, impulses) + self._error_price * _length(e)
            better = merit < least if number else ca.SX(1)
            best = [ca.if_else(better, new, old) for new, old in zip(impulses, best, strict=True)]
            left = [ca.if_else(better, new, old) for new, old in zip(e, left, strict=True)]
            least = ca.if_else(better, merit, least)
        halves = [bit / 2 for bit in self._bits]
        inside = [ca.fabs(dot(normal, left)) <= 1 + _ZERO for normal in facets(self.columns, halves)]
        kept = bounds.all_of(ca.vertcat(*inside))
        return [ca.if_else(kept, new, old) for new, old in zip(best, nearest, strict=True)]

    def _neighbours(self, impulse: Any, own: list[Any], period: float) -> tuple[Any, Any]:
        """Return the impulses of the next widths, down and up."""
        pulses = self._made.values()
        force, least = _of(own, [self.most[i] for i in self._made]), _of(own, [each.least_on for each in pulses])
        width = impulse / force
        low = high = width
        if any(each.quantum > 0 for each in pulses):
            fine = _of(own, [each.quantum for each in pulses])
            any_width = _of(own, [float(each.quantum <= 0) for each in pulses])
            step = ca.if_else(any_width, 1, fine)
            steps = ca.floor(width / step)
            low, high = (ca.if_else(any_width, width, step * count) for count in (steps, steps + 1))
        short = width < least
        low = ca.if_else(short, 0, bounds.maximum(low, least))
        high = ca.if_else(short, least, bounds.clip(high, least, period))
        return force * low, force * high

    def _surplus(self, effort: list[Any], made: list[Any], least: Any) -> Any:
        left = _length([u - x for u, x in zip(effort, self._effort(made), strict=True)])
        shortest = [pulse.least_on or pulse.quantum for pulse in self._made.values()]
        forces = [self.most[i] for i in self._made]
        pulse = min(p * f * t for p, f, t in zip(self.prices, forces, shortest, strict=True))
        bound = bounds.maximum(least - self._error_price * left, ca.if_else(left < _length(effort), pulse, 0))
        return sum(p * x for p, x in zip(self.prices, made, strict=True)) - bound


def _of(own: Sequence[Any], values: Sequence[Any]) -> Any:
    """Return the value of the thruster that is flagged."""
    if len(set(values)) == 1:
        return values[0]
    return sum(ca.if_else(flag, value, 0) for flag, value in zip(own, values, strict=True))


def _sum(ours: Sequence[Sequence[Any]], values: Sequence[Any], k: int) -> Any:
    """Return what thruster k has of the triple's values."""
    return sum(ca.if_else(own[k], value, 0) for own, value in zip(ours, values, strict=True))


def _length(e: Sequence[Any]) -> Any:
    """Return |e|_1."""
    return ca.fabs(e[0]) + ca.fabs(e[1]) + ca.fabs(e[2])
