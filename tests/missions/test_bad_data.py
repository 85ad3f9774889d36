"""On board nothing may stay broken: fuzzed inputs, corrupt memory, flights that diverge."""

import json
import math

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError, LawError
from casadi_gnc.missions.flight import save_summary
from casadi_gnc.status import StepStatus

SCHEMES = [
    ("huang2020/detumble", "observer_pinv"),
    ("huang2020/detumble", "damping_pinv"),
    ("huang2020/slew", "funnel_pinv"),
    ("huang2020/slew", "pd_pinv"),
    ("huang2020/slew_as_printed", "funnel_pinv"),
]
STRANGE = [np.nan, np.inf, -np.inf, 1e300, -1e300, 5e-324, 0.0, 2.0, 11.0]


@pytest.mark.parametrize(("problem", "scheme"), SCHEMES)
def test_fuzzed_measurements_leave_bounded_forces_and_recovery(problem, scheme, rng):
    """2000 steps, a third of them with strange numbers; then good ones: memory finite, no bad status."""
    mission = casadi_gnc.load(problem).with_timing(mode="sampled")
    step = mission.step(scheme)
    size = step.numel_in("y")
    calm = np.zeros(size)
    state = {"good": calm, "m": np.zeros(step.numel_in("m")), "actuators": np.zeros(12)}
    for k in range(2000):
        y = rng.uniform(-0.5, 0.5, size)
        if k % 3 == 0:
            y[rng.integers(size)] = rng.choice(STRANGE)
        found = step(t=0.1 * k, y=y, **state)
        force = np.array(found["actuators_next"])
        assert np.all((force >= 0) & (force <= 3.75e-3)), k
        state = {name: np.array(found[f"{name}_next"]).ravel() for name in state}
    for k in range(50):
        found = step(t=200 + 0.1 * k, y=calm, **state)
        state = {name: np.array(found[f"{name}_next"]).ravel() for name in state}
    assert np.all(np.isfinite(state["m"]))
    assert not int(found["status"]) & (StepStatus.MEASUREMENT_REPLACED | StepStatus.MEMORY_RESET)


@pytest.mark.parametrize(("problem", "scheme"), SCHEMES)
def test_corrupt_memory_is_started_afresh(problem, scheme):
    mission = casadi_gnc.load(problem).with_timing(mode="sampled")
    step = mission.step(scheme)
    y, force = np.full(step.numel_in("y"), 0.01), np.zeros(12)
    fresh = mission.scheme(scheme).law
    if not fresh.memory.size:
        return
    for value in (np.nan, np.inf, -1e300):
        m = np.zeros(fresh.memory.size)
        m[-1] = value
        found = step(t=0.0, y=y, good=y, m=m, actuators=force)
        assert int(found["status"]) & StepStatus.MEMORY_RESET
        assert np.all(np.isfinite(np.array(found["m_next"])))
        assert np.all(np.isfinite(np.array(found["wanted"])))


def test_lost_time_and_lost_measurements_command_nothing_wild():
    step = casadi_gnc.load("huang2020/slew").step("funnel_pinv")
    nothing = np.full(6, np.nan)
    for t, y, good in ((np.nan, np.zeros(6), np.zeros(6)), (0.0, nothing, nothing)):
        found = step(t=t, y=y, good=good, m=np.zeros(9), actuators=np.zeros(12))
        assert np.all(np.isfinite(np.array(found["wanted"])))
        assert np.all(np.isfinite(np.array(found["limited"])))
        assert int(found["status"]) & (StepStatus.COMMAND_REPLACED | StepStatus.MEASUREMENT_REPLACED)


@pytest.fixture(scope="module")
def diverged():
    """Half a minute between samples of a fast tumble: the integrator itself runs away."""
    mission = casadi_gnc.load("huang2020/detumble").with_timing(sample_period=50.0, duration=5000.0)
    return casadi_gnc.fly(mission, "damping_pinv")


