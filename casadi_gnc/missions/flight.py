"""The result of flying: named signals, metrics and statuses, and how they were made."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.errors import FlightError
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus
from casadi_gnc.system.files import write_beside


@dataclass(frozen=True, eq=False)
class Flight:
    """Hold one flown scheme.

    Parameters
    ----------
    mission, scheme, title : names.
    layout : columns of `samples`.
    samples : (K, columns), every `decimation`-th sample, taken before its step.
    metrics : value by name; `None` is "never" (a settling that did not happen).
    metric_units : unit by name of a metric.
    statuses : for each status bit raised, the number of samples and the time of the first [s].
    made : engine, elementary functions, mode, versions, digest of the problem file.
    seconds : wall time of the samples, without building.
    notes : what a reader must know, e.g. that no compiler was found.
    """

    mission: str
    scheme: str
    title: str
    layout: Layout
    samples: np.ndarray
    metrics: dict[str, float | None]
    metric_units: dict[str, str]
    statuses: dict[StepStatus, tuple[int, float]]
    made: dict[str, Any]
    seconds: float
    notes: tuple[str, ...] = field(default=())

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a signal, (K,) or (K, n)."""
        block = self.block(name)
        return block[:, 0] if block.shape[1] == 1 else block

    def __repr__(self) -> str:
        kept, columns = self.samples.shape
        return f"Flight({self.mission}, {self.scheme}: {kept} samples of {columns} numbers, {self.metrics})"

    @property
    def diverged(self) -> bool:
        """Whether the simulated state ran away; then no metric has a value."""
        return StepStatus.DIVERGED in self.statuses

    @property
    def time(self) -> np.ndarray:
        """Sample times, (K,), [s]."""
        return self["time"]

    @property
    def signals(self) -> dict[str, np.ndarray]:
        """All signals by name."""
        return self.layout.columns(self.samples)

    def block(self, name: str) -> np.ndarray:
        """Return a signal as (K, n), also where n is 1."""
        try:
            return self.samples[:, self.layout.place(name)]
        except KeyError as error:
            raise FlightError(str(error.args[0])) from None

    def unit(self, name: str) -> str:
        """Return the unit of a signal."""
        try:
            return self.layout.signal(name).unit
        except KeyError as error:
            raise FlightError(str(error.args[0])) from None

    def summary(self) -> dict[str, Any]:
        """Return metrics, statuses and provenance as plain data, ready for JSON."""
        return {
            "scheme": self.scheme,
            "title": self.title,
            "metrics": {
                name: {"value": value, "unit": self.metric_units[name]} for name, value in self.metrics.items()
            },
            "statuses": [
                {"status": str(bit.name), "samples": count, "first_s": first, "meaning": bit.sentences[0]}
                for bit, (count, first) in self.statuses.items()
            ],
            "notes": list(self.notes),
            "made": self.made,
            "seconds": self.seconds,
        }

    def save(self, folder: Path) -> Path:
        """Write the signals as `<scheme>.npz` (with units under `unit_<name>`); return its path."""
        arrays: dict[str, Any] = dict(self.signals)
        arrays.update({f"unit_{name}": np.array(self.unit(name)) for name in self.layout.names})
        target = folder / f"{self.scheme}.npz"
        write_beside(target, lambda path: np.savez_compressed(path, **arrays))
        return target


def save_summary(folder: Path, flights: list[Flight]) -> Path:
    """Write `summary.json` of several flights of a mission; return its path."""
    content = {"mission": flights[0].mission, "schemes": [flight.summary() for flight in flights]}
    target = folder / "summary.json"
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    return target
