"""The one place where what libraries raise about numbers of a file becomes a sentence about the file.

A file may have numbers that are each in range and overflow together (gains near 1e308), or leave a matrix without an
inverse. What computes with them says so in many ways and in its own words; whoever wrote the file is told where the
largest number stands. An error of ours is none of these, and goes on as it is.
"""

from __future__ import annotations

import os
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

import casadi_gnc
from casadi_gnc.errors import GncError, ProblemError
from casadi_gnc.problem_files.document import Document, read
from casadi_gnc.problem_files.toml_text import extreme

#: What arithmetic raises, wherever it is.
_OF_NUMBERS = (ArithmeticError, np.linalg.LinAlgError, MemoryError, RecursionError)
#: What libraries raise for numbers that they cannot take, where the innermost code is theirs.
_OF_LIBRARIES = (ValueError, RuntimeError, TypeError)
_LIBRARIES = {"numpy", "scipy", "casadi", "clarabel", "scs", "proxsuite", "qpsolvers", "daqp"}
_OWN = str(Path(casadi_gnc.__file__).parent) + os.sep
#: Magnitude beyond which a number is named as the likely cause.
_LARGE = 1e12


@contextmanager
def about(problem: str | Path | Document) -> Iterator[None]:
    """Name the file in whatever is wrong inside; what is raised about numbers becomes a `ProblemError` about them.

    Warnings of the same by NumPy and SciPy are silent inside: statuses and checks tell what is not finite.
    """
    name = problem.path.name if isinstance(problem, Document) else Path(problem).name
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            yield
    except ProblemError as error:
        if error.place or name in str(error):
            raise
        raise ProblemError(str(error), name) from None
    except GncError as error:
        if name not in str(error):
            error.args = (f"{name}: {error}",)
        raise
    except (*_OF_NUMBERS, *_OF_LIBRARIES) as error:
        if not isinstance(error, _OF_NUMBERS) and not _is_of_a_library(error):
            raise
        raise _sentence(problem if isinstance(problem, Document) else read(problem), error) from error


def _is_of_a_library(error: BaseException) -> bool:
    """Return whether the innermost code that an error came from is that of a library below."""
    frames = traceback.extract_tb(error.__traceback__)
    last = frames[-1].filename if frames else _OWN
    return not last.startswith(_OWN) and (last.startswith("<") or not _LIBRARIES.isdisjoint(last.split(os.sep)))


def _sentence(document: Document, error: BaseException) -> ProblemError:
    found = extreme(document.data)
    if isinstance(error, (MemoryError, RecursionError)):
        return ProblemError("asks for more memory than there is; look for a size that is too large", document.path.name)
    what = "its numbers, each in range, overflow together or leave a matrix without an inverse"
    if found is None or abs(found[1]) < _LARGE:
        return ProblemError(f"{what}; look for values of another unit, or that are all zero", document.path.name)
    return ProblemError(f"{what}; the largest, {found[1]:.3g}, stands here", document.place(found[0]))
