"""Numbers that became columns fly as numbers do, on every engine, and what cannot be one is told."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.errors import FlightError, GncError
from casadi_gnc.missions.flying import fly
from casadi_gnc.missions.one_build import OneBuild, fly_case
from casadi_gnc.missions.parameters import vary
from casadi_gnc.missions.paths import changed, number_at, numbers_of

#: Keys of each kind, by mission: truth, environment, start, orbit, sensors, faults, gains.
KEYS = {
    "huang2020/detumble": (
        "observer_pinv",
        [
            *(
                "truth.inertia_factor",
                "truth.centre_of_mass_error_m",
                "initial.*",
                "scheme.observer_pinv.law.rate_gain",
            ),
            *("scheme.observer_pinv.torque_limit_N_m", "spacecraft.thrusters.max_force_N"),
            "spacecraft.rate_limit_rad_per_s",
        ],
    ),
    "huang2020/slew": ("funnel_robust", ["truth.inertia_factor", "environment.constant_torque_N_m", "initial.mrp"]),
    "huang2019/wheel_faults": (None, ["fault.1.effectiveness", "initial.*", "environment.orbit_rate_rad_per_s"]),
    "shi2020/docking": ("iobc", ["spacecraft.target_mass_kg", "orbit.eccentricity", "sensors.position_deviation_m"]),
    "sun2018/circular_orbit": (None, ["spacecraft.mass_kg", "target.inertia_kg_m2", "initial.position_error_m"]),
    "tao2019/case1": (None, ["spacecraft.mass_kg", "environment.constant.*", "orbit.altitude_m", "initial.mrp"]),
    "satellites/thruster_hold": (
        "robust",
        ["truth.centre_of_mass_error_m", "slosh.1.frequency_Hz", "initial.*", "scheme.robust.effort_limit"],
    ),
    "satellites/earth_pointing": (
        "mrp",
        [
            *("orbit.altitude_m", "initial.*", "wheel.1.max_momentum_N_m_s", "wheel.*.max_torque_N_m"),
            *("sensor.1.bias_rad_per_s", "sensor.1.angle_random_walk_rad_per_sqrt_s", "sensor.1.range_rad_per_s"),
            *("sensor.2.dropout", "sensor.2.across_rad", "sensor.2.about_rad", "sensor.2.max_rate_rad_per_s"),
            *("estimator.attitude_deviation_deg", "estimator.bias_deviation_deg_per_s", "estimator.gate"),
            "spacecraft.inertia_kg_m2.2.1",
        ],
    ),
}


#: The fast tests take the first.
FEW = [name if i < 1 else pytest.param(name, marks=pytest.mark.slow) for i, name in enumerate(KEYS)]


def shortened(name):
    mission = casadi_gnc.load(name)
    return mission.with_timing(duration=60 * mission.timing.sample_period)


def words(flight):
    return flight.samples.view(np.uint64)


class Varied(dict):
    """Missions by name, each made when it is first asked for."""

    def __missing__(self, name):
        scheme, own = KEYS[name]
        self[name] = vary(shortened(name), own, scheme)
        return self[name]


@pytest.fixture(scope="module")
def varied():
    return Varied()


def apart(one, left, right):
    """Return the largest relative difference of states and commands; an allocator's own counts are left out."""
    names = [*one.nominal.truth.state.names, *one.nominal.truth.inputs.names]
    return max(np.abs(left[name] - right[name]).max() / (np.abs(left[name]).max() + 1e-300) for name in names)


@pytest.mark.parametrize("name", FEW)
def test_at_their_nominal_values_columns_fly_like_the_numbers_to_rounding(varied, name):
    one = varied[name]
    numbers = fly(one.nominal, decimation=1)
    columns = fly_case(one, one.parameters.nominal, one.nominal.noise.seed, decimation=1)
    assert apart(one, numbers, columns) < 1e-6  # the allocator's gap at most; else rounding


@pytest.mark.parametrize("name", FEW)
def test_other_values_fly_like_a_mission_that_has_them_as_numbers(varied, name):
    one = varied[name]
    values = one.parameters.nominal * (1 + 1e-3 * np.sin(np.arange(one.parameters.size) + 1.0))
    columns = fly_case(one, values, one.nominal.noise.seed, decimation=1)
    assert apart(one, fly(one.at(values), decimation=1), columns) < 1e-6
    assert apart(one, fly(one.nominal, decimation=1), columns) > 1e-5


@pytest.mark.parametrize("name", [one for one in FEW if one != "huang2020/slew"])
def test_columns_have_the_same_words_in_c_and_on_the_virtual_machine(varied, name):
    one = varied[name]
    flights = [
        fly_case(one, one.parameters.nominal, 7, decimation=1, **how) for how in ({"maths": "libm"}, {"engine": "vm"})
    ]
    assert (words(flights[0]) == words(flights[1])).all()


def test_what_follows_from_parameters_alone_is_computed_once(varied):
    one = varied["huang2020/detumble"]
    plant = one.tapes.functions["plant"]
    assert "p" not in plant.name_in()
    assert plant.n_instructions() <= casadi_plant(one).n_instructions()


def casadi_plant(one):
    from casadi_gnc.missions.tapes import tapes_of

    return tapes_of(one.nominal, one.nominal.schemes[0]).functions["plant"]


