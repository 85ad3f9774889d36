"""The result of flying: named signals, metrics and statuses, and how they were made."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from casadi_gnc.errors import FlightError, OutputError
from casadi_gnc.missions.requirements import Verdict
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus
from casadi_gnc.system.files import prepare_folder, write_beside


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
    verdicts : whether each requirement of the mission was met, by its id, from every sample.
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
    verdicts: dict[str, Verdict] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a signal, (K,) or (K, n)."""
        block = self.block(name)
        return block[:, 0] if block.shape[1] == 1 else block

    def __contains__(self, name: object) -> bool:
        return name in self.layout.names

    def __iter__(self) -> Iterator[str]:
        return iter(self.layout.names)

    def __len__(self) -> int:
        return len(self.layout.names)

    def keys(self) -> tuple[str, ...]:
        """Return the names of all signals, in order."""
        return self.layout.names

    def _ipython_key_completions_(self) -> list[str]:
        """Return what a notebook offers inside flight["..."]."""
        return list(self.layout.names)

    def __repr__(self) -> str:
        kept, columns = self.samples.shape
        told = ", ".join(f"{name} {_told(value, self.metric_units[name])}" for name, value in self.metrics.items())
        return f"Flight({self.mission}, {self.scheme}: {kept} samples of {columns} numbers; {told or 'no metric'})"

    def _repr_html_(self) -> str:
        rows = [(name, _told(value, self.metric_units[name])) for name, value in self.metrics.items()]
        for bit, (count, first) in self.statuses.items():
            rows.append((str(bit.name), f"{count} samples, first at {first:g} s"))
        rows += [(name, f"{one.word}, {one.margin}") for name, one in self.verdicts.items()]
        cells = "".join(f"<tr><td>{escape(name)}</td><td>{escape(told)}</td></tr>" for name, told in rows)
        notes = "".join(f"<li>{escape(note)}</li>" for note in self.notes)
        listed = f"<ul>{notes}</ul>" if notes else ""
        return f"<b>{escape(self.title or self.scheme)}</b><table>{cells}</table>{listed}"

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
            "requirements": [verdict.as_data() for verdict in self.verdicts.values()],
            "notes": list(self.notes),
            "made": self.made,
            "seconds": self.seconds,
        }

    def columns(self) -> tuple[list[str], np.ndarray]:
        """Return a name for each column, "rate_1" or "time", and the samples, (K, columns)."""
        names = [
            signal.name if signal.size == 1 else f"{signal.name}_{i}"
            for signal in self.layout.signals
            for i in range(1, signal.size + 1)
        ]
        return names, self.samples

    def to_csv(self, target: str | Path) -> Path:
        """Write all samples as a table into `target`: names first, then units, every bit of every number."""
        names, samples = self.columns()
        units = [signal.unit or "-" for signal in self.layout.signals for _ in range(signal.size)]

        def write(path: Path) -> None:
            with path.open("w", newline="", encoding="utf-8") as file:
                rows = csv.writer(file)
                rows.writerows([names, units])
                rows.writerows([repr(float(number)) for number in row] for row in samples)

        return _written(target, ".csv", write)

    def to_mat(self, target: str | Path) -> Path:
        """Write the signals as the MATLAB file `target`, of version 5, with their units in the struct `units`."""
        from scipy.io import savemat

        content = {**self.signals, "units": {name: self.unit(name) or "-" for name in self.layout.names}}
        return _written(target, ".mat", lambda path: savemat(path, content, appendmat=False))

    def to_pandas(self) -> Any:
        """Return the samples as a pandas DataFrame with the time as index; raise `FlightError` without pandas."""
        try:
            import pandas  # type: ignore[import-not-found, import-untyped]
        except ImportError:
            raise FlightError("pandas is not installed; pip install pandas, or take to_csv or flight[signal]") from None
        names, samples = self.columns()
        return pandas.DataFrame(samples, columns=names).set_index("time")

    def save(self, folder: Path) -> Path:
        """Write the signals as `<scheme>.npz` into a folder (with units under `unit_<name>`); return its path."""
        return self.save_as(folder / f"{self.scheme}.npz")

    def save_as(self, target: Path) -> Path:
        """Write the signals as the file `target`; else as `save`."""
        arrays: dict[str, Any] = dict(self.signals)
        arrays.update({f"unit_{name}": np.array(self.unit(name)) for name in self.layout.names})
        write_beside(target, lambda path: np.savez_compressed(path, **arrays))
        return target


def _told(value: float | None, unit: str) -> str:
    return "never" if value is None else f"{value:.5g} {unit if unit != '-' else ''}".rstrip()


def _written(target: str | Path, ending: str, write: Callable[[Path], Any]) -> Path:
    """Write a whole file or none; return its path."""
    path = Path(target)
    if path.suffix != ending:
        raise OutputError(f"{path} does not end in {ending}")
    prepare_folder(path.parent)
    write_beside(path, write)
    return path


def save_summary(folder: Path, flights: list[Flight]) -> Path:
    """Write `summary.json` of several flights of a mission; return its path."""
    content = {"mission": flights[0].mission, "schemes": [flight.summary() for flight in flights]}
    target = folder / "summary.json"
    text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    write_beside(target, lambda path: path.write_text(text, encoding="utf-8"))
    return target
