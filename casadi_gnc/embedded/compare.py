"""Compare words with words, signal by signal."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from casadi_gnc.signals import Layout


@dataclass(frozen=True)
class Difference:
    """Say how far two records of a signal are apart.

    Parameters
    ----------
    signal, unit : which.
    words : numbers whose bits differ, of `count`.
    ulp : largest distance in units in the last place (0 for equal words; +0 and -0 are 0 apart).
    absolute, relative : largest distance in the signal's unit, and of the larger magnitude of the signal.
    """

    signal: str
    unit: str
    count: int
    words: int
    ulp: float
    absolute: float
    relative: float


def as_numbers(words: np.ndarray) -> np.ndarray:
    """Return words as the numbers whose bits they are."""
    return words.view(np.float64 if words.dtype == np.uint64 else np.float32)


def as_words(numbers: np.ndarray, word: np.dtype) -> np.ndarray:
    """Return numbers as words of a type, rounded to it."""
    real = np.float64 if word == np.uint64 else np.float32
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(numbers, dtype=real).view(word)


def differences(found: np.ndarray, expected: np.ndarray, outputs: Layout) -> list[Difference]:
    """Return a line for each signal and one for the status, the last column, which is an integer.

    Parameters
    ----------
    found, expected : (K, outputs.size + 1) words.
    """
    lines = []
    for signal in outputs.signals:
        rows = outputs.place(signal.name)
        lines.append(_difference(signal.name, signal.unit, found[:, rows], expected[:, rows]))
    wrong = int((found[:, -1] != expected[:, -1]).sum())
    return [*lines, Difference("status", "", len(found), wrong, float(wrong > 0), float(wrong > 0), float(wrong > 0))]


def _difference(name: str, unit: str, found: np.ndarray, expected: np.ndarray) -> Difference:
    a, b = np.ascontiguousarray(found), np.ascontiguousarray(expected)
    x, y = as_numbers(a).astype(float), as_numbers(b).astype(float)
    apart = np.abs(_order(a) - _order(b))
    absolute = float(np.abs(x - y).max(initial=0.0))
    largest = float(np.abs(y).max(initial=0.0))
    return Difference(
        name, unit, a.size, int((a != b).sum()), float(apart.max(initial=0.0)), absolute,
        absolute / largest if largest > 0.0 else absolute,
    )  # fmt: skip


def _order(words: np.ndarray) -> np.ndarray:
    """Return integers in the order of the numbers, both zeros at 0; as float64, exact where it matters."""
    signed = words.astype(object) if words.dtype == np.uint64 else words.astype(np.int64)
    sign = 1 << (8 * words.dtype.itemsize - 1)
    return np.where(signed >= sign, sign - signed, signed).astype(object)


def words_that_differ(lines: list[Difference]) -> int:
    """Return the number of words that differ in all signals."""
    return sum(line.words for line in lines)


def as_data(lines: list[Difference]) -> list[dict[str, Any]]:
    """Return the lines as plain data."""
    return [asdict(line) for line in lines]
