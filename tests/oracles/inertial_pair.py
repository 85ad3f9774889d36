"""Chaser and target as two free bodies in the inertial frame, in as many digits as one likes.

Independent of the library on purpose: absolute positions and velocities, direction cosine matrices
that are integrated themselves, no relative equation anywhere. The relative state is read off by its
definition, Sun and Zheng (2018), eq. (6), from numbers of 30 digits, so that what a difference of two
positions near 1e9 m loses does not matter.
"""

from dataclasses import dataclass

import mpmath
import numpy as np
from scipy.integrate import DOP853

mpmath.mp.dps = 30
MU = 3.986e14


def exactly(values) -> np.ndarray:
    return np.vectorize(mpmath.mpf, otypes=[object])(np.asarray(values, dtype=object))


def cross(a, b) -> np.ndarray:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]], dtype=object)


def skew(a) -> np.ndarray:
    zero = mpmath.mpf(0)
    return np.array([[zero, -a[2], a[1]], [a[2], zero, -a[0]], [-a[1], a[0], zero]], dtype=object)


def turn(s) -> np.ndarray:
    """Return R(sigma), eq. (4)."""
    n, across = s @ s, skew(s)
    return exactly(np.eye(3)) - (4 * (1 - n) * across - 8 * across @ across) / (1 + n) ** 2


@dataclass
class Pair:
    """Constants: mass, inertia and its inverse, the target's, and p_t; numbers of many digits."""

    mass: float
    inertia: np.ndarray
    inverse: np.ndarray
    target_inertia: np.ndarray
    target_inverse: np.ndarray
    point: np.ndarray

    @classmethod
    def of(cls, mass, inertia, target_inertia, point):
        own, other = (exactly((mpmath.matrix(m) ** -1).tolist()) for m in (inertia, target_inertia))
        return cls(mpmath.mpf(mass), exactly(inertia), own, exactly(target_inertia), other, exactly(point))

    def begin(self, relative, position, velocity, rate) -> np.ndarray:
        """Return the absolute state of r_e, sigma_e, v_e, omega_e; the chaser's frame is the inertial one."""
        re, se, ve, we = (exactly(relative[i : i + 3]) for i in (0, 3, 6, 9))
        r, v, w, back = exactly(position), exactly(velocity), exactly(rate), turn(se).T
        wt = back @ (w - we)
        rt, vt = back @ (r - re) - self.point, back @ (v - ve) - cross(wt, self.point)
        return np.concatenate([r, v, exactly(np.eye(3)).ravel(), w, back.T @ rt, back.T @ vt, back.ravel(), wt])

    def rate(self, x, force, torque) -> np.ndarray:
        """Return x': Newton, Euler, A' = -S(omega) A, twice."""
        halves = []
        for part, inertia, inverse, push, twist in (
            (x[:18], self.inertia, self.inverse, force / self.mass, torque),
            (x[18:], self.target_inertia, self.target_inverse, None, None),
        ):
            r, v, a, w = part[:3], part[3:6], part[6:15].reshape(3, 3), part[15:]
            pull = -MU / mpmath.sqrt(r @ r) ** 3 * r
            moment = -cross(w, inertia @ w)
            if push is not None:
                pull, moment = pull + a.T @ push, moment + twist
            halves += [v, pull, -(skew(w) @ a).ravel(), inverse @ moment]
        return np.concatenate(halves)

    def step(self, x, h, force, torque) -> np.ndarray:
        """Return x after one step of the explicit Runge-Kutta method of order 8 of Dormand and Prince."""
        slopes = []
        for row in DOP853.A[: DOP853.n_stages]:
            moved = sum((h * a * k for a, k in zip(row, slopes, strict=False) if a), 0 * x)
            slopes.append(self.rate(x + moved, force, torque))
        return x + sum(h * b * k for b, k in zip(DOP853.B, slopes, strict=True) if b)

    def relative(self, x) -> dict[str, np.ndarray]:
        """Return r_e, R, v_e and omega_e by their definition, and q."""
        r, v, a, w = x[:3], x[3:6], x[6:15].reshape(3, 3), x[15:18]
        rt, vt, b, wt = x[18:21], x[21:24], x[24:33].reshape(3, 3), x[33:]
        r_ct = a @ b.T
        return {
            "position_error": a @ (r - rt) - r_ct @ self.point,
            "turn": r_ct,
            "velocity_error": a @ (v - vt) - r_ct @ cross(wt, self.point),
            "rate_error": w - r_ct @ wt,
            "separation": a @ (r - rt),
        }
