"""The monitor of a flight package: the words and verdicts of the same formula in Python, and of its record."""

import ctypes
import math
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.delivery.verifying import verify
from casadi_gnc.embedded import host, package
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.embedded.targets import units
from casadi_gnc.errors import PackageError, RequirementError
from casadi_gnc.missions.onboard import describe
from casadi_gnc.missions.requirements import Monitor, Requirement
from casadi_gnc.problem_files.document import locate
from casadi_gnc.signals import Layout, Signal

#: Members of Layout that the formulas read on board.
SIGNALS = Layout(
    (
        Signal("time"),
        Signal("mrp", 3),
        Signal("rate", 3),
        Signal("force", 12),
        Signal("wanted", 3),
        Signal("limited", 3),
        Signal("status"),
    )
)
FORMULAS = {
    "FOLDED.1": "always[3, end](norm(rate) <= 0.5) or eventually[2, 900](max(mrp) - min(mrp) < 0.001)",
    "BACK-1": "eventually(held[1.7](norm(rate) <= 0.075)) and always(not raised(MEASUREMENT_REPLACED))",
    "AHEAD-1": "always(norm(rate) > 0.12 implies eventually[0, 4.1](norm(rate) <= 0.05))",
    "AHEAD-2": "eventually(always[0.5, 2](abs(rate[1]) <= 0.06) and held[0.9](dot(rate, mrp) >= -0.001))",
    "UNTIL-1": "always(norm(rate) <= 0.15 until[0.3, 3] max(abs(limited)) <= 0.005) or norm(wanted) >= 3 until[40] force[1] >= 0.001",
    "NOT-1": "not eventually[0, 700](norm(rate) > 0.2 and not (norm(mrp) >= 0.1 until[1] norm(rate) <= 0.1))",
    "EQUAL-1": "always(norm(wanted - limited) == 0 or raised(COMMAND_LIMITED))",
    "TIME-1": "always(time >= 2 implies status != 3)",
}


def mission(formulas):
    asked = [Requirement(name, formula=text) for name, text in formulas.items()]
    return replace(gnc.load("huang2020/detumble"), requirements=asked)


def telemetry(samples, seed=5):
    """Return times and credible measurements: a rate that comes and goes over many samples."""
    rng = np.random.default_rng(seed)
    size = np.abs(np.convolve(rng.normal(size=samples + 20), np.ones(20) / 20, "valid")[:samples])
    rate = size[:, None] * rng.normal(size=(samples, 3)) * 0.3
    return np.column_stack([0.1 * np.arange(samples), rng.normal(size=(samples, 3)) * 0.3, rate])


def flown(folder, formulas, rows):
    """Return robustness and verdict of each sample, (K, 2 R), from the compiled monitor, and what it saw."""
    controller = describe(mission(formulas), "observer_pinv", monitored=True)
    options = Options("watched")
    files = package.flight_files(controller, options)
    package.put(folder, {**files, "test/replay.h": package.replay_header(controller, options, 1)})
    words = HostPackage(folder, options.name).replay(rows.view(np.uint64), controller.replayed.size + 1)
    numbers = words[:, :-1].view(float)
    outputs = {name: numbers[:, controller.outputs.place(name)] for name in controller.outputs.names}
    seen = {
        "time": rows[:, 0],
        "mrp": rows[:, 1:4],
        "rate": rows[:, 4:],
        **outputs,
        "status": words[:, -1].astype(float),
    }
    return numbers[:, controller.outputs.size :], {name: seen[name] for name in SIGNALS.names}


def test_words_are_those_of_python(tmp_path):
    found, seen = flown(tmp_path, FORMULAS, telemetry(3000))
    monitor = Monitor([Requirement(name, formula=text) for name, text in FORMULAS.items()], SIGNALS, 0.1)
    columns = np.column_stack([seen[name] for name in monitor.signals])
    expected = np.array([monitor.advance(row).T.ravel() for row in columns])
    assert np.array_equal(found.view(np.uint64), expected.view(np.uint64))
    verdicts = found[:, 1::2]
    assert set(verdicts.ravel()) == {0.0, 1.0, 2.0}
    assert len(np.unique(found[-1, ::2])) > 5


