"""Random numbers that depend on nothing but a seed and a counter.

Every draw is a function of (seed, number of the draw, place in it), so that compiled flights and
CasADi's virtual machine see the same numbers, a flight can be resumed anywhere, and many flights
run side by side without sharing state. The bits come from Philox4x32-10 (Salmon, Moraes, Dror,
Shaw 2011, doi:10.1145/2063384.2063405); `codegen/runtime/gnc_random.h` is the same in C. Integers
become uniform numbers exactly; what turns those into normal ones is a CasADi expression like
everything else, so each engine evaluates it with its own elementary functions.
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.mathematics import bounds

_WORD = 0xFFFFFFFF
_MULTIPLIERS = (0xD2511F53, 0xCD9E8D57)
_WEYL = (0x9E3779B9, 0xBB67AE85)


def philox(counter: tuple[Any, Any, Any, Any], key: tuple[int, int]) -> tuple[Any, Any, Any, Any]:
    """Return four random words of 32 bits for a counter of four words and a key of two.

    Words of the counter are integers or arrays of uint64, as many results as they have elements.

    Examples
    --------
    >>> [f"{word:08x}" for word in philox((0, 0, 0, 0), (0, 0))]
    ['6627e8d5', 'e169c58d', 'bc57ac4c', '9b00dbd8']
    """
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(10):
        left, right = _MULTIPLIERS[0] * c0, _MULTIPLIERS[1] * c2
        c0, c1, c2, c3 = (right >> 32) ^ c1 ^ k0, right & _WORD, (left >> 32) ^ c3 ^ k1, left & _WORD
        k0, k1 = (k0 + _WEYL[0]) & _WORD, (k1 + _WEYL[1]) & _WORD
    return c0, c1, c2, c3


def uniforms(seed: int, draw: int, count: int) -> np.ndarray:
    """Return `count` numbers in (0, 1], multiples of 2^-53, of one draw.

    Parameters
    ----------
    seed : 0 to 2^64 - 1.
    draw : number of the draw, 0 to 2^64 - 1.
    """
    key, numbers = (seed & _WORD, seed >> 32), []
    for block in range(-(-count // 2)):
        words = philox((block, 0, draw & _WORD, draw >> 32), key)
        for high, low in (words[:2], words[2:]):
            numbers.append(((high >> 5) * 67108864.0 + (low >> 6) + 1.0) / 9007199254740992.0)
    return np.array(numbers[:count])


def uniform_count(normals: int) -> int:
    """Return how many uniform numbers so many normal ones are made of."""
    return 2 * -(-normals // 2)


def normals(uniform: Any, count: int, truncation: float = math.inf) -> Any:
    """Return standard normal numbers, (count,), as an expression of uniform ones (Box and Muller 1958).

    Parameters
    ----------
    uniform : (uniform_count(count),), each in (0, 1].
    truncation : larger magnitudes are set to this one.
    """
    numbers = []
    for i in range(0, uniform_count(count), 2):
        radius, angle = ca.sqrt(-2 * ca.log(uniform[i])), 2 * math.pi * uniform[i + 1]
        numbers += [radius * ca.cos(angle), radius * ca.sin(angle)]
    column = ca.vertcat(*numbers[:count])
    return column if truncation == math.inf else bounds.clip(column, -truncation, truncation)
