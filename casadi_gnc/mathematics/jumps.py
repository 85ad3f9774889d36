"""Decisions on time, taken once for a whole integration step.

A fault that ends or a profile in pieces makes x' = f(t, x) jump at times that are known. A Runge-Kutta step whose
last stage already sees beyond a jump at its end is of order 1. So every decision on time is taken where the middle
of the step is, for all of its stages: with jumps between steps the method keeps its order, and a jump inside a step
happens at one of its ends.

A decision is a comparison, `floor`, `ceil`, the sign that `copysign` takes, or the whole periods that `fmod` and
`remainder` take away (by a fixed divisor), of operands that depend on time and on nothing that moves within a step.
Decisions on the state are none: nobody knows beforehand when they turn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import casadi as ca

_COMPARISONS = (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE)
_ROUNDING = (ca.OP_FLOOR, ca.OP_CEIL)
_WHOLE = (ca.OP_FMOD, ca.OP_REMAINDER)
#: Names of ports besides the columns.
_TIME, _REST = " time", " parameters"


class Timed:
    """Hold an expression of a time and of columns, whose decisions on time can be taken elsewhere.

    Parameters
    ----------
    expression : (n, 1), SX.
    time : the symbol, (1, 1).
    columns : symbols by name of all that may move within a step; others in the expression are parameters, which stay.

    Examples
    --------
    >>> t, x = ca.SX.sym("t"), ca.SX.sym("x")
    >>> timed = Timed(ca.if_else(t > 1, t, 0) + x, t, {"x": x})
    >>> timed.decides, timed.at(1.0, 1.05, {"x": 0.0}), timed.at(1.0, 0.95, {"x": 0.0})
    (True, SX(1), SX(0))
    """

    def __init__(self, expression: Any, time: ca.SX, columns: Mapping[str, ca.SX]) -> None:
        self._expression, self._own = ca.SX(expression), {_TIME: time, **columns}
        known = {symbol.element_hash() for column in self._own.values() for symbol in ca.symvar(column)}
        rest = [symbol for symbol in ca.symvar(self._expression) if symbol.element_hash() not in known]
        self._own[_REST] = ca.vertcat(*rest) if rest else ca.SX(0, 1)
        self._names = list(self._own)
        ports = [ca.vec(column) for column in self._own.values()]
        self._tape = ca.Function("timed", ports, [ca.densify(self._expression)])
        # What time is not in decides nothing on it, and need not be read.
        self._kinds = self._sorted() if ca.depends_on(self._expression, time) else []

    @cached_property
    def _steps(self) -> list[tuple[int, list[int], list[int]]]:
        """The instructions of the expression: code, places that are read, places that are written."""
        tape = self._tape
        return [
            (tape.instruction_id(k), tape.instruction_input(k), tape.instruction_output(k))
            for k in range(tape.n_instructions())
        ]

    def _sorted(self) -> list[bool]:
        """Return for each instruction whether it is a decision on time."""
        timed: dict[int, bool | None] = {}  # place in the work vector -> depends on time; None: moves within a step
        found = []
        for code, given, target in self._steps:
            decision = False
            if code == ca.OP_INPUT:
                name = self._names[given[0]]
                timed[target[0]] = {_TIME: True, _REST: False}.get(name)
            elif code == ca.OP_CONST:
                timed[target[0]] = False
            elif code != ca.OP_OUTPUT:
                known = [timed[i] for i in given]
                if code in (*_COMPARISONS, *_ROUNDING):
                    decision = None not in known and any(known)
                elif code in _WHOLE:
                    decision = known == [True, False]
                elif code == ca.OP_COPYSIGN:
                    decision = bool(known[1])
                timed[target[0]] = None if None in known else any(known)
            found.append(decision)
        return found

    @property
    def decides(self) -> bool:
        """Whether the expression decides on time."""
        return any(self._kinds)

    def at(self, time: Any, middle: Any, columns: Mapping[str, Any]) -> ca.SX:
        """Return the expression at a time and of columns, its decisions on time taken at `middle`.

        An expression without any is the same for every `middle`.
        """
        if not self.decides:
            (same,) = self._tape.call([ca.vec(ca.SX(each)) for each in self._given(time, columns)], True, False)
            return ca.reshape(same, self._expression.shape)
        result, _ = self._walked(time, middle, columns)
        return result

    def decisions(self, time: Any) -> ca.SX:
        """Return what each decision is at a time, (K, 1)."""
        return self._walked(time, time, self._own)[1] if self.decides else ca.SX(0, 1)

    def _given(self, time: Any, columns: Mapping[str, Any]) -> list[ca.SX]:
        """Return what stands at the ports of the tape."""
        now = {**columns, _TIME: time, _REST: self._own[_REST]}
        return [ca.SX(now[name]) for name in self._names]

    def _walked(self, time: Any, middle: Any, columns: Mapping[str, Any]) -> tuple[ca.SX, ca.SX]:
        ports = self._given(time, columns)
        result, taken = [ca.SX(0)] * self._expression.numel(), []
        # Place in the work vector -> its value in this stage, and in the middle: the same where time is not in it.
        value: dict[int, tuple[ca.SX, ca.SX]] = {}
        for k, (code, given, target) in enumerate(self._steps):
            if code == ca.OP_OUTPUT:
                result[target[1]] = value[given[0]][0]
                continue
            if code == ca.OP_INPUT:
                own = ports[given[0]][given[1]]
                value[target[0]] = (own, ca.SX(middle) if self._names[given[0]] == _TIME else own)
                continue
            if code == ca.OP_CONST:
                constant = ca.SX(self._tape.instruction_constant(k))
                value[target[0]] = (constant, constant)
                continue
            operands = [value[i] for i in given]
            there = _made(code, [each for _, each in operands])
            if self._kinds[k]:
                here, decided = _decided(code, operands, there)
                taken.append(decided)
            else:
                same = all(one is other for one, other in operands)
                here = there if same else _made(code, [each for each, _ in operands])
            value[target[0]] = (here, there)
        return ca.reshape(ca.vertcat(*result), self._expression.shape), ca.vertcat(*taken) if taken else ca.SX(0, 1)


def _made(code: int, operands: Sequence[ca.SX]) -> ca.SX:
    return ca.SX.unary(code, *operands) if len(operands) == 1 else ca.SX.binary(code, *operands)


def _decided(code: int, operands: Sequence[tuple[ca.SX, ca.SX]], there: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return the value in this stage under the decision in the middle, and what was decided."""
    if code in _WHOLE:
        (dividend, middle), (divisor, _) = operands
        whole = middle - there
        return dividend - whole, whole / divisor
    if code == ca.OP_COPYSIGN:
        size, sign = operands[0][0], operands[1][1]
        return ca.copysign(size, sign), ca.copysign(1.0, sign)
    return there, there