def test_the_last_word_is_that_of_the_record(tmp_path):
    """Where every interval has passed, what the monitor says is the robustness of the whole record."""
    rows, bounded = (
        telemetry(1200, 6),
        {name: text for name, text in FORMULAS.items() if name not in ("AHEAD-1", "AHEAD-2", "UNTIL-1")},
    )
    bounded |= {
        "AHEAD-1": FORMULAS["AHEAD-1"].replace("always(", "always[0, 100](", 1),
        "AHEAD-2": FORMULAS["AHEAD-2"].replace("eventually(", "eventually[0, 100](", 1),
    }
    found, seen = flown(tmp_path, bounded, rows)
    for i, (name, text) in enumerate(bounded.items()):
        truth = Requirement(name, formula=text).robustness(seen)
        assert found[-1, 2 * i] == truth, name
        if found[-1, 2 * i + 1]:
            assert (found[-1, 2 * i + 1] == 1) == (truth >= 0), name


@pytest.mark.slow
def test_a_million_samples_have_the_verdicts_of_python(tmp_path):
    found, seen = flown(tmp_path, FORMULAS, telemetry(1_000_000, 7))
    monitor = Monitor([Requirement(name, formula=text) for name, text in FORMULAS.items()], SIGNALS, 0.1)
    columns = np.column_stack([seen[name] for name in monitor.signals])
    wrong = sum(
        not np.array_equal(monitor.advance(row).T.ravel(), given) for row, given in zip(columns, found, strict=True)
    )
    assert wrong == 0


FINISH = """
#include <string.h>
#include "replay.h"
int over(void *state, double *seen);
int over(void *state, double *seen)
{
    replay_state *at = (replay_state *)state;
    watched_input input;
    watched_output output;
    memset(&input, 0, sizeof input);
    memset(&output, 0, sizeof output);
    (void)watched_monitor_finish(&at->monitor, &at->step, &input, &output);
    memcpy(seen, &at->monitor.seen, sizeof at->monitor.seen);
    return (int)(sizeof at->monitor.seen / sizeof(watched_seen));
}
"""


def test_the_end_of_a_flight_decides_all_as_the_whole_record_does(tmp_path, monkeypatch):
    """In C and in Python; intervals reach beyond the end, of which the record says what there is."""
    files, replay, made = package.flight_files, HostPackage.replay, []
    monkeypatch.setattr(package, "flight_files", lambda *given: {**files(*given), "test/over.c": FINISH})
    monkeypatch.setattr(host, "units", lambda folder, name: [*units(folder, name), folder / "test" / "over.c"])
    monkeypatch.setattr(HostPackage, "replay", lambda self, *given: made.append(self) or replay(self, *given))
    found, seen = flown(tmp_path, FORMULAS, telemetry(300, 8))
    monitor = Monitor([Requirement(name, formula=text) for name, text in FORMULAS.items()], SIGNALS, 0.1)
    for row in np.column_stack([seen[name] for name in monitor.signals]):
        monitor.advance(row)
    over = monitor.finish()
    words = np.zeros(2 * len(FORMULAS))
    state, target = (ctypes.c_void_p(each.ctypes.data) for each in (made[0]._state, words))
    assert made[0]._c.over(state, target) == len(FORMULAS)
    robustness, verdicts = words[::2], words.view(np.uint32)[2::4]
    assert 0.0 in found[-1, 1::2]  # open before
    for i, (name, text) in enumerate(FORMULAS.items()):
        truth = Requirement(name, formula=text).robustness(seen)
        assert (over[name].robustness, over[name].word) == (truth, "met" if truth >= 0 else "not met"), name
        assert robustness[i] == (truth if math.isfinite(truth) else math.copysign(1e30, truth)), name
        assert verdicts[i] == (1 if truth >= 0 else 2), name


