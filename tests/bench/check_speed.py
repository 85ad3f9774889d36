"""Time `casadi-gnc check` of every shipped mission and synthesis, with an empty cache of compiled C and a warm one.

Each is a process of its own, as typed at a prompt; processor time counts what it starts (the C compiler) too. Python's
compiled modules are kept from one to the next, as an installed package has them. Of several runs the shortest counts.
`python tests/bench/check_speed.py [runs] [part of a name]`
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

ASKED = sys.argv[1:] if __name__ == "__main__" else []
RUNS = int(ASKED[0]) if ASKED else 3
PART = ASKED[1] if len(ASKED) > 1 else ""
PROBLEMS = Path(__file__).parents[2] / "problems"
#: Kinds of files that `check` takes.
KINDS = ("mission", "synthesis")
#: Most processor time that a check may take, [s].
MOST = 3.0


def names() -> list[str]:
    """Return the shipped problems that `check` takes."""
    files = sorted(PROBLEMS.glob("*/*.toml"))
    kinds = {file: tomllib.loads(file.read_text())["kind"] for file in files}
    found = [file.relative_to(PROBLEMS).with_suffix("").as_posix() for file in files if kinds[file] in KINDS]
    return [name for name in found if PART in name]


def timed(name: str, environment: dict[str, str]) -> tuple[float, float]:
    """Return the processor time and the wall time of one check, [s]."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    command = [str(Path(sys.executable).parent / "casadi-gnc"), "check", name, "--json"]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, check=False)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    assert json.loads(done.stdout)["checks"], f"{name} was not checked"
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def main() -> None:
    with tempfile.TemporaryDirectory() as kept:
        environment = {**os.environ, "PYTHONPYCACHEPREFIX": kept}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        timed("huang2020/detumble", environment)  # fills Python's cache
        print(f"{'shortest of ' + str(RUNS) + ' [s]':32s}  {'empty cache':>15s}  {'warm cache':>15s}")
        print(f"{'':32s}  {'processor':>9s} {'wall':>5s}  {'processor':>9s} {'wall':>5s}")
        worst = 0.0
        for name in names():
            cold, warm = [], []
            for _ in range(RUNS):
                with tempfile.TemporaryDirectory() as cache:
                    own = {**environment, "CASADI_GNC_CACHE": cache}
                    cold.append(timed(name, own))
                    warm.append(timed(name, own))
            row = [min(each) for runs in (cold, warm) for each in zip(*runs, strict=True)]
            worst = max(worst, row[0], row[2])
            print(f"{name:32s}  {row[0]:9.2f} {row[1]:5.2f}  {row[2]:9.2f} {row[3]:5.2f}", flush=True)
        print(f"most processor time {worst:.2f} s, asked {MOST:g} s")
        if worst > MOST:
            raise SystemExit(1)


if __name__ == "__main__":
    main()
