"""Distances between words, from cases known by hand."""

import numpy as np
import pytest

from casadi_gnc.embedded.compare import as_numbers, as_words, differences, words_that_differ
from casadi_gnc.signals import Layout, Signal

OUTPUTS = Layout((Signal("force", 2, "N"), Signal("speed", 1, "m/s")))


def words(rows, word):
    real = np.float64 if word == np.uint64 else np.float32
    return np.array(rows, dtype=real).view(word)


@pytest.mark.parametrize("word", [np.uint64, np.uint32])
def test_words_and_numbers_are_each_other(word, rng):
    numbers = rng.normal(size=(5, 3)).astype(np.float32).astype(float)
    assert (as_numbers(as_words(numbers, np.dtype(word))) == numbers).all()


@pytest.mark.parametrize(
    ("word", "eps"), [(np.uint64, np.finfo(np.float64).eps), (np.uint32, np.finfo(np.float32).eps)]
)
def test_one_ulp_is_one(word, eps):
    expected = words([[1.0, 2.0, 0.0], [4.0, -1.0, 0.0]], word)
    found = words([[1.0 + eps, 2.0, -0.0], [4.0, -1.0 - 3 * eps, 0.0]], word)
    status = np.array([[0], [8]], dtype=word)
    force, speed, bits = differences(np.hstack([found, status]), np.hstack([expected, status]), OUTPUTS)
    assert (force.signal, force.unit, force.count, force.words, force.ulp) == ("force", "N", 4, 2, 3.0)
    assert force.absolute == pytest.approx(3 * eps)
    assert force.relative == pytest.approx(3 * eps / 4.0)
    # Zeros of two signs: another word, no distance.
    assert (speed.words, speed.ulp, speed.absolute) == (1, 0.0, 0.0)
    assert bits.words == 0
    other = status.copy()
    other[1] = 10
    lines = differences(np.hstack([found, other]), np.hstack([expected, status]), OUTPUTS)
    assert lines[-1].words == 1
    assert words_that_differ(lines) == 4


def test_steps_across_zero_are_counted():
    least = 5e-324
    found, expected = words([[least, 0.0, 0.0]], np.uint64), words([[-least, 0.0, 0.0]], np.uint64)
    status = np.zeros((1, 1), dtype=np.uint64)
    force = differences(np.hstack([found, status]), np.hstack([expected, status]), OUTPUTS)[0]
    assert force.ulp == 2.0
