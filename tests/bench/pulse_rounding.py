"""Measure the pulses that are made on board beside the best ones of each sample, on samples of flights.

    python tests/bench/pulse_rounding.py [--samples 100] [--method robust] [--choice each]

Instances are the samples of satellites/thruster_pulses, as shipped and with rules for its valves: what each thruster is
asked for with what it carries over, and the pulses that the flight made of it. The best pulses keep the same rules and
miss the wanted effort impulse by no more than the flown ones, with least propellant (mixed-integer programs). An error
counts in half least bits: the least s for which it is made by impulses of all thrusters within s half least bits.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from scipy.optimize import linprog

import casadi_gnc
from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.pulse_optimum import PulseRules, best_pulses
from casadi_gnc.allocation.pulses import Pulse, Valves
from casadi_gnc.errors import AllocationError

MISSION = "satellites/thruster_pulses"
PERIOD, LEAST, QUANTUM = 0.2, 0.02, 0.005
VALVES = {
    "no rules": None,
    "two pairs": {"never_together": [[1, 2], [5, 6]]},
    "two pairs, three open": {"never_together": [[1, 2], [5, 6]], "open_at_most": 3},
}


def half_bits(effectiveness: np.ndarray, error: np.ndarray) -> float:
    """Return by how many half least bits of all thrusters an error of effort impulse is made, by a linear program."""
    rows, count = effectiveness.shape
    exact = np.hstack([effectiveness, np.zeros((rows, 1))])
    sides = [np.hstack([sign * np.eye(count), np.full((count, 1), -LEAST / 2)]) for sign in (1.0, -1.0)]
    cost, free = np.eye(count + 1)[-1], [(None, None)] * count + [(0, None)]
    return float(linprog(cost, np.vstack(sides), np.zeros(2 * count), exact, error, bounds=free).fun)


def measured(
    valves: dict[str, Any] | None, samples: int, method: str, choice: str, *, least_too: bool = True
) -> dict[str, float]:
    """Return propellant of flown and best pulses, and errors of effort impulse, over samples of a flight."""
    changes: dict[str, Any] = {"timing.duration_s": samples * PERIOD, "scheme.1.allocation": {"method": method}}
    if valves or choice != "each":
        changes["valves"] = {**(valves or {}), "choice": choice}
    mission = casadi_gnc.load(MISSION, changes=changes)
    flight = casadi_gnc.fly(mission, decimation=1)
    made: Any = mission.scheme().actuation.effectiveness
    problem = AllocationProblem(np.array(made), 0.0, 1.0)
    pairs = tuple((i - 1, j - 1) for i, j in (valves or {}).get("never_together", []))
    rules = PulseRules(
        [Pulse(LEAST, QUANTUM)] * problem.count, PERIOD, Valves(pairs, (valves or {}).get("open_at_most"))
    )
    told, carry = flight["force"][:samples], flight["impulse_carry"][:samples]
    surplus = flight["pulse_surplus"].ravel()[:samples] if choice == "together" else told.sum(axis=1) * PERIOD
    flown, best, errors, least, worst, bits = 0.0, 0.0, [], [], 0.0, 0.0
    for pulses, left, above in zip(told, carry, surplus, strict=True):
        widths, wanted = pulses * PERIOD, problem.effectiveness @ (pulses * PERIOD + left)
        assert not rules.broken(widths)
        error = float(np.abs(wanted - problem.effectiveness @ widths).sum())
        found = best_pulses(problem, wanted, rules, error=error)
        assert not rules.broken(found.widths)
        assert widths.sum() - above <= found.propellant + 1e-7
        flown, best = flown + float(widths.sum()), best + found.propellant
        errors.append(error)
        least.append(_least_error(problem, wanted, rules) if least_too else np.nan)
        worst = max(worst, float(np.abs(left).max()))
        bits = max(bits, half_bits(problem.effectiveness, problem.effectiveness @ left))
    return {
        "instances": len(told),
        "flown_N_s": flown,
        "best_N_s": best,
        "bound_N_s": flown - float(surplus.sum()),
        "ratio": flown / best if best > 0 else np.nan,
        "error_flown_N_m_s": float(np.mean(errors)),
        "error_least_N_m_s": float(np.nanmean(least)) if least_too else np.nan,
        "largest_carry_N_s": worst,
        "largest_error_half_bits": bits,
    }


def _least_error(problem: AllocationProblem, wanted: np.ndarray, rules: PulseRules) -> float:
    """Return the least error of any pulses; NaN where HiGHS gives up near its own tolerance."""
    try:
        return best_pulses(problem, wanted, rules).error
    except AllocationError:
        return np.nan


def main() -> None:
    """Print a line for each set of rules and each allocation before the pulses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--samples", type=int, default=100, help="of each flight, one with each set of rules")
    parser.add_argument("--method", default="robust", help="allocation before the pulses: robust, pinv")
    parser.add_argument("--choice", default="each", help="of the pulses: each, together")
    given = parser.parse_args()
    for name, valves in VALVES.items():
        found = measured(valves, given.samples, given.method, given.choice)
        print(f"{name}: " + ", ".join(f"{key} {value:.4g}" for key, value in found.items()), flush=True)


if __name__ == "__main__":
    main()
