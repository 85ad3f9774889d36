"""Time every installed back end on the twelve thrusters of Huang, Biggs, Duan (2020), certificate included.

Random commands, normal with 4e-4 N m an axis, random previous forces, one Allocator each. Wall time of
`Allocator.solve` and the solver's own where it says it, in milliseconds; then the relative gap that we computed.
"""

import argparse
import sys
from importlib import import_module
from pathlib import Path

import numpy as np

from casadi_gnc.allocation import Allocator, backends

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
oracle = import_module("allocation_cases")
SLOW = {"sdp_scs": 12}


def measure(problem, name: str, count: int) -> str:
    """Return one row of the table."""
    rng = np.random.default_rng(0)
    commands, previous = 4e-4 * rng.normal(size=(count, 3)), 3.75e-3 * rng.uniform(size=(count, 12))
    allocator = Allocator(problem, name)
    allocator.solve(commands[0], previous[0])
    answers = [allocator.solve(u, last) for u, last in zip(commands, previous, strict=True)]
    wall, own = (1e3 * np.array([getattr(a, key) for a in answers]) for key in ("seconds", "solver_seconds"))
    gaps = [answer.relative_gap for answer in answers]
    inner = "" if np.isnan(own).all() else f"{np.nanmedian(own):.3g}"
    return (
        f"| `{name}` | {np.median(wall):.3g} / {wall.max():.3g} | {inner} | {np.median(gaps):.0e} / {max(gaps):.0e} |"
    )


def main() -> None:
    """Print one table with an uncertain mass centre, and one without."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    count = parser.parse_args().count
    for title, error in (("centre of mass +-5 mm", 5e-3), ("no uncertainty", 0.0)):
        problem = oracle.huang2020(error)
        print(f"\n| {title} | wall, median / max [ms] | solver's own [ms] | relative gap, median / max |")
        print("|---|---|---|---|")
        for name in backends.available():
            if not problem.is_robust or backends.Capability.ROBUST in backends.module(name).CAPABILITIES:
                print(measure(problem, name, min(count, SLOW.get(name, count))), flush=True)


if __name__ == "__main__":
    main()
