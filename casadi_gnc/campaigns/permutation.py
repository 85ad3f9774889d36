"""A random permutation of 0 ... n - 1 of which any element can be had without the others.

Numbers are written with two digits, left (base a) and right (base b), a b >= n, and stirred: each round adds to one
digit a random function of the other, which can be undone and so is a permutation of a b numbers; those that land at or
beyond n go round again until they do not. Black and Rogaway (2002), "Ciphers with arbitrary finite domains",
doi:10.1007/3-540-45760-7_9: generalised Feistel network and cycle walking. The random functions are tables of about
sqrt(n) entries drawn from the counter-based generator, so nothing of size n is kept.
"""

from __future__ import annotations

import math

import numpy as np

from casadi_gnc.campaigns.draws import Purpose, words

#: Four make a network as good as random to whoever sees few elements; small n have few tables and need more.
_ROUNDS = 12


def permuted(seed: int, dimension: int, size: int, elements: np.ndarray) -> np.ndarray:
    """Return where the permutation of a seed and a dimension sends elements, (k,).

    Parameters
    ----------
    seed : 0 to 2^64 - 1.
    dimension : which permutation, below 2^24.
    size : n, from 1 to 2^32.
    elements : (k,), of 0 ... n - 1.
    """
    left_base = max(1, math.isqrt(size - 1) + 1)
    right_base = -(-size // left_base)
    entries = np.arange(max(left_base, right_base))
    tables = words(seed, Purpose.CELLS, entries, _ROUNDS, part=dimension)
    found = np.asarray(elements, dtype=np.uint64).copy()
    walking = np.arange(len(found))
    while len(walking):
        left, right = np.divmod(found[walking], np.uint64(right_base))
        for number in range(_ROUNDS):
            if number % 2:
                right = _added(right, tables[left, number], right_base)
            else:
                left = _added(left, tables[right, number], left_base)
        found[walking] = left * np.uint64(right_base) + right
        walking = walking[found[walking] >= np.uint64(size)]
    return found


def _added(digit: np.ndarray, random: np.ndarray, base: int) -> np.ndarray:
    return (digit + random % np.uint64(base)) % np.uint64(base)
