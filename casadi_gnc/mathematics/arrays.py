"""Arrays of real numbers from whatever a caller has: the one place where kinds of arrays are taken or refused.

Taken: lists, tuples, arrays of whole or floating numbers of any size and byte order, sparse matrices (scipy), CasADi's
DM, arrays of objects that are numbers, masked arrays without a masked entry. Refused with a sentence: complex numbers,
text, truth values and dates, rows of different length, masked entries, symbols.
"""

from __future__ import annotations

from numbers import Real
from typing import Any

import numpy as np

_SHOWN = 8  # rows of a ragged matrix, or characters of an entry, that a sentence names


def real_array(name: str, value: Any, error: type[Exception] = ValueError) -> np.ndarray:
    """Return a new array of native doubles, any shape; raise `error` with a sentence that names the array.

    Examples
    --------
    >>> real_array("A", [[1, 2], [3, 4]]).dtype.name
    'float64'
    >>> real_array("A", [[1j]])
    Traceback (most recent call last):
    ...
    ValueError: A holds complex numbers, expected real ones; give real and imaginary parts as rows of their own
    """
    if type(value) is np.ndarray and value.dtype == np.float64:
        return np.array(value, dtype=float)
    held: Any = value
    if isinstance(value, np.ma.MaskedArray):
        if np.any(np.ma.getmaskarray(value)):
            raise error(f"{name} has masked entries, expected numbers everywhere; fill them first")
        held = value.data
    if hasattr(held, "toarray") and hasattr(held, "nnz") and not callable(held.nnz):  # scipy's sparse
        held = held.toarray()
    elif hasattr(held, "full") and hasattr(held, "is_constant"):  # CasADi's
        held = held.full()
    elif hasattr(held, "is_constant"):
        raise error(f"{name} holds symbols of CasADi, expected numbers")
    try:
        array = np.asarray(held)
    except (TypeError, ValueError):
        raise error(f"{name} is no array of numbers: {_ragged(held)}") from None
    kind = array.dtype.kind
    if kind == "O":
        return _from_objects(name, array, error)
    if kind == "c":
        raise error(
            f"{name} holds complex numbers, expected real ones; give real and imaginary parts as rows of their own"
        )
    if kind not in "iuf":
        word = {"b": "truth values", "U": "text", "S": "text", "M": "dates", "m": "times"}.get(kind, "no numbers")
        raise error(f"{name} holds {word}, expected numbers")
    with np.errstate(over="ignore"):  # larger than a double becomes infinite, which the caller judges
        return array.astype(float)


def _from_objects(name: str, array: np.ndarray, error: type[Exception]) -> np.ndarray:
    found = np.empty(array.shape)
    for place, entry in np.ndenumerate(array):
        if isinstance(entry, (complex, np.complexfloating)):
            raise error(f"{name} holds complex numbers, expected real ones; give real and imaginary parts as rows")
        good = isinstance(entry, Real) and not isinstance(entry, (bool, np.bool_))
        if not good:
            if isinstance(entry, (list, tuple, np.ndarray)):
                raise error(f"{name} is no array of numbers: {_ragged(array.tolist())}")
            raise error(f"{name} holds {str(entry)[:_SHOWN]!r} ({type(entry).__name__}), expected numbers")
        try:
            found[place] = float(entry)
        except OverflowError:
            raise error(f"{name} holds a number too large for a double") from None
    return found


def _ragged(value: Any) -> str:
    """Return what is wrong with rows that do not fit each other."""
    try:
        lengths = [len(row) for row in value]
    except TypeError:
        return "numbers stand beside rows"
    listed = ", ".join(str(length) for length in lengths[:_SHOWN]) + (", ..." if len(lengths) > _SHOWN else "")
    if len(set(lengths)) > 1:
        return f"rows of different length: {listed}"
    return "its parts have different shapes"
