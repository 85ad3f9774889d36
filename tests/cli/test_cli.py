"""The command line as its users run it: a process."""

import json
import os
import signal
import subprocess
import sys
import time

import jsonschema
import numpy as np
import pytest

import casadi_gnc

SHORT = "duration_s = 20.0"


def run(*arguments: str, cwd=None, **environment: str) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "casadi_gnc.cli.main", *arguments]
    env = {**os.environ, "COLUMNS": "120", **environment}
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env=env, timeout=300)


@pytest.fixture
def problem(tmp_path):
    """A short de-tumble in a file of its own."""
    done = run("problems", "copy", "huang2020/detumble", str(tmp_path))
    assert done.returncode == 0, done.stderr
    path = tmp_path / "detumble.toml"
    path.write_text(path.read_text().replace("duration_s = 1500.0", SHORT))
    return path


def assert_told(done: subprocess.CompletedProcess, message: str) -> None:
    assert done.returncode == 2, (done.returncode, done.stderr)
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_problems_are_listed():
    done = run("problems")
    assert done.returncode == 0
    for name in casadi_gnc.shipped():
        assert name in done.stdout


def test_copy_never_overwrites(problem):
    before = problem.read_text()
    assert_told(run("problems", "copy", "huang2020/detumble", str(problem.parent)), "exists and was left alone")
    assert problem.read_text() == before
    assert_told(run("problems", "copy", "nothing", str(problem.parent)), "no shipped problem 'nothing'")


def test_fly_writes_signals_summary_and_pictures(problem, tmp_path):
    out = tmp_path / "deep" / "out"
    done = run("fly", str(problem), "--out", str(out), "--figures", str(out))
    assert done.returncode == 0, done.stderr
    names = {path.name for path in out.iterdir()}
    schemes = {"damping_pinv", "observer_pinv", "observer_robust"}
    shared = {"summary.json", "mission.json", "comparison.png"}
    assert names == shared | {f"{s}.{end}" for s in schemes for end in ("npz", "png")}
    with np.load(out / "observer_robust.npz") as signals:
        assert signals["rate"].shape == (201, 3)
        assert signals["force"].shape == (201, 12)
        assert str(signals["unit_rate"]) == "rad/s"
        assert np.all(signals["duality_gap"] >= -1e-12)
    summary = json.loads((out / "summary.json").read_text())
    assert [scheme["scheme"] for scheme in summary["schemes"]] == ["damping_pinv", "observer_pinv", "observer_robust"]
    assert all((out / name).read_bytes().startswith(b"\x89PNG") for name in names if name.endswith("png"))
    assert "wrote" in done.stdout
    assert "never" in done.stdout


def test_json_is_the_only_output(problem, tmp_path):
    done = run("fly", str(problem), "--out", str(tmp_path / "o"), "--scheme", "damping_pinv", "--json")
    summary = json.loads(done.stdout)
    assert summary["schemes"][0]["metrics"]["torque_sample_sum"]["value"] > 0
    assert summary["schemes"][0]["made"]["engine"] == "c"
    assert {path.name for path in (tmp_path / "o").iterdir()} == {"damping_pinv.npz", "summary.json", "mission.json"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "options", [("--engine", "vm"), ("--math", "libm"), ("--mode", "continuous"), ("--decimation", "10")]
)
def test_fly_options(problem, tmp_path, options):
    done = run("fly", str(problem), "--out", str(tmp_path / "o"), "--scheme", "observer_pinv", *options)
    assert done.returncode == 0, done.stderr
    made = json.loads((tmp_path / "o" / "summary.json").read_text())["schemes"][0]["made"]
    expected = {"--engine": ("engine", "vm"), "--math": ("maths", "libm"), "--mode": ("mode", "continuous")}
    if options[0] in expected:
        key, value = expected[options[0]]
        assert made[key] == value
    else:
        with np.load(tmp_path / "o" / "observer_pinv.npz") as signals:
            assert len(signals["time"]) == 21


