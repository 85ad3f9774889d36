"""Sensors, estimators, references and plates of a satellite, as a file may not say them: a sentence each."""

import pickle
import tomllib
from typing import Any

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import GncError, ProblemError
from casadi_gnc.problem_files.document import read
from casadi_gnc.vehicles.satellite import SatelliteCraft

WHEELS = [{"axis": axis, "max_torque_N_m": 0.02, "inertia_kg_m2": 1e-3} for axis in np.eye(3).tolist()]
BODY = {"mass_kg": 90.0, "inertia_kg_m2": np.diag([9.0, 11.0, 7.0]).tolist()}
ORBIT = {"altitude_m": 550e3, "epoch": "2026-11-27T12:00:00"}
GYRO = {"kind": "gyro", "angle_random_walk_rad_per_sqrt_s": 1e-5}
STARS = {"kind": "star_tracker", "across_rad": 5e-5, "about_rad": 3e-4}
MEKF = {"kind": "mekf"}
STILL = {"quaternion_scalar_first": [1.0, 0.0, 0.0, 0.0]}


def craft(**tables) -> SatelliteCraft:
    return SatelliteCraft(**{**BODY, "wheel": WHEELS, **tables})


@pytest.mark.parametrize(
    ("tables", "told"),
    [
        ({"sensor": [{"kind": "magnetometer"}]}, "there is no field to measure; give [field]"),
        ({"sensor": [{"kind": "sun_sensor"}]}, "sensor.0.kind: needs to know when and where it is; give [orbit]"),
        ({"sensor": [GYRO, GYRO]}, "another sensor is named gyro too; give it a name"),
        ({"sensor": [{**GYRO, "dropout": 1.0}]}, "dropout: is 1.0, expected a number < 1"),
        ({"wheel": [], "thruster": [], "sensor": [{"kind": "tachometers"}]}, "give 1 to 128 [[wheel]]"),
        ({"estimator": MEKF}, 'moves by one gyro, there are 0 [[sensor]] of kind = "gyro"'),
        ({"sensor": [GYRO], "estimator": MEKF}, "the filter has a gyro alone; expected a star tracker"),
        ({"sensor": [{"kind": "gyro"}, STARS], "estimator": MEKF}, "the angle random walk is 0 for the filter"),
        ({"sensor": [GYRO, {"kind": "star_tracker"}], "estimator": MEKF}, "a deviation is 0 for the filter"),
        ({"reference": [{"kind": "nadir"}]}, "reference.0.kind: needs to know where the satellite is; give [orbit]"),
        ({"reference": [{"kind": "sun"}]}, 'a reference of kind "sun" needs to know when it is; give [orbit]'),
        (
            {"reference": [{"kind": "inertial", "from_s": 5.0}]},
            "nothing is said of the time before; let the first one begin at 0",
        ),
        (
            {"reference": [{"kind": "inertial"}, {"kind": "inertial", "from_s": 0.0}]},
            "reference.1.from_s: begins at 0 s, not after the one before, 0 s",
        ),
        (
            {"reference": [{"kind": "table", "times_s": [0.0, 1.0], "quaternions_scalar_first": [[1.0, 0, 0, 0]] * 1}]},
            "a table of 2 times and 1 attitudes",
        ),
        (
            {
                "reference": [
                    {
                        "kind": "table",
                        "times_s": [0.0, 1.0],
                        "quaternions_scalar_first": [[1.0, 0, 0, 0], [0, 1.0, 0, 0]],
                    }
                ]
            },
            "the table jumps by 180 degrees from 0 s to 1 s",
        ),
        (
            {"reference": [{"kind": "inertial", **STILL, "mrp": [0.0, 0.0, 0.0]}]},
            "the attitude is given 2 times, by quaternion_scalar_first and mrp; keep one",
        ),
        ({"plate": [{"area_m2": 1.0, "normal": [1.0, 0, 0], "centre_m": [0.0] * 3}]}, "give [orbit]"),
        (
            {"orbit": ORBIT, "plate": [{"area_m2": 1.0, "normal": [1.0, 1.0, 0], "centre_m": [0.0] * 3}]},
            "normal: ",
        ),
        (
            {"orbit": ORBIT, "air": {"density_kg_per_m3": 1e-12, "altitude_m": 5e5, "scale_m": 6e4}},
            "there is no [[plate]] for the air to push",
        ),
    ],
)
def test_what_cannot_be_is_said(tables, told):
    with pytest.raises(GncError) as raised:
        craft(**tables)
    assert told in str(raised.value)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"timing.sample_period_s": 0.3}, "a value every 0.5 s, expected a whole multiple of the sample period 0.3 s"),
        ({"timing.mode": "continuous"}, "gyro is a sensor that is sampled; fly in mode sampled"),
    ],
)
def test_sensors_and_the_timing_of_a_mission(change, told):
    with pytest.raises(GncError) as raised:
        casadi_gnc.load("satellites/earth_pointing", change)
    assert told in str(raised.value)


