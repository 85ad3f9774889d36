"""Words of a processor as known numbers, or as multiples of unknown ones that lie in an interval."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

LEAST, MOST = -(1 << 31), (1 << 31) - 1


@dataclass(frozen=True)
class Unknown:
    """Hold times * unknown + plus."""

    which: int
    times: int = 1
    plus: int = 0


#: A word: a number in -2^31..2^31-1, or what is not known.
Value: TypeAlias = int | Unknown
Narrowed: TypeAlias = dict[int, tuple[int, int]]


def word(number: int) -> int:
    """Return a number as a word with sign."""
    return (number + (1 << 31)) % (1 << 32) - (1 << 31)


class Values:
    """Make unknown words, and reckon with them; `narrowed` are the intervals that a way through the program knows."""

    def __init__(self) -> None:
        self._limits: list[tuple[int, int]] = []

    def fresh(self, low: int = LEAST, high: int = MOST) -> Value:
        """Return a new unknown of an interval."""
        if low == high:
            return low
        self._limits.append((max(low, LEAST), high))
        return Unknown(len(self._limits) - 1)

    def limits(self, value: Value, narrowed: Narrowed) -> tuple[int, int]:
        """Return the interval of a word; all words where it may have wrapped around."""
        if isinstance(value, int):
            return value, value
        low, high = narrowed.get(value.which) or self._limits[value.which]
        one, other = value.times * low + value.plus, value.times * high + value.plus
        low, high = (one, other) if one <= other else (other, one)
        return (low, high) if low >= LEAST and high <= MOST else (LEAST, MOST)

    def plus(self, a: Value, b: Value, narrowed: Narrowed) -> Value:
        """Return a + b modulo 2^32."""
        if isinstance(a, int) and isinstance(b, int):
            return word(a + b)
        if isinstance(a, int):
            a, b = b, a
        assert isinstance(a, Unknown)
        if isinstance(b, int):
            return Unknown(a.which, a.times, a.plus + b)
        if a.which == b.which:
            times = a.times + b.times
            return Unknown(a.which, times, a.plus + b.plus) if times else word(a.plus + b.plus)
        (low, high), (low_b, high_b) = self.limits(a, narrowed), self.limits(b, narrowed)
        if low + low_b < LEAST or high + high_b > MOST:
            return self.fresh()
        return self.fresh(low + low_b, high + high_b)

    def times(self, value: Value, factor: int, narrowed: Narrowed) -> Value:
        """Return a product with a number modulo 2^32."""
        if isinstance(value, int):
            return word(value * factor)
        return Unknown(value.which, value.times * factor, value.plus * factor) if factor else 0

    def holds(self, condition: str, a: Value, b: Value, narrowed: Narrowed) -> bool | None:
        """Tell whether a comparison of a with b comes out so; None where that is not known."""
        difference = self.plus(a, self.times(b, -1, narrowed), narrowed)
        if condition in ("eq", "ne"):
            low, high = self.limits(difference, narrowed)
            never = low > 0 or high < 0
            if isinstance(difference, Unknown) and (low, high) != (LEAST, MOST):
                never = never or difference.plus % difference.times != 0  # its steps miss zero
            return (condition == "ne") if never else (condition == "eq") if low == high == 0 else None
        (low, high), (low_b, high_b) = self.limits(a, narrowed), self.limits(b, narrowed)
        least, most = low - high_b, high - low_b
        if isinstance(difference, int) and (LEAST, MOST) not in ((low, high), (low_b, high_b)):
            least = most = difference
        if condition in ("cs", "cc", "hi", "ls"):
            if low < 0 or low_b < 0:
                if not (isinstance(a, int) and isinstance(b, int)):
                    return None
                least = most = (a & 0xFFFFFFFF) - (b & 0xFFFFFFFF)
            condition = {"cs": "ge", "cc": "lt", "hi": "gt", "ls": "le"}[condition]
        return _sign(condition, least, most)

    def narrow(self, condition: str, a: Value, b: Value, narrowed: Narrowed) -> bool:
        """Narrow a and b by a comparison that came out so; return whether it can."""
        if self.holds(condition, a, b, narrowed) is False:
            return False
        if condition in ("eq", "ne") and isinstance(b, Unknown):
            difference = self.plus(a, self.times(b, -1, narrowed), narrowed)
            if isinstance(a, int) or (isinstance(difference, Unknown) and difference.which == b.which):
                a, b = difference, 0
        (low, high), (low_b, high_b) = self.limits(a, narrowed), self.limits(b, narrowed)
        if condition in ("ls", "cc") and low_b >= 0:  # below as a number without sign: not negative
            low, condition = max(low, 0), {"ls": "le", "cc": "lt"}[condition]
        elif condition in ("hi", "cs") and low >= 0 and low_b >= 0:
            condition = {"hi": "gt", "cs": "ge"}[condition]
        if condition in ("lt", "mi"):
            high, low_b = min(high, high_b - 1), max(low_b, low + 1)
        elif condition == "le":
            high, low_b = min(high, high_b), max(low_b, low)
        elif condition == "gt":
            low, high_b = max(low, low_b + 1), min(high_b, high - 1)
        elif condition in ("ge", "pl"):
            low, high_b = max(low, low_b), min(high_b, high)
        elif condition == "eq":
            low = low_b = max(low, low_b)
            high = high_b = min(high, high_b)
        elif condition == "ne" and low_b == high_b:
            low, high = low + (low == low_b), high - (high == low_b)
        return self._keep(a, low, high, narrowed) and self._keep(b, low_b, high_b, narrowed)

    def _keep(self, value: Value, low: int, high: int, narrowed: Narrowed) -> bool:
        """Keep that a word lies in an interval; return whether it can."""
        if low > high:
            return False
        if isinstance(value, int):
            return low <= value <= high
        wraps = self.limits(value, narrowed) == (LEAST, MOST) and value.plus != 0
        low, high = low - value.plus, high - value.plus
        if wraps and (value.times != 1 or low < LEAST or high > MOST):
            return True
        if value.times < 0:
            low, high = -high, -low
        size = abs(value.times)
        least, most = -(-low // size), high // size
        old = narrowed.get(value.which) or self._limits[value.which]
        least, most = max(least, old[0]), min(most, old[1])
        if (least, most) != old:
            narrowed[value.which] = (least, most)
        return least <= most


def _sign(condition: str, least: int, most: int) -> bool | None:
    """Tell whether a difference between two limits has a sign."""
    always, never = {
        "eq": (least == most == 0, least > 0 or most < 0),
        "ne": (least > 0 or most < 0, least == most == 0),
        "lt": (most < 0, least >= 0),
        "mi": (most < 0, least >= 0),
        "ge": (least >= 0, most < 0),
        "pl": (least >= 0, most < 0),
        "gt": (least > 0, most <= 0),
        "le": (most <= 0, least > 0),
    }.get(condition, (False, False))
    return True if always else False if never else None


def join(values: Values, a: Value, narrowed_a: Narrowed, b: Value, narrowed_b: Narrowed) -> Value:
    """Return what is known of a word that is a on one way and b on another."""
    (low, high), (low_b, high_b) = values.limits(a, narrowed_a), values.limits(b, narrowed_b)
    return values.fresh(min(low, low_b), max(high, high_b))


def logic(name: str, a: Value, b: Value, values: Values, narrowed: Narrowed) -> Value:
    """Return and, orr, orn, eor or bic of two words."""
    if isinstance(a, int) and isinstance(b, int):
        return word({"and": a & b, "orr": a | b, "orn": a | ~b, "eor": a ^ b, "bic": a & ~b}[name])
    mask = b if isinstance(b, int) else a
    if name == "and" and isinstance(mask, int) and mask >= 0:
        return values.fresh(0, mask)
    low, high = values.limits(a, narrowed)
    if name == "bic" and low >= 0:
        return values.fresh(0, high)
    if name == "orr" and low >= 0 and values.limits(b, narrowed)[0] >= 0:
        top = max(high, values.limits(b, narrowed)[1])
        return values.fresh(low, (1 << top.bit_length()) - 1)
    return values.fresh()
