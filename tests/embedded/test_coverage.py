"""Which branches the vectors take: decisions read from C and counted, what a package says, what `verify` finds."""

import ctypes
import hashlib
import json
import shutil
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.embedded.coverage import COVERAGE, counting, read_unit
from casadi_gnc.system import compilers

#: What a unit can hold: nested choices, a chain of `if`, loops, text and comments with signs, lines that are left out.
UNIT = r"""#define TWICE(x) ((x) > 0 ? 2 * (x) : 0)
#define NAME(x) own_##x
enum { MOST = 3 };
static int NAME(sign)(int x) /* ? : */
{
    /* the sign */
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}
int walk(int x)
{
    int found = 0, table[2] = {x > 1 ? 5 : 6, 7};
    const char *said = "if (x) ? '\"' : ;";
#ifdef LEFT_OUT
    if (x == 77) return 0;
#else
    if (x == 78) return 0;
#endif
    if ((x > 2 ? x : -x) > 4) // if (comment)
    {
        found = 1;
    } else if (x == 4 || said[0] != 'i') found = (x < 0) ? 2 : 3;
    else {
        /* counts down */
        while (x > 0) { x -= 1; found += table[x > 0 ? 1 : 0]; }
    }
    if (MOST > 2) do { ++found; } while (found < 0);
    return found + own_sign(x);
}
"""
#: Decision -> line, place, how often false and true for x = 5, 4, 1, 0.
EXPECTED = {
    "x > 0": (7, "sign: the sign", 2, 2),
    "x < 0": (7, "sign: the sign", 2, 0),
    "x > 1": (11, "walk", 2, 2),
    "x == 78": (16, "walk", 4, 0),
    "x > 2": (18, "walk", 2, 2),
    "(x > 2 ? x : -x) > 4": (18, "walk", 3, 1),
    "(x < 0)": (21, "walk", 1, 0),
    "x == 4 || said[0] != 'i'": (21, "walk", 2, 1),
    "x > 0 ": (24, "walk: counts down", 2, 1),
    "x > 0  ": (24, "walk: counts down", 1, 0),
    "found < 0": (26, "walk: counts down", 4, 0),
}


def test_decisions_are_found_and_counted_as_by_hand(tmp_path):
    unit = read_unit(UNIT)
    c = compilers.load(counting(UNIT, unit, 0), include=tmp_path)
    plain = compilers.load(UNIT, include=tmp_path)
    assert [c.walk(x) for x in (5, 4, 1, 0)] == [plain.walk(x) for x in (5, 4, 1, 0)]
    there = list((ctypes.c_ulonglong * len(unit.decisions)).in_dll(c, "gnc_there_0"))
    counts = list((ctypes.c_ulonglong * (2 * len(unit.decisions))).in_dll(c, "gnc_seen_0"))
    found = sorted(
        (one.line, one.text, one.place, counts[2 * k], counts[2 * k + 1])
        for k, one in enumerate(unit.decisions)
        if k + 1 in there
    )
    assert found == sorted((line, text.strip(), *rest) for text, (line, *rest) in EXPECTED.items())


@pytest.fixture(scope="module")
def package(tmp_path_factory) -> Path:
    """Return the package of a function with a branch that its vectors never take and one that they take."""
    x = ca.SX.sym("x")
    y = ca.if_else(x > 50, 7 * x, ca.if_else(x > 0, x, -2 * x))
    folder = tmp_path_factory.mktemp("coverage") / "folded"
    rows = np.linspace(-3, 3, 20)[:, None]
    gnc.generate(ca.Function("folded", [x], [y], ["x"], ["y"]), folder, vectors=rows)
    return folder


def test_a_branch_that_the_vectors_never_take_is_named_with_its_line(package):
    text = (package / "folded.c").read_text().splitlines()
    rows = [row.split(" | ") for row in (package / COVERAGE).read_text().splitlines() if row.startswith("| ")][1:]
    printed = [(int(row[0].strip("| ")), row[1].strip("`"), row[3].strip(" |")) for row in rows if "f_folded" in row[2]]
    ((line, name, never),) = printed
    assert never == "true"
    assert f"({name} ? " in text[line - 1]
    (defined,) = (row for row in text if f" {name} = " in row)
    left = defined.split(" = ")[1].split(" < ")[0]
    assert f"    const gnc_real {left} = 50.;" in text


@pytest.mark.slow
def test_a_planted_count_is_found_by_verification(package, tmp_path):
    assert gnc.verify(package)["is_sound"]
    copy = Path(shutil.copytree(package, tmp_path / "copy"))
    about, text = json.loads((copy / "manifest.json").read_text()), (copy / COVERAGE).read_text()
    told = about["coverage"]
    told["both_ways"] += 1
    (copy / COVERAGE).write_text(text.replace("| true |", "| false |"))
    about["files"][COVERAGE] = hashlib.sha256((copy / COVERAGE).read_bytes()).hexdigest()
    (copy / "manifest.json").write_text(json.dumps(about))
    found = gnc.verify(copy)
    assert not found["is_sound"]
    assert found["edited"] == []
    assert found["not_regenerated"] == [COVERAGE, "manifest.json"]
