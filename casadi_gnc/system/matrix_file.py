"""Matrices from files: numbers in rows apart by commas, and MATLAB's .mat, versions 4 to 7."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from casadi_gnc.errors import ProblemError
from casadi_gnc.system.csv_file import number
from casadi_gnc.system.reading import bytes_of, text_of

#: Largest file that is read [bytes].
LARGEST = 16_000_000


def read_matrix(told: str, folder: Path) -> list[list[float]]:
    r"""Return a matrix as rows.

    Parameters
    ----------
    told : "plant.csv", rows of numbers without a line of names, or "plant.mat:A", the variable A of that file.
    folder : where the file is looked for.

    Raises
    ------
    ProblemError
        With file and line, for what is no matrix of finite numbers.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "plant.csv").write_text("# position, rate\n0, 1\n-1e-6, 0\n")
    ...     read_matrix("plant.csv", Path(folder))
    [[0.0, 1.0], [-1e-06, 0.0]]
    """
    name, _, variable = told.partition(".mat:")
    if variable:
        return _of_mat(folder / f"{name}.mat", variable)
    if told.endswith(".csv"):
        return _of_csv(folder / told)
    raise ProblemError(
        f'{told!r} names no matrix; write its rows, "FILE.csv", or "FILE.mat:NAME" with the name of the variable'
    )


def _of_csv(path: Path) -> list[list[float]]:
    rows: list[list[float]] = []
    for line, text in enumerate(text_of(path, largest=LARGEST).splitlines(), 1):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        try:
            row = [number(entry.strip()) for entry in text.split(",")]
        except ValueError as error:
            raise ProblemError(f"{error}; a matrix has no line of names", f"{path.name}, line {line}") from None
        if rows and len(row) != len(rows[0]):
            raise ProblemError(
                f"has {len(row)} numbers, and the first row {len(rows[0])}; expected rows of one length",
                f"{path.name}, line {line}",
            )
        rows.append(row)
    return _finite(rows, path.name)


def _of_mat(path: Path, variable: str) -> list[list[float]]:
    from scipy import io as formats

    content = io.BytesIO(bytes_of(path, largest=LARGEST))
    try:
        known = [name for name, _, _ in formats.whosmat(content)]
        content.seek(0)
        found = formats.loadmat(content, variable_names=[variable]) if variable in known else {}
    except NotImplementedError:  # version 7.3 is another format
        raise ProblemError("is of MATLAB's version 7.3; save it with -v7", path.name) from None
    except Exception as error:  # whatever SciPy says of a file that is none
        raise ProblemError(f"cannot be read as a .mat file: {error}", path.name) from None
    if variable not in found:
        raise ProblemError(f"has no variable {variable!r}; there is {', '.join(known) or 'none'}", path.name)
    matrix = found[variable]
    if not isinstance(matrix, np.ndarray) or matrix.ndim != 2 or matrix.dtype.kind not in "fiub":
        raise ProblemError(
            f"its variable {variable!r} is no matrix of real numbers, full, of two dimensions", path.name
        )
    return _finite(matrix.astype(float).tolist(), path.name)


def _finite(rows: list[list[float]], name: str) -> list[list[float]]:
    if not rows or not rows[0]:
        raise ProblemError("holds no number, expected the rows of a matrix", name)
    if not np.isfinite(np.array(rows)).all():
        raise ProblemError("holds a number that is not finite", name)
    return rows
