"""Time the online allocator against Clarabel (second-order cones) and DAQP (quadratic program) in one run.

    python tests/bench/allocation_speed.py [--daqp-source daqp-x.y.z/csrc] [--samples 4000] [--no-native]

Robust problem: a closed-loop flight at 10 Hz with 12 thrusters and 8 vertices. Clarabel is set up once and
updated; its processor time spans update and solve; the time it reports itself is shown too, but contains its first
set-up. Non-robust problem: the same commands with V = 1, P = 0; DAQP runs inside a C loop if its C sources are
given (`pip download --no-binary :all: daqp`), else by its Python function, whose reported solve time is used.
Each time is the least of several repeats of one command; then come median, mean and maximum over commands.
Answers are compared by their true objective.
"""

import argparse
import ctypes
import json
import platform
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
oa = import_module("online_allocator")

H_WEIGHT, BOX = 1e6, 5e-3


MEASURED = {}  # what --json writes: for each flight the rows of both tables, and ratios


def table(rows, flight, kind):
    MEASURED.setdefault(flight, {})[kind] = dict(rows)
    for label, values in rows:
        print(f"  {label:38s}" + "".join(f"{name} {value:>10}   " for name, value in values.items()))


def statistics(t):
    return {"median": f"{np.median(t):.2f}", "mean": f"{t.mean():.2f}", "max": f"{t.max():.1f}"}


def robust_objective(F, u, previous, D):
    errors = [u - F @ (oa.A0_2020 + d @ oa.E_2020).T for d in D]
    return (F**2).sum(1) + ((F - previous) ** 2).sum(1) + H_WEIGHT * np.max([(e**2).sum(1) for e in errors], axis=0)


class ConicPeer:
    """Clarabel on  min |F|^2 + |F - Fp|^2 + h w,  |u - B_v F|^2 <= w, in x = F / Fmax and errors / 30 uN m.

    The scale was chosen for Clarabel's accuracy on these flights: larger or smaller ones lose digits."""

    def __init__(self, D, tolerance):
        import clarabel
        from scipy import sparse

        self.unit, self.tolerance = 3e-5, tolerance
        self.weight = oa.MAX_FORCE**2 / (H_WEIGHT * self.unit**2)
        P = sparse.diags(np.r_[np.full(12, 4 * self.weight), 0.0], format="csc")
        w = np.zeros((1, 13))
        w[0, 12] = -0.5
        rows = [np.eye(13)[:12], -np.eye(13)[:12]]
        for d in D:
            B = (oa.A0_2020 + d @ oa.E_2020) * oa.MAX_FORCE / self.unit
            rows += [w, w, np.c_[B, np.zeros(3)]]  # ((w+1)/2, (w-1)/2, u - Bx) in the cone
        A = sparse.csc_matrix(np.vstack(rows))
        cones = [clarabel.NonnegativeConeT(24)] + [clarabel.SecondOrderConeT(5)] * len(D)
        settings = clarabel.DefaultSettings()
        settings.verbose, settings.presolve_enable = False, False
        settings.tol_gap_rel = settings.tol_feas = tolerance
        settings.tol_gap_abs = 1e-14
        self.copies, self.q = len(D), np.r_[np.zeros(12), 1.0]
        b = np.concatenate([np.ones(12), np.zeros(12)] + [[0.5, -0.5, 0, 0, 0]] * len(D))
        self.solver = clarabel.DefaultSolver(P, self.q, A, b, cones, settings)

    def solve(self, u, previous, lower, upper):
        q = self.q.copy()
        q[:12] = -2 * self.weight * previous / oa.MAX_FORCE
        b = np.concatenate(
            [upper / oa.MAX_FORCE, -lower / oa.MAX_FORCE] + [np.r_[0.5, -0.5, u / self.unit]] * self.copies
        )
        start = time.process_time()
        self.solver.update(q=q, b=b)
        solution = self.solver.solve()
        wall = 1e6 * (time.process_time() - start)
        return np.clip(np.array(solution.x[:12]) * oa.MAX_FORCE, lower, upper), wall, solution


