"""Generate and compile a function of 1e5 operations: processor time and memory, of this process and of its compilers.

    python tests/bench/large_function.py            # prints one line of JSON

`printed_s` is the time to print the C, `compiled_s` that of `gcc -O2` for it; `generated_s` that of the whole package:
its answers to the steps, which compile it once more, and the branches that these take, which do so without optimiser.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import casadi_gnc as gnc
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.flight_function import flight_function
from casadi_gnc.embedded.function_source import function_files
from casadi_gnc.embedded.package import put
from casadi_gnc.system import compilers

sys.path[:0] = [str(Path(__file__).parents[1] / "oracles"), str(Path(__file__).parents[1] / "embedded")]
OPERATIONS = 100_000


def spent() -> float:
    """Return the processor time of this process and its compilers so far [s]."""
    each = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in each)


def measured() -> dict[str, float]:
    """Return operations, seconds, and most megabytes."""
    function = import_module("test_functions").long_function(OPERATIONS)
    times = [spent()]
    with tempfile.TemporaryDirectory() as place:
        put(Path(place) / "c", function_files(flight_function(function), Options("long_one")))
        times.append(spent())
        unit = Path(place) / "c" / "long_one.c"
        flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-c"]
        subprocess.run([*compilers.find().command, *flags, "-o", f"{place}/long.o", unit], check=True)
        times.append(spent())
        gnc.generate(function, Path(place) / "package", name="long_one")
        times.append(spent())
    found = {"operations": function.n_instructions()}
    names = ("printed_s", "compiled_s", "generated_s")
    found |= {name: round(times[k + 1] - times[k], 1) for k, name in enumerate(names)}
    for name, who in (("own_MB", resource.RUSAGE_SELF), ("compilers_MB", resource.RUSAGE_CHILDREN)):
        found[name] = round(resource.getrusage(who).ru_maxrss / 1e3)
    return found


if __name__ == "__main__":
    print(json.dumps(measured()))
