"""Step a flight function on CasADi's virtual machine, in the order of the generated step."""

from __future__ import annotations

import casadi as ca
import numpy as np

from casadi_gnc.embedded.fault_machine import HandledFaults
from casadi_gnc.embedded.faults import SAFE_MODE
from casadi_gnc.embedded.flight_function import HELD, STATUSES, FlightFunction
from casadi_gnc.embedded.parts import Parts
from casadi_gnc.embedded.programs import expanded
from casadi_gnc.embedded.programs import is_plain as is_plain_function

_BITS = {name: bit for bit, (name, _) in STATUSES.items()}


class FunctionMachine:
    """Step a function in double precision; the reference that compiled code is compared with."""

    def __init__(self, own: FlightFunction) -> None:
        self._own = own
        self._parts = Parts()
        self._parts.function(own.function)
        # What the C is made of: CasADi's way to scalars simplifies some sums and products, so MX has other last bits.
        is_plain = is_plain_function(own.function)
        self._function = expanded(own.function, own.function.name()) if is_plain else own.function
        self._memory = np.array(own.initial)
        self._last = np.zeros(own.outputs.size)
        self._handled = HandledFaults(own.faults, own.outputs)

    @property
    def is_exact(self) -> bool:
        """Whether the C computes in the order of this machine: it is straight-line code, without a call."""
        return len(self._parts.texts) == 1 and self._function.is_a("SXFunction")

    def step(self, row: np.ndarray) -> np.ndarray:
        """Return outputs, state and status of a step."""
        status = 0 if np.isfinite(row).all() else _BITS["INPUT_REFUSED"]
        if not status:
            status = self._advance(row)
        faults = self._own.faults
        if faults is None:
            return np.concatenate([self._last, self._memory, [status]])
        status |= self._handled.held({name: bool(status & HELD) for name, _ in faults.ages})
        is_safe = self._handled.is_safe(status)
        status |= SAFE_MODE if is_safe else 0
        status |= self._handled.noted(status)
        return np.concatenate([faults.safe if is_safe else self._last, self._memory, [status]])  # type: ignore[list-item]

    def _advance(self, row: np.ndarray) -> int:
        own, function = self._own, self._function
        given = []
        for i, name in enumerate(function.name_in()):
            layout, column = (own.state, self._memory) if name in own.pairs else (own.inputs, row)
            values = column[layout.place(name)] if name in layout else np.zeros(0)
            given.append(ca.reshape(ca.DM(values), *function.size_in(i)))
        try:
            results = dict(zip(function.name_out(), function.call(given), strict=True))
        except RuntimeError:  # what CasADi says of a singular matrix, and of a quadratic program that it gave up
            return _BITS["UNCERTIFIED" if self._parts.solvers else "SINGULAR"]
        found = {name: np.array(ca.vec(value)).ravel() for name, value in results.items()}
        outputs = np.concatenate([np.zeros(0), *(found[name] for name in own.outputs.names)])
        after = np.concatenate([np.zeros(0), *(found[own.pairs[name]] for name in own.state.names)])
        if not (np.isfinite(outputs).all() and np.isfinite(after).all()):
            return _BITS["RESULT_REFUSED"]
        self._last, self._memory = outputs, after
        return 0

    def replay(self, rows: np.ndarray) -> np.ndarray:
        """Return outputs, state and status of steps (K, inputs), from the first one on."""
        return np.array([self.step(row) for row in rows])
