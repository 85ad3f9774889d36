"""Truth: published test vectors of the generator, moments and tails of the normal law, the same words in C."""

import ctypes
import math

import casadi as ca
import numpy as np
import pytest
from scipy import stats

from casadi_gnc.mathematics import noise
from casadi_gnc.system import assets, compilers

SOURCE = """
#include "gnc_random.h"
void fill(uint64_t seed, uint64_t draw, uint32_t count, double *numbers);
void fill(uint64_t seed, uint64_t draw, uint32_t count, double *numbers) { gnc_uniforms(seed, draw, count, numbers); }
"""

#: Known answers published with the generator (Random123, philox 4x32 with 10 rounds).
KNOWN = [
    ("00000000 00000000 00000000 00000000 00000000 00000000", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ("ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    ("243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
]


@pytest.mark.parametrize(("given", "expected"), KNOWN)
def test_generator_gives_the_published_words(given, expected):
    words = [int(word, 16) for word in given.split()]
    found = noise.philox(tuple(words[:4]), tuple(words[4:]))
    assert [f"{word:08x}" for word in found] == expected.split()


def test_c_draws_the_same_numbers():
    library = compilers.load(SOURCE, include=assets.folder("codegen") / "runtime")
    library.fill.argtypes = [ctypes.c_uint64, ctypes.c_uint64, ctypes.c_uint32, ctypes.c_void_p]
    for seed, draw, count in [(0, 0, 1), (1, 0, 9), (2**64 - 1, 2**40 + 3, 12), (2**32, 17, 5)]:
        numbers = np.zeros(count)
        library.fill(seed, draw, count, numbers.ctypes.data)
        assert numbers.tolist() == noise.uniforms(seed, draw, count).tolist()


def test_draws_do_not_depend_on_how_many_are_taken():
    assert noise.uniforms(5, 8, 7)[:3].tolist() == noise.uniforms(5, 8, 3).tolist()
    assert noise.uniforms(5, 8, 3).tolist() != noise.uniforms(5, 9, 3).tolist() != noise.uniforms(6, 9, 3).tolist()


def draws(count: int, truncation: float = math.inf) -> np.ndarray:
    uniform = ca.SX.sym("u", 6)
    normal = ca.Function("normal", [uniform], [noise.normals(uniform, 5, truncation)])
    columns = np.array([noise.uniforms(1, k, 6) for k in range(count)]).T
    return np.array(normal(columns))


def test_numbers_are_standard_normal_and_independent():
    """Kolmogorov-Smirnov at one in a million; correlations of 4000 draws stay below 5 of their deviations."""
    numbers = draws(4000)
    for row in numbers:
        assert stats.kstest(row, "norm").pvalue > 1e-6
    within = np.corrcoef(numbers) - np.eye(5)
    across = [np.corrcoef(row[:-1], row[1:])[0, 1] for row in numbers]
    assert max(np.abs(within).max(), np.abs(across).max()) < 5 / math.sqrt(4000)


def test_truncation_cuts_at_the_deviations_asked_for():
    assert np.abs(draws(2000)).max() > 3 > 2.5 == np.abs(draws(2000, 2.5)).max()


def test_normals_are_finite_at_the_ends_of_the_uniform_range():
    ends = ca.DM([2.0**-53, 1.0, 1.0, 2.0**-53])
    assert np.all(np.isfinite(np.array(noise.normals(ends, 4))))