def test_a_flight_that_diverges_has_no_metrics(diverged, tmp_path):
    assert StepStatus.DIVERGED in diverged.statuses
    assert set(diverged.metrics.values()) == {None}
    assert any("diverged at" in note for note in diverged.notes)
    summary = json.loads(save_summary(tmp_path, [diverged]).read_text())
    assert summary["schemes"][0]["metrics"]["steady_rate"]["value"] is None


def test_a_peak_after_the_end_has_no_value(detumble):
    flight = casadi_gnc.fly(detumble.with_timing(duration=10.0), "damping_pinv")
    assert flight.metrics["steady_rate"] is None
    assert any(note.startswith("steady_rate: none") for note in flight.notes)


def test_rate_limit_is_kept_step_by_step(detumble):
    """Amplitude and rate bounds of the thrusters, over a whole flight, by both kinds of allocation."""
    from dataclasses import replace

    for name in ("observer_pinv", "observer_robust"):
        actuation = replace(detumble.scheme(name).actuation, rate=1e-2)
        mission = detumble.with_scheme(name, actuation=actuation).with_timing(duration=100.0)
        force = casadi_gnc.fly(mission)["force"]
        assert np.abs(np.diff(force, axis=0)).max() <= 1e-2 * 0.1 * (1 + 1e-12)
        assert np.abs(force[0]).max() <= 1e-3 * (1 + 1e-12)
        assert force.min() >= 0
        assert force.max() <= 3.75e-3
        assert np.abs(np.diff(force, axis=0)).max() > 0.9e-3  # the limit was met


def test_true_centre_of_mass_changes_the_truth_only(tmp_path):
    from casadi_gnc.problem_files.document import read

    text = read("huang2020/detumble").text
    path = tmp_path / "moved.toml"
    path.write_text(
        text.replace("inertia_factor = 1.1", "inertia_factor = 1.1\ncentre_of_mass_error_m = [5e-3, 0.0, 0.0]")
    )
    moved, known = casadi_gnc.load(path), casadi_gnc.load("huang2020/detumble")
    assert not np.allclose(np.array(moved.truth.effectiveness), np.array(known.truth.effectiveness))
    believed = [np.array(mission.scheme().actuation.effectiveness) for mission in (moved, known)]
    assert np.array_equal(*believed)
    sums = [casadi_gnc.fly(m, "observer_pinv").metrics["torque_sample_sum"] for m in (moved, known)]
    assert sums[0] != sums[1]
    assert sums[0] == pytest.approx(sums[1], rel=0.03)  # an independent simulation: about 1 %


def test_python_arguments_are_checked(detumble):
    for changes, message in (
        ({"mode": "foo"}, "mode is 'foo'"),
        ({"substeps": 0}, "substeps is 0"),
        ({"sample_period": -1.0}, "sample_period is -1"),
    ):
        with pytest.raises(FlightError, match=message):
            detumble.with_timing(**changes)
    with pytest.raises(FlightError, match="feedback is 'acheived'"):
        detumble.with_scheme("observer_pinv", feedback="acheived")
    with pytest.raises(FlightError, match="has no 'rate_gian'; its law has .*rate_gain"):
        detumble.with_scheme("observer_pinv", rate_gian=1.0)
    with pytest.raises(LawError, match="rate_gain is -3, expected more than 0"):
        detumble.with_scheme("observer_pinv", rate_gain=-3)
    with pytest.raises(LawError, match="rate_gain is nan"):
        detumble.with_scheme("observer_pinv", rate_gain=math.nan)
    with pytest.raises(FlightError, match="decimation is 0"):
        casadi_gnc.fly(detumble, decimation=0)
    with pytest.raises(FlightError, match="no signal 'spin'; there is time, mrp"):
        casadi_gnc.fly(detumble.with_timing(duration=1.0))["spin"]
    with pytest.raises(FlightError, match="need .* GB; keep fewer by a larger decimation"):
        casadi_gnc.fly(detumble.with_timing(duration=9e7))


def test_symbols_do_not_fly(detumble):
    import casadi as ca

    with pytest.raises(FlightError, match=r"k is a symbol, not a number"):
        casadi_gnc.fly(detumble.with_scheme("observer_pinv", rate_gain=ca.SX.sym("k")))
