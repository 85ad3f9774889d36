"""The bound on instructions from compiled text: counts by hand, and what a board counts at the worst input."""

import subprocess

import pytest

import casadi_gnc
from casadi_gnc.embedded import boards, targets
from casadi_gnc.embedded.worst_case import Counter
from casadi_gnc.errors import TargetError


def listing(**functions):
    """Return a disassembly of functions, each a list of instructions of two bytes; L1: stands before a target."""
    lines, at = [], 0x1000
    for name, body in functions.items():
        marks, rows = {}, []
        start = at
        for line in body:
            mark, _, rest = line.rpartition(": ")
            if mark:
                marks[mark] = at
            rows.append((at, rest))
            at += 2
        lines.append(f"{start:08x} <{name}>:")
        for place, text in rows:
            mnemonic, _, rest = text.partition(" ")
            for mark, target in marks.items():
                rest = rest.replace(mark, f"{target:x} <{name}>")
            lines.append(f"    {place:x}:\t{mnemonic}\t{rest}")
    return "\n".join(lines)


def bound(**functions):
    return Counter(listing(**functions), b"").worst(next(iter(functions)), 1)


def test_a_counted_loop():
    # one before, three in each of five rounds, the return
    assert bound(f=["movs r3, #0", "L1: adds r3, #1", "cmp r3, #5", "bne.n L1", "bx lr"]) == 1 + 5 * 3 + 1


def test_the_dearer_way_of_an_unknown_branch_in_each_round():
    body = [
        "movs r3, #0",
        "L1: ldr r2, [r0, #0]",
        "cbz r2, L2",
        "nop",
        "nop",
        "L2: adds r3, #1",
        "cmp r3, #4",
        "bne.n L1",
    ]
    assert bound(f=[*body, "bx lr"]) == 1 + 4 * 7 + 1


def test_a_count_that_is_checked_before():
    # a number from memory, taken only where it is 1 to 6: the rounds are six at most
    body = ["ldr r1, [r0, #4]", "subs r2, r1, #1", "cmp r2, #5", "bhi.n L9", "movs r3, #0"]
    loop = ["L1: adds r3, #1", "cmp r3, r1", "bne.n L1"]
    assert bound(f=[*body, *loop, "L9: bx lr"]) == 5 + 6 * 3 + 1


def test_pointers_that_meet_after_unknown_many_steps():
    # from r0 to r0 + 8 n in steps of 8, n from 1 to 3
    body = ["ldr r1, [r0, #4]", "subs r2, r1, #1", "cmp r2, #2", "bhi.n L9", "add.w r2, r0, r1, lsl #3"]
    loop = ["L1: vldmia r0!, {d7}", "cmp r0, r2", "bne.n L1"]
    assert bound(f=[*body, *loop, "L9: bx lr"]) == 5 + 3 * 3 + 1


def test_a_budget_that_falls_by_unknown_steps():
    # four units; a round costs one or two
    body = [
        "movs r3, #4",
        "L1: ldr r2, [r0, #0]",
        "cbz r2, L2",
        "subs r3, #1",
        "L2: subs r3, #1",
        "cmp r3, #0",
        "bgt.n L1",
    ]
    # four rounds of the cheap kind are the most; each counts as a dear one, since what is joined forgets which it was
    assert bound(f=[*body, "bx lr"]) == 1 + 4 * 6 + 1


def test_calls_count_each_time_and_registers_come_back():
    g = ["push {r3, lr}", "movs r3, #0", "L1: adds r3, #1", "cmp r3, #2", "bne.n L1", "pop {r3, pc}"]
    f = [
        "push {r4, lr}",
        "movs r4, #0",
        "L1: bl 1010 <g>",
        "adds r4, #1",
        "cmp r4, #3",
        "bne.n L1",
        "nop",
        "pop {r4, pc}",
    ]
    assert len(f) * 2 == 0x10
    assert bound(f=f, g=g) == 2 + 3 * (4 + 9) + 2


