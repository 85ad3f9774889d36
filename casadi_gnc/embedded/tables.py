"""Read the tables of CasADi's interpolants and splines, which its C generator alone gives away.

The generated text is read, never compiled: one call, and the constant arrays that it names.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import casadi as ca
import numpy as np

from casadi_gnc.errors import PrinterError

_ARRAY = re.compile(r"static const casadi_(?:real|int) (casadi_[cs]\d+)\[\d+\] =\s*\{([^}]*)\}", re.DOTALL)
_LINEAR = re.compile(r"casadi_interpn(_grad)?\(res\[0\], (\d+), (\w+), (\w+), (\w+), arg\[0\], (\w+), ?(\d+), iw, w\)")
_SEARCH = re.compile(r"casadi_low\(\*cr, [^,]+, \d+, (\d)\)")
_SPLINE = re.compile(
    r"nd_boor_eval\)?\((?:\(&\w+\)|\w+), ?(\d+), ?(\w+), ?(\w+), ?(\w+), ?(\w+), ?(\w+), ?(\d+), "
    r"?(?:\(&\w+\)|\w+), ?(\w+), ?iw, ?w\)"
)


@dataclass(frozen=True, eq=False)
class Table:
    """Hold a table over a grid, interpolated linearly or as a B-spline.

    Parameters
    ----------
    starts : where the grid (or the knots) of each dimension begins, and where the last one ends.
    grid : of all dimensions, one after the other; ascending.
    values : (outputs, points), the first dimension fastest, as one column.
    modes : of the search, by dimension: 1 where the grid is even and a division finds the place.
    outputs : numbers of a result.
    degrees : of the spline, by dimension; empty for linear tables.
    slopes : whether the result are the derivatives by each input, (outputs, dimensions), not the values.
    """

    starts: tuple[int, ...]
    grid: tuple[float, ...]
    values: tuple[float, ...]
    modes: tuple[int, ...]
    outputs: int
    degrees: tuple[int, ...] = ()
    slopes: bool = False

    @property
    def dimensions(self) -> int:
        """How many inputs there are."""
        return len(self.starts) - 1


def _text(function: ca.Function) -> tuple[str, dict[str, list[str]]]:
    generator = ca.CodeGenerator("tables.c")
    generator.add(function)
    text = generator.dump()
    return text, {
        name: [one.strip().removeprefix("casadi_") for one in body.split(",")] for name, body in _ARRAY.findall(text)
    }


def search_mode(node: ca.MX) -> int:
    """Return how `low` searches: 1 where its grid is even and a division finds the place."""
    grid, point = ca.MX.sym("grid", node.dep(0).sparsity()), ca.MX.sym("point", node.dep(1).sparsity())
    alone = ca.graph_substitute([node], [node.dep(0), node.dep(1)], [grid, point])
    return int(_SEARCH.findall(_text(ca.Function("search", [grid, point], alone))[0])[0])


def read_table(function: ca.Function, place: str) -> Table:
    """Return the table of an interpolant, or of a function that is one B-spline.

    Raises
    ------
    PrinterError
        For tables whose grid or values are arguments, or are no finite numbers.
    """
    if function.n_in() != 1 and function.class_name() != "LinearInterpolantJac":
        raise PrinterError(f"{place} is an interpolant whose values are arguments; give the values when it is made")
    try:
        text, arrays = _text(function)
    except RuntimeError as error:
        said = str(error).strip().splitlines()[-1][-200:]
        raise PrinterError(f"{place} is an interpolant that CasADi cannot write down: {said}") from None
    linear, spline = _LINEAR.findall(text), _SPLINE.findall(text)
    if len(linear) == 1:
        slopes, _, grid, starts, values, modes, outputs = linear[0]
        degrees: list[str] = []
    elif len(spline) == 1:
        slopes = ""
        _, grid, starts, degree, _, values, outputs, modes = spline[0]
        degrees = arrays[degree]
    else:
        raise PrinterError(f"{place} is an interpolant of a form that is not known here; call it once for each point")
    found = Table(
        starts=tuple(map(int, arrays[starts])),
        grid=tuple(map(float, arrays[grid])),
        values=tuple(map(float, arrays[values])),
        modes=tuple(int(one or 0) for one in arrays.get(modes, ["0"])),
        outputs=int(outputs),
        degrees=tuple(map(int, degrees)),
        slopes=bool(slopes),
    )
    if not (np.isfinite(found.grid).all() and np.isfinite(found.values).all()):
        raise PrinterError(f"{place} is a table with an entry that is no finite number; put that entry right")
    return found
