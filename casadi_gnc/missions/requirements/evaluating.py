"""Robustness over a whole record, at every sample, in a time proportional to its length."""

from __future__ import annotations

import numpy as np

from casadi_gnc.missions.requirements.tree import BEYOND, Held, Join, Margin, Node, Until, Window


def robustness(node: Node, margins: np.ndarray) -> np.ndarray:
    """Return the robustness of a formula at every sample.

    Parameters
    ----------
    node : of `casadi_gnc.missions.requirements.tree`.
    margins : (M, K), of each comparison at each sample.

    Returns
    -------
    array, (K,)
        Within `BEYOND`, which stands for infinity.
    """
    if isinstance(node, Margin):
        return margins[node.number]
    if isinstance(node, Join):
        parts = [robustness(part, margins) for part in node.parts]
        return (np.minimum if node.every else np.maximum).reduce(parts)
    assert isinstance(node, (Window, Held, Until))
    sign = 1.0 if node.every else -1.0
    if isinstance(node, Window):
        return sign * least_ahead(sign * robustness(node.part, margins), node.first, node.last)
    if isinstance(node, Held):
        return sign * _least_behind(sign * robustness(node.part, margins), node.samples)
    keep, goal = (-sign * robustness(part, margins) for part in (node.keep, node.goal))
    return -sign * _until(keep, goal, node.first, node.last)


def least_ahead(values: np.ndarray, first: int, last: int | None) -> np.ndarray:
    """Return for each sample the least value from `first` to `last` samples later, `BEYOND` where there is none."""
    count = len(values)
    found = np.full(count, BEYOND)
    if first >= count:
        return found
    rest = values[first:]
    if last is None or last >= count - 1:
        # Every window reaches the end of the record.
        rest = np.minimum.accumulate(rest[::-1])[::-1]
    else:
        rest = _sliding(rest, last - first + 1)
    found[: count - first] = rest
    return found


def _sliding(values: np.ndarray, width: int) -> np.ndarray:
    """Return the least of each value and the width - 1 after it: least so far from both ends of blocks of `width`."""
    count = len(values)
    blocks = -(-count // width) + 1
    padded = np.full((blocks, width), BEYOND)
    padded.ravel()[:count] = values
    ahead = np.minimum.accumulate(padded[:, ::-1], axis=1)[:, ::-1].ravel()
    behind = np.minimum.accumulate(padded, axis=1).ravel()
    return np.minimum(ahead[:count], behind[width - 1 : width - 1 + count])


def _least_behind(values: np.ndarray, samples: int) -> np.ndarray:
    """Return for each sample the least value of it and so many before, -`BEYOND` before there are so many."""
    found = np.full(len(values), -BEYOND)
    if samples < len(values):
        found[samples:] = _sliding(values, samples + 1)[: len(values) - samples]
    return found


def _until(keep: np.ndarray, goal: np.ndarray, first: int, last: int | None) -> np.ndarray:
    """Return for each sample how far `goal` holds in the window, and `keep` up to there.

    keep until[0, b] goal is the lesser of eventually[0, b] goal and keep until goal: where a goal is reached within b,
    and some goal is reached with keep before it, the first goal of all has keep before it. Above any level this is so
    of margins too. As in Donze, Ferrere and Maler (2013), doi:10.1007/978-3-642-39799-8_19, for continuous time.
    """
    count, reached = len(goal), []
    later = -BEYOND
    for stays, there in zip(keep[::-1].tolist(), goal[::-1].tolist(), strict=True):
        later = max(there, min(stays, later))
        reached.append(later)
    found = np.array(reached[::-1])
    if last is not None:
        found = np.minimum(found, -least_ahead(-goal, 0, last - first))
    if first:
        shifted = np.full(count, -BEYOND)
        shifted[: max(count - first, 0)] = found[first:]
        found = np.minimum(shifted, least_ahead(keep, 0, first - 1))
    return found
