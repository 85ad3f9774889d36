"""Satellites by tables: what is refused, which laws fit, that they fly, and parts of one's own."""

from typing import Any

import casadi as ca
import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import ProblemError
from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.mechanics import attitude
from casadi_gnc.missions import fitting
from casadi_gnc.vehicles.satellite import pointing_checks

HEAD = """
format = 1
kind = "mission"
[timing]
mode = "sampled"
sample_period_s = 0.1
duration_s = 10.0
[[scheme]]
name = "pd"
law = { type = "attitude_pd", attitude_gain = 4.0, rate_gain = 18.0 }
"""
BODY = """
[spacecraft]
model = "satellite"
mass_kg = 100.0
inertia_kg_m2 = [[24.0, 0.0, 0.0], [0.0, 30.0, 0.0], [0.0, 0.0, 34.0]]
"""
WHEEL = """
[[wheel]]
axis = {}
inertia_kg_m2 = 0.02
max_torque_N_m = 0.1
"""
WHEELS = "".join(map(WHEEL.format, ("[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", "[0.0, 0.0, 1.0]")))
MODE = """
[[flexible_mode]]
frequency_Hz = 0.1
damping = 0.01
rotation_kg05_m = [1.0, 0.0, 0.0]
"""
PANEL = """
[[hinged_panel]]
mass_kg = 6.0
inertia_kg_m2 = [[2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 2.2]]
hinge_m = [0.0, 0.5, 0.0]
axis = [1.0, 0.0, 0.0]
centre_m = [0.0, 1.5, 0.0]
stiffness_N_m_per_rad = 3.0
"""
WRONG = {
    "axis": (WHEEL.format("[0.6, 0.0, 0.9]"), "wheel[4].axis: a direction of length 1.082, expected a unit vector"),
    "inertia": ("[[wheel]]\naxis = [1.0, 0.0, 0.0]\nmax_torque_N_m = 0.1", "wheel[4]: give inertia_kg_m2, or both"),
    "three": (
        WHEEL.format("[1.0, 0.0, 0.0]") + "max_speed_rad_per_s = 600.0\nmax_momentum_N_m_s = 4.0",
        "wheel[4]: inertia_kg_m2, max_momentum_N_m_s and max_speed_rad_per_s are all given; keep two",
    ),
    "speed": (
        WHEEL.format("[1.0, 0.0, 0.0]") + "max_speed_rad_per_s = 600.0\nspeed_rad_per_s = 700.0",
        "wheel[4].speed_rad_per_s: 700 is beyond the wheel's largest speed, 600",
    ),
    "damping": (
        MODE.replace("damping = 0.01", "damping = 0.0"),
        "flexible_mode[1].damping: is 0.0, expected a number > 0",
    ),
    "undamped": (MODE.replace("damping = 0.01\n", ""), "flexible_mode[1].damping: is missing"),
    "unseen": (
        MODE.replace("frequency_Hz = 0.1", "frequency_Hz = 12.0"),
        "flexible_mode[1].frequency_Hz: 12 Hz is above the sampling frequency, 10 Hz; sample faster",
    ),
    "short": (
        '[[reference]]\nkind = "table"\ntimes_s = [0.0, 1.0]\nquaternions_scalar_first = [[1, 0, 0, 0], [1, 0, 0, 0]]',
        "reference[1]: the table ends at 1 s and is needed until",
    ),
    "no turn": (
        '[[reference]]\nkind = "inertial"\nturn_s = 5.0',
        "reference[1].turn_s: there is no reference before it",
    ),
    "long turn": (
        '[[reference]]\nkind = "inertial"'
        + "".join(f'\n[[reference]]\nkind = "inertial"\nfrom_s = {t}\nturn_s = 3.0' for t in (2.0, 4.0)),
        "reference[2].turn_s: the turn ends at 5 s, after the next one begins, 4 s",
    ),
    "unnamed": ("[[sensor]]\nperiod_s = 1.0", "sensor[1]: lacks the key kind; write one of 'gyro', 'star_tracker', "),
    "heavy": (MODE.replace("[1.0, 0", "[5.0, 0"), "spacecraft: wheels and modes have more inertia about some axis"),
    "hinge": (
        PANEL.replace("[1.0, 0", "[1.0, 1"),
        "hinged_panel[1].axis: a direction of length 1.414, expected a unit",
    ),
    "sheet": (
        PANEL.replace("[[2.0", "[[9.0"),
        "hinged_panel[1].inertia_kg_m2: ",
    ),
    "loose": (PANEL.replace("= 3.0", "= 0.0"), "hinged_panel[1].stiffness_N_m_per_rad: is 0.0, expected a number > 0"),
    "twice": (
        "[initial]\nmrp = [0.1, 0.0, 0.0]\naxis = [1.0, 0.0, 0.0]\nangle_deg = 5.0",
        "initial: the attitude is given 2 times, by mrp and axis",
    ),
    "angle": (
        "[initial]\nangle_deg = 5.0",
        "initial: an axis needs one angle, angle_deg or angle_rad, and an angle an axis",
    ),
    "angles": (
        "[initial]\naxis = [1.0, 0.0, 0.0]\nangle_deg = 5.0\nangle_rad = 1.0",
        "there is axis and angle_deg and angle_rad",
    ),
    "quaternion": (
        "[initial]\nquaternion_scalar_last = [0.0, 0.0, 1.0, 1.0]",
        "quaternion_scalar_last has length 1.41421, expected 1",
    ),
    "rate": (
        "[initial]\nrate_rad_per_s = [0.0, 0.0, 0.0]\nrate_deg_per_s = [0.0, 0.0, 0.0]",
        "initial: rate_rad_per_s and rate_deg_per_s",
    ),
    "size": ("[orbit]\ninclination_deg = 5.0", "orbit: give either altitude_m or semi_major_axis_m"),
    "low": ("[orbit]\naltitude_m = 500.0", "orbit: the orbit comes down to 0.5 km above the equatorial radius"),
    "ellipse": (
        "[orbit]\naltitude_m = 500e3\neccentricity = 0.1",
        "orbit.eccentricity: an altitude is of a circular orbit",
    ),
    "date": ('[orbit]\naltitude_m = 500e3\nepoch = "noon"', "orbit.epoch: the epoch is 'noon'"),
    "field": ('[field]\nmodel = "igrf"', "needs to know where and when; give [orbit] with an epoch"),
    "years": ('[orbit]\naltitude_m = 500e3\nepoch = "2045-01-01T00:00:00"\n[field]\nmodel = "igrf"', "orbit.epoch"),
    "coil": (
        "[[magnetorquer]]\naxis = [1.0, 0.0, 0.0]\nmax_dipole_A_m2 = 5.0",
        "magnetorquers push against a magnetic field; give [field]",
    ),
    "unloading": (
        "[momentum]\nunload_per_s = 1e-3",
        "momentum.unload_per_s: coils take momentum away; give [[magnetorquer]]",
    ),
    "speeds": (
        "[momentum]\nnull_per_s = 1e-3\nrest_speeds_rad_per_s = [1.0]",
        "momentum.rest_speeds_rad_per_s: 1 speeds, and there are 3 wheels",
    ),
    "thruster": (
        "[[thruster]]\nposition_m = [1.0, 0.0, 0.0]\ndirection = [0.0, 1.0, 0.0]\nmax_force_N = 1.0\nmin_force_N = 2.0",
        "thruster[1].min_force_N: 2 exceeds max_force_N 1",
    ),
}


