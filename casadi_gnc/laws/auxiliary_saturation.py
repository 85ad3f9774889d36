"""Shift a backstepping law's errors by what saturation cost, and take the shift back later.

=========  =========================================  ==================================
symbol     meaning                                    name in the code
=========  =========================================  ==================================
xi1, xi2   shift of the transformed error, of the     error_shift, rate_shift
           rate error, (n,)
Delta      achieved less wanted effort, (n,)          missing
K1, K21    decay of xi1, what xi2 adds to it          decay, coupling
K2         largest effort that unloads xi2            unloading
k          gain against what xi1 and xi2 do           sqrt of memory `gain`
b, b1, b2  growth, decay and softness of k            growth, threshold, softness
=========  =========================================  ==================================

    xi1' = -K1 xi1 + K21 xi2                                                          (28), (66)
    M^ xi2' = -K2 tanh(xi2/2) + Delta                                                 (29), (67)
    effort -= K2 tanh(xi2/2) + (1 + k) x2 c/(|x2|^2 + b2),    c = |xi1' K21 xi2|      (42), (77)
    z' = 2 b (k |x2|^2 - b1) c/(|x2|^2 + b2),    k = sqrt(z),    z >= 0               (46), (80)

The paper integrates k itself: k' = b/k (...) is singular where k reaches zero, which it does in
half a second of its own manoeuvre, and restarts from there for ever. z = k^2 has the same rate
without the singularity. The proof needs b1 >= b2.

xi2 is not in the proof's V. Nothing bounds it when |Delta| stays above K2: xi1 then steers the
error *to* the wall of the funnel it should keep. So there are three ways to treat saturation:

* the printed system, which counts every newton and promises nothing beyond |Delta| < K2;
* `counted` c < 1: Delta counts as clipped to c K2, so |xi2| <= 2 atanh(c), and |xi1| after it;
* `NoAuxiliary`: the clipped command alone, xi1 = xi2 = 0.

Source: Tao, Zhang (2019), doi:10.16356/j.1005-1120.2019.04.008.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import casadi as ca

from casadi_gnc.checks import Check, sufficient
from casadi_gnc.mathematics import bounds
from casadi_gnc.mathematics.exact import is_number

#: Time [s] of saturation that a manoeuvre should at least be able to have.
_LASTING = 1.0


@dataclass(frozen=True, eq=False)
class AuxiliarySaturation:
    """Carry the shifts in a memory with the fields `error_shift`, `rate_shift` and `gain`.

    Parameters
    ----------
    decay, coupling, unloading : K1 [1/s], K21 [1/s per rate unit], K2 [unit of the effort].
    growth, threshold, softness : b, b1, b2.
    first_gain : k(0) > 0.
    counted : share of K2 up to which missing effort counts; None counts all.
    singular_gain : integrate k as printed instead of its square.
    """

    decay: Any
    coupling: Any
    unloading: Any
    growth: Any
    threshold: Any
    softness: Any
    first_gain: Any
    counted: Any = None
    singular_gain: bool = False

    @property
    def start(self) -> Any:
        """Return the first value of the memory `gain`."""
        return self.first_gain if self.singular_gain else self.first_gain**2

    def checks(self, part: str) -> Iterator[Check]:
        """Yield the proof's condition on b1, and how long the printed k stays away from where its rate is singular."""
        numbers = (self.threshold, self.softness, self.growth, self.first_gain)
        if not all(map(is_number, numbers)):
            return
        yield sufficient(f"gains.auxiliary_threshold.{part}", self.threshold, self.softness, "-", "b1 >= b2")
        if self.singular_gain:
            yield Check(
                f"gains.auxiliary_gain.{part}",
                self.first_gain**2 / (2 * self.growth * self.threshold),
                _LASTING,
                "s",
                "fail",
                "The auxiliary gain k falls to zero, and its printed rate divides by it: from there it jumps for ever.",
                "Take gain_singular out of as_printed: the square of k has the same rate without the division.",
                "time after which k is zero while the errors rest and c/b2 is one",
                at_least=True,
            )

    def gain(self, memory: Any) -> Any:
        """Return k."""
        return memory.gain if self.singular_gain else ca.sqrt(bounds.maximum(memory.gain, 0.0))

    def pull(self, memory: Any) -> Any:
        """Return K1 xi1 - K21 xi2, (n,): -xi1'."""
        return self.decay * memory.error_shift - self.coupling * memory.rate_shift

    def unload(self, memory: Any) -> Any:
        """Return K2 tanh(xi2/2), (n,), unit of the effort."""
        return self.unloading * ca.tanh(memory.rate_shift / 2)

    def counts(self, missing: Any) -> Any:
        """Return what of the missing effort drives xi2, (n,)."""
        if self.counted is None:
            return missing
        most = self.counted * self.unloading
        return bounds.clip(missing, -most, most)

    def weight(self, memory: Any, x2: Any) -> Any:
        """Return c/(|x2|^2 + b2)."""
        return ca.fabs(self.coupling * ca.dot(memory.error_shift, memory.rate_shift)) / (ca.sumsqr(x2) + self.softness)

    def damping(self, memory: Any, x2: Any) -> Any:
        """Return (1 + k) x2 c/(|x2|^2 + b2), (n,), unit of the effort."""
        return (1 + self.gain(memory)) * self.weight(memory, x2) * x2

    def gain_rate(self, memory: Any, x2: Any) -> Any:
        """Return the rate of the memory `gain`."""
        k = self.gain(memory)
        power = self.growth * (k * ca.sumsqr(x2) - self.threshold) * self.weight(memory, x2)
        if self.singular_gain:
            return ca.if_else(k != 0, power / ca.if_else(k != 0, k, 1.0), self.softness)
        return ca.if_else(memory.gain > 0, 2 * power, bounds.maximum(2 * power, 0.0))


class NoAuxiliary:
    """Let a clipped command be clipped: no shifts."""

    start = 0.0

    def gain(self, memory: Any) -> Any:
        """Return no gain."""
        return 0.0

    def pull(self, memory: Any) -> Any:
        """Return no pull."""
        return ca.DM.zeros(3)

    def unload(self, memory: Any) -> Any:
        """Return no effort."""
        return ca.DM.zeros(3)

    def counts(self, missing: Any) -> Any:
        """Return that nothing counts."""
        return ca.DM.zeros(3)

    def damping(self, memory: Any, x2: Any) -> Any:
        """Return no effort."""
        return ca.DM.zeros(3)

    def gain_rate(self, memory: Any, x2: Any) -> Any:
        """Return no rate."""
        return 0.0
