"""Bad data of a craft on wheels: one clear sentence with file, line and key."""

import re
import subprocess
import sys

import pytest

import casadi_gnc
from casadi_gnc.problem_files.document import read

NOMINAL = read("huang2019/nominal").text
FREE = read("huang2019/free_axes").text
CASES = {
    "axis": (NOMINAL, "index = 3", "index = 4", "line \\d+, fault\\[4\\]: fault of axis 4, but there are 1 to 3"),
    "wheel": (FREE, "index = 3", "index = 5", "fault\\[4\\]: fault of wheel 5, but there are 1 to 4"),
    "backwards": (
        NOMINAL,
        "until_s = 15.0",
        "until_s = 4.0",
        "fault\\[4\\]: fault of axis 3: it ends at 4 s, before it starts at 5 s",
    ),
    "negative time": (NOMINAL, "from_s = 10.0", "from_s = -1.0", "starts at -1 s, expected 0 s or later"),
    "overlap": (
        NOMINAL,
        "index = 2\nbias_N_m = -0.2\nfrom_s = 5.0\n",
        'index = 2\nbias_N_m = -0.2\nfrom_s = 5.0\n\n[[fault]]\nchannel = "axis"\n'
        "index = 2\nbias_N_m = 0.1\nfrom_s = 7.0\n",
        "two faults of axis 2 overlap, from 5 s and from 7 s; end one before",
    ),
    "effectiveness": (
        NOMINAL,
        "effectiveness = 0.0",
        "effectiveness = -0.5",
        "fault of axis 3: effectiveness is -0.5, expected 0",
    ),
    "bias of an axis": (
        NOMINAL,
        "bias_N_m = 0.2",
        "bias_rad_per_s2 = 0.2",
        'the bias of a fault of channel "axis" is bias_N_m, not bias_rad_per_s2',
    ),
    "channel": (
        NOMINAL,
        'channel = "axis"',
        'channel = "thruster"',
        "is 'thruster', expected 'axis' or 'wheel'",
    ),
    "deviation": (
        NOMINAL,
        "mrp_deviation = 1e-4",
        "mrp_deviation = -1e-4",
        "sensors.mrp_deviation: is -0.0001, expected a number >= 0",
    ),
    "seed": (NOMINAL, "seed = 1", "seed = -1", "noise.seed: is -1, expected a number >= 0"),
    "axes": (
        NOMINAL,
        "[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]",
        "[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]",
        "wheel 2: a direction of length 2, expected a unit vector",
    ),
    "flat": (
        FREE,
        "[0.0, 0.0, 1.0],\n  [0.5773502691896258, 0.5773502691896258, 0.5773502691896258],",
        "[0.0, 1.0, 0.0]",
        "the wheels make no torque about some axis",
    ),
    "inertia": (NOMINAL, "[0.0, 0.0, 20.0]]", "[0.0, 0.0, -20.0]]", "spacecraft.inertia_kg_m2: not positive definite"),
    "mass centre": (
        FREE,
        "[sensors]",
        "centre_of_mass_error_m = [0.1, 0.0, 0.0]\n\n[sensors]",
        "truth.centre_of_mass_error_m: no centre of mass moves wheel axes, which are free",
    ),
    "robust against nothing": (
        NOMINAL,
        "centre_of_mass_error_m = [0.3, 0.3, 0.3], ",
        "",
        "robust against what. give wheel_effectiveness or centre_of_mass_error_m",
    ),
    "crossed shares": (
        NOMINAL,
        "centre_of_mass_error_m = [0.3, 0.3, 0.3], ",
        "wheel_effectiveness = [1.0, 0.5], ",
        "the least share 1 exceeds the largest 0.5",
    ),
    "vertices": (
        NOMINAL,
        "centre_of_mass_error_m = [0.3, 0.3, 0.3], ",
        "centre_of_mass_error_m = [0.3, 0.3, 0.3], wheel_effectiveness = [0.5, 1.0], ",
        "make 128 vertices; 64 are the limit",
    ),
    "law": (
        NOMINAL,
        'type = "two_observer_attitude"',
        'type = "prescribed_pefrormance"',
        "no law 'prescribed_pefrormance'; did you mean 'prescribed_performance'",
    ),
    "gain": (
        NOMINAL,
        "filter_time_constant = 1.0",
        "filter_time_constant = 0.0",
        "filter_time_constant: is 0.0, expected a number > 0",
    ),
    "two matrices": (
        NOMINAL,
        "\n[spacecraft.wheels]",
        "rotation_321_rad = [0.1, 0.2, 0.3]\n\n[spacecraft.wheels]",
        "wheels.as_points has a matrix of its own",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_data_are_one_clear_sentence(case, tmp_path):
    text, old, new, message = CASES[case]
    assert old in text
    path = tmp_path / "bad.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(casadi_gnc.GncError) as found:
        casadi_gnc.load(path)
    told = str(found.value)
    assert re.search(message, told), told
    assert told.startswith("bad.toml, line ")
    assert "\n" not in told


def test_the_command_line_tells_the_same_and_nothing_else(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(NOMINAL.replace("index = 3", "index = 4"))
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "fly", str(path), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert "fault of axis 4, but there are 1 to 3" in " ".join(done.stderr.split())
    assert "Traceback" not in done.stderr
