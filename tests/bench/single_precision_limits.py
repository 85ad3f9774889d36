"""How near the least cost forces can be that are told as floats, beside how near the allocator in floats comes.

For families of random problems, all numbers given rounded to float: the gap of the float allocator's answers; that of
the double allocator's answers with their forces rounded to the nearest floats, its weights kept; and the smallest gap
found when each of those forces may move to a neighbouring float as long as that helps. What the last two leave no
arithmetic on board can mend: forces are told as floats.

    python tests/bench/single_precision_limits.py [--problems 20] [family ...]
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "oracles"))
import online_allocator as oa

SIZES, ENOUGH = (4, 12, 24), 1e-4


def rounded(value):
    return None if value is None else np.asarray(np.asarray(value, np.float32), float)


def moved(gap, force, box, most=6):
    """Return the smallest gap that moving one force at a time by one float finds; stop below what is enough."""
    force, least = force.copy(), gap(force)
    for _ in range(most):
        before = least
        for i in range(len(force)):
            for way in (-np.inf, np.inf):
                other = force.copy()
                other[i] = np.clip(float(np.nextafter(np.float32(force[i]), np.float32(way))), box[0][i], box[1][i])
                if (found := gap(other)) < least:
                    force, least = other, found
        if least == before or least <= ENOUGH:
            break
    return least


def gaps(family, count, problems):
    """Return status, gap of the float answer, gap of rounded best forces, and after moving, of each command."""
    rng, rows = np.random.default_rng(17), []
    single, double = oa.Allocator(count, 3, 3, 8, single=True), oa.Allocator(count, 3, 3, 8)
    for _ in range(problems):
        problem, *commands, step = oa.instance(rng, family, count)
        problem, (u, previous, lower, upper), step = [*map(rounded, problem)], map(rounded, commands), rounded(step)
        for allocator in (single, double):
            allocator.setup(*problem)
        _, told = single.sequence(u, previous, lower, upper, step)
        _, best = double.sequence(u, previous, lower, upper, step)
        for k, (a, b) in enumerate(zip(told, best, strict=True)):
            box = oa.effective_box(lower, upper, previous[k], step)

            def gap(force, lam, k=k, problem=problem, box=box, u=u, previous=previous):
                found, f, _ = oa.certificate(problem, u[k], previous[k], *box, np.clip(force, *box), lam)
                return float(found / f) if f > 0 else 0.0

            near, weights = rounded(b["force"]), b["lam"]
            nearest = gap(near, weights)
            least = moved(lambda force: gap(force, weights), near, box) if nearest > ENOUGH else nearest  # noqa: B023
            rows.append((a["status"], gap(np.asarray(a["force"], float), np.asarray(a["lam"], float)), nearest, least))
    return np.array(rows)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("families", nargs="*", default=["m1_zero", "ties", "h", "mixed_zero"])
    options.add_argument("--problems", type=int, default=20, help="of each size and family, six commands each")
    given = options.parse_args()
    print("| family | answers | not certified | gap of floats, median | worst | above 1e-4 |", end="")
    print(" best forces rounded: worst | above 1e-4 | best of neighbours: worst | above 1e-4 |")
    print("|" + "---|" * 10)
    for family in given.families:
        found = np.vstack([gaps(family, count, given.problems) for count in SIZES])
        status, ours, nearest, least = found.T
        lost = int((status == oa.NOT_CERTIFIED).sum())
        cells = [f"{np.median(ours):.1e}"]
        for one in (ours, nearest, least):
            cells += [f"{one.max():.1e}", str(int((one > ENOUGH).sum()))]
        print(f"| {family} | {len(found)} | {lost} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    main()
