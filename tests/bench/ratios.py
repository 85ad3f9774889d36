"""Measure every time and ratio that README and the documentation quote, and write them into docs/ratios.md.

    python tests/bench/ratios.py [--daqp-source DIR] [--out FILE] [--quick]      (or: make ratios)

Runs the scripts beside this one and `casadi-gnc bench`, one after another, each comparing its peers in one
run. The documentation includes parts of the file, from `<!-- name -->` to `<!-- /name -->`; the README has
one of them between the same marks and is written anew as well. `--quick` measures less, for tests.
"""

import argparse
import importlib.metadata
import json
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

from casadi_gnc.benchmarks import machine, read_results
from casadi_gnc.benchmarks.markdown import CLOCKS, ranking_table
from casadi_gnc.benchmarks.summary import overview

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
OURS = "our C, gnc_math"
FLIGHTS = {
    "flight": ("flight_speed.py", "De-tumbling, 1500 s at 10 Hz, observer law, pseudo-inverse"),
    "proximity": ("proximity_speed.py", "Proximity, 250 s at 100 Hz, six channels"),
    "drag_free": ("drag_free_speed.py", "Drag-free, 100 s continuously in steps of 0.5 ms"),
}
SLEW = "slew"
#: On a busy machine every contestant must still be measured.
LONG = ["--run-limit", 900]


