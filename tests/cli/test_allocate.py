"""`casadi-gnc allocate` as its users run it: tables, streams, interruptions."""

import contextlib
import csv
import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from casadi_gnc.errors import ProblemError
from casadi_gnc.problem_files.allocating import read_commands
from casadi_gnc.problem_files.allocation_file import load_allocation

PROGRAM = [sys.executable, "-m", "casadi_gnc.cli.main", "allocate"]
CASE = "huang2020/allocation"


def run(*arguments: str, given: str | None = None) -> subprocess.CompletedProcess:
    return subprocess.run([*PROGRAM, *arguments], capture_output=True, text=True, input=given, timeout=300)


@pytest.fixture
def commands(tmp_path, rng):
    path = tmp_path / "torques.csv"
    rows = rng.uniform(-1e-3, 1e-3, (50, 3))
    path.write_text(
        "t,u1,u2,u3\n" + "".join(f"{k},{','.join(repr(float(v)) for v in row)}\n" for k, row in enumerate(rows))
    )
    return path, rows


@pytest.mark.parametrize("backend", ["online", "clarabel", "pinv"])
def test_table_in_table_out(commands, tmp_path, backend):
    path, rows = commands
    out = tmp_path / "deep" / "forces.csv"
    done = run(CASE, "--commands", str(path), "--backend", backend, "--out", str(out), "--json")
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["answers"] == 50
    problem = load_allocation(CASE).problem
    with out.open() as file:
        answers = list(csv.DictReader(file))
    for answer, command in zip(answers, rows, strict=True):
        forces = np.array([float(answer[f"F{i}"]) for i in range(1, 13)])
        missing = np.array([float(answer[f"unallocated{i}"]) for i in (1, 2, 3)])
        assert np.all((forces >= 0) & (forces <= 3.75e-3))
        assert np.allclose(command - problem.effectiveness @ forces, missing, atol=1e-15)
        assert answer["status"] == ("NOT_CERTIFIED" if backend == "pinv" else "OPTIMAL")
    if backend == "pinv":
        assert summary["largest_relative_gap"] > 0.1
    else:
        assert summary["largest_relative_gap"] <= 1e-6


def test_back_ends_agree(commands, tmp_path):
    path, _ = commands
    costs = []
    for backend in ("online", "clarabel"):
        out = tmp_path / f"{backend}.csv"
        assert run(CASE, "--commands", str(path), "--backend", backend, "--out", str(out)).returncode == 0
        with out.open() as file:
            costs.append([float(row["objective"]) for row in csv.DictReader(file)])
    # Each chain goes on from its own previous forces, which differ within the certified gaps.
    assert np.allclose(*costs, rtol=1e-4)


@pytest.mark.slow
def test_ten_thousand_lines_stream_in_order():
    u = 1e-3 * np.sin(np.arange(10_000)[:, None] * np.array([0.001, 0.002, 0.003]))
    given = "".join(f"{a!r},{b!r},{c!r}\n" for a, b, c in u.tolist())
    done = run(CASE, "--stream", given=given)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert len(lines) == 10_000
    effectiveness = load_allocation(CASE).problem.effectiveness
    made = np.array([[float(v) for v in line.split(",")[:12]] for line in lines]) @ effectiveness.T
    missing = np.array([[float(v) for v in line.split(",")[17:20]] for line in lines])
    assert np.allclose(made + missing, u, atol=1e-12)
    assert "latency [us]: p50" in done.stderr
    assert "10000 OPTIMAL" in done.stderr


def test_malformed_lines_are_told_and_the_stream_goes_on():
    done = run(CASE, "--stream", "--json", given="1e-4 0 0\nabc,1,2\n1,2\nnan,0,0\n1e999,0,0\n\n0,0,0\n")
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0
    assert [answer.get("status", "error") for answer in answers] == [
        "OPTIMAL", "error", "error", "BAD_COMMAND", "BAD_COMMAND", "OPTIMAL",
    ]  # fmt: skip
    assert answers[1]["error"] == "line 2: 'abc' is no number"
    assert answers[2]["error"] == "line 3: expected 3 numbers, got 2"
    assert all(np.all(np.isfinite(answer["forces"])) for answer in answers if "forces" in answer)
    assert json.loads(done.stderr)["malformed"] == 2