def test_schema_accepts_the_shipped_problems():
    import tomllib

    from casadi_gnc.problem_files.document import read

    schema = json.loads(run("schema").stdout)
    assert schema["$schema"].endswith("2020-12/schema")
    jsonschema.Draft202012Validator.check_schema(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for name in casadi_gnc.shipped():
        validator.validate(tomllib.loads(read(name).text))
    with pytest.raises(jsonschema.ValidationError):
        validator.validate({**tomllib.loads(read("huang2020/detumble").text), "mood": 1})


def test_doctor_tells_what_is_there():
    report = json.loads(run("doctor", "--json").stdout)
    assert report["packages"]["casadi"]
    assert report["cache"]["folder"] == os.environ["CASADI_GNC_CACHE"]
    assert "clarabel" in report["solvers"]
    text = run("doctor").stdout
    assert "compilers" in text
    nothing = json.loads(run("doctor", "--json", PATH="", CC="").stdout)
    assert {"C compiler"} <= {missing["what"] for missing in nothing["missing"]}


def test_without_a_compiler_the_machine_flies_and_says_so(problem, tmp_path):
    done = run("fly", str(problem), "--out", str(tmp_path / "o"), "--scheme", "observer_pinv", PATH="", CC="")
    assert done.returncode == 0, done.stderr
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())["schemes"][0]
    assert summary["made"]["engine"] == "vm"
    assert any("no C compiler found" in note and "slower" in note for note in summary["notes"])
    assert "no C compiler found" in done.stdout


def test_bad_input_is_one_sentence_and_exit_2(problem, tmp_path):
    out = str(tmp_path / "o")
    assert_told(run("fly", "nowhere.toml", "--out", out), "no problem file 'nowhere.toml'")
    assert_told(run("fly", str(problem), "--scheme", "best", "--out", out), "no scheme 'best' in detumble")
    bad = tmp_path / "bad.toml"
    bad.write_text(problem.read_text().replace("3.75e-3", "-3.75e-3"))
    line = bad.read_text().splitlines().index("max_force_N = -3.75e-3") + 1
    assert_told(run("fly", str(bad), "--out", out), f"bad.toml, line {line}, spacecraft.thrusters.max_force_N")
    assert not os.path.exists(out)
    blocked = tmp_path / "file"
    blocked.write_text("")
    assert_told(run("fly", str(problem), "--out", str(blocked / "o")), "cannot write to the output folder")
    assert run("fly", str(problem), "--engine", "abacus").returncode == 2
    assert run("fly", str(problem), "--wings").returncode == 2


@pytest.mark.slow
def test_interrupted_flight_leaves_no_half_file(tmp_path):
    run("problems", "copy", "huang2020/detumble", str(tmp_path))
    slow = (
        (tmp_path / "detumble.toml")
        .read_text()
        .replace('method = "robust",', 'method = "robust", backend = "clarabel",')
    )
    (tmp_path / "detumble.toml").write_text(slow.replace("duration_s = 1500.0", "duration_s = 15000.0"))
    out = tmp_path / "o"
    command = [
        sys.executable,
        "-m",
        "casadi_gnc.cli.main",
        "fly",
        str(tmp_path / "detumble.toml"),
        "--out",
        str(out),
        "--scheme",
        "observer_robust",
    ]
    # A background shell starts its children with SIGINT ignored; a terminal does not.
    flight = subprocess.Popen(
        command,
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    until = time.monotonic() + 120
    while not out.is_dir() and time.monotonic() < until:
        time.sleep(0.1)
    time.sleep(3)  # it flies now
    flight.send_signal(signal.SIGINT)
    _, errors = flight.communicate(timeout=60)
    assert flight.returncode == 130, errors
    assert "Traceback" not in errors
    assert list(out.iterdir()) == []


def test_reader_may_go_away():
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "schema"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as listing:
        listing.stdout.close()
        assert listing.stderr.read() == ""
        listing.wait(timeout=60)


@pytest.mark.slow
def test_long_flight_shows_progress_on_a_terminal(tmp_path):
    """A flight of more than a second draws a bar where standard error is a terminal."""
    import pty

    text = casadi_problem_text().replace('method = "robust",', 'method = "robust", backend = "clarabel",')
    path = tmp_path / "slow.toml"
    path.write_text(text.replace("duration_s = 1500.0", "duration_s = 500.0"))
    master, slave = pty.openpty()
    command = [
        sys.executable,
        "-m",
        "casadi_gnc.cli.main",
        "fly",
        str(path),
        "--out",
        str(tmp_path / "o"),
    ]
    with subprocess.Popen([*command, "--scheme", "observer_robust"], stderr=slave, stdout=subprocess.DEVNULL) as flight:
        os.close(slave)
        shown = b""
        try:
            while chunk := os.read(master, 4096):
                shown += chunk
        except OSError:  # the other end closed, which is how a terminal says that it is over
            pass
        assert flight.wait(timeout=120) == 0
    os.close(master)
    assert b"observer_robust" in shown
    assert b"%" in shown


def casadi_problem_text() -> str:
    from casadi_gnc.problem_files.document import read

    return read("huang2020/detumble").text
