"""Regions of the left half plane in which a closed loop's poles are to lie, as linear matrix inequalities.

A region is { z : L + z M + conj(z) M' < 0 } with L symmetric. All eigenvalues of A lie in it exactly if some X > 0 has

    L (x) X + M (x) A X + M' (x) (A X)' < 0,

(x) being Kronecker's product (M. Chilali, P. Gahinet, 1996, doi:10.1109/9.486637, theorem 2.2):

| region | L | M |
|---|---|---|
| half plane Re z < -a | 2 a | 1 |
| disc of radius r about c | [-r, -c; -c, -r] | [0, 1; 0, 0] |
| sector: -Re z > zeta abs(z) | 0 | [s, c; -c, s] with s = sqrt(1 - zeta^2), c = zeta |

Regions are met together by one X, which for several is sufficient, not necessary.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis.lmis import Lmis


@dataclass(frozen=True, eq=False)
class Region:
    """Hold a region of poles.

    Parameters
    ----------
    name : for the reader. L, M : (k, k), see the top of the module. sentence : where its poles lie.
    """

    name: str
    L: np.ndarray
    M: np.ndarray
    sentence: str

    def pose(self, lmis: Lmis, X: ca.SX, moved: Any, margin: float) -> None:
        """State that the eigenvalues of A lie in the region, for X > 0 and A X = moved, or X A = moved for the dual."""
        stated = ca.kron(ca.DM(self.L), X) + ca.kron(ca.DM(self.M), moved) + ca.kron(ca.DM(self.M.T), moved.T)
        lmis.nsd(stated, margin=margin, name=self.name)

    def at(self, where: str) -> Region:
        """Return the region with a name that says for which of several plants it is stated."""
        return replace(self, name=f"{self.name}, {where}")

    def depth(self, pole: complex) -> float:
        """Return how deep a pole lies in the region: positive inside, in the unit of the poles."""
        stated = self.L + pole * self.M + np.conj(pole) * self.M.T
        return -float(np.linalg.eigvalsh(stated)[-1])


def half_plane(decay_1_s: float) -> Region:
    """Return the poles with a real part below -decay_1_s, a number of at least zero, [1/s]."""
    a = _number("decay_1_s", decay_1_s, least=0.0)
    return Region("decay", np.array([[2 * a]]), np.array([[1.0]]), f"have a real part below {-a:g} rad/s")


def disc(centre_rad_s: float, radius_rad_s: float) -> Region:
    """Return the poles within a distance of a point of the real axis, [rad/s]; the radius is positive."""
    c, r = _number("the centre of a disc", centre_rad_s), _number("the radius of a disc", radius_rad_s, above=0.0)
    said = f"lie within {r:g} rad/s of {c:g}"
    return Region("disc", np.array([[-r, -c], [-c, -r]]), np.array([[0.0, 1.0], [0.0, 0.0]]), said)


def fastest(radius_rad_s: float) -> Region:
    """Return the poles within a distance of zero, [rad/s]."""
    r = _number("fastest_rad_s", radius_rad_s, above=0.0)
    corner = np.array([[0.0, 1.0], [0.0, 0.0]])
    return Region("fastest pole", -r * np.eye(2), corner, f"lie within {r:g} rad/s of 0")


def sector(damping: float) -> Region:
    """Return the poles with at least a damping ratio between 0 and 1, both excluded."""
    zeta = _number("damping", damping, above=0.0, below=1.0)
    s = float(np.sqrt(1 - zeta**2))
    return Region("damping", np.zeros((2, 2)), np.array([[s, zeta], [-zeta, s]]), f"have a damping above {zeta:g}")


def regions(
    decay_1_s: float | None = None,
    damping: float | None = None,
    disc_rad_s: Sequence[float] | None = None,
    fastest_rad_s: float | None = None,
) -> tuple[Region, ...]:
    """Return the regions that are given.

    Parameters
    ----------
    decay_1_s : every pole's real part is below -decay_1_s, [1/s].
    damping : every pole's damping ratio is above this number, between 0 and 1.
    disc_rad_s : centre, on the real axis, and radius of a disc, [rad/s].
    fastest_rad_s : distance of the poles from zero, [rad/s].

    Raises
    ------
    SynthesisError
        For numbers out of range, and for regions of which two have no point in common.
    """
    found = []
    if fastest_rad_s is not None:
        found.append(fastest(fastest_rad_s))
    if decay_1_s is not None:
        found.append(half_plane(decay_1_s))
    if damping is not None:
        found.append(sector(damping))
    if disc_rad_s is not None:
        pair = list(disc_rad_s)
        if len(pair) != 2:
            raise SynthesisError(f"disc_rad_s has {len(pair)} numbers, expected two: the centre and the radius")
        found.append(disc(*pair))
    _refuse_empty(decay_1_s, disc_rad_s, fastest_rad_s)
    return tuple(found)


def _refuse_empty(decay: float | None, circle: Sequence[float] | None, reach: float | None) -> None:
    """Refuse regions without a common point of the negative real axis, which a sector holds whole."""
    slowest = [("decay_1_s", 0.0 if decay is None else -decay)]  # ends of the pieces of that axis
    quickest = [("fastest_rad_s", -np.inf if reach is None else -reach)]
    if circle is not None:
        slowest.append(("disc_rad_s", circle[0] + circle[1]))
        quickest.append(("disc_rad_s", circle[0] - circle[1]))
    (least, low), (most, high) = max(quickest, key=lambda end: end[1]), min(slowest, key=lambda end: end[1])
    if low < high:
        return
    if low >= 0:
        raise SynthesisError(
            f"{least} lies in the right half plane, where no pole of a loop may be; move it to the left"
        )
    raise SynthesisError(
        f"no pole meets both {least} and {most}: the one holds poles above {low:g} rad/s on the real axis, the other "
        f"below {high:g}; change one of them"
    )


def _number(name: str, value: Any, least: float = -np.inf, above: float = -np.inf, below: float = np.inf) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not np.isfinite(value):
        raise SynthesisError(f"{name} is {value!r}, expected a finite number")
    if not (least <= value < below and value > above):
        wanted = f"above {above:g}" if above > -np.inf else f"of at least {least:g}"
        wanted += f" and below {below:g}" if np.isfinite(below) else ""
        raise SynthesisError(f"{name} is {value:g}, expected a number {wanted}")
    return float(value)
