# SPDX-License-Identifier: MIT-0
"""Check the elementary functions of `codegen/runtime` against multiple-precision truth and Annex F of C99.

Truth is mpmath; the error bound of each function is the one its comment in the header states, so the
documentation is what the tests hold the code to. `tests/bench/math_accuracy.py` does the same over millions of
points; `test_gnc_math_bits.py` compares compilers.
"""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from math_functions import (
    DOUBLE,
    EXACT,
    FUNCTIONS,
    KEEP_NAN,
    ONE_ARGUMENT,
    PRECISIONS,
    Library,
    Precision,
    build_plain,
    by_name,
)
from math_truth import SPECIAL, arguments, neighbours, stated_bound, worst_error


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The plainest build: every other one must agree with it."""
    return Library(build_plain(tmp_path_factory.mktemp("gnc_math")))


# ---- Accuracy -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_error_is_within_the_stated_bound(library: Library, name: str, p: Precision):
    columns = arguments(name, p, 2000)
    got = library(name, p, *columns)
    if name == "sqrt":  # the IEEE operation is its own truth, and numpy uses it
        np.testing.assert_array_equal(got, np.sqrt(columns[0]))
        return
    bound = 0.0 if name in EXACT else stated_bound(name, p)
    assert bound <= 1.5
    worst, where = worst_error(name, p, columns, got)
    assert worst <= bound, f"{name}{p.suffix}: {worst:.3f} ulp at {where}"


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
def test_trigonometry_far_out_stays_bounded(library: Library, p: Precision):
    limit = 2.0**20 if p is DOUBLE else 1e4
    end = 2.0**30 if p is DOUBLE else 2.0**17
    info = np.finfo(p.dtype)
    far = 2.0 ** np.linspace(math.log2(limit), info.maxexp - 0.01, 500)
    x = np.concatenate([far, [info.max], neighbours(p, [limit, end])]).astype(p.dtype)
    for name in ("sin", "cos"):
        assert np.all(np.abs(library(name, p, x)) <= 1)
    assert np.all(np.isfinite(library("tan", p, x)))
    between = x[(x > limit) & (x <= end)]
    with mpmath.workprec(160):
        truth = np.array([float(mpmath.sin(mpmath.mpf(v))) for v in between.tolist()])
    phase = between.astype(float) * 2.0 ** (1 - p.digits) + 2.0 ** (1 - p.digits)
    assert np.all(np.abs(library("sin", p, between) - truth) <= phase)
    np.testing.assert_array_equal(library("cos", p, x[x > end]), 1)


# ---- Special values -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
@pytest.mark.parametrize("name", FUNCTIONS)
def test_special_values_follow_annex_f(library: Library, name: str, p: Precision):
    for *values, expected in SPECIAL[name]:
        (got,) = library(name, p, *([v] for v in values))
        if math.isnan(expected):
            assert got.view(p.bits) == p.nan_bits, f"{name}{tuple(values)} = {got}, not the canonical NaN"
        else:
            # Compared as bits, so that the sign of zero counts. Multiples of pi are the nearest ones.
            assert got.view(p.bits) == p.dtype(expected).view(p.bits), f"{name}{tuple(values)} = {got}"


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
@pytest.mark.parametrize("name", [name for name in FUNCTIONS if name not in KEEP_NAN])
def test_a_nan_result_is_always_the_same_one(library: Library, name: str, p: Precision):
    """Its sign and payload depend on the processor and on the order of operands, so they are not handed on."""
    sign = 1 << (8 * np.dtype(p.dtype).itemsize - 1)
    nan = np.array([p.nan_bits, p.nan_bits + 1, p.nan_bits + sign, p.nan_bits + sign + 5], p.bits).view(p.dtype)
    columns = (
        [(nan,)] if name in ONE_ARGUMENT else [(nan, nan), (nan, np.full_like(nan, 2)), (np.full_like(nan, 2), nan)]
    )
    for column in columns:
        assert set(library(name, p, *column).view(p.bits).tolist()) == {p.nan_bits}


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
def test_odd_and_even_functions_are_symmetric_bit_for_bit(library: Library, p: Precision):
    for name in ("sin", "tan", "sinh", "tanh", "asin", "atan", "erf"):
        (x,) = arguments(name, p, 2000)
        np.testing.assert_array_equal(library(name, p, -x), -library(name, p, x))
    for name in ("cos", "cosh"):
        (x,) = arguments(name, p, 2000)
        np.testing.assert_array_equal(library(name, p, -x), library(name, p, x))


@pytest.mark.parametrize("p", PRECISIONS, **by_name)
def test_tanh_never_falls_where_its_argument_rises(library: Library, p: Precision):
    """It starts from the nearest of a row of points: here on both sides of where two of them meet, and between."""
    borders = neighbours(p, np.arange(1, 250) * 0.078125)
    between = np.random.default_rng(3).uniform(0, 20, 4000).astype(p.dtype).view(p.bits)
    runs = (between[:, None] + np.arange(8, dtype=p.bits)).view(p.dtype)  # eight numbers in a row
    for x in (np.sort(np.concatenate([borders, runs.ravel()])), np.sort(runs.ravel())[::-1] * p.dtype(-1)):
        found = library("tanh", p, x)
        assert np.all(np.diff(found) >= 0)
        assert np.abs(found).max() == 1
