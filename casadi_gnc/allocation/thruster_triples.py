"""Triples of thrusters: the answers of the linear program of least propellant, and the zonotope of half least bits.

    min p' v,   A v = U,   v >= 0,   A of three rows

has an answer of three thrusters S, v_S = B^-1 U, whose dual prices B' l = p_S break A_k' l <= p_k for no thruster k
that may be open. Which S that is depends on U; all that some U needs are found here, before the flight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from casadi_gnc.allocation.pulses import Valves

#: Three numbers.
Column = tuple[float, ...]
_ZERO = 1e-9  # of what it is compared with: rounding


@dataclass(frozen=True)
class Triple:
    """Three thrusters, and how they make an effort impulse.

    Parameters
    ----------
    thrusters : S, counted from 0.
    inverse : rows of B^-1.
    dual : l, (3,), price per effort impulse.
    """

    thrusters: tuple[int, ...]
    inverse: tuple[Column, ...]
    dual: Column


def cross(a: Sequence[Any], b: Sequence[Any]) -> Column:
    """Return a x b of two columns of three numbers."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return a' b of two columns of three numbers or expressions."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def triples(columns: Sequence[Column], prices: Sequence[float], valves: Valves) -> list[Triple]:
    """Return the triples that may be open together and that some effort impulse needs.

    Kept is S where each thruster that breaks l may be kept shut by an open one: some set of thrusters that may be open
    together has S as an answer only if so.

    Parameters
    ----------
    columns : of A, (3, N).
    prices : p, (N,), positive.
    valves : pairs that are never open together.
    """
    everyone = range(len(columns))
    partners = [{sum(pair) - k for pair in valves.never_together if k in pair} for k in everyone]
    size, found = _size(columns), []
    for chosen in combinations(everyone, 3):
        if any(j in partners[i] for i, j in combinations(chosen, 2)):
            continue
        a, b, c = (columns[i] for i in chosen)
        volume = dot(a, cross(b, c))
        if abs(volume) <= _ZERO * size**3:
            continue
        inverse = tuple(tuple(value / volume for value in cross(*pair)) for pair in ((b, c), (c, a), (a, b)))
        dual = tuple(sum(prices[i] * row[r] for i, row in zip(chosen, inverse, strict=True)) for r in range(3))
        broken: set[int] = set()
        for k in everyone:
            if dot(columns[k], dual) > prices[k] * (1 + _ZERO):
                broken.add(k)
                if not partners[k]:
                    break
        if all(partners[k] - broken for k in broken):
            found.append(Triple(chosen, inverse, dual))
    return found


def facets(columns: Sequence[Column], halves: Sequence[float]) -> list[Column]:
    """Return normals n such that the zonotope of all sum A_i d_i, |d_i| <= halves_i, is where |n' e| <= 1 for each n.

    Parameters
    ----------
    columns : of A, (3, N), of rank 3.
    halves : (N,), positive.
    """
    size, found = _size(columns), []
    for pair in combinations(columns, 2):
        normal = cross(*pair)
        if max(map(abs, normal)) <= _ZERO * size**2:
            continue
        reach = sum(abs(dot(normal, column)) * half for column, half in zip(columns, halves, strict=True))
        first = next(value for value in normal if abs(value) > _ZERO * size**2)
        scaled = tuple(value / reach if first > 0 else -value / reach for value in normal)
        near = _ZERO * max(map(abs, scaled))
        if not any(max(abs(x - y) for x, y in zip(scaled, other, strict=True)) <= near for other in found):
            found.append(scaled)
    return found


def _size(columns: Sequence[Column]) -> float:
    return max(abs(value) for column in columns for value in column)
