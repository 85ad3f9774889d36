import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from casadi_gnc.reports.packed import Packed
from casadi_gnc.reports.thinning import kept, runs


@given(st.integers(1, 3000), st.integers(1, 3), st.integers(1, 200), st.integers(0, 2**32 - 1))
def test_no_stretch_loses_an_extreme(count, width, stretches, seed):
    """Judged stretch by stretch, of the length that so many stretches have."""
    columns = np.random.default_rng(seed).standard_cauchy((count, width))
    chosen = kept(columns, stretches)
    assert (np.diff(chosen) > 0).all()
    assert chosen[0] == 0
    assert chosen[-1] == count - 1
    length = -(-count // stretches)
    for start in range(0, count, length):
        here = columns[start : start + length]
        there = columns[chosen[(chosen >= start) & (chosen < start + length)]]
        np.testing.assert_array_equal(there.max(axis=0), here.max(axis=0))
        np.testing.assert_array_equal(there.min(axis=0), here.min(axis=0))
    assert len(chosen) <= max(2 * stretches * width + 2 * width + 2, 2 * stretches)


def test_what_is_not_finite_hides_no_peak():
    column = np.full((1000, 1), np.nan)
    column[::7] = 0.0
    column[413], column[700] = 9.0, np.inf
    chosen = kept(column, 20)
    assert 413 in chosen


@given(st.lists(st.booleans(), max_size=60), st.integers(1, 8))
def test_runs_cover_what_is_raised(flags, most):
    raised = np.array(flags, dtype=bool)
    found = runs(raised, most)
    assert len(found) <= most
    covered = np.zeros(len(raised), dtype=bool)
    for first, last in found:
        assert raised[first]
        assert raised[last]
        covered[first : last + 1] = True
    assert (covered | ~raised).all()
    if np.count_nonzero(np.diff(np.concatenate([[False], raised])) & raised) <= most:
        np.testing.assert_array_equal(covered, raised)


@pytest.mark.filterwarnings("error")
def test_columns_come_back_as_single_precision():
    """Read as the page reads them: base 64, zlib, four planes of bytes."""
    import base64
    import zlib

    columns = [np.array([1.0, -2.5e-7, 3e38]), np.array([np.nan, 1e300]), np.array([])]
    packed = Packed()
    assert [packed.add(column) for column in columns] == [0, 1, 2]
    bytes_ = zlib.decompress(base64.b64decode(packed.letters()))
    at = 0
    for count, column in zip(packed.counts, columns, strict=True):
        planes = np.frombuffer(bytes_[at : at + 4 * count], dtype=np.uint8).reshape(4, count)
        at += 4 * count
        with np.errstate(over="ignore"):
            np.testing.assert_array_equal(planes.T.copy().view("<f4")[:, 0], column.astype("<f4"))