def test_a_loop_without_a_bound_and_a_jump_through_a_register_are_told(monkeypatch):
    monkeypatch.setattr("casadi_gnc.embedded.worst_case._PATIENCE", 1000)
    with pytest.raises(TargetError, match="loop without a bound"):
        bound(f=["L1: ldr r2, [r0, #0]", "cmp r2, #0", "bne.n L1", "bx lr"])
    with pytest.raises(TargetError, match="through a register"):
        bound(f=["bx r0"])
    with pytest.raises(TargetError, match="has no function nothing"):
        Counter(listing(f=["bx lr"]), b"").worst("nothing", 1)


C = """
struct data { int n; int wide; double x[16], a[6][6]; };
double entry(struct data *d);
double entry(struct data *d)
{
    double sum = 0;
    int i, k;
    if (d->n < 0 || d->n > 16) return 0;
    for (i = 0; i < d->n; ++i) if (d->x[i] > 0) for (k = 0; k < 6; ++k) sum += d->a[k][i % 6] * d->x[i];
    return sum;
}
"""
MAIN = """
#include "target.h"
struct data { int n; int wide; double x[16], a[6][6]; };
double entry(struct data *d);
static double (*volatile run)(struct data *) = entry;
static struct data d;
int main(void)
{
    const int file = target_open("count.bin");
    uint64_t before;
    int i;
    d.n = 16;
    for (i = 0; i < 16; ++i) d.x[i] = 1;
    before = target_instructions();
    (void)run(&d);
    before = target_instructions() - before;
    target_write(file, &before, sizeof before);
    return 0;
}
"""


@pytest.mark.tools("arm-none-eabi-gcc", "qemu-system-arm")
@pytest.mark.parametrize("level", ["-Os", "-O2"])
def test_the_bound_is_what_a_board_counts_at_the_worst_input(tmp_path, level):
    board = boards.find("cortex-m7")
    (tmp_path / "entry.c").write_text(C)
    (tmp_path / "main.c").write_text(MAIN)
    folder = board.place(board.script).parent
    command = [board.compiler, *board.flags, *board.link, f"-T{board.place(board.script)}", f"-I{folder}", level]
    sources = ["entry.c", "main.c", *map(str, map(board.place, board.sources))]
    subprocess.run([*command, *sources, "-o", "image.elf"], check=True, cwd=tmp_path)
    quiet = ["-nographic", "-monitor", "none", "-serial", "none", "-semihosting-config", "enable=on,target=native"]
    subprocess.run([*board.emulator, *quiet, "-kernel", "image.elf"], check=True, cwd=tmp_path, timeout=100)
    counted = int.from_bytes((tmp_path / "count.bin").read_bytes(), "little")
    text = subprocess.run(
        ["arm-none-eabi-objdump", "-d", "--no-show-raw-insn", "image.elf"],
        check=True, cwd=tmp_path, capture_output=True, text=True,
    ).stdout  # fmt: skip
    found = Counter(text, b"").worst("entry", 1)
    assert found <= counted <= found + 20  # and the call, and the reading of the counter


@pytest.mark.slow
@pytest.mark.tools("arm-none-eabi-gcc", "qemu-system-arm")
def test_a_robust_step_stays_below_its_bound(tmp_path):
    """The twelve thrusters: neither the flight nor a search over measurements comes above what the text allows."""
    casadi_gnc.generate("huang2020/slew", tmp_path / "package", scheme="funnel_robust", name="slew", steps=100)
    found = targets.measure(tmp_path / "package", "slew", boards.find("cortex-m7"), prove=True, climb=True).summary()
    assert found["instructions_bound_missing"] == ""
    assert found["instructions_climbed_steps"] == 1200
    assert found["instructions_worst"] <= found["instructions_bound"]
    assert found["instructions_climbed"] <= found["instructions_bound"] <= 3 * found["instructions_climbed"]
    assert found["instructions_bound"] < 1_400_000