def robust(title, flight, flags, repeats, every):
    D = oa.centre_of_mass_vertices([BOX] * 3)
    commands = [flight[k] for k in ("u", "previous", "lower", "upper")]
    some = [c[::every] for c in commands]
    best = robust_objective
    found = {}
    allocator = oa.Allocator(12, 3, 3, 8, flags=flags)
    allocator.setup(oa.A0_2020, oa.E_2020, D, 1, 1, H_WEIGHT)
    rows = []
    for label, mode, data in (
        ("online, warm", oa.WARM, commands),
        ("online, cold", oa.COLD, some),
        ("online, interior point alone, cold", oa.INTERIOR_POINT, some),
    ):
        t, r = allocator.sequence(*data, mode=mode, repeats=repeats)
        assert (r["status"] == oa.OPTIMAL).all()
        found[label] = t
        rows.append(
            (
                label,
                {
                    **statistics(t),
                    "fallback": f"{100 * (r['path'] == 2).mean():.2f}%",
                    "iterations": f"{(r['active_set_iterations'] + r['interior_point_iterations']).mean():.1f}",
                    "gap": f"{r['relative_gap'].max():.0e}",
                },
            )
        )
        if mode == oa.COLD:
            reference = best(r["force"], some[0], some[1], D)
    try:
        for tolerance in (1e-8, 1e-9):
            peer, walls, owns, forces = ConicPeer(D, tolerance), [], [], []
            for row in zip(*some, strict=False):
                tries = [peer.solve(*row) for _ in range(3)]
                walls.append(min(w for _, w, _ in tries))
                owns.append(min(1e6 * s.solve_time for _, _, s in tries))
                forces.append(tries[0][0])
            walls = np.array(walls)
            found[f"clarabel {tolerance:g}"] = walls
            error = best(np.array(forces), some[0], some[1], D) / reference - 1
            rows.append(
                (
                    f"Clarabel, update, {tolerance:g}",
                    {
                        **statistics(walls),
                        "own": f"{np.median(owns):.0f}",
                        "accuracy": f"{np.median(error):.0e}",
                        "worst": f"{error.max():.0e}",
                    },
                )
            )
    except ImportError:
        print("  (clarabel is not installed)")
    found["the paper's SDP"], own = semidefinite(D, [c[:: max(1, len(c) // 40)] for c in some])
    rows.append(("the paper's SDP, Clarabel", {**statistics(found["the paper's SDP"]), "own": f"{own:.0f}"}))
    table(rows, title, "robust")
    w, c = found["online, warm"], found["online, cold"]
    for name, p in found.items():
        if not name.startswith("online"):
            MEASURED[title].setdefault("ratios", {})[name] = {
                "warm, median": np.median(p) / np.median(w),
                "warm, mean": p.mean() / w.mean(),
                "cold, median": np.median(p) / np.median(c),
            }
            print(
                f"  {name}: warm {np.median(p) / np.median(w):.0f} x in the median, "
                f"{p.mean() / w.mean():.0f} x in the mean; "
                f"cold {np.median(p) / np.median(c):.0f} x in the median"
            )


def semidefinite(D, some):
    """Return processor times [us] of the SDP of Theorem 3 (casadi_gnc's back end, set up once), and its own median."""
    from casadi_gnc.allocation import AllocationProblem, backends

    problem = AllocationProblem(oa.A0_2020, 0.0, oa.MAX_FORCE, coupling=oa.E_2020, errors=np.array(D))
    solver, walls, owns = backends.module("sdp").set_up(problem), [], []
    for row in zip(*some, strict=True):
        tries = []
        for _ in range(3):
            start = time.process_time()
            found = solver.find(*row)
            tries.append((1e6 * (time.process_time() - start), 1e6 * found.seconds))
        walls.append(min(wall for wall, _ in tries))
        owns.append(min(own for _, own in tries))
    return np.array(walls), float(np.median(owns))


def daqp_library(source):
    folder = Path(tempfile.mkdtemp())
    subprocess.run(
        [
            "gcc",
            "-O3",
            "-fPIC",
            "-shared",
            f"-I{source}/include",
            str(oa.HERE / "daqp_timing.c"),
            *map(str, Path(source).glob("src/*.c")),
            "-lm",
            "-o",
            str(folder / "daqp.so"),
        ],
        check=True,
    )
    return ctypes.CDLL(str(folder / "daqp.so"))


def not_robust(title, flight, flags, repeats, source):
    u, previous, lower, upper = [np.ascontiguousarray(flight[k]) for k in ("u", "previous", "lower", "upper")]
    allocator = oa.Allocator(12, 3, 0, 1, flags=flags)
    allocator.setup(oa.A0_2020, None, None, 1, 1, H_WEIGHT)
    # x = F / Fmax, so that DAQP's tolerance on the bounds is relative; 1e-9 there is about 1e-8 of the objective
    unit = oa.MAX_FORCE
    H = np.ascontiguousarray(unit**2 * (4 * np.eye(12) + 2 * H_WEIGHT * oa.A0_2020.T @ oa.A0_2020))
    f = np.ascontiguousarray(unit * (-2 * H_WEIGHT * u @ oa.A0_2020 - 2 * previous))
    lo, hi = np.ascontiguousarray(lower / unit), np.ascontiguousarray(upper / unit)

    def objective(F):
        return (F**2).sum(1) + ((F - previous) ** 2).sum(1) + H_WEIGHT * ((u - F @ oa.A0_2020.T) ** 2).sum(1)

    rows, pointer = [], lambda a: a.ctypes.data_as(ctypes.c_void_p)
    library = daqp_library(source) if source else None
    for label, mode in (("warm", oa.WARM), ("cold", oa.COLD)):
        t, r = allocator.sequence(u, previous, lower, upper, mode=mode, repeats=repeats)
        rows.append(
            (
                f"online, {label}",
                {
                    **statistics(t),
                    "fallback": f"{100 * (r['path'] == 2).mean():.2f}%",
                    "gap": f"{r['relative_gap'].max():.0e}",
                },
            )
        )
        x, time_ = np.zeros_like(f), np.zeros(len(u))
        if library:
            library.daqp_sequence(
                12,
                len(u),
                pointer(H),
                pointer(f),
                pointer(lo),
                pointer(hi),
                int(mode == oa.COLD),
                repeats,
                ctypes.c_double(1e-9),
                pointer(time_),
                pointer(x),
            )
            name = f"DAQP in C, {label}"
        elif mode == oa.COLD:
            import daqp

            for k in range(len(u)):
                for _ in range(3):
                    x[k], _, _, info = daqp.solve(
                        H, f[k], np.zeros((0, 12)), hi[k], lo[k], np.zeros(12, np.int32), primal_tol=1e-9
                    )
                    time_[k] = min(time_[k] or 1e9, 1e6 * info["solve_time"])
            name = "DAQP from Python, own time, cold"
        else:
            continue
        error = objective(np.clip(x * unit, lower, upper)) / objective(r["force"]) - 1
        rows.append((name, {**statistics(time_), "accuracy": f"{np.median(error):.0e}", "worst": f"{error.max():.0e}"}))
    table(rows, title, "not robust")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--daqp-source", help="folder with DAQP's include/ and src/")
    parser.add_argument("--samples", type=int, default=4000)
    parser.add_argument("--every", type=int, default=20, help="Clarabel and cold starts on every n-th command")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--flight", action="append", help="only this one of the four; may be repeated")
    parser.add_argument("--json", type=Path, help="file for the same numbers")
    parser.add_argument("--no-native", action="store_true", help="compile for the generic processor of the family")
    options = parser.parse_args()
    flags = oa.FAST_FLAGS + (() if options.no_native else ("-march=native",))
    print(f"{platform.processor() or platform.machine()}, gcc {' '.join(flags)}; times in microseconds")
    for name, arguments in {
        "slew": {},
        "noisy slew": {"noise": 2e-6},
        "slew with rate box": {"rate": 1e-2},
        "de-tumble": {},
    }.items():
        if options.flight and name not in options.flight:
            continue
        kind = "detumble" if name == "de-tumble" else "slew"
        flight = oa.fly(kind, options.samples, box=BOX, **arguments)
        print(f"{name}: {options.samples} samples, robust")
        robust(name, flight, flags, options.repeats, options.every)
        print(f"{name}: not robust")
        not_robust(name, flight, flags, options.repeats, options.daqp_source)
    if options.json:
        options.json.write_text(json.dumps(MEASURED, indent=2) + "\n")


if __name__ == "__main__":
    main()