def test_a_key_may_stand_for_several_numbers():
    one = vary(casadi_gnc.load("huang2020/detumble"), ["initial.*", "truth.centre_of_mass_error_m.2"])
    assert one.parameters.keys[:4] == ("initial.mrp.1", "initial.mrp.2", "initial.mrp.3", "initial.rate_rad_per_s.1")
    assert one.parameters.keys[-1] == "truth.centre_of_mass_error_m.2"


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("truht.inertia_factor", "did you mean truth"),
        ("truth.inertia", "did you mean"),
        ("truth.inertia_kg_m2", "write its nominal value"),
        ("initial.mrp.4", "initial.mrp has no '4'"),
        ("timing.duration_s", "sizes and steps follow from it"),
        ("noise.seed", "noise of its own"),
        ("spacecraft.thrusters.max_force_N", "set up for one effectiveness and one range; take method pinv"),
        ("spacecraft.thrusters", "no number"),
        ("scheme.observer_robust.torque_limit", "did you mean torque_limit_N_m"),
        ("scheme.observer_robust.allocation", "leads nowhere"),
    ],
)
def test_a_key_that_cannot_be_a_column_is_told_in_one_sentence(key, told):
    with pytest.raises(FlightError, match=told) as error:
        vary(casadi_gnc.load("huang2020/detumble"), [key], "observer_robust")
    assert key in str(error.value)
    assert len(str(error.value)) < 400


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ("sensor.2.period_s", "before the flight depends on it"),
        ("sensor.1.dropout", "where it is not zero the flight has other signals"),
        ("momentum.null_per_s", "where it is not zero the flight has other signals or steps"),
        ("momentum.unload_per_s", "coils take momentum away"),
        ("initial.mrp", "write its nominal value"),
    ],
)
def test_a_satellites_key_that_cannot_be_a_column_is_told_in_one_sentence(key, told):
    with pytest.raises(FlightError, match=told) as error:
        vary(casadi_gnc.load("satellites/earth_pointing"), [key], "mrp")
    assert key in str(error.value)
    assert len(str(error.value)) < 300


def test_a_star_stands_for_the_numbers_that_a_table_gives():
    one = vary(casadi_gnc.load("satellites/earth_pointing"), ["initial.*"], "mrp")
    expected = [f"initial.{name}.{i}" for name in ("euler_321_deg", "rate_deg_per_s") for i in (1, 2, 3)]
    assert sorted(one.parameters.keys) == expected


def test_one_number_cannot_follow_two_keys():
    with pytest.raises(FlightError, match=r"'initial\.mrp\.1' is given by two keys"):
        vary(casadi_gnc.load("huang2020/detumble"), ["initial.mrp.1", "initial.*"])


@pytest.mark.parametrize(
    ("entry", "named"),
    [
        ("", "11 12 13 22 23 33"),
        (".*.*", "11 12 13 22 23 33"),
        (".1.2", "12"),
        (".2.1", "12"),
        (".3", "13 23 33"),
        (".*.2", "12 22 23"),
    ],
)
@pytest.mark.parametrize(
    ("mission", "key"),
    [
        ("sun2018/circular_orbit", "spacecraft.inertia_kg_m2"),
        ("sun2018/circular_orbit", "target.inertia_kg_m2"),
        ("tao2019/case1", "believed.inertia_kg_m2"),
        ("satellites/earth_pointing", "spacecraft.inertia_kg_m2"),
    ],
)
def test_an_entry_of_an_inertia_and_its_mirror_image_are_one_number(mission, key, entry, named):
    one = casadi_gnc.load(mission)
    one = one.with_scheme(one.schemes[0].name)
    keys = numbers_of(one, f"{key}{entry}")
    assert keys == [f"{key}.{row}.{column}" for row, column in named.split()]
    values = {each: number_at(one, each) + 0.01 * i for i, each in enumerate(keys, 1)}
    craft = changed(one, values)[0]  # which refuses what is not symmetric
    table: Any = craft if key.startswith("spacecraft") else getattr(craft, key.split(".")[0])
    for each, value in values.items():
        row, column = (int(part) - 1 for part in each.split(".")[-2:])
        assert table.inertia_kg_m2[row][column] == table.inertia_kg_m2[column][row] == value


def test_mirror_entries_by_two_keys_are_given_twice():
    keys = ["spacecraft.inertia_kg_m2.1.2", "spacecraft.inertia_kg_m2.2.1"]
    with pytest.raises(FlightError, match=r"'spacecraft\.inertia_kg_m2\.1\.2' is given by two keys"):
        vary(casadi_gnc.load("satellites/earth_pointing"), keys, "mrp")


def test_a_build_takes_a_whole_inertia_or_an_entry_by_either_name():
    one = vary(casadi_gnc.load("sun2018/circular_orbit"), ["spacecraft.inertia_kg_m2"])
    build, whole = OneBuild(one), np.array([[600.0, -20.0, -50.0], [-20.0, 420.0, -25.0], [-50.0, -25.0, 260.0]])
    assert (build.row({"spacecraft.inertia_kg_m2": whole}) == whole[np.triu_indices(3)]).all()
    assert build.row({"spacecraft.inertia_kg_m2.3.1": -49.0})[2] == -49.0
    whole[2, 0] = -51.0
    with pytest.raises(FlightError, match="expected equal numbers in mirror entries"):
        build.row({"spacecraft.inertia_kg_m2": whole})


def test_values_that_no_craft_can_have_are_refused_as_a_file_would_refuse_them():
    one = vary(casadi_gnc.load("huang2020/detumble"), ["truth.inertia_factor"])
    with pytest.raises(GncError, match="expected a number > 0"):
        one.at([-1.0])
