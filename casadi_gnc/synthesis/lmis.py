"""Declare unknown matrices, state LMIs in CasADi symbols, solve, certify."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import SynthesisError
from casadi_gnc.synthesis import backends
from casadi_gnc.synthesis.answer import LmiAnswer, LmiStatus, Verdict
from casadi_gnc.synthesis.backends import Found
from casadi_gnc.synthesis.conic import ConicData, Kind
from casadi_gnc.synthesis.extraction import Constraint, extract
from casadi_gnc.synthesis.looks import Looks, first_scaling
from casadi_gnc.synthesis.proofs import Reach
from casadi_gnc.synthesis.unknowns import Unknown, as_sx, diagonal_index, symmetric_index, unknown

_FAR = 1e4  # natural sizes beyond which an unknown may run to infinity
_MOST_SOUGHT = 24  # constraints among which a smallest conflict is sought by leaving out one after another


class Lmis:
    """Collect unknowns and constraints, then `solve`.

    Examples
    --------
    The largest P with A'P + PA + Q - PBB'P >= 0 is the cost of the linear-quadratic regulator:

    >>> import casadi as ca
    >>> lmis = Lmis()
    >>> P = lmis.symmetric("P", 1)
    >>> lmis.psd(ca.blockcat([[2 * P + 3, P], [P, 1]]), margin=0, name="Riccati")
    >>> lmis.minimize(-P)
    >>> round(float(lmis.solve().unknowns["P"][0, 0]), 6)
    3.0
    """

    def __init__(self) -> None:
        self._unknowns: dict[str, Unknown] = {}
        self._constraints: dict[str, Constraint] = {}
        self._objective = ca.SX(0)
        self._data: ConicData | None = None  # of what is stated so far

    def symmetric(self, name: str, size: int) -> ca.SX:
        """Return an unknown symmetric matrix, (size, size), of any definiteness."""
        return self._declare(name, symmetric_index(_size(name, size)))

    def rectangular(self, name: str, rows: int, columns: int) -> ca.SX:
        """Return an unknown full matrix, (rows, columns)."""
        return self._declare(name, np.arange(_size(name, rows) * _size(name, columns)).reshape(rows, columns))

    def diagonal(self, name: str, size: int) -> ca.SX:
        """Return an unknown diagonal matrix, (size, size)."""
        return self._declare(name, diagonal_index(_size(name, size), equal=False))

    def scaled_identity(self, name: str, size: int) -> ca.SX:
        """Return an unknown multiple of the identity, (size, size)."""
        return self._declare(name, diagonal_index(_size(name, size), equal=True))

    def scalar(self, name: str) -> ca.SX:
        """Return an unknown number, (1, 1)."""
        return self._declare(name, np.zeros((1, 1), dtype=int))

    def _declare(self, name: str, index: np.ndarray) -> ca.SX:
        if name in self._unknowns:
            raise SynthesisError(f"unknown {name!r} is declared twice; give the second another name")
        self._unknowns[name], self._data = unknown(name, index), None
        return self._unknowns[name].expression

    def psd(self, expression: Any, *, margin: float | None = None, name: str | None = None) -> None:
        """Ask that expression - margin I is positive semidefinite.

        Parameters
        ----------
        expression : (m, m), affine in the unknowns, symmetric.
        margin : at least 0, in the unit of the expression. It is required: solvers know no strict
            inequality. At a certified point half of it is left; zero asks for no more than
            semidefinite, and only an answer that keeps it to rounding is certified.
        name : for messages and certificates.
        """
        matrix = as_sx(expression)
        if matrix.shape[0] != matrix.shape[1]:
            raise SynthesisError(
                f"constraint {self._name(name)!r} has shape {matrix.shape}, expected a square matrix; check its blocks"
            )
        self._add(name, Kind.SEMIDEFINITE, matrix, margin)

    def nsd(self, expression: Any, *, margin: float | None = None, name: str | None = None) -> None:
        """Ask that expression + margin I is negative semidefinite; arguments as for `psd`."""
        self.psd(-as_sx(expression), margin=margin, name=name)

    def nonnegative(self, expression: Any, *, margin: float | None = None, name: str | None = None) -> None:
        """Ask that every element of an affine expression is at least the margin; arguments as for `psd`."""
        self._add(name, Kind.NONNEGATIVE, as_sx(expression), margin)

    def equal(self, expression: Any, *, name: str | None = None) -> None:
        """Ask that every element of an affine expression is zero."""
        self._add(name, Kind.EQUAL, as_sx(expression), 0.0)

    def minimize(self, expression: Any) -> None:
        """Set the objective, an affine scalar; by default any point will do."""
        objective = as_sx(expression)
        if objective.shape != (1, 1):
            raise SynthesisError(f"the objective has shape {objective.shape}, expected a scalar; take its trace or sum")
        self._objective, self._data = objective, None

    def _name(self, name: str | None) -> str:
        return name if name is not None else f"constraint {len(self._constraints) + 1}"

    def _add(self, name: str | None, kind: Kind, expression: ca.SX, margin: float | None) -> None:
        name = self._name(name)
        if name in self._constraints:
            raise SynthesisError(f"constraint {name!r} is stated twice; give the second another name")
        if margin is None:
            raise SynthesisError(
                f"constraint {name!r} has no margin; give margin=..., in the unit of the expression: "
                "solvers know no strict inequality (0 asks for semidefinite only)"
            )
        if not (isinstance(margin, (int, float)) and np.isfinite(margin) and margin >= 0):
            raise SynthesisError(f"constraint {name!r} has margin {margin!r}, expected a finite number, at least 0")
        if expression.is_empty():
            raise SynthesisError(f"constraint {name!r} is empty; leave it out")
        self._constraints[name], self._data = Constraint(name, kind, expression, float(margin)), None

    def data(self) -> ConicData:
        """Return the conic data; raise `SynthesisError` for what is not affine, symmetric or finite."""
        if not self._unknowns or not self._constraints:
            raise SynthesisError("there are no LMIs yet; declare unknowns and state at least one constraint")
        if self._data is not None:
            return self._data
        symbols = ca.vertcat(*[one.symbols for one in self._unknowns.values()])
        labels = tuple(label for one in self._unknowns.values() for label in one.labels)
        self._data = extract(symbols, labels, list(self._constraints.values()), self._objective)
        return self._data

    def solve(
        self, backend: Any = None, *, conflict: bool = True, within: Reach | None = None, **options: Any
    ) -> LmiAnswer:
        """Return the certified answer.

        Parameters
        ----------
        backend : name, see `casadi_gnc.synthesis.backends`, or a module of your own like those; if left out it is taken
            by size, and where it decides nothing, another one is asked.
        conflict : whether to seek a smallest set of conflicting constraints if there is no point.
        within : range that a proof of infeasibility must cover: a bound on the entries of all unknowns, in their
            units, or one by name. By default it must hold for all unknowns, but for the last digits of the
            coefficients: of those beyond the range that it states, the rounding of the data decides.
        options : of the back end; an unknown one is an error.

        Raises
        ------
        SynthesisError
            For constraints that cannot be posed. Failure to solve them is a status.
        """
        if within is not None:
            self._refuse_range(within)
        answer = self.attempt(self.data(), backend, within=within, **options)
        if answer.status is LmiStatus.INFEASIBLE and conflict and len(self._constraints) <= _MOST_SOUGHT:
            answer = replace(answer, conflict=self._conflict(backend, within, options))
        return answer

    def _refuse_range(self, within: Reach) -> None:
        stated = within if isinstance(within, Mapping) else {"within": within}
        for name, value in stated.items():
            if isinstance(within, Mapping) and name not in self._unknowns:
                raise SynthesisError(f"within names {name!r}; the unknowns are {', '.join(self._unknowns)}")
            if not (isinstance(value, (int, float)) and value > 0):
                raise SynthesisError(f"within is {value!r} for {name!r}, expected a positive number")

    def attempt(
        self,
        data: ConicData,
        backend: Any = None,
        *,
        within: Reach | None = None,
        prove: bool = True,
        **options: Any,
    ) -> LmiAnswer:
        """Return the certified answer to conic data of these unknowns, as `data` returns.

        Parameters
        ----------
        within : as in `solve`.
        prove : whether multipliers that exclude points of ordinary size are made a proof that there is none; without
            it they end the search undecided, for a caller who asks for the proof later.
        """
        scaled = first_scaling(data)
        asked = backends.by_size(len(data.cost)) if backend is None else (backend,)
        look, taken = None, backend
        for one in asked[:1] if options else asked:  # options are those of one back end
            looks = Looks(backends.module(one), within, prove, options)
            try:
                other = looks.best(scaled)
            except TypeError as error:
                raise SynthesisError(f"back end {one!r}: {error}") from error
            if look is None or other.verdict.rank > look.verdict.rank:
                look, taken = other, one
            if not look.verdict.is_lacking:
                break
        assert look is not None
        return self._answer(data, taken, scaled.unit, look.verdict, look.found)

    def _answer(self, data: ConicData, backend: Any, natural: np.ndarray, verdict: Verdict, found: Found) -> LmiAnswer:
        far = np.abs(verdict.point) > _FAR * natural
        return LmiAnswer(
            status=verdict.status,
            point=verdict.point,
            unknowns=self._matrices(verdict.point),
            objective=verdict.objective,
            gap=verdict.gap,
            checks=verdict.checks,
            infeasibility=verdict.infeasibility,
            ray=verdict.ray,
            least=verdict.least,
            backend=backend if isinstance(backend, str) else getattr(backend, "__name__", repr(backend)),
            iterations=found.iterations,
            seconds=found.seconds,
            claim=found.claim,
            far=tuple(dict.fromkeys(data.names[i] for i in np.flatnonzero(far))),
        )

    def _matrices(self, point: np.ndarray) -> dict[str, np.ndarray]:
        found, start = {}, 0
        for one in self._unknowns.values():
            count = one.symbols.numel()
            found[one.name] = one.value(point[start : start + count])
            start += count
        return found

    def _conflict(self, backend: Any, within: Reach | None, options: dict[str, Any]) -> tuple[str, ...]:
        """Return constraints that are infeasible together, leaving out each that is not needed for it."""
        data = self.data()
        data = replace(data, cost=np.zeros_like(data.cost))
        left_out: set[str] = set()
        for name in list(self._constraints):
            trial = left_out | {name}
            if len(trial) == len(self._constraints):
                continue
            if self.attempt(data.without(trial), backend, within=within, **options).status is LmiStatus.INFEASIBLE:
                left_out = trial
        return tuple(name for name in self._constraints if name not in left_out)


def _size(name: str, size: int) -> int:
    if isinstance(size, bool) or not isinstance(size, (int, np.integer)) or size < 1:
        raise SynthesisError(f"unknown {name!r} has size {size!r}, expected a whole number, at least 1")
    return int(size)
