"""Advance a law's memory over one hold.

Over a hold the measurement, the wanted and the achieved effort are constants, so those signals of
the memory whose rate is affine in themselves, m' = A m + b, have the exact solution

    m(h) = m(0) + h phi1(h A) m'(0),        phi1(X) = I + X/2! + X^2/3! + ...

which needs no inverse of A. The matrix A is found by differentiation. The other signals (limited
filters, adaptive laws) are advanced by one Runge-Kutta step of order 4.

A disturbance observer takes the exact road; its own feed-through makes that right although the
plant does *not* stand still during the hold (see `casadi_gnc.laws.disturbance_observer`).
"""

from __future__ import annotations

import math
from typing import Any

import casadi as ca

from casadi_gnc.laws._law import Law
from casadi_gnc.mathematics import exact
from casadi_gnc.mathematics.integrators import runge_kutta


def advance(law: Law, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
    """Return the memory one hold later, (n,); `m` may be any expression."""
    if not law.memory.size:
        return m
    symbol = law.memory.symbol("m")
    rate = ca.SX(law.rate(t, y, symbol, wanted, achieved))
    slope = ca.jacobian(rate, symbol)
    affine = _affine_rows(law, slope, symbol)
    moved = symbol[:]
    if affine:
        exactly = law.hold * ca.mtimes(phi1(slope[affine, affine] * law.hold), rate[affine])
        moved[affine] = symbol[affine] + exactly
    others = [row for row in range(law.memory.size) if row not in affine]
    if others:
        # The measurement is held, and so is the time at which the law sees it.
        stepped = runge_kutta(lambda _, at: law.rate(t, y, at, wanted, achieved), t, symbol, law.hold)
        moved[others] = stepped[others]
    return at(moved, symbol, m)


def at(expression: Any, symbol: Any, value: Any) -> Any:
    """Return an expression of a symbol at a value of it."""
    return ca.substitute(expression, symbol, value)


def _affine_rows(law: Law, slope: ca.SX, symbol: ca.SX) -> list[int]:
    """Return the rows of the largest set of signals that is affine in itself and needs no other."""
    places = {name: range(law.memory.size)[law.memory.place(name)] for name in law.memory.names}
    kept = [name for name, rows in places.items() if not ca.depends_on(slope[list(rows), :], symbol)]
    while True:
        inside = [row for name in kept for row in places[name]]
        outside = [row for row in range(law.memory.size) if row not in inside]
        leaning = [name for name in kept if outside and slope[list(places[name]), outside].nnz()]
        if not leaning:
            return inside
        kept = [name for name in kept if name not in leaning]


def phi1(a: ca.SX) -> ca.SX:
    """Return phi1 of a constant matrix: element by element if diagonal, else scaled and doubled."""
    if a.sparsity().is_diag() or not a.nnz():
        entries = [a[i, i] for i in range(a.shape[0])]
        return ca.diag(ca.vertcat(*(exact.phi1(_number_or_symbol(entry)) for entry in entries)))
    # Taylor to X^13/14! of X = A/2^k, then phi1(2X) = (e^X + I) phi1(X)/2 k times: exact to rounding
    # for |A| up to 2^(k - 1), free of branches for symbolic gains (k = 10: up to 500).
    size = float(ca.norm_1(ca.vec(ca.DM(a)))) if a.is_constant() else 0.0
    doublings, identity = max(10, math.ceil(math.log2(size + 1)) + 1), ca.SX.eye(a.shape[0])
    x = a / 2**doublings
    phi = identity
    for order in range(14, 1, -1):
        phi = identity + ca.mtimes(x, phi) / order
    for _ in range(doublings):
        exponential = identity + ca.mtimes(x, phi)
        phi = ca.mtimes(exponential + identity, phi) / 2
        x = 2 * x
    return phi


def _number_or_symbol(entry: ca.SX) -> Any:
    return float(entry) if entry.is_constant() else entry