def write(folder, *parts):
    path = folder / "mine.toml"
    path.write_text("\n".join((HEAD, BODY, *parts)))
    return path


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_one_sentence(name, tmp_path):
    text, expected = WRONG[name]
    with pytest.raises(ProblemError) as error:
        casadi_gnc.load(write(tmp_path, WHEELS, text))
    assert expected in str(error.value)
    assert len(str(error.value).splitlines()) == 1


def test_all_that_is_wrong_is_told_at_once(tmp_path):
    several = [WRONG[name][0] for name in ("axis", "damping", "twice", "size")]
    with pytest.raises(ProblemError) as error:
        casadi_gnc.load(write(tmp_path, WHEELS, *several))
    for name in ("axis", "damping", "twice", "size"):
        assert WRONG[name][1] in str(error.value)


PLANE = "".join(map(WHEEL.format, ["[1.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]", "[0.6, 0.8, 0.0]", "[0.8, -0.6, 0.0]"]))
SLOSH = """
[[slosh]]
mass_kg = 5.0
position_m = [0.0, 0.0, 0.1]
axis = [1.0, 0.0, 0.0]
frequency_Hz = 12.0
damping = 0.01
"""
GYRO = """
[[sensor]]
kind = "gyro"
angle_random_walk_rad_per_sqrt_s = 1e-6
bias_random_walk_rad_per_s_sqrt_s = 1e-9
period_s = 0.05
"""
JUMP = """
[[reference]]
kind = "table"
times_s = [0.0, 1.0]
quaternions_scalar_first = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]]
"""
SUN = """
[[reference]]
kind = "sun"
axis = [0.0, 1.0, 1.0]
"""


