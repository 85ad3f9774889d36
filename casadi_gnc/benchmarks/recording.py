"""Record command sequences from flights: what the allocation sets of `problems/benchmarks` are made of.

    python -m casadi_gnc.benchmarks.recording FOLDER

writes the tables of `FLIGHTS` anew. A table has short runs of samples that follow one another, from
different parts of a flight, so that both warm starts and different situations are in few rows.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from casadi_gnc.missions.flying import fly
from casadi_gnc.problem_files.loading import load
from casadi_gnc.system.files import prepare_folder, write_beside

#: Samples that follow one another.
RUN = 5


@dataclass(frozen=True)
class Recording:
    """Say what is recorded: a scheme's limited commands and its actuators, from some samples on."""

    mission: str
    scheme: str
    actuators: str
    units: str
    starts: tuple[int, ...]


FLIGHTS = {
    "detumble": Recording(
        "huang2020/detumble", "observer_robust", "force", "[N m] and [N]", (100, 5000, 9000, 1500, 9500)
    ),
    "slew": Recording("huang2020/slew", "funnel_robust", "force", "[N m] and [N]", (20, 1500, 400, 5000, 3000)),
    "wheel_faults": Recording(
        "huang2019/wheel_faults",
        "observers_soft",
        "wheel_acceleration",
        "[N m] and [rad/s^2]",
        (48, 150, 98, 300, 800),
    ),
}


def record(what: Recording) -> str:
    """Fly and return the table of commands, with the actuators' values before each."""
    flight = fly(load(what.mission), what.scheme)
    commands, values = flight.block("limited"), flight.block(what.actuators)
    chosen = np.concatenate([np.arange(start, start + RUN) for start in what.starts])
    names = [f"u{i + 1}" for i in range(commands.shape[1])] + [f"p{i + 1}" for i in range(values.shape[1])]
    lines = [
        f"# A flight of {what.mission}, scheme {what.scheme}: commands and actuators before them, {what.units};",
        f"# {RUN} samples each from sample {', '.join(map(str, what.starts))} on.",
        ",".join(names),
    ]
    lines += [",".join(f"{value:.7g}" for value in (*commands[k], *values[k - 1])) for k in chosen]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write every table into the folder named."""
    folder = prepare_folder(Path(sys.argv[1]))
    for name, what in FLIGHTS.items():
        text = record(what)
        write_beside(folder / f"{name}.csv", lambda path, text=text: path.write_text(text, encoding="utf-8"))


if __name__ == "__main__":
    main()
