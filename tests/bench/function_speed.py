"""Time functions as printed here against CasADi's own C: its default, and expanded with common parts taken out.

    python tests/bench/function_speed.py                # 41 functions
    python tests/bench/function_speed.py all            # every function of tests/embedded/test_function_set.py

Processor time of one call in nanoseconds, the least of several runs, both compiled with -O2, ours with the elementary
functions that are the same everywhere; then the shifted geometric mean of the ratios of times (shift 10 ns), of each
family and of all.
"""

from __future__ import annotations

import contextlib
import ctypes
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

import casadi as ca
import numpy as np

from casadi_gnc.embedded.parts import Parts
from casadi_gnc.system import assets, compilers

sys.path[:0] = [str(Path(__file__).parents[1] / "oracles"), str(Path(__file__).parents[1] / "embedded")]
functions_of = import_module("test_function_set")

FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared", "-w")
RUNS, LEAST_NS, SHIFT = 7, 5e6, 10.0

LOOP = """
void bench(const double **given, double **found, long long *iw, double *w, long times);
void bench(const double **given, double **found, long long *iw, double *w, long times)
{
    long k;
    for (k = 0; k < times; ++k) {
        %s
        __asm__ volatile("" : : "r"(given), "r"(found) : "memory");
    }
}
"""


def ours(function: ca.Function) -> str:
    """Return the C that is printed here."""
    parts = Parts()
    callee = parts.function(function)
    given = [f"given[{i}]" for i in range(function.n_in())] + [f"found[{i}]" for i in range(function.n_out())]
    head = '#include <stdint.h>\n#include "gnc_math.h"\ntypedef double gnc_real;\ntypedef _Bool gnc_flag;\n'
    head += "#define GNC_APART __attribute__((noinline))\n#define GNC_SINGULAR 4\n"
    return head + parts.text() + LOOP % f"{callee.name}({', '.join(given)});"


def casadis(function: ca.Function, *, best: bool) -> str:
    """Return CasADi's own C."""
    if best and function.is_a("MXFunction"):
        with contextlib.suppress(RuntimeError):
            function = function.expand()
    if best and function.is_a("SXFunction"):
        x = function.sx_in()
        function = ca.Function(function.name(), x, ca.cse(function.call(x)))
    generator = ca.CodeGenerator("c.c")
    generator.add(function)
    return generator.dump() + LOOP % f"{function.name()}(given, found, iw, w, 0);"


class Timed:
    """Hold a function in C with numbers to call it on.

    Parameters
    ----------
    text : C with `bench` of LOOP.
    function : whose ports it has.
    """

    def __init__(self, text: str, function: ca.Function) -> None:
        rng = np.random.default_rng(1)
        self.given = [rng.normal(size=max(function.nnz_in(i), 1)) for i in range(function.n_in())]
        self.found = [np.zeros(max(function.nnz_out(i), 1)) for i in range(function.n_out())]
        self._room = [np.zeros(100_000, np.int64), np.zeros(100_000)]
        with tempfile.TemporaryDirectory() as place:
            (Path(place) / "f.c").write_text(text)
            words = [*FLAGS, f"-I{assets.folder('codegen') / 'runtime'}", "-o", f"{place}/f.so", f"{place}/f.c", "-lm"]
            compilers.compile_in(Path(place), compilers.find(), words, "a function")
            self._c = ctypes.CDLL(f"{place}/f.so")

    def run(self, times: int) -> float:
        """Call it so many times; return the processor time [ns]."""

        def pointers(arrays: list[np.ndarray]) -> ctypes.Array:
            # Ports beyond the last are work space of CasADi's C.
            return (ctypes.c_void_p * (len(arrays) + 1000))(*(each.ctypes.data for each in arrays))

        room = [ctypes.c_void_p(each.ctypes.data) for each in self._room]
        begun = time.process_time_ns()
        self._c.bench(pointers(self.given), pointers(self.found), *room, ctypes.c_long(times))
        return float(time.process_time_ns() - begun)


def answers(text: str, function: ca.Function) -> list[np.ndarray]:
    """Return what one call gives."""
    timed = Timed(text, function)
    timed.run(1)
    return timed.found


def nanoseconds(text: str, function: ca.Function) -> float:
    """Return the least processor time of a call."""
    timed, times = Timed(text, function), 10
    while timed.run(times) < LEAST_NS:
        times *= 4
    return min(timed.run(times) for _ in range(RUNS)) / times


def families(*, everything: bool) -> dict[str, list[ca.Function]]:
    """Return the functions by family; `everything` takes all of the test's set but the one of 2500 operations."""
    own = functions_of
    graphs = [own.random_graph(seed, 150) for seed in range(3)]
    if everything:
        graphs = [own.random_graph(seed, 20 + seed % 40) for seed in range(130)]
        graphs += [own.random_graph(1000 + seed, 150) for seed in range(15)]
    return {
        "missions": own.steps_of_missions(),
        "network and filter": [own.network(), own.kalman(solve=False)],
        "calls, maps, tables": own.shapes() if everything else own.shapes()[-12:],
        "random graphs": graphs,
    }


def main(arguments: list[str]) -> None:
    """Print a line a function, and the means."""
    times = {}
    for family, functions in families(everything="all" in arguments).items():
        rows = []
        for function in functions:
            texts = ours(function), casadis(function, best=False), casadis(function, best=True)
            rows.append([nanoseconds(text, function) for text in texts])
            numbers = "".join(f"{each:11.1f}" for each in rows[-1])
            print(f"{function.name():12} {function.n_instructions():6}{numbers}", flush=True)
        times[family] = np.array(rows) + SHIFT
    for family, rows in {**times, "all": np.concatenate([*times.values()])}.items():
        default, best = (np.exp(np.log(rows[:, i] / rows[:, 0]).mean()) for i in (1, 2))
        print(f"{family} ({len(rows)}): CasADi's C {default:.2f}, with best options {best:.2f} times our time")


if __name__ == "__main__":
    main(sys.argv[1:])