@pytest.mark.parametrize("tables", ["wrong by themselves", "wrong together"])
def test_mistakes_of_every_kind_are_told_together(tables, tmp_path):
    """What is wrong with a table, between tables, with the flight's times and with what the parts make together."""
    parts = [PLANE, SLOSH, GYRO, WRONG["years"][0]]
    expected = [
        "wheel: the wheels make no torque about",
        "slosh[1].frequency_Hz: 12 Hz is above the sampling frequency",
        "sensor[1].period_s: gyro: a value every 0.05 s",
        "orbit.epoch: the field model IGRF-14 is asked for the year 2045",
    ]
    if tables == "wrong together":
        parts += [WRONG["short"][0], SUN.replace("[0.0, 1.0,", "[0.0, 0.0,"), MODE.replace("[1.0, 0", "[5.0, 0")]
        expected += ["reference[2].from_s: begins at 0 s", "spacecraft: wheels and modes have more inertia"]
    else:
        parts += [JUMP, SUN, WRONG["damping"][0], WRONG["twice"][0]]
        expected += ["reference[1]: the table jumps by 180 degrees", "reference[2].axis: a direction of length 1.414"]
        expected += [WRONG["damping"][1], WRONG["twice"][1]]
    with pytest.raises(ProblemError) as error:
        casadi_gnc.load(write(tmp_path, *parts))
    told = str(error.value).splitlines()
    assert all(sum(each in line for line in told) == 1 for each in expected)
    assert all("mine.toml, line " in line for line in told)
    assert len(told) == len(expected)


def test_four_wheels_in_a_plane(tmp_path):
    path = write(tmp_path, PLANE)
    with pytest.raises(ProblemError, match=r"wheel: the wheels make no torque about the axis \(0, 0, -?1\)"):
        casadi_gnc.load(path)
    failed = {each.name for each in casadi_gnc.check(path) if each.verdict == "fail"}
    assert "authority.span" in failed


def test_a_mode_above_the_sampling(tmp_path):
    path = write(tmp_path, WHEELS, MODE.replace("0.1\n", "6.0\n"))
    found = {each.name: each.verdict for each in casadi_gnc.check(path)}
    assert found["sampling.mode_frequency"] == "fail"
    assert found["numbers.mode_steps"] == "note"
    slow = {each.name: each.verdict for each in casadi_gnc.check(write(tmp_path, WHEELS, MODE))}
    assert slow["sampling.mode_frequency"] == slow["numbers.mode_steps"] == "ok"


def test_laws_of_rigid_bodies_fit():
    mission = casadi_gnc.load("satellites/slew")
    scheme, read = mission.scheme(), fitting.read_by(mission.scheme(), mission.truth)
    fit = [
        name
        for name in LAWS.shipped()
        if not list(fitting.misfits(LAWS.find(name), read, scheme.law.belief, scheme.actuation.effort))
    ]
    assert {"rate_damping", "attitude_pd", "detumble", "prescribed_performance", "two_observer_attitude"} <= set(fit)
    assert "finite_time_fault_tolerant" in fit
    assert not {"proximity_tracking", "intermediate_observer", "drag_free"} & set(fit)


def test_the_software_believes_what_is_true():
    """A commanded torque turns the known body as it turns the true one, wheels spinning, whatever the attitude."""
    mission = casadi_gnc.load(
        "satellites/slew", {"wheel.1.speed_rad_per_s": 80.0, "initial.rate_rad_per_s": [0.02, -0.01, 0.03]}
    )
    plant, believed = mission.truth, mission.scheme().law.belief
    x, u = ca.DM(mission.start), ca.DM([0.05, -0.02, 0.03, 0.01])
    now = plant.state.split(x)
    wheels = plant.assembly.components[0]
    torque = -ca.mtimes(wheels.axes, u - ca.DM(wheels.friction(now.wheel_speed)))
    known = believed.acceleration(now.mrp, now.rate, torque + believed.coupling(now.rate, now.wheel_speed))
    true = plant.state.split(ca.DM(plant.rate(0.0, x, u, ca.DM(0, 1)))).rate
    assert np.allclose(np.array(known), np.array(true), rtol=1e-12, atol=1e-18)


def test_a_slew_ends_where_it_should():
    flight = casadi_gnc.fly("satellites/slew")
    assert flight["pointing_error_deg"][0] == pytest.approx(60.0, rel=1e-6)
    mission = casadi_gnc.load("satellites/slew")
    shown = next(one for one in mission.craft.panels(mission) if one.signal == "pointing_error_deg")
    assert (shown.logarithmic, shown.level) == (True, pytest.approx(0.1, rel=1e-12))
    assert flight.metrics["settling_time"] < 120
    assert flight["pointing_error_deg"][-1] < 0.01
    turned = np.array(attitude.dcm(ca.DM(flight["mrp"][500])))
    kept = np.array(attitude.dcm(ca.DM(flight["mrp"][0])))
    start, later = kept.T @ flight["momentum"][0], turned.T @ flight["momentum"][500]
    assert np.abs(later - start).max() < 1e-6  # wheels keep the momentum inside


