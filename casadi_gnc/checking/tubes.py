"""Where the states of an uncertain linear loop are at each sample, whatever varies within its box.

The loop at the centre of the box is followed, and its slopes by each number that varies; what they leave is of second
order, and lies in an ellipsoid that a proved contraction makes smaller from sample to sample. With s the state at the
centre and S_i its slope by d_i,

    e' = A(p) e + sum_ij d_i d_j A_j S_i + rests,     sqrt(e' P e) <= radius,

so a state is within sum_i abs(S_i) + radius sqrt(diag(P^-1)) of s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from casadi_gnc.checking.uncertain_loop import UncertainLoop
from casadi_gnc.mathematics.intervals import Interval
from casadi_gnc.synthesis.contraction import Contraction, contraction

#: Rates that are tried: this share of the way from 1 to the loop's own; the last ones where no other is proved.
_SHARES, _LAST = (0.9, 0.5), (0.2, 0.05, 0.005)
#: Perturbations and states together of which inequalities are posed.
_MOST = 60
#: What computed sums are widened by, relative.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Tube:
    """Hold what contains the states of a loop.

    Parameters
    ----------
    states : (n, K), at each sample, in their own units.
    proof : of the contraction, with states in `units`.
    units : (n,).
    """

    states: Interval
    proof: Contraction
    units: np.ndarray


def tubes(of: UncertainLoop) -> list[Tube]:
    """Return a tube for each rate of contraction that is proved, none where nothing is; a state is in all of them."""
    nominal, slopes = followed(of)
    units = np.abs(nominal).max(axis=1) + np.abs(slopes).max(axis=2).sum(axis=0)
    units = np.where(units > 0, units, 1.0)
    one = of.as_map(units)
    if one.radius >= 1 or of.size + sum(each.shape[1] for each in one.left) > _MOST:
        return []
    found = []
    for share in (*_SHARES, *_LAST):
        if share in _LAST and found:
            break
        proof = contraction(one, 1.0 - share * (1.0 - one.radius))
        if proof is not None:
            found.append(_tube(of, proof, units, nominal, slopes))
    return found


def followed(of: UncertainLoop) -> tuple[np.ndarray, np.ndarray]:
    """Return the states at the centre, (n, K), and their slopes by each d_i, (P, n, K)."""
    A, parts = of.square(of.A.centre), np.array([of.square(each) for each in of.A.parts]).reshape(-1, of.size, of.size)
    count = of.b.centre.shape[-1]
    states, slopes = np.zeros((of.size, count)), np.zeros((len(parts), of.size, count))
    now, slope = of.start.centre, of.start.parts
    for k in range(count):
        states[:, k], slopes[:, :, k] = now, slope
        slope = slope @ A.T + parts @ now + of.b.parts[:, :, k]
        now = A @ now + of.b.centre[:, k]
    return states, slopes


def _tube(of: UncertainLoop, proof: Contraction, units: np.ndarray, nominal: np.ndarray, slopes: np.ndarray) -> Tube:
    root = np.linalg.cholesky(proof.P).T / units  # the norm of root @ s is that of s in P
    length = np.sqrt(np.diag(proof.P)) / units
    reach = np.abs(slopes).sum(axis=0)
    pushed = length @ (of.square(of.A.rest) @ (np.abs(nominal) + reach) + of.b.rest)
    for entries in of.A.parts:
        if np.any(entries):
            moved = root @ of.square(entries)
            pushed += np.linalg.norm(moved @ slopes, axis=1).sum(axis=0)
    radius = np.zeros(nominal.shape[1])
    now = float(length @ of.start.rest)
    for k, push in enumerate(pushed):
        radius[k] = now
        now = proof.rate * now + float(push)
    widest = units * np.sqrt(np.diag(np.linalg.inv(proof.P)))
    wide = reach + widest[:, None] * radius
    wide += _ROUNDING * (wide + np.abs(nominal) + 1e-12 * units[:, None])
    middle = of.target[:, None] + nominal
    return Tube(Interval(middle - wide, middle + wide), proof, units)