@pytest.mark.slow
@pytest.mark.parametrize("real", ["float64", pytest.param("float32", marks=pytest.mark.slow)])
def test_a_package_is_made_replayed_and_verified_with_its_monitor(tmp_path, real):
    path = tmp_path / "mine.toml"
    tables = "".join(f'\n[[requirement]]\nid = "{name}"\nformula = "{text}"\n' for name, text in FORMULAS.items())
    late = '\n[[requirement]]\nid = "LATE"\nformula = "always(norm(rate) <= 1 or eventually(norm(rate) <= 0.01))"\n'
    metric = '\n[[requirement]]\nid = "METRIC"\nmetric = "settling_time"\nat_most = 600\n'
    path.write_text(locate("huang2020/detumble").read_text(encoding="utf-8") + tables + late + metric)
    folder = tmp_path / "package"
    gnc.generate(path, folder, scheme="observer_pinv", steps=200, real=real)
    readme = (folder / "README.md").read_text()
    assert (
        "| `ahead_1` | AHEAD-1: `always(norm(rate) > 0.12 implies eventually[0, 4.1](norm(rate) <= 0.05))` | rad/s | 4.1 s |"
        in readme
    )
    assert "* LATE: an interval up to the end of the flight stands inside another condition over time" in readme
    assert "METRIC" not in readme
    told = verify(folder)
    assert told["words"] == 0
    assert {"ahead_1_robustness", "ahead_1_verdict"} <= {one["signal"] for one in told["comparisons"][0]["signals"]}
    done = subprocess.run(["make", "-C", str(folder), "test"], capture_output=True, text=True)
    assert "0 words differ" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("real", ["double", "float"])
def test_the_c_is_strict(tmp_path, real):
    controller = describe(mission(FORMULAS), "observer_pinv", monitored=True)
    package.put(tmp_path, package.flight_files(controller, Options("watched", real)))
    flags = [
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wconversion",
        "-Wshadow",
        "-Wmissing-prototypes",
        "-pedantic",
        "-Werror",
        "-ffp-contract=off",
        "-O2",
        "-c",
    ]
    source = next(unit for unit in units(tmp_path, "watched") if "monitor" in unit.name)
    subprocess.run(["gcc", *flags, str(source), "-o", str(tmp_path / "monitor.o")], check=True)


@pytest.mark.tools("arm-none-eabi-gcc", "qemu-system-arm")
def test_a_board_says_the_same_words(tmp_path):
    made = mission(FORMULAS)
    gnc.generate(made, tmp_path / "package", scheme="observer_pinv", name="watched", steps=100)
    assert verify(tmp_path / "package", ("cortex-m7",))["words"] == 0


@pytest.mark.slow
def test_a_mission_of_objects_keeps_its_monitor(tmp_path):
    gnc.generate(mission(FORMULAS), tmp_path / "package", scheme="observer_pinv", name="watched", steps=50)
    assert (tmp_path / "package" / "controller.json").is_file()
    told = verify(tmp_path / "package")
    assert (told["words"], told["edited"]) == (0, [])


def test_requirements_that_no_package_watches_leave_it_as_it_was(tmp_path):
    """A bound on a metric is no matter of one craft's software; formulas alone make a monitor."""
    bare = gnc.load("huang2020/detumble")
    asked = replace(bare, requirements=[Requirement("R", metric="settling_time", at_most=600.0)])
    options = Options("plain")
    files = [package.flight_files(describe(one, "observer_pinv", monitored=True), options) for one in (bare, asked)]
    assert files[0] == files[1]
    assert not any("monitor" in name for name in files[0])


def test_a_stepper_tells_what_its_monitor_knows():
    made = mission(
        {"R": "always(norm(rate) <= 1)", "LATE": "always(norm(rate) > 0.5 implies eventually[0.2](norm(rate) <= 0.5))"}
    )
    stepper = made.controller("observer_pinv")
    assert stepper.seen == {}
    rates, monitor = (0.1, 0.7, 0.6, 0.4, 0.3, 2.0), Monitor(made.requirements, SIGNALS, 0.1)
    for k, rate in enumerate(rates):
        given = {"mrp": [0.1, 0, 0], "rate": [rate, 0, 0]}
        assert set(stepper.step(0.1 * k, **given)) == {"force", "wanted", "limited", "status"}
        assert stepper.seen == monitor.step(time=0.1 * k, **given)
    assert stepper.seen["R"].word == "not met"
    stepper.reset()
    assert stepper.seen == {}