def test_each_answer_is_flushed():
    """A process that waits for each answer before it sends the next command does not hang."""
    with subprocess.Popen(
        [*PROGRAM, CASE, "--stream"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as peer:
        for _ in range(3):
            peer.stdin.write("1e-4,0,0\n")
            peer.stdin.flush()
            assert peer.stdout.readline().count(",") > 12
        peer.stdin.close()
        assert peer.wait(timeout=60) == 0
        assert "3 OPTIMAL" in peer.stderr.read()


@pytest.mark.slow
def test_reader_that_leaves_and_ctrl_c_end_cleanly():
    given = "1e-4,0,0\n" * 5000
    pipe = f"{' '.join(PROGRAM)} {CASE} --stream | head -n 2"
    done = subprocess.run(pipe, shell=True, capture_output=True, text=True, input=given, timeout=120)
    assert len(done.stdout.splitlines()) == 2
    assert "Traceback" not in done.stderr
    with subprocess.Popen(
        [*PROGRAM, CASE, "--stream"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as peer:  # fmt: skip
        peer.stdin.write("1e-4,0,0\n")
        peer.stdin.flush()
        peer.stdout.readline()
        peer.stdout.close()
        with contextlib.suppress(BrokenPipeError):
            peer.stdin.write("1e-4,0,0\n")
            peer.stdin.close()
        assert peer.wait(timeout=60) == 0
        errors = peer.stderr.read()
        assert "OPTIMAL" in errors
        assert "Exception" not in errors
    with subprocess.Popen(
        [*PROGRAM, CASE, "--stream"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    ) as peer:  # fmt: skip
        peer.stdin.write("1e-4,0,0\n")
        peer.stdin.flush()
        peer.stdout.readline()
        time.sleep(0.2)
        peer.send_signal(signal.SIGINT)
        errors = peer.stderr.read()
        assert peer.wait(timeout=60) == 130
        assert "Traceback" not in errors
        assert "1 OPTIMAL" in errors


def test_nothing_is_imported_for_a_bad_command():
    """The first command that is none is answered as soon as the next one."""
    code = (
        "import sys, numpy as np\n"
        "from casadi_gnc.problem_files.allocating import CaseAllocator\n"
        "from casadi_gnc.problem_files.allocation_file import load_allocation\n"
        f"allocator = CaseAllocator(load_allocation({CASE!r}), 'online')\n"
        "allocator.load_all()\n"
        "allocator.solve(np.array([1e-4, 0, 0]))\n"
        "before = set(sys.modules)\n"
        "for command in ([np.nan, 0, 0], [1e300, 0, 0], [1.0, 0, 0]): allocator.solve(np.array(command))\n"
        "print(sorted(set(sys.modules) - before))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.stdout == "[]\n", done.stderr


def told(done: subprocess.CompletedProcess, message: str) -> None:
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


@pytest.mark.slow
def test_bad_input_is_told(commands, tmp_path):
    path, _ = commands
    bad = tmp_path / "bad.csv"
    bad.write_text("u1,u3\n1,2\n")
    told(
        run(CASE, "--commands", str(bad)),
        "bad.csv, line 1: column u2 is missing in the line of names; expected u1, u2, u3, found u1, u3",
    )
    bad.write_text("u1,u2,u3\n1,2,3\n1,x,3\n")
    told(run(CASE, "--commands", str(bad)), "bad.csv, line 3, column u2: 'x' is no number")
    bad.write_text("u1,u2,u3\n")
    told(run(CASE, "--commands", str(bad)), "has a line of names and no rows of commands")
    told(run(CASE, "--commands", "nowhere.csv"), "nowhere.csv: cannot be read: No such file")
    told(run(CASE, "--commands", str(path), "--backend", "magic"), "no allocation back end 'magic'; there is online")
    told(run(CASE, "--commands", str(path), "--backend", "daqp"), "without uncertainty only")
    told(run(CASE), "give either --commands FILE or --stream")
    told(run("huang2020/detumble", "--stream"), "takes a file of kind")
    assert os.path.exists(path)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("accuracy = 1e6", "accuracy = -1"), "weights.accuracy"),
        (("[weights]", "[faults]\ndead = [13]\n[weights]"), "fault on actuator 13; there are actuators 1 to 12"),
        (("[weights]", "[matrices]\neffectiveness = [[1.0]]\nlower = 0\nupper = 1\n[weights]"), "stands alone"),
        (("[weights]", "[options]\npriorities = [0]\n[weights]"), "1 priorities for 3 rows"),
        (("effort = 1.0", "effort = [1.0, 2.0]"), "effort_weight has shape (2,), expected 12"),
        (("torque_limit_N_m = [1.5e-3, 1.5e-3, 1.5e-3]", "torque_limit_N_m = [1.5e-3]"), "N_m has 1 entries"),
    ],
)  # fmt: skip
def test_bad_files_are_told(tmp_path, change, message):
    from casadi_gnc.problem_files.document import read

    text = read(CASE).text
    path = tmp_path / "bad.toml"
    assert change[0] in text
    path.write_text(text.replace(*change, 1))
    told(run(str(path), "--stream"), message)


def test_options_of_the_file_are_used(tmp_path):
    from casadi_gnc.problem_files.document import read

    text = read(CASE).text
    path = tmp_path / "options.toml"
    path.write_text(text.replace("[weights]", "[options]\nkeep_direction = true\n[weights]"))
    done = run(str(path), "--stream", "--json", given="3e-3,0,0\n")
    answer = json.loads(done.stdout)
    made = np.array([3e-3, 0, 0]) - answer["unallocated"]
    assert made[0] > 1e-4
    assert np.allclose(made[1:], 0, atol=2e-5)
    path.write_text(text.replace("[weights]", "[options]\nleast_force_N = 1e-3\n[weights]"))
    answer = json.loads(run(str(path), "--stream", "--json", given="3e-4,0,1e-4\n").stdout)
    assert all(force == 0 or force >= 1e-3 * (1 - 1e-9) for force in answer["forces"])


def test_rank_deficient_effectiveness_is_warned_of_and_solved(tmp_path):
    path = tmp_path / "flat.toml"
    path.write_text(
        'format = 1\nkind = "allocation"\n[matrices]\nlower = 0.0\nupper = 1.0\n'
        "effectiveness = [[1.0, -1.0, 0.5], [2.0, -2.0, 1.0]]\n"
    )
    done = run(str(path), "--stream", "--json", given="0.3 0.6\n")
    assert "warning: the effectiveness has rank 1 of 2" in done.stderr
    assert json.loads(done.stdout)["status"] == "OPTIMAL"


def test_bytes_that_are_no_text_do_not_end_the_stream():
    done = subprocess.run(
        [*PROGRAM, CASE, "--stream"], input=b"1e-4 0 0\n\xff\xfe 0 0\n1e-4 0 0\n", capture_output=True, timeout=120
    )
    lines = done.stdout.decode().splitlines()
    assert done.returncode == 0, done.stderr
    assert [line.startswith("error") for line in lines] == [False, True, False]


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("u1,u2,u3\n0,001,0,002,0,003\n", "u.csv, line 2: 6 entries, expected 3"),
        ("u1,u2,u3\n0,1\n", "u.csv, line 2: 2 entries, expected 3"),
        ("u1,u2,u3,u1\n1e-4,2e-4,-3e-4,9\n", "u.csv, line 1: the column 'u1' is named twice"),
        ("u1,u2,u3,u4\n0,0,0,0\n", "u.csv, line 1: there is a column u4, and the problem takes u1, u2, u3"),
        ('u1,u2,u3\n"0,001","0,002","0,003"\n', "u.csv, line 2, column u1: '0,001' is no number"),
        ("u1;u2;u3\n0;0;0\n", "column u1 is missing in the line of names; expected u1, u2, u3, found u1;u2;u3"),
    ],
)
def test_no_entry_is_taken_for_another(tmp_path, table, message):
    (tmp_path / "u.csv").write_text(table)
    with pytest.raises(ProblemError, match=re.escape(message)):
        read_commands(tmp_path / "u.csv", 3)


def test_blanks_and_further_columns_change_no_command(tmp_path):
    path = tmp_path / "u.csv"
    path.write_text("t, u2, u1 , note,u3\n0, 2e-4,1e-4, -, -3e-4\n")
    assert read_commands(path, 3).tolist() == [[1e-4, 2e-4, -3e-4]]


def test_table_with_byte_order_mark_and_blank_lines(tmp_path):
    path = tmp_path / "excel.csv"
    path.write_bytes(b"\xef\xbb\xbfu1,u2,u3\r\n1e-4,0,0\r\n\r\n\r\n0,x,0\r\n")
    told(run(CASE, "--commands", str(path)), "excel.csv, line 5, column u2: 'x' is no number")


def test_priorities_do_not_change_what_can_be_attained(tmp_path):
    from casadi_gnc.problem_files.document import read

    text = read(CASE).text
    path = tmp_path / "priorities.toml"
    path.write_text(text.replace("[weights]", "[options]\npriorities = [0, 1, 1]\n[weights]"))
    shares = []
    for problem in (CASE, str(path)):
        command = [*PROGRAM[:-1], "attainable", problem, "--json", "--samples", "0"]
        shares.append(json.loads(subprocess.run(command, capture_output=True, text=True).stdout)["share_of_wanted"])
    assert shares[0] == shares[1]
