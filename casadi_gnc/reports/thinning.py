"""Which samples of a record are drawn: few, and every extreme of each short stretch among them."""

from __future__ import annotations

import numpy as np


def kept(columns: np.ndarray, stretches: int) -> np.ndarray:
    """Return the places of the samples that are drawn, rising; the first and the last are among them.

    The record is cut into stretches of one length. Of each stretch the samples stay at which a column is least or
    largest, so that whatever is drawn has the peaks of all columns, at their times. Numbers that are not finite count
    as nothing.

    Parameters
    ----------
    columns : (K, n).
    stretches : into how many the record is cut, at most.

    Examples
    --------
    >>> spike = np.zeros((1000, 1))
    >>> spike[617] = 5.0
    >>> chosen = kept(spike, 10)
    >>> len(chosen) < 30, 617 in chosen
    (True, True)
    """
    count = len(columns)
    length = -(-count // max(1, stretches))
    if length <= 2 or count == 0:
        return np.arange(count)
    whole = count // length * length
    blocks = columns[:whole].reshape(-1, length, columns.shape[1])
    first = np.arange(len(blocks))[:, None] * length
    finite = np.isfinite(blocks)
    low, high = np.where(finite, blocks, np.inf).argmin(axis=1), np.where(finite, blocks, -np.inf).argmax(axis=1)
    rest = np.arange(whole, count)
    if len(rest) > 2:
        tail, sure = columns[whole:], np.isfinite(columns[whole:])
        rest = whole + np.concatenate(
            [np.where(sure, tail, np.inf).argmin(axis=0), np.where(sure, tail, -np.inf).argmax(axis=0)]
        )
    return np.unique(np.concatenate([(first + low).ravel(), (first + high).ravel(), rest, [0, count - 1]]))


def runs(flags: np.ndarray, most: int) -> list[tuple[int, int]]:
    """Return the stretches where a flag is raised, as places (first, last), at most so many.

    Where there are more, those nearest to each other become one.

    Examples
    --------
    >>> runs(np.array([0, 1, 1, 0, 0, 0, 1], dtype=bool), 10)
    [(1, 2), (6, 6)]
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    starts, ends = edges[::2], edges[1::2] - 1
    if len(starts) > most:
        gaps = starts[1:] - ends[:-1]
        widest = np.sort(np.argsort(-gaps, kind="stable")[: most - 1])
        starts, ends = starts[np.concatenate([[0], widest + 1])], ends[np.concatenate([widest, [len(ends) - 1]])]
    return [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)]
