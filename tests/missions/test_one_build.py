"""One build flies with any numbers: what changes in a notebook, and the values of a sweep."""

from __future__ import annotations

import json

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.flying import fly
from casadi_gnc.problem_files.sweeping import fly_sweep, load_sweeps
from casadi_gnc.system import assets, compilers

GAIN = "scheme.observer_pinv.law.rate_gain"


def short(samples=100):
    mission = casadi_gnc.load("huang2020/detumble")
    return mission.with_timing(duration=samples * mission.timing.sample_period)


@pytest.fixture(scope="module")
def build():
    return casadi_gnc.vary(short(), [GAIN, "initial.rate_rad_per_s"], "observer_pinv")


@pytest.fixture
def loaded(monkeypatch):
    """Count the libraries that are asked of the compiler."""
    found, load = [], compilers.load

    def counted(source, **options):
        found.append(source)
        return load(source, **options)

    monkeypatch.setattr("casadi_gnc.system.compilers.load", counted)
    return found


def test_a_changed_gain_needs_no_build(build, loaded):
    flights = [build.fly({GAIN: gain}, decimation=1) for gain in (0.3, 0.7)]
    assert len(loaded) == 1
    assert flights[0].made["problem_sha256"] != flights[1].made["problem_sha256"]
    for gain, found in zip((0.3, 0.7), flights, strict=True):
        alone = fly(short().with_scheme("observer_pinv", rate_gain=gain), decimation=1)
        assert np.abs(found["rate"] - alone["rate"]).max() < 1e-12  # rounding of folded constants
    assert np.abs(flights[0]["rate"] - flights[1]["rate"]).max() > 1e-4
    started = build.fly({"initial.rate_rad_per_s": [0.1, 0.2, 0.3]}, decimation=1)
    assert started["rate"][0].tolist() == [0.1, 0.2, 0.3]
    assert (build.fly(seed=7)["rate"] == build.fly(seed=7)["rate"]).all()


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({GAIN: -1.0}, "rate_gain is -1.0, expected more than 0"),
        ({"truth.inertia_factor": 1.0}, "'truth.inertia_factor' is no column of this build; there is scheme"),
        ({"initial.rate_rad_per_s": [1.0, 2.0]}, "stands for 3 numbers, and 2 are given"),
        ({GAIN: "fast"}, "rate_gain holds text, expected numbers"),
    ],
)
def test_numbers_that_cannot_fly_are_told(build, values, told):
    with pytest.raises(FlightError, match=told):
        build.fly(values)


def test_a_sweep_is_one_build_of_each_scheme(tmp_path, loaded):
    text = (assets.folder("problems") / "huang2020" / "detumble.toml").read_text()
    sweep = (
        '\n[[sweep]]\nname = "heavy"\nkey = "truth.inertia_factor"\nvalues = [0.9, 1.0, 1.1]\nshow = "settling_time"\n'
    )
    place = tmp_path / "tumbling.toml"
    place.write_text(text.replace("duration_s = 1500.0", "duration_s = 150.0") + sweep)
    (found,) = load_sweeps(place)
    rows = fly_sweep(found, ["observer_pinv", "damping_pinv"])
    assert len(loaded) == 2
    for mission, row in zip(found.missions, rows, strict=True):
        alone = fly(mission, "observer_pinv", decimation=mission.timing.samples)
        told, expected = row["observer_pinv"].summary(), alone.summary()
        for name in ("steady_rate", "torque_sample_sum"):
            value = expected["metrics"][name]["value"]
            assert value is None or told["metrics"][name]["value"] == pytest.approx(value, rel=1e-9)
        assert told["metrics"]["torque_sample_sum"]["value"] > 0
        assert told["made"]["problem_sha256"] == expected["made"]["problem_sha256"]
        assert row["observer_pinv"].mission == mission.name
    json.dumps([row["observer_pinv"].summary() for row in rows], allow_nan=False)


def test_a_sweep_of_what_is_no_column_builds_each_value(tmp_path, loaded):
    text = (assets.folder("problems") / "huang2020" / "detumble.toml").read_text()
    sweep = '\n[[sweep]]\nname = "long"\nkey = "timing.duration_s"\nvalues = [1.0, 2.0]\nshow = "settling_time"\n'
    place = tmp_path / "tumbling.toml"
    place.write_text(text + sweep)
    (found,) = load_sweeps(place)
    rows = fly_sweep(found, ["damping_pinv"])
    assert [row["damping_pinv"].mission for row in rows] == ["tumbling_long_1", "tumbling_long_2"]
    assert len(loaded) == 2
