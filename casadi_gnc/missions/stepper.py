"""Step a controller by hand: hardware in the loop, notebooks, another simulator.

The step is the compiled flight package (`casadi_gnc.embedded`), so its words are those of what flies; without
a compiler it is CasADi's machine, and `compiled` says so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_gnc.embedded import package
from casadi_gnc.embedded.controller import Controller, Options
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.errors import FlightError, NoCompilerError
from casadi_gnc.mathematics.arrays import real_array
from casadi_gnc.missions.onboard import describe
from casadi_gnc.missions.requirements.monitor import WORDS, Seen
from casadi_gnc.missions.requirements.requirement import unbounded
from casadi_gnc.status import StepStatus
from casadi_gnc.system.folders import workshop

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission


class Stepper:
    """Hold one controller and what it remembers.

    Parameters
    ----------
    mission : a continuous one is taken at its sample period.
    scheme : its name; the first one by default.

    Raises
    ------
    PackageError
        For a scheme that cannot fly on board.
    """

    def __init__(self, mission: Mission, scheme: str | None = None) -> None:
        self._controller = describe(mission, scheme, monitored=True)
        self._run, self.compiled = _runner(self._controller)
        self.reset()

    def reset(self) -> None:
        """Forget everything, as before the first sample."""
        self._run.reset()
        self._last = -np.inf
        self._watched = np.zeros(0)

    @property
    def period(self) -> float:
        """Sample period, [s]."""
        return self._controller.period

    @property
    def measurements(self) -> tuple[str, ...]:
        """Names of what `step` is given."""
        return self._controller.measured.names

    @property
    def seen(self) -> dict[str, Seen]:
        """What the monitor knows of each requirement after the last step, by id; nothing before the first.

        Of formulas that can be watched on board; it is the package's monitor that watches.
        """
        monitor, found = self._controller.monitor, self._watched.reshape(-1, 2)
        if monitor is None or not len(found):
            return {}
        return {
            one.id: Seen(WORDS[int(verdict)], unbounded(robustness))
            for one, (robustness, verdict) in zip(monitor.watched, found, strict=True)
        }

    def step(self, t: float, **measurements: Any) -> dict[str, Any]:
        """Return actuators and efforts of one sample, by signal, and its `status` (a `StepStatus`).

        Parameters
        ----------
        t : time [s]; later than that of the last step.
        measurements : each measured signal by name; NaN where a sensor is silent.

        Raises
        ------
        FlightError
            For a signal that is missing, unknown or of another size, and a time that does not advance.
        """
        layout = self._controller.measured
        if set(measurements) != set(layout.names):
            given = ", ".join(measurements) or "nothing"
            raise FlightError(f"step was given {given}; expected each of {', '.join(layout.names)}")
        row = [float(t)]
        for signal in layout.signals:
            numbers = real_array(signal.name, measurements[signal.name], FlightError).ravel()
            if numbers.size != signal.size:
                raise FlightError(f"{signal.name} has {numbers.size} numbers, expected {signal.size}")
            row.extend(numbers)
        if not t > self._last:
            raise FlightError(f"the time {t:g} s is not after the last one, {self._last:g} s; `reset` begins anew")
        self._last = t
        numbers = self._run.step(np.array(row))
        self._watched = numbers[self._controller.outputs.size : -1]
        outputs = {
            name: float(value[0]) if len(value) == 1 else value
            for name, value in ((n, numbers[self._controller.outputs.place(n)]) for n in self._controller.outputs.names)
        }
        return {**outputs, "status": StepStatus(int(numbers[-1]))}

    def __repr__(self) -> str:
        how = "compiled C" if self.compiled else "CasADi's machine (no compiler was found)"
        return (
            f"Stepper({self._controller.scheme}, every {self.period:g} s, {how}; takes {', '.join(self.measurements)})"
        )


class _Compiled:
    """The package, built in a folder that is gone once it is loaded."""

    def __init__(self, controller: Controller) -> None:
        options = Options("stepper")
        self._outputs = controller.replayed.size + 1
        with workshop() as folder:
            files = package.flight_files(controller, options)
            package.put(folder, {**files, "test/replay.h": package.replay_header(controller, options, 1)})
            self._host = HostPackage(folder, options.name)

    def reset(self) -> None:
        """Forget everything."""
        self._host.reset()

    def step(self, row: np.ndarray) -> np.ndarray:
        """Return outputs and status."""
        words = self._host.replay(row.view(np.uint64)[None, :], self._outputs)[0]
        return np.append(words[:-1].view(float), float(words[-1]))


class _Interpreted:
    """CasADi's machine."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._machine = Machine(self._controller)

    def step(self, row: np.ndarray) -> np.ndarray:
        """Return outputs and status."""
        return self._machine.step(row)


def _runner(controller: Controller) -> tuple[_Compiled | _Interpreted, bool]:
    try:
        return _Compiled(controller), True
    except NoCompilerError:
        return _Interpreted(controller), False