GUEST = '''
from dataclasses import dataclass
from typing import Any

import casadi as ca
from pydantic import Field

from casadi_gnc.mechanics.multibody import Action, Component
from casadi_gnc.signals import Layout, Signal
from casadi_gnc.tables.part import Part, table
from casadi_gnc.vehicles.satellite import SatelliteCraft


@dataclass(frozen=True, eq=False)
class Boom(Component):
    """A boom that turns about z on a motor of its own: a speed, and a torque from nobody."""

    spin: float
    torque: float

    state = Layout((Signal("boom_rate", 1, "rad/s"),))

    @property
    def moving(self):
        return {"boom_rate": None}

    def start(self):
        return {"boom_rate": [0.0]}

    def couplings(self, own):
        return ca.DM.zeros(3, 1), ca.DM([0, 0, self.spin]), ca.DM(self.spin)

    def act(self, t, own, told, around):
        return Action(internal=ca.DM(self.torque))


class BoomTable(Part):
    """A boom."""

    inertia_kg_m2: float
    torque_N_m: float


class Mine(SatelliteCraft):
    """A satellite with booms."""

    boom: list[BoomTable] = table([])

    def components(self):
        return [*super().components(), *(Boom(each.inertia_kg_m2, each.torque_N_m) for each in self.boom)]
'''


def test_a_part_of_ones_own_is_as_good(tmp_path):
    """It is a table of the file, moves with the rest, and the body feels it."""
    (tmp_path / "mine.py").write_text(GUEST)
    path = write(tmp_path, WHEELS, "[[boom]]\ninertia_kg_m2 = 0.5\ntorque_N_m = 0.01")
    path.write_text(path.read_text().replace('"satellite"', '"./mine.py:Mine"'))
    flight = casadi_gnc.fly(path)
    assert flight["boom_rate"][-1] == pytest.approx(0.01 * 10 / 0.5, rel=0.02)
    assert np.abs(flight["momentum"]).max() < 1e-12  # from rest, nothing outside
    assert np.abs(flight["rate"][:, 2]).max() > 1e-5


@pytest.mark.slow
def test_a_day_of_looking_at_the_earth():
    """Filter, feedback and unloading at 10 Hz: pointing held, wheels off zero and far from their limits all day."""
    mission = casadi_gnc.load("satellites/earth_pointing_day")
    flight = casadi_gnc.fly(mission)
    assert all(verdict.robustness > 0 for verdict in flight.verdicts.values())
    late = flight["time"] > 3000
    # What is checked of the filter beforehand is what it says of itself, and what it truly errs by.
    craft: Any = mission.craft
    limit = pointing_checks.wanted(mission)
    assert limit is not None
    (noise,) = pointing_checks.checks(craft, mission, mission.scheme(), limit)
    assert np.degrees(3 * flight["attitude_deviation"][late].max()) == pytest.approx(noise.value, rel=0.2)
    assert noise.value < flight["pointing_error_deg"][late].max() < noise.limit
    speeds = np.abs(flight["wheel_speed"][late])
    assert (speeds > 20).all()  # of 60 that they are to have
    assert (speeds < 100).all()
    assert np.abs(flight["dipole"]).max() <= 10.0
    still = casadi_gnc.load("satellites/earth_pointing_day", {"momentum.unload_per_s": 0.0})
    loaded = casadi_gnc.fly(still)
    assert np.abs(loaded["wheel_speed"][-1]).max() > 1.5 * speeds.max()


FUNNEL = """
[[funnel]]
signal = "mrp"
start = [0.6, 0.6, 0.6]
floor = [0.02, 0.02, 0.02]
decay_per_s = [0.02, 0.02, 0.02]
below = [1.0, 1.0, 1.0]
above = [1.0, 1.0, 1.0]
"""
PAPER = (
    'law = { type = "prescribed_performance", attitude_gain = 0.05, rate_gain = 0.5, compensator_gain = 0.0, '
    "compensator_decay = 0.1, observer_gain = 0.2, filter_time_constant = 1.0 }"
)


def test_a_law_with_a_funnel_keeps_it_and_none_that_means_another_frame(tmp_path):
    path = write(tmp_path, WHEELS, FUNNEL, "[initial]\naxis = [0.6, 0.0, 0.8]\nangle_deg = 20.0")
    text = path.read_text().replace("duration_s = 10.0", "duration_s = 120.0")
    lines = [PAPER if line.startswith("law = ") else line for line in text.splitlines()]
    path.write_text("\n".join(lines))
    flight = casadi_gnc.fly(path)
    assert flight["funnel_use"].max() < 1
    assert flight["pointing_error_deg"][-1] < 1
    path.write_text("\n".join([*lines, '[[reference]]\nkind = "inertial"\nmrp = [0.1, 0.0, 0.0]']))
    with pytest.raises(ProblemError, match="reads it from the reference; leave out the funnel, or the reference"):
        casadi_gnc.load(path)
