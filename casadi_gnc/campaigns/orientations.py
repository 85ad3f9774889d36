"""Random directions and random rotations, as maps from the unit cube.

A rotation is told as the house does, v_B = C v_N (`casadi_gnc.mechanics.attitude`): as modified Rodrigues parameters,
e tan(angle/4), or as a quaternion, e sin(angle/2) and cos(angle/2), of the turn by an angle about the unit axis e.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from casadi_gnc.campaigns.distributions import Distribution, normals
from casadi_gnc.errors import CampaignError
from casadi_gnc.mathematics import elementary, exact

Form = Literal["mrp", "quaternion_scalar_first", "quaternion_scalar_last"]


@dataclass(frozen=True)
class Direction(Distribution):
    """Vectors whose direction is uniform on a sphere, or on the part of it around an axis.

    Parameters
    ----------
    length : of the vectors.
    length_to : if given, lengths are uniform from `length` to this one.
    about : (3,), the axis, of any length but zero.
    within_rad : largest angle to the axis, above 0, at most pi.
    """

    length: float = 1.0
    length_to: float | None = None
    about: tuple[float, float, float] = (0.0, 0.0, 1.0)
    within_rad: float = math.pi

    def __post_init__(self) -> None:
        if not any(self.about):
            raise CampaignError("the axis of a direction is zero; expected a vector")

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """2, or 3 with lengths."""
        return 2 if self.length_to is None else 3

    @property
    def values(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Three."""
        return 3

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return vectors; the cosine of the angle to the axis is uniform (Archimedes)."""
        _, sine = exact.cos_sin(0.5 * self.within_rad)
        vectors = _on_sphere(points[:, 0], points[:, 1], 2.0 * sine * sine, _frame(self.about))
        if self.length_to is None:
            return self.length * vectors
        return (self.length * (1.0 - points[:, 2]) + self.length_to * points[:, 2])[:, None] * vectors


@dataclass(frozen=True)
class Rotation(Distribution):
    """Attitudes: all alike, or turned from one by a normal angle about a random axis.

    All alike: Shoemake (1992), doi:10.1016/B978-0-08-050755-2.50036-1.

    Parameters
    ----------
    form : how an attitude is written.
    deviation_rad : standard deviation of the angle; None for attitudes that are all alike.
    truncate : the angle stays within so many deviations.
    nominal : the attitude that is turned, in the same form; none at all if None. It matters only with a deviation.
    """

    form: Form = "mrp"
    deviation_rad: float | None = None
    truncate: float | None = None
    nominal: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if self.nominal is None:
            return
        if len(self.nominal) != self.values:
            raise CampaignError(f"the nominal attitude has {len(self.nominal)} numbers; expected {self.values}")
        if self.form != "mrp" and abs(math.hypot(*self.nominal) - 1.0) > 1e-4:
            raise CampaignError(f"the nominal quaternion has length {math.hypot(*self.nominal):.4g}; expected 1")

    @property
    def dimensions(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Three: of the sphere of quaternions, or of axis and angle."""
        return 3

    @property
    def values(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Three, or four of a quaternion."""
        return 3 if self.form == "mrp" else 4

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return attitudes; of the two that mean the same, that of the turn by at most half a revolution."""
        if self.deviation_rad is None:
            vector, scalar = _uniform(points)
        else:
            half = 0.5 * self.deviation_rad * normals(points[:, 2], self.truncate)
            sine, scalar = elementary.sin_cos(half)
            vector = sine[:, None] * _on_sphere(points[:, 0], points[:, 1], 2.0, _frame((0.0, 0.0, 1.0)))
            if self.nominal is not None:
                vector, scalar = _turned(vector, scalar, *_quaternion(self.nominal, self.form))
        sign = np.where(scalar < 0.0, -1.0, 1.0)
        vector, scalar = sign[:, None] * vector, sign * scalar
        if self.form == "mrp":
            return vector / (1.0 + scalar)[:, None]
        parts = (scalar[:, None], vector) if self.form == "quaternion_scalar_first" else (vector, scalar[:, None])
        return np.hstack(parts)


def _on_sphere(across: np.ndarray, around: np.ndarray, depth: float, frame: list[list[float]]) -> np.ndarray:
    """Return unit vectors on the cap of a depth, 2 for the whole sphere, about the third axis of a frame."""
    fallen = depth * across
    sine = np.sqrt(fallen * (2.0 - fallen))
    turn = elementary.sin_cos(2.0 * math.pi * around)
    parts = (sine * turn[1], sine * turn[0], 1.0 - fallen)
    columns = [sum(part * axis[i] for part, axis in zip(parts, frame, strict=True)) for i in range(3)]
    return np.stack(columns, axis=1)


def _frame(about: tuple[float, float, float]) -> list[list[float]]:
    """Return three unit axes at right angles, the third along a vector."""
    third = _unit(about)
    flat = min(range(3), key=lambda i: abs(third[i]))
    # Right-handed and, about z, the axes x and y themselves.
    first = _unit([(1.0 if i == flat else 0.0) - third[flat] * third[i] for i in range(3)])
    second = [third[i - 2] * first[i - 1] - third[i - 1] * first[i - 2] for i in range(3)]
    return [first, second, third]


def _unit(vector: tuple[float, float, float] | list[float]) -> list[float]:
    largest = max(abs(each) for each in vector)
    scaled = [each / largest for each in vector]
    length = math.sqrt(scaled[0] * scaled[0] + scaled[1] * scaled[1] + scaled[2] * scaled[2])
    return [each / length for each in scaled]


def _uniform(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vector and scalar of quaternions that are uniform on their sphere."""
    low, high = np.sqrt(1.0 - points[:, 0]), np.sqrt(points[:, 0])
    sine_1, cosine_1 = elementary.sin_cos(2.0 * math.pi * points[:, 1])
    sine_2, cosine_2 = elementary.sin_cos(2.0 * math.pi * points[:, 2])
    return np.stack([low * sine_1, low * cosine_1, high * sine_2], axis=1), high * cosine_2


def _quaternion(attitude: tuple[float, ...], form: Form) -> tuple[list[float], float]:
    """Return vector and scalar of an attitude, of length 1."""
    if form == "mrp":
        square = attitude[0] * attitude[0] + attitude[1] * attitude[1] + attitude[2] * attitude[2]
        return [2.0 * each / (1.0 + square) for each in attitude], (1.0 - square) / (1.0 + square)
    length = math.sqrt(sum(each * each for each in attitude))
    parts = [each / length for each in attitude]
    return (parts[1:], parts[0]) if form == "quaternion_scalar_first" else (parts[:3], parts[3])


def _turned(
    vector: np.ndarray, scalar: np.ndarray, first: list[float], first_scalar: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the quaternions of C(vector, scalar) C(first): first turned once more."""
    columns = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        across = vector[:, j] * first[k] - vector[:, k] * first[j]
        columns.append(first_scalar * vector[:, i] + scalar * first[i] - across)
    along = vector[:, 0] * first[0] + vector[:, 1] * first[1] + vector[:, 2] * first[2]
    return np.stack(columns, axis=1), scalar * first_scalar - along