def run(*command, json_file=None):
    """Run a command and return what it printed, or the JSON that it wrote, now or before."""
    if json_file is not None and Path(json_file).exists():
        return json.loads(Path(json_file).read_text())
    done = subprocess.run([sys.executable, *map(str, command)], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    if json_file is not None and Path(json_file).exists():
        return json.loads(Path(json_file).read_text())
    if done.returncode:
        raise SystemExit(f"{command[0]} ended with code {done.returncode}")
    return done.stdout


def line(cells):
    return "| " + " | ".join(cells) + " |"


def digits(value):
    return f"{value:.3g}" if value < 100 else f"{value:.0f}"


def daqp_source(folder):
    """Return DAQP's C sources in the version that is installed, or None where they cannot be had."""
    version = importlib.metadata.version("daqp")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--no-binary", ":all:"]
    if subprocess.run([*command, f"daqp=={version}", "--dest", str(folder)], capture_output=True).returncode:
        return None
    with tarfile.open(next(folder.glob("daqp-*.tar.gz"))) as archive:
        archive.extractall(folder, filter="data")
    return next(folder.glob("daqp-*/csrc"))


def flights(folder, wanted):
    parts = []
    for name in wanted:
        script, title = FLIGHTS[name]
        if not (HERE / script).exists():
            continue
        seconds = run(HERE / script, "--json", folder / f"{name}.json", json_file=folder / f"{name}.json")["seconds"]
        rows = [line(["", "time [ms]", "times ours"]), line(["---", "---:", "---:"])]
        rows += [line([who, digits(1e3 * value), digits(value / seconds[OURS])]) for who, value in seconds.items()]
        parts.append((name, title, seconds, "\n".join(rows)))
    return parts


def allocation(folder, source, samples):
    options = ["--samples", samples, "--flight", SLEW, "--json", folder / "allocation.json"]
    options += ["--daqp-source", source] if source else []
    found = run(HERE / "allocation_speed.py", *options, json_file=folder / "allocation.json")[SLEW]
    rows = [line(["", "median [us]", "mean [us]", "largest gap or error, of the cost"]), line(["---"] + ["---:"] * 3)]
    for kind in ("robust", "not robust"):
        for who, row in found[kind].items():
            prefix = "" if kind == "robust" else "no uncertainty: "
            rows.append(line([prefix + who, row["median"], row["mean"], row.get("gap") or row.get("worst") or ""]))
    ratios = [
        f"* {who}: " + ", ".join(f"{what} {digits(value)} times" for what, value in some.items()) + " ours"
        for who, some in found["ratios"].items()
    ]
    return found, "\n".join(rows) + "\n\nRatios to the on-board allocator:\n\n" + "\n".join(ratios)


def back_ends(folder, clock, options):
    out = folder / "bench"
    run("-m", "casadi_gnc.cli.main", "bench", "allocation", "--clock", clock, "--out", out, *options)
    found = overview(read_results(out))
    return {group: ranking_table(order, found.whole(group)) for group, order in found.orders.items()}


def steps(folder, clock, options):
    out = folder / "step"
    run("-m", "casadi_gnc.cli.main", "bench", "step", "--clock", clock, "--out", out, *options)
    found = overview(read_results(out))
    rows = [line(["way", "one step [us]"]), line(["---", "---:"])]
    rows += [line([f"`{who}`", digits(row["warm_us"])]) for who, row in found.whole("steps").items()]
    return "\n".join(rows)


def gains(folder):
    kept = folder / "synthesis.txt"
    if not kept.exists():
        kept.write_text(run(HERE / "synthesis_speed.py"))
    return kept.read_text().strip()


def sentence(measured, found):
    """Return what the README says of speed."""
    by_hand, machine_, ours = (measured[who] for who in ("numpy, by hand", "CasADi VM, mapaccum", OURS))
    warm, clarabel = (found["robust"][who]["median"] for who in ("online, warm", "Clarabel, update, 1e-08"))
    return (
        f"One 1500 s flight (15001 samples): hand-written numpy {digits(by_hand)} s, CasADi's virtual machine "
        f"(`mapaccum`)\n{digits(1e3 * machine_)} ms, our C {digits(1e3 * ours)} ms, a ratio of "
        f"{digits(by_hand / ours)} and {digits(machine_ / ours)}. A warm robust allocation of twelve\nthrusters, "
        f"certificate included, takes {warm} us in the median, Clarabel {clarabel} us."
    )


def mark(name, text):
    return f"<!-- {name} -->\n{text}\n<!-- /{name} -->"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--daqp-source", type=Path, help="folder with DAQP's include/ and src/; else downloaded")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "ratios.md")
    parser.add_argument(
        "--clock", default="wall", help="of `casadi-gnc bench`: wall, or cpu where others load the machine"
    )
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--folder", type=Path, help="keep what is measured there; a run that was ended goes on")
    options = parser.parse_args()
    few = ["--samples", 3, "--passes", 1] if options.quick else []
    with tempfile.TemporaryDirectory() as workshop:
        folder = options.folder or Path(workshop)
        folder.mkdir(parents=True, exist_ok=True)
        source = options.daqp_source or (None if options.quick else daqp_source(folder))
        flown = flights(folder, list(FLIGHTS)[: 1 if options.quick else None])
        found, on_board = allocation(folder, source, 100 if options.quick else 1500)
        chosen = [*few, "--backends", "online,clarabel,daqp"] if options.quick else LONG
        tables = back_ends(folder, options.clock, chosen)
        step = steps(folder, options.clock, few)
        inequalities = "" if options.quick else gains(folder)
    about = machine.describe()
    told = sentence(flown[0][2], found)
    parts = [
        "# Measured times and ratios",
        "Written by `make ratios`; no number here is typed by hand, and those that other pages show are included from "
        "here. Each table is one run that compares its rows. Read the ratios: times are of this machine on this day.",
        f"{about['processor']}, {about['cores']} cores, {about['compiler']}, "
        f"casadi-gnc {machine.version('casadi-gnc')}, CasADi {machine.version('casadi')}; "
        f"load at the end (1, 5, 15 min) {', '.join(f'{value:g}' for value in about['load'] or [])}; {about['date']}.",
        mark("readme", told),
        "## Whole flights",
        "Processor time, the least of several runs; building and compiling are not timed.",
        *[f"{title}:\n\n{mark(name, rows)}" for name, title, _, rows in flown],
        "## Allocation on board",
        "A 10 Hz slew of twelve thrusters, microseconds a command inside a C loop (`-O3 -march=native`), the least of "
        "nine repeats of each; peers called with their set-up reused, processor time:",
        mark("on_board", on_board),
        "## Allocation back ends from Python",
        f"`casadi-gnc bench allocation`, {CLOCKS[options.clock]}; [](benchmarks.md) says what the columns mean.",
        *[f"Set `{group}`:\n\n{mark(f'bench_{group}', rows)}" for group, rows in tables.items()],
        "## One controller step",
        f"`casadi-gnc bench step`, de-tumbling and slew, {CLOCKS[options.clock]}:",
        mark("step", step),
    ]
    if inequalities:
        parts += [
            "## Gains",
            "The docking synthesis beside cvxpy + Clarabel:",
            mark("synthesis", f"```text\n{inequalities}\n```"),
        ]
    options.out.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    readme = ROOT / "README.md"
    text = readme.read_text(encoding="utf-8")
    head, tail = "<!-- readme -->\n", "\n<!-- /readme -->"
    if options.out == ROOT / "docs" / "ratios.md" and head in text:
        before, _, rest = text.partition(head)
        readme.write_text(before + head + told + tail + rest.partition(tail)[2], encoding="utf-8")


if __name__ == "__main__":
    main()
