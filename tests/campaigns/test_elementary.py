"""Truth: the words of the C that flies, and 40 digits of mpmath for the normal law."""

import ctypes
import math

import casadi as ca
import mpmath
import numpy as np
import pytest

from casadi_gnc.mathematics import elementary, normal
from casadi_gnc.system import assets, compilers

SOURCE = """
#include "gnc_math.h"
#define EACH(name) \\
    void all_##name(const double *x, double *y, int n); \\
    void all_##name(const double *x, double *y, int n) { for (int i = 0; i < n; i++) y[i] = gnc_##name(x[i]); }
EACH(exp)
EACH(log)
EACH(sin)
EACH(cos)
"""


@pytest.fixture(scope="module")
def library():
    return compilers.load(SOURCE, include=assets.folder("codegen") / "runtime")


def of_c(library, name: str, x: np.ndarray) -> np.ndarray:
    y = np.zeros_like(x)
    call = getattr(library, f"all_{name}")
    call.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int]
    call(x.ctypes.data, y.ctypes.data, len(x))
    return y


TINY, HUGE = [5e-324, 2.0**-1022, -5e-324], [1.7e308, 2.0**30, 2.0**31]
EDGES = [0.0, -0.0, 1.0, -1.0, 0.5, *TINY, *HUGE, math.inf, -math.inf, math.nan]


def arguments(rng: np.random.Generator, name: str) -> np.ndarray:
    count = 200_000
    if name == "exp":
        return np.concatenate([rng.uniform(-760, 720, count), rng.normal(size=count), EDGES])
    if name == "log":
        anything = rng.integers(0, 2**64, count, dtype=np.uint64).view(float)
        return np.concatenate([rng.uniform(0, 1, count), np.exp(rng.uniform(-700, 700, count)), anything, EDGES])
    near = np.arange(-2000, 2000) * math.pi / 4
    return np.concatenate([rng.uniform(-7, 7, count), rng.uniform(-(2**20), 2**20, count), near, EDGES])


@pytest.mark.parametrize("name", ["exp", "log", "sin", "cos"])
def test_functions_give_the_words_of_the_c(library, rng, name):
    x = arguments(rng, name)
    ours = {"sin": lambda v: elementary.sin_cos(v)[0], "cos": lambda v: elementary.sin_cos(v)[1]}
    found = ours.get(name, getattr(elementary, name, None))(x)
    expected = of_c(library, name, x)
    differ = found.view(np.uint64) != expected.view(np.uint64)
    differ &= ~(np.isnan(found) & np.isnan(expected))
    assert not differ.any(), x[differ][:5]


def test_layout_and_length_do_not_change_the_words(rng):
    """Vector units take other paths for strided arrays and for the rest of a length."""
    block = rng.uniform(1e-9, 1, (1001, 7))
    for function in (elementary.exp, elementary.log, normal.quantile, normal.cumulative):
        whole = function(block)
        for column in range(7):
            assert np.array_equal(function(block[:, column]), whole[:, column])
        assert [float(function(np.array(value))) for value in block[:50, 0]] == whole[:50, 0].tolist()


def test_quantile_is_good_to_the_last_digits(rng):
    """Of 40 digits; 8 units of rounding are left for the rational function and the root of the logarithm."""
    low, high = 10.0 ** rng.uniform(-300, 0, 200), 1 - 2.0 ** -rng.integers(2, 53, 50)
    inside = np.concatenate([rng.uniform(0, 1, 400), low, high])
    with mpmath.workdps(40):
        for p, found in zip(inside, normal.quantile(inside), strict=True):
            miss = mpmath.ncdf(mpmath.mpf(float(found))) - mpmath.mpf(float(p))
            error = miss / mpmath.npdf(mpmath.mpf(float(found)))
            assert abs(error) <= 8 * 2.0**-53 * max(abs(found), 1e-3), p
    assert normal.quantile(np.array([0.0, 0.5, 1.0])).tolist() == [-math.inf, 0.0, math.inf]
    assert np.isnan(normal.quantile(np.array([-0.1, 1.1, math.nan]))).all()


def test_the_quantile_of_a_symbol_is_that_of_a_number():
    """Only the logarithm's last digit may differ: by 2^-53 of a number up to 37, which the root halves."""
    p = ca.SX.sym("p")
    inside = np.concatenate([np.linspace(1e-3, 1 - 1e-3, 97), 10.0 ** -np.arange(4.0, 290.0, 13.0)])
    found = np.array(ca.Function("quantile", [p], [normal.quantile_of(p)])(inside.reshape(1, -1))).ravel()
    assert found == pytest.approx(normal.quantile(inside), rel=4e-15, abs=1e-16)
    assert normal.quantile_of(0.9) == float(normal.quantile(np.array(0.9)))


def test_cumulative_is_good_relative_to_its_tail(rng):
    """Of 40 digits; 16 units of rounding are left in the tail."""
    x = np.concatenate([rng.uniform(-37, 8, 500), rng.normal(size=300)])
    with mpmath.workdps(40):
        for value, found in zip(x, normal.cumulative(x), strict=True):
            exact = mpmath.ncdf(mpmath.mpf(float(value)))
            assert abs(found / exact - 1) < 16 * 2.0**-53, value
    assert normal.cumulative(np.array([-math.inf, 0.0, math.inf])).tolist() == [0.0, 0.5, 1.0]
    assert np.isnan(normal.cumulative(np.array([math.nan]))).all()
