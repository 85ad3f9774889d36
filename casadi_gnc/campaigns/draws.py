"""Random numbers of a campaign's cases: functions of (seed, what for, case, place) and of nothing else.

The generator is that of a flight's noise (`casadi_gnc.mathematics.noise`), with its key, the seed. Its counter has four
words: a flight's noise takes the first for the place in a draw and the last two for the number of the draw. Here the
second, which noise leaves at zero, is the case, and the last two are a draw that no flight reaches: the upper word is
all ones, the lower says what the numbers are for.

=======  =====================================
word     content
=======  =====================================
0        block of four words, from 0
1        case, 0 to 2^32 - 1
2        purpose (below), and a part of it
3        2^32 - 1
=======  =====================================
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np

from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics.noise import philox

_WORD = 0xFFFFFFFF
#: Cases of a campaign at most: what a word of the counter can tell apart.
MOST_CASES = 2**32


class Purpose(IntEnum):
    """What numbers are drawn for; each has 2^24 parts, such as a dimension or a level."""

    POINTS = 0
    CELLS = 1
    RESAMPLING = 2
    CHAINS = 3
    LINES = 4
    AUDIT = 5
    NOISE = 6
    KEPT = 7


def check_seed(seed: int) -> int:
    """Return a seed as it came; raise `CampaignError` where it does not fit the generator's key."""
    if not 0 <= seed < 2**64:
        raise CampaignError(f"the seed is {seed}; expected a whole number from 0 to 2^64 - 1")
    return seed


def words(seed: int, purpose: Purpose, cases: np.ndarray, count: int, part: int = 0) -> np.ndarray:
    """Return words of 64 random bits, (cases, count).

    Parameters
    ----------
    seed : 0 to 2^64 - 1.
    purpose, part : what for; part is below 2^24.
    cases : (cases,), numbers of the cases.
    count : how many for each case; the first of them do not depend on it.
    """
    check_seed(seed)
    case = np.asarray(cases, dtype=np.uint64)
    found = np.empty((len(case), count), dtype=np.uint64)
    draw = (int(purpose) << 24) | part
    for block in range(-(-count // 2)):
        four = philox((block, case, draw, _WORD), (seed & _WORD, seed >> 32))
        for half in range(min(2, count - 2 * block)):
            found[:, 2 * block + half] = (four[2 * half] << np.uint64(32)) | four[2 * half + 1]
    return found


def uniforms(seed: int, purpose: Purpose, cases: np.ndarray, count: int, part: int = 0) -> np.ndarray:
    """Return numbers in the open interval (0, 1), odd multiples of 2^-53, (cases, count); arguments as of `words`.

    Neither 0 nor 1 comes out, so every quantile is finite.
    """
    return odd_multiples(words(seed, purpose, cases, count, part), 52)


def odd_multiples(bits: np.ndarray, kept: int) -> np.ndarray:
    """Return the middles of 2^kept equal cells of (0, 1), chosen by the upper of 64 bits; kept is at most 52."""
    return ((bits >> np.uint64(64 - kept)).astype(float) * 2.0 + 1.0) * 0.5 ** (kept + 1)
