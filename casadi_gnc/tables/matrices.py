"""Checks of matrices and vectors in a problem file, with messages that say what is wrong."""

from __future__ import annotations

from functools import cache
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel

from casadi_gnc.mathematics.exact import is_number
from casadi_gnc.tables.part import Matrix

Rows = list[list[float]]

#: Largest entry of R R' - I for a rotation printed with five digits.
ROTATION_TOLERANCE = 1e-4


def check_rotation(rows: Rows) -> Rows:
    """Return a rotation as it came; raise `ValueError` telling by how much it is not one."""
    matrix = np.array(rows)
    residual = np.abs(matrix @ matrix.T - np.eye(3))
    if residual.max() > ROTATION_TOLERANCE:
        lengths = np.linalg.norm(matrix, axis=1)
        worst = int(np.argmax(np.abs(lengths - 1)))
        raise ValueError(
            f"no rotation: the largest entry of R R' - I is {residual.max():.2g}, expected below "
            f"{ROTATION_TOLERANCE:g}; row {worst + 1} has length {lengths[worst]:.4g}. Look for a mistyped entry"
        )
    if np.linalg.det(matrix) < 0:
        raise ValueError("no rotation but a reflection: its determinant is -1; one axis has the wrong sign")
    return rows


def check_inertia(rows: Rows) -> Rows:
    """Return an inertia matrix as it came; raise `ValueError` where no body can have it."""
    matrix = np.array(rows)
    if not 1e-12 < np.abs(matrix).max() < 1e12:
        raise ValueError(f"its largest entry is {np.abs(matrix).max():.3g} kg m^2, no spacecraft's; look at the unit")
    skew = np.abs(matrix - matrix.T).max()
    if skew > 1e-9 * np.abs(matrix).max():
        raise ValueError(f"not symmetric: entries differ from their mirror images by up to {skew:.3g} kg m^2")
    moments = np.linalg.eigvalsh(matrix)
    if moments[0] <= 0:
        raise ValueError(f"not positive definite: its smallest principal moment is {moments[0]:.3g} kg m^2")
    if moments[2] > (moments[0] + moments[1]) * (1 + 1e-3):
        raise ValueError(
            f"no body has these principal moments: {moments[2]:.4g} exceeds the sum of the other two, "
            f"{moments[0]:.4g} + {moments[1]:.4g} kg m^2"
        )
    return rows


def check_unit(vector: list[float], *, prefix: str = "") -> list[float]:
    """Return a direction as it came; raise `ValueError` if it has not length 1. Symbols may have any."""
    if not all(map(is_number, vector)):
        return vector
    length = float(np.linalg.norm(vector))
    if abs(length - 1) > ROTATION_TOLERANCE:
        raise ValueError(f"{prefix}a direction of length {length:.4g}, expected a unit vector")
    return vector


class Symmetric:
    """Mark the type of a key as a symmetric matrix: an entry and its mirror image are one number."""


#: The mark, for `Annotated`.
SYMMETRIC = Symmetric()
#: An inertia matrix that a body can have, [kg m^2].
Inertia = Annotated[Matrix, SYMMETRIC, AfterValidator(check_inertia)]


@cache
def symmetric_keys(model: type[BaseModel]) -> frozenset[str]:
    """Return the keys of a table that are symmetric matrices."""
    return frozenset(
        name
        for name, field in model.model_fields.items()
        if any(isinstance(mark, Symmetric) for mark in field.metadata) or _is_marked(field.annotation)
    )


def _is_marked(annotation: Any) -> bool:
    """Return whether a type, or one of the alternatives of a union, has the mark."""
    if get_origin(annotation) in (Annotated, Union, UnionType):
        return any(isinstance(each, Symmetric) or _is_marked(each) for each in get_args(annotation))
    return False
