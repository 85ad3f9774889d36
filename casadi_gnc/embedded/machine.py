"""Run a controller's tapes on CasADi's virtual machine, in the order of the generated step."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import OnlineInFlight
from casadi_gnc.embedded.controller import Controller
from casadi_gnc.embedded.fault_machine import HandledFaults
from casadi_gnc.status import StepStatus


class Machine:
    """Step a controller in double precision; the reference that compiled code is compared with."""

    def __init__(self, controller: Controller) -> None:
        self._c = controller
        self._derived = ca.DM(0, 1)
        if controller.tunables:
            self._derived = self._run("derive", p=[v for one in controller.tunables for v in one.default])["derived"]
        self._solve = OnlineInFlight(controller.allocation).start() if controller.allocation is not None else None
        self._memory = np.zeros(controller.memory.size)
        self._good = np.zeros(controller.measured.size)
        self._told = np.zeros(controller.actuators.size)
        self._started = False
        self._handled = HandledFaults(controller.faults, controller.measured, controller.limited.size)
        self._watch()

    def _run(self, name: str, **ports: Any) -> dict[str, np.ndarray]:
        tape = self._c.tapes[name]
        inputs = [ports[port] if port != "e" else self._derived for port in tape.name_in()]
        results = tape.call([ca.DM(value) for value in inputs])
        return {port: np.array(value).ravel() for port, value in zip(tape.name_out(), results, strict=True)}

    def _watch(self) -> None:
        """Put the monitor where it is before the first sample."""
        if self._c.monitor is not None:
            self._age, self._kept = 0, np.array(self._c.monitor.initial)
            self._lines = [np.zeros(length) for length in self._c.monitor.lines]

    def _watched(self, **ports: Any) -> np.ndarray:
        """Return robustness and verdict of each requirement of the monitor after a sample."""
        monitor = self._c.monitor
        if monitor is None or not monitor.watched:
            return np.zeros(0)
        at = [self._age % length for length in monitor.lines]
        past = [line[i] for line, i in zip(self._lines, at, strict=True)]
        given = {**ports, "age": min(self._age, monitor.horizon), "after": 0, "past": past, "kept": self._kept}
        found = monitor.tape.call([ca.DM(given[port]) for port in monitor.tape.name_in()])
        pushed, self._kept, robustness, verdict = (np.array(each).ravel() for each in found)
        for line, i, value in zip(self._lines, at, pushed, strict=True):
            line[i] = value
        self._age += 1
        return np.column_stack([robustness, verdict]).ravel()

    def step(self, row: np.ndarray) -> np.ndarray:
        """Return outputs and status of a sample; `row` is the time and the measurement."""
        t, y = row[0], row[1:]
        if not self._started:
            self._good = y
            self._memory = self._run("start", t=t, y=y)["m"] if self._c.memory.size else self._memory
        given = {"t": t, "y": y, "good": self._good, "m": self._memory, "actuators": self._told}
        now = self._run("before", **given, **self._handled.unfaded)
        status = int(now["flags"][0]) | self._handled.aged(y, now["accepted"])
        self._started = self._started or not status & StepStatus.MEASUREMENT_REPLACED
        box = {"lower": now["lower"], "upper": now["upper"]}
        report = np.zeros(0)
        if self._solve is not None:
            told, noted, report = self._solve(now["limited"], self._told.copy(), *box.values())
            status |= int(noted)
        else:
            ports = {"limited": now["limited"], "actuators": self._told, "carried": now["carried"]}
            told = self._run("allocate", **ports, **box)["allocated"]
        told, raised = self._handled.guarded(status, np.array(told), self._told, *box.values())
        status |= raised
        status |= int(self._run("judge", told=told, carried=now["carried"])["verdict"][0])
        self._good, self._told, carry = now["accepted"], np.array(told), np.zeros(0)
        if "modulate" in self._c.tapes:
            told, carry = self._run("modulate", told=told, carried=now["carried"]).values()
        self._memory = np.append(self._run("after", told=told, carried=now["carried"])["memory"], carry)
        status |= self._handled.noted(status)
        given = {"t": t, "y": now["accepted"], "actuators": told, "report": report, "status": status}
        seen = self._watched(**given, wanted=now["wanted"], limited=now["limited"])
        return np.concatenate([told, now["wanted"], now["limited"], report, seen, [status]])

    def replay(self, rows: np.ndarray) -> np.ndarray:
        """Return outputs and status of samples (K, 1 + measured), from the first one on."""
        return np.array([self.step(row) for row in rows])
