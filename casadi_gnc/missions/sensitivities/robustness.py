"""The robustness of a formula and how much each margin counts in it: exact, or its smooth companion.

Every least and largest becomes a soft one of the same temperature (`casadi_gnc.mathematics.soft`); what is off by at
most `slack` adds up from the inside out. The exact robustness is that at temperature 0.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from casadi_gnc.mathematics.soft import slack, soft_maximum, soft_minimum
from casadi_gnc.missions.requirements.tree import BEYOND, Held, Join, Margin, Node, Until, Window

#: Values at some instants; what takes how much they count and adds it to the margins; the bound of their error.
_Values = tuple[np.ndarray, Callable[[np.ndarray], None], float]


def weighed_robustness(tree: Node, margins: np.ndarray, temperature: float) -> tuple[float, np.ndarray, float]:
    """Return the robustness at the first sample, its derivatives by the margins, (M, K), and the bound of its error.

    Parameters
    ----------
    tree : of `casadi_gnc.missions.requirements.tree`.
    margins : (M, K), of each comparison at each sample.
    temperature : in the unit of the margins; 0 for the robustness itself.
    """
    walk = _Walk(margins, temperature)
    (value,), pull, bound = walk.at(tree, np.zeros(1, dtype=int))
    pull(np.ones(1))
    return float(value), walk.counts, bound


class _Walk:
    def __init__(self, margins: np.ndarray, temperature: float) -> None:
        self._margins, self._temperature = margins, temperature
        self._count = margins.shape[1]
        self.counts = np.zeros(margins.shape)

    def at(self, node: Node, instants: np.ndarray) -> _Values:
        """Return a node at some instants, which rise."""
        if isinstance(node, Margin):

            def pull(bars: np.ndarray) -> None:
                np.add.at(self.counts[node.number], instants, bars)

            return self._margins[node.number, instants], pull, 0.0
        if isinstance(node, Join):
            return self._joined(node, instants)
        if isinstance(node, Until):
            return self._until(node, instants)
        assert isinstance(node, (Window, Held))
        return self._windows(node, instants)

    def _best(self, every: bool) -> Callable[[np.ndarray, float], tuple[float, np.ndarray]]:
        return soft_minimum if every else soft_maximum

    def _joined(self, node: Join, instants: np.ndarray) -> _Values:
        parts = [self.at(part, instants) for part in node.parts]
        table, best = np.array([values for values, _, _ in parts]), self._best(node.every)
        found = [best(column, self._temperature) for column in table.T]
        weights = np.array([weight for _, weight in found]).T

        def pull(bars: np.ndarray) -> None:
            for (_, each, _), weight in zip(parts, weights, strict=True):
                each(weight * bars)

        bound = max(bound for _, _, bound in parts) + slack(len(parts), self._temperature)
        return np.array([value for value, _ in found]), pull, bound

    def _windows(self, node: Window | Held, instants: np.ndarray) -> _Values:
        if isinstance(node, Held):
            firsts, lasts, none = instants - node.samples, instants, -BEYOND
        else:
            end = self._count - 1
            firsts = instants + node.first
            lasts = np.full(len(instants), end) if node.last is None else np.minimum(instants + node.last, end)
            none = BEYOND
        there = (firsts >= 0) & (lasts >= firsts)
        if not there.any():
            return np.full(len(instants), none if node.every else -none), lambda bars: None, 0.0
        low, high = int(firsts[there].min()), int(lasts[there].max())
        inner, further, bound = self.at(node.part, np.arange(low, high + 1))
        best, values = self._best(node.every), np.full(len(instants), none if node.every else -none)
        spans = [(int(a) - low, int(b) - low + 1) for a, b in zip(firsts, lasts, strict=True)]
        for i in np.flatnonzero(there):
            values[i] = best(inner[slice(*spans[i])], self._temperature)[0]

        def pull(bars: np.ndarray) -> None:
            total = np.zeros(len(inner))
            for i in np.flatnonzero(there & (bars != 0)):
                total[slice(*spans[i])] += bars[i] * best(inner[slice(*spans[i])], self._temperature)[1]
            further(total)

        return values, pull, bound + slack(int((lasts - firsts).max()) + 1, self._temperature)

    def _until(self, node: Until, instants: np.ndarray) -> _Values:
        """Return the largest of the least of `goal` and all of `keep` before it, or the contrary."""
        sign, low = (-1.0 if node.every else 1.0), int(instants[0])
        inner = np.arange(low, self._count)
        keep, keeps, first_bound = self.at(node.keep, inner)
        goal, goals, second_bound = self.at(node.goal, inner)
        keep, goal = sign * keep, sign * goal
        T, widest = self._temperature, 1

        def reached(start: int) -> tuple[list[int], np.ndarray]:
            end = self._count - 1 if node.last is None else min(start + low + node.last, self._count - 1)
            ends = list(range(start + node.first, end - low + 1))
            return ends, np.array([soft_minimum(np.append(keep[start:j], goal[j]), T)[0] for j in ends])

        values = np.full(len(instants), -BEYOND)
        for i, instant in enumerate(instants):
            ends, found = reached(int(instant) - low)
            if ends:
                values[i] = soft_maximum(found, T)[0]
                widest = max(widest, ends[-1] - int(instant) + low + 1)

        def pull(bars: np.ndarray) -> None:
            kept, aimed = np.zeros(len(inner)), np.zeros(len(inner))
            for i in np.flatnonzero(bars):
                start = int(instants[i]) - low
                ends, found = reached(start)
                for j, weight in zip(ends, soft_maximum(found, T)[1] if ends else (), strict=True):
                    if weight:
                        counts = bars[i] * weight * soft_minimum(np.append(keep[start:j], goal[j]), T)[1]
                        kept[start:j] += counts[:-1]
                        aimed[j] += counts[-1]
            keeps(kept)
            goals(aimed)

        return sign * values, pull, max(first_bound, second_bound) + 2 * slack(widest, T)
