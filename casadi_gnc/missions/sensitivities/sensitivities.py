"""How one number of a flight changes with the numbers that it flies with."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.missions.loop import CREDIBLE
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.one_build import OneBuild
from casadi_gnc.missions.parameters import Varied, vary
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.sensitivities.engine import Along, DerivativeEngine, Flown
from casadi_gnc.missions.sensitivities.outcomes import Weighed, outcome_of

Method = Literal["adjoint", "tangents"]


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Hold one number of a flight and its gradient.

    Parameters
    ----------
    keys : of the parameters, whole paths.
    value : the number; of its smooth companion where a temperature was given.
    exact : the number that the flight tells.
    gradient : (P,), unit of the value by unit of each parameter.
    slack : bound of the distance from `value` to `exact`.
    """

    keys: tuple[str, ...]
    value: float
    exact: float
    gradient: np.ndarray
    slack: float

    def __getitem__(self, key: str) -> float | np.ndarray:
        """Return the derivative by a key; of one that stands for several numbers, a column."""
        places = [i for i, known in enumerate(self.keys) if known == key or known.startswith(f"{key}.")]
        if not places:
            raise FlightError(f"{key!r} is no parameter here; there is {', '.join(self.keys)}")
        found = self.gradient[places]
        return float(found[0]) if key in self.keys else found


class Sensitivities:
    """Fly a scheme with derivatives of one number by some of its own, in compiled C.

    Made by `casadi_gnc.sensitivities`. The values have the words of the flights of `casadi_gnc.vary`.

    Parameters
    ----------
    varied : the mission and its parameters.
    of : name of a metric, or a requirement or its id.

    Raises
    ------
    FlightError, RequirementError, CompilerError
        For a number that the mission does not have, an allocation without derivatives, no compiler.
    """

    def __init__(self, varied: Varied, of: str | Requirement) -> None:
        self.varied, self._build = varied, OneBuild(varied)
        self._outcome = outcome_of(varied.nominal, varied.tapes.row, of)
        self._engine = DerivativeEngine(varied, self._outcome.quantities)

    @property
    def keys(self) -> tuple[str, ...]:
        """The whole path of each parameter."""
        return self.varied.parameters.keys

    def at(
        self,
        values: Mapping[str, Any] | None = None,
        *,
        temperature: float = 0.0,
        method: Method = "adjoint",
        seed: int | None = None,
    ) -> Sensitivity:
        """Fly with some values, and return the number and its gradient.

        Parameters
        ----------
        values : by key, as for `OneBuild.fly`; those that are not given are the file's.
        temperature : of the smooth companion, unit of the number; 0 for the number itself.
        method : "adjoint", one way back, whatever the number of parameters; "tangents", all of them along with the
            flight.
        seed : of the noise; the mission's own by default.

        Raises
        ------
        FlightError
            For a key that is no parameter, and values that no such craft or law can have.
        """
        row = self._build.row(values or {})
        refused = self.varied.refusals(row[None, :])[0]
        if refused:
            raise FlightError(refused)
        return self.at_row(row, temperature=temperature, method=method, seed=seed)

    def at_row(
        self, row: np.ndarray, *, temperature: float = 0.0, method: Method = "adjoint", seed: int | None = None
    ) -> Sensitivity:
        """Return the same of a number for every parameter, (P,), which are not looked at again."""
        if not (math.isfinite(temperature) and temperature >= 0):
            raise FlightError(f"the temperature is {temperature:g}, expected 0 or a positive number")
        if method not in ("adjoint", "tangents"):
            raise FlightError(f"method is {method!r}, expected 'adjoint' or 'tangents'")
        p = np.array(row, dtype=float)
        noise = self.varied.nominal.noise.seed if seed is None else seed
        along = self._engine.along(p, noise, np.eye(len(p))) if method == "tangents" else None
        flown = self._engine.values(p, noise) if along is None else along
        if not (np.abs(flown.last) <= CREDIBLE).all() or not np.isfinite(flown.asked).all():
            nothing = np.full(len(p), math.nan)
            return Sensitivity(self.keys, self._outcome.diverged, self._outcome.diverged, nothing, 0.0)
        exact = self._outcome.weigh(flown.asked, 0.0)
        weighed = exact if temperature == 0 else self._outcome.weigh(flown.asked, temperature)
        gradient = self._gradient(p, noise, weighed, flown, method)
        return Sensitivity(self.keys, weighed.value, exact.value, gradient, weighed.slack)

    def _gradient(self, p: np.ndarray, seed: int, weighed: Weighed, flown: Flown | Along, method: Method) -> np.ndarray:
        if not weighed.weights.any():
            return np.zeros(len(p))
        if isinstance(flown, Along):
            return flown.gradient(weighed.weights)
        if method == "adjoint":
            return self._engine.adjoint(p, seed, weighed.weights, flown)
        return self._engine.tangents(p, seed, weighed.weights, np.eye(len(p)))

    def at_rows(
        self, rows: np.ndarray, *, threads: int = 1, temperature: float = 0.0, method: Method = "adjoint"
    ) -> list[Sensitivity]:
        """Return those of many rows, (n, P), on threads."""
        with ThreadPoolExecutor(max(1, threads)) as pool:
            return list(pool.map(lambda row: self.at_row(row, temperature=temperature, method=method), rows))


def sensitivities(
    mission: Mission, keys: str | Sequence[str], of: str | Requirement, scheme: str | None = None
) -> Sensitivities:
    """Return what flies a scheme with derivatives; arguments as for `casadi_gnc.sensitivities`."""
    return Sensitivities(vary(mission, [keys] if isinstance(keys, str) else keys, scheme), of)
