"""Bad files of proximity missions: one clear sentence with file, line and key."""

import re

import pytest

import casadi_gnc
from casadi_gnc.errors import ProblemError
from casadi_gnc.problem_files.document import read

GOOD = read("sun2018/circular_orbit").text
J = "inertia_kg_m2 = [[598.3, -22.5, -51.5]"
RADIUS = "keep_out_radius_m = 4.0"
CASES = {
    "inertia not spd": (
        J,
        "inertia_kg_m2 = [[-598.3, -22.5, -51.5]",
        "line LINE, spacecraft.inertia_kg_m2: not positive definite",
    ),
    "inertia not symmetric": (J, "inertia_kg_m2 = [[598.3, -20.5, -51.5]", "spacecraft.inertia_kg_m2: not symmetric"),
    "target not spd": ("[[3336.0,", "[[-3336.0,", "line LINE, target.inertia_kg_m2: not positive definite"),
    "point inside": (
        RADIUS,
        "keep_out_radius_m = 6.0",
        "spacecraft.hold_point_m: hold_point_m is 5 m from the target's centre, inside the keep-out sphere of 6 m",
    ),
    "point on the sphere": (RADIUS, "keep_out_radius_m = 5.0", "inside the keep-out sphere of 5 m"),
    "negative radius": (
        RADIUS,
        "keep_out_radius_m = -1.0",
        "line LINE, spacecraft.keep_out_radius_m: is -1.0, expected a number >= 0",
    ),
    "negative deviation": (
        "velocity_deviation_m_per_s = 1e-3",
        "velocity_deviation_m_per_s = -1e-3",
        "line LINE, sensors.velocity_deviation_m_per_s: is -0.001, expected a number >= 0",
    ),
    "negative random force": (
        "random_force_N = 0.5",
        "random_force_N = -0.5",
        "line LINE, environment.random_force_N: is .*, expected a number >= 0",
    ),
    "negative truncation": (
        "truncation_sigma = 3.0",
        "truncation_sigma = -3.0",
        "line LINE, noise.truncation_sigma: is .*, expected a number > 0",
    ),
    "no mass": ("mass_kg = 58.2", "mass_kg = 0.0", "line LINE, spacecraft.mass_kg: is .*, expected a number > 0"),
    "at the centre": (
        "position_m = [4086485.2053241716, 4086485.2053241716, 4086485.2053241716]",
        "position_m = [0, 0, 0]",
        "line LINE, initial.position_m: the chaser is at the Earth's centre",
    ),
    "not circular": (
        "velocity_m_per_s = [2005.623225500195,",
        "velocity_m_per_s = [2305.623225500195,",
        r"line \d+, orbit.circular: the target's orbit has eccentricity 0.0\d+ and perigee radius \d+.* km; circ",
    ),
    "falls down": (
        "velocity_m_per_s = [2005.623225500195, 4011.24645100039, -6016.869676500585]",
        "velocity_m_per_s = [0, 0, 0]",
        r"orbit.circular: the target's orbit has eccentricity 1 and perigee radius 4\.\d+e-05 km",
    ),
    "no limit": (
        "force_limit_N = [20.0, 20.0, 20.0]",
        "force_limit_N = [20.0, 20.0]",
        r"scheme\[1\].force_limit_N: has . entr.*, expected at least 3",
    ),
    "chattering switch": (
        "switch_above = 1.05",
        "switch_above = 0.9",
        r"line LINE, scheme\[1\].law.switch_above: is 0.9, expected a number >= 1",
    ),
    "misspelt": (
        "observer_gain = 0.3",
        "observr_gain = 0.3",
        r"scheme\[1\].law.observr_gain: unknown key; did you mean observer_gain",
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_bad_files_are_refused_in_one_sentence(case, tmp_path):
    right, wrong, expected = case
    assert GOOD.count(right) == 1
    path = tmp_path / "bad.toml"
    path.write_text(GOOD.replace(right, wrong), encoding="utf-8")
    line = GOOD[: GOOD.index(right)].count("\n") + 1
    with pytest.raises(ProblemError) as told:
        casadi_gnc.load(path)
    message = str(told.value)
    assert re.search(expected.replace("LINE", str(line)), message), message
    assert "\n" not in message


def notes(factor: float) -> tuple[str, ...]:
    """Return the notes with the chaser's velocity scaled, where the orbit need not be circular."""
    velocity = [factor * v for v in casadi_gnc.load("sun2018/circular_orbit").start[15:18]]
    changes = {"orbit.circular": False, "initial.velocity_m_per_s": velocity}
    return casadi_gnc.load("sun2018/circular_orbit", changes).craft.notes()


def test_orbits_that_are_none_are_told_unless_they_must_be_circular():
    """Twice the circular speed v^2 r/mu = 4 is an eccentricity of 3; no speed falls to the centre."""
    assert re.search(r"hits the body .*: eccentricity 1 and perigee radius 4\.\d+e-05 km", notes(0.0)[0])
    assert re.search(r"hyperbola: eccentricity 3 and perigee radius 7078", notes(2.0)[0])
    assert not any("orbit" in note for note in notes(1.0))
