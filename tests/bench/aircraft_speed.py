"""Time the on-board allocator, DAQP and ActiveSetCtlAlloc inside a C loop on aircraft data, all in one run.

    python tests/bench/aircraft_speed.py admiredata.mat f18data.mat --active-set FOLDER --daqp-source daqp-x.y.z/csrc

Data (`casadi_gnc.benchmarks.outside`) and both programs are the user's own copies: QCAT's two files come with QCAT,
ActiveSetCtlAlloc from its authors' repository (under the GPL; FOLDER holds its src/), DAQP from its source
distribution (`pip download --no-binary :all: --no-deps daqp`). Nothing of them is kept here. All are compiled with the
same flags for the size of the data, and solve the same least squares in a box. ActiveSetCtlAlloc gets its matrix made
beforehand and its right-hand side within the clock, and does not end early ("cost truncation" off).

Each time is the least of several repeats of one command. The excess is that of the cost over the least of all.
"""

import argparse
import ctypes
import platform
import subprocess
import sys
import tempfile
from importlib import import_module
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "oracles")]
oa = import_module("online_allocator")
speed = import_module("allocation_speed")

ALGORITHMS = {"QR": 1, "Cholesky": 2}
UNITS = (
    *("common/solveActiveSet", "solveActiveSet_qr_naive", "solveActiveSet_qr", "solveActiveSet_chol"),
    *("lib/chol_math", "lib/qr_updates", "lib/qr_wrapper", "lib/qr_solve/qr_solve", "lib/qr_solve/r8lib_min"),
    "lib/sparse_math",
)


def pointer(array):
    return array.ctypes.data_as(ctypes.c_void_p)


class Case:
    """The data of one file, and the forces whose costs are compared."""

    def __init__(self, path):
        samples = import_module("casadi_gnc.benchmarks.outside").read_outside(path)
        self.problem = samples.problem
        arrays = (samples.commands, samples.previous, samples.lower, samples.upper)
        self.u, self.previous, self.lower, self.upper = (np.ascontiguousarray(array) for array in arrays)
        self.rows, self.count = self.problem.effectiveness.shape

    def costs(self, forces):
        forces = np.clip(forces, self.lower, self.upper)
        rows = zip(forces, self.u, self.previous, strict=True)
        return np.array([self.problem.objective(*row) for row in rows])

    def online(self, flags, cold, repeats):
        allocator = oa.Allocator(self.count, self.rows, 0, 1, flags=flags)
        p = self.problem
        allocator.setup(p.effectiveness, None, None, p.effort_weight, p.change_weight, p.accuracy_weight, p.preferred)
        mode = oa.COLD if cold else oa.WARM
        time, results = allocator.sequence(self.u, self.previous, self.lower, self.upper, mode=mode, repeats=repeats)
        return time, results["force"], int((results["status"] > oa.AT_ROUNDING).sum())

    def daqp(self, library, cold, repeats):
        p, time, x = self.problem, np.zeros(len(self.u)), np.zeros((len(self.u), self.count))
        unit = np.maximum(np.abs(p.lower), np.abs(p.upper))
        columns = p.effectiveness * unit
        weight = 2 * (p.effort_weight + p.change_weight) * unit**2
        hessian = np.ascontiguousarray(np.diag(weight) + 2 * p.accuracy_weight * columns.T @ columns)
        pulled = p.effort_weight * p.preferred + p.change_weight * self.previous
        linear = np.ascontiguousarray(-2 * p.accuracy_weight * self.u @ columns - 2 * pulled * unit)
        box = np.ascontiguousarray(self.lower / unit), np.ascontiguousarray(self.upper / unit)
        sizes = self.count, len(self.u)
        data = [pointer(one) for one in (hessian, linear, *box)]
        library.daqp_sequence(*sizes, *data, int(cold), repeats, ctypes.c_double(1e-9), pointer(time), pointer(x))
        return time, x * unit, 0

    def active_set(self, library, algorithm, cold, repeats):
        p, time, x = self.problem, np.zeros(len(self.u)), np.zeros((len(self.u), self.count))
        total = p.effort_weight + p.change_weight
        pulled = np.ascontiguousarray(
            np.sqrt(total) * (p.effort_weight * p.preferred + p.change_weight * self.previous) / total
        )
        accuracy = np.sqrt(p.accuracy_weight)
        matrix = np.vstack([accuracy * p.effectiveness, np.diag(np.sqrt(total))]).T.copy()  # column by column
        iterations, status = (np.zeros(len(self.u), dtype=np.intc) for _ in range(2))
        data = [pointer(one) for one in (matrix, self.u, pulled, self.lower, self.upper)]
        library.active_set_sequence(
            *(algorithm, len(self.u), *data, ctypes.c_double(accuracy), ctypes.c_double(1.0), int(cold), repeats),
            *(pointer(one) for one in (time, x, iterations, status)),
        )
        return time, x, int((status != 0).sum())


def active_set_library(source, case, flags):
    folder, home = Path(tempfile.mkdtemp()), Path(source) / "src"
    files = [str(home / f"{unit}.c") for unit in UNITS]
    include = [f"-I{home / part}" for part in ("common", "lib", "")]
    sizes = [f"-DAS_N_U={case.count}", f"-DAS_N_V={case.rows}"]
    command = ["gcc", *flags, "-w", "-fwrapv", "-fPIC", "-shared", *include, *sizes]
    subprocess.run(
        [*command, str(oa.HERE / "active_set_timing.c"), *files, "-lm", "-o", str(folder / "a.so")], check=True
    )
    return ctypes.CDLL(str(folder / "a.so"))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "data", nargs="+", type=Path, help=".mat files or folders of CSV, as bench allocation takes them"
    )
    parser.add_argument("--active-set", type=Path, help="folder of ActiveSetCtlAlloc")
    parser.add_argument("--daqp-source", type=Path, help="folder with DAQP's include/ and src/")
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    flags = (*oa.FAST_FLAGS, "-march=native")
    print(f"{platform.machine()}, gcc {' '.join(flags)}; microseconds a command")
    for path in options.data:
        case = Case(path)
        ways = {"online": lambda cold, case=case: case.online(flags, cold, options.repeats)}
        if options.daqp_source:
            library = speed.daqp_library(str(options.daqp_source))
            ways["DAQP"] = lambda cold, case=case, it=library: case.daqp(it, cold, options.repeats)
        if options.active_set:
            library = active_set_library(options.active_set, case, flags)
            for name, number in ALGORITHMS.items():
                ways[f"ActiveSetCtlAlloc, {name}"] = lambda cold, case=case, it=library, number=number: case.active_set(
                    it, number, cold, options.repeats
                )
        print(f"{path.name}: {case.rows} x {case.count}, {len(case.u)} commands")
        for cold in (False, True):
            found = {name: way(cold) for name, way in ways.items()}
            costs = {name: case.costs(forces) for name, (_, forces, _) in found.items()}
            least, ours = np.min(list(costs.values()), axis=0), found["online"][0]
            for name, (time, _, failed) in found.items():
                excess = (costs[name] - least) / np.maximum(least, 1e-300)
                ratios = [f"{of(time) / of(ours):5.2f}" for of in (np.median, np.mean)]
                start = "cold" if cold else "warm"
                print(
                    f"  {start} {name:28s} median {np.median(time):5.2f}  mean {time.mean():5.2f}  "
                    f"largest {time.max():6.1f}  times ours {', '.join(ratios)}  "
                    f"excess {excess.max():.0e}  failed {failed}"
                )


if __name__ == "__main__":
    main()
