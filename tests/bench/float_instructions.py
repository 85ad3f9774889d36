"""Count instructions on a Cortex-M4F of functions in single precision: ours against CasADi's C of `casadi_real=float`.

    python tests/bench/float_instructions.py            # the functions of function_speed.py
    python tests/bench/float_instructions.py all        # every function of tests/embedded/test_function_set.py

Both are compiled with -O2 for the processor's unit of single precision and linked with newlib; the emulator counts. An
argument is drawn from a normal distribution; a number is the mean of several calls. Then the shifted geometric mean of
the ratios (shift 10 instructions), of each family and of all.
"""

from __future__ import annotations

import sys
import tempfile
from importlib import import_module
from pathlib import Path

import casadi as ca
import numpy as np

from casadi_gnc.embedded import boards, targets
from casadi_gnc.embedded.parts import Parts
from casadi_gnc.embedded.scalars import c_constant
from casadi_gnc.system import assets

sys.path.insert(0, str(Path(__file__).parent))
speed = import_module("function_speed")

DRAWS, SHIFT = 8, 10.0
_RUNTIME = assets.folder("codegen") / "runtime"
_FLAGS = (*targets.FLAGS, "-O2", "-w", f"-I{_RUNTIME}")

_MAIN = """
#include <stdint.h>
#include "target.h"
void ours(const float **given, float **found);
void casadis(const float **given, float **found);
static void nothing(const float **given, float **found) { (void)given; (void)found; }
static void (*volatile call[3])(const float **, float **) = {nothing, ours, casadis};
static const float drawn[DRAWS][GIVEN] = {NUMBERS};
static float room[FOUND];
static uint64_t counts[3];
static const float *given[1000];
static float *found[1000];
static const int32_t sizes_in[] = {SIZES_IN 0}, sizes_out[] = {SIZES_OUT 0};
int main(void)
{
    int k, n, draw, at;
    for (draw = 0; draw < DRAWS; ++draw) {
        for (k = at = 0; k < INPUTS; at += sizes_in[k++]) given[k] = &drawn[draw][at];
        for (k = at = 0; k < OUTPUTS; at += sizes_out[k++]) found[k] = &room[at];
        for (n = 0; n < 3; ++n) {
            const uint64_t before = target_instructions();
            call[n](given, found);
            counts[n] += target_instructions() - before;
        }
    }
    target_write(target_open("counts.bin"), counts, sizeof counts);
    return 0;
}
"""


def ours(function: ca.Function) -> str:
    """Return the C that is printed here, in single precision."""
    parts = Parts(real="float")
    callee = parts.function(function)
    given = [f"given[{i}]" for i in range(function.n_in())] + [f"found[{i}]" for i in range(function.n_out())]
    head = "#include <stdint.h>\n#define GNC_INLINE static __attribute__((unused))\n"
    head += '#include "gnc_mathf.h"\ntypedef float gnc_real;\ntypedef _Bool gnc_flag;\n'
    head += "#define GNC_APART __attribute__((noinline))\n#define GNC_SINGULAR 4\n"
    head += "void ours(const float **given, float **found);\n"
    call = f"void ours(const float **given, float **found) {{ {callee.name}({', '.join(given)}); }}\n"
    return head + parts.text() + call


def casadis(function: ca.Function) -> str:
    """Return CasADi's own C with its option `casadi_real`."""
    generator = ca.CodeGenerator("c.c", {"casadi_real": "float", "casadi_int": "int"})
    generator.add(function)
    call = f"static int iw[{function.sz_iw() + 1}]; static float w[{function.sz_w() + 1}];\n"
    call += "void casadis(const float **given, float **found);\n"
    call += f"void casadis(const float **given, float **found) {{ {function.name()}(given, found, iw, w, 0); }}\n"
    return generator.dump() + call


def main_text(function: ca.Function) -> str:
    """Return the program that calls both."""
    rng = np.random.default_rng(1)
    sizes = [function.nnz_in(i) for i in range(function.n_in())], [function.nnz_out(i) for i in range(function.n_out())]
    rows = rng.normal(size=(DRAWS, max(sum(sizes[0]), 1)))
    numbers = ", ".join("{" + ", ".join(c_constant(each, "float") for each in row) + "}" for row in rows)
    replaced = {
        "NUMBERS": numbers,
        "DRAWS": DRAWS,
        "GIVEN": rows.shape[1],
        "FOUND": sum(sizes[1]) + 1,
        "INPUTS": function.n_in(),
        "OUTPUTS": function.n_out(),
        "SIZES_IN": "".join(f"{each}, " for each in sizes[0]),
        "SIZES_OUT": "".join(f"{each}, " for each in sizes[1]),
    }
    text = _MAIN
    for word, value in replaced.items():
        text = text.replace(word, str(value))
    return text


def instructions(function: ca.Function) -> tuple[float, float]:
    """Return the mean instructions of a call of ours and of CasADi's."""
    target = boards.find("cortex-m4f")
    with tempfile.TemporaryDirectory() as place:
        shop = Path(place)
        objects = []
        for name, text in (("ours", ours(function)), ("casadis", casadis(function)), ("main", main_text(function))):
            (shop / f"{name}.c").write_text(text)
            objects.append(targets._compile(shop / f"{name}.c", shop, shop, target, _FLAGS))
        plain = ("-std=gnu99", "-O2")
        board = [targets._compile(each, shop, shop, target, plain) for each in map(target.place, target.sources)]
        image = targets._link([*objects, *board], shop / "both.elf", target, shop)
        empty, own, other = np.frombuffer(targets._emulate(image, target, shop, "counts.bin"), "<u8")
    return float(own - empty) / DRAWS, float(other - empty) / DRAWS


def main(arguments: list[str]) -> None:
    """Print a line a function, and the means."""
    counts = {}
    for family, functions in speed.families(everything="all" in arguments).items():
        rows = []
        for function in functions:
            rows.append(instructions(function))
            print(f"{function.name():12} {rows[-1][0]:11.1f} {rows[-1][1]:11.1f}", flush=True)
        counts[family] = np.array(rows) + SHIFT
    for family, rows in {**counts, "all": np.concatenate([*counts.values()])}.items():
        ratios = rows[:, 1] / rows[:, 0]
        print(
            f"{family} ({len(rows)}): CasADi's C takes {np.exp(np.log(ratios).mean()):.2f} times our instructions, ",
            end="",
        )
        print(f"from {ratios.min():.2f} to {ratios.max():.1f}")


if __name__ == "__main__":
    main(sys.argv[1:])