def test_sensors_that_are_too_fast_are_told_at_their_lines_with_what_else_is_wrong():
    with pytest.raises(GncError) as raised:
        casadi_gnc.load("satellites/earth_pointing", {"sensor.1.period_s": 0.03, "noise.period_s": 0.07})
    told = str(raised.value)
    assert "sensor[1].period_s" in told
    assert "gyro: a value every 0.03 s, expected a whole multiple" in told
    assert "period_s is 0.07" in told


def test_a_table_that_a_file_gives_is_followed():
    """Attitudes by the minute: the flight's last one is the table's."""
    rows = [[np.cos(a), 0.0, np.sin(a), 0.0] for a in (0.0, 0.1, 0.2, 0.25)]
    told = {"kind": "table", "times_s": [0.0, 60.0, 120.0, 180.0], "quaternions_scalar_first": rows}
    pointed = craft(reference=[told]).pointed().at(500.0, None)
    assert np.allclose(np.array(ca.evalf(pointed.quaternion)).ravel(), rows[-1])


def test_the_shipped_file_is_what_its_readers_see():
    text = read("satellites/earth_pointing").path.read_text(encoding="utf-8")
    kinds = [each["kind"] for each in tomllib.loads(text)["sensor"]]
    assert kinds == ["gyro", "star_tracker"]
    mission = casadi_gnc.load("satellites/earth_pointing")
    assert "mrp" not in mission.truth.measurement
    assert {"gyro", "star_tracker", "star_tracker_valid"} <= set(mission.truth.measurement.names)


def test_a_table_comes_from_a_file_beside_the_problem(tmp_path):
    """The same rows as in the problem file are the same mission; the file is part of it, and of its digest."""
    rows = "t,q0,q1,q2,q3\n0,1,0,0,0\n60,0.8,0,0.6,0\n400,0.6,0,0.8,0\n"
    (tmp_path / "pointing").mkdir()
    (tmp_path / "pointing" / "day.csv").write_text(rows)
    problem = tmp_path / "sat.toml"
    text = read("satellites/slew").text
    own = {"kind": "table", "file": "pointing/day.csv"}
    problem.write_text(text)
    mission = casadi_gnc.load(problem, {"reference": [own]})
    craft: Any = mission.craft
    (table,) = craft.reference
    assert table.times_s == [0.0, 60.0, 400.0]
    assert mission.guests()[-1].text == rows
    (tmp_path / "pointing" / "day.csv").write_text(rows.replace("400", "500"))
    assert casadi_gnc.load(problem, {"reference": [own]}).digest != mission.digest
    assert pickle.loads(pickle.dumps(mission)).digest == mission.digest
    for name, told in (
        ("../day.csv", "leads out of the problem file's folder"),
        ("/etc/hosts", "leads out of the problem file's folder"),
        ("gone.csv", "there is no file gone.csv in"),
    ):
        with pytest.raises(ProblemError, match=rf"reference.*file.*{told}"):
            casadi_gnc.load(problem, {"reference": [{**own, "file": name}]})
    (tmp_path / "pointing" / "day.csv").write_text(rows + "500,1,1,0,0\n")
    with pytest.raises(ProblemError, match=r"day\.csv, line 5: row 4 of the table"):
        casadi_gnc.load(problem, {"reference": [own]})
    with pytest.raises(ProblemError, match="the rows are in the file; leave times_s and quaternions_scalar_first out"):
        casadi_gnc.load(problem, {"reference": [{**own, "times_s": [0.0, 1.0]}]})