def test_what_the_law_shows_is_watched_where_time_and_measurement_say_it():
    slew = gnc.load("huang2020/slew")
    asked = [Requirement("USE", formula="always(max(abs(funnel_use)) < 1)")]
    monitor = describe(replace(slew, requirements=asked), "funnel_pinv", monitored=True).monitor
    assert [one.id for one in monitor.watched] == ["USE"]
    shown = slew.scheme("funnel_pinv").law.outputs.names
    for name in shown:
        asked = [Requirement("SHOWN", formula=f"always(max(abs({name})) < 1)")]
        told = describe(replace(slew.with_scheme("funnel_pinv"), requirements=asked), monitored=True).monitor
        assert [one.id for one in told.watched] == ["SHOWN"] or "there is no signal" in told.left_out[0][1]


def test_the_truth_is_not_on_board():
    wheels = gnc.load("huang2019/nominal")
    asked = [Requirement("TRUE", formula="always(norm(true_torque) <= 1e9)")]
    monitor = describe(replace(wheels, requirements=asked), monitored=True).monitor
    assert monitor.watched == ()
    assert "there is no signal 'true_torque'" in monitor.left_out[0][1]


def test_ids_become_names_of_c():
    with pytest.raises(PackageError, match="'A-1' and another are both 'a_1' in C; rename one"):
        describe(mission({"A-1": "always(time >= 0)", "A.1": "always(time >= 0)"}), "observer_pinv", monitored=True)
    with pytest.raises(PackageError, match="the requirement 'int' is a keyword"):
        describe(mission({"INT": "always(time >= 0)"}), "observer_pinv", monitored=True)
    many = {f"R{i}": "always(time >= 0)" for i in range(32)}
    with pytest.raises(PackageError, match="32 requirements are watched on board, expected at most 31"):
        describe(mission(many), "observer_pinv", monitored=True)


def test_memory_is_bounded():
    row = Layout((Signal("time", 1, "s"), Signal("a")))
    Monitor([Requirement("R", formula="always(eventually[0, 409.6](a < 0))")], row, 0.1)
    with pytest.raises(RequirementError, match="R needs 4097 numbers of what has been, one for each sample of 0.1 s"):
        Monitor([Requirement("R", formula="always(eventually[0, 409.7](a < 0))")], row, 0.1)
    with pytest.raises(RequirementError, match="R: an interval up to the end of the flight stands inside another"):
        Monitor([Requirement("R", formula="always(eventually(a < 0))")], row, 0.1)
    with pytest.raises(RequirementError, match="R bounds a metric, which is known when the flight is over"):
        Monitor([Requirement("R", metric="m", at_most=1.0)], row, 0.1)
    Monitor([Requirement("R", formula="always[1e6, 2e6](a < 0)")], row, 0.1)
    far = mission({"R": "always[1e6, 2e6](norm(rate) < 0)"})
    with pytest.raises(PackageError, match="reach 2000.... samples far, and a float counts 16777216 without a gap"):
        package.flight_files(describe(far, "observer_pinv", monitored=True), Options("watched", "float"))


def test_a_monitor_is_told_what_it_needs():
    monitor = Monitor([Requirement("R", formula="always(norm(rate) <= 1)")], SIGNALS, 0.1)
    assert monitor.signals == ("rate",)
    with pytest.raises(RequirementError, match="the monitor was given no rate; it reads rate"):
        monitor.step(mrp=[0, 0, 0])
    with pytest.raises(RequirementError, match="rate has 2 numbers, expected 3"):
        monitor.step(rate=[0, 0])
    assert monitor.step(rate=[0, 0, 2], mrp=[9, 9, 9])["R"].word == "not met"
    assert monitor.finish()["R"].word == "not met"
    with pytest.raises(RequirementError, match="the flight is over; `reset` begins anew"):
        monitor.step(rate=[0, 0, 0])
    monitor.reset()
    with pytest.raises(RequirementError, match="has seen no sample"):
        monitor.finish()
    assert monitor.step(rate=[0, 0, 0.5])["R"].robustness == 0.5
    assert math.isinf(
        Monitor([Requirement("R", formula="always[1, 2](time < 0)")], SIGNALS, 0.1).step(time=0)["R"].robustness
    )
