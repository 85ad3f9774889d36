"""Derivatives of whole flights whose allocation is an expression.

Truths: differences of the same flights in long double, extrapolated (Richardson).
"""

import long_double_flight
import numpy as np
import pytest
from differences import flown, richardson

import casadi_gnc
from casadi_gnc.errors import FlightError
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.sensitivities import engine as engines

#: Of the other missions, which take longer to build.
MORE = {
    "tao2019/case1": ("funnels", ["initial.position_m"]),
    "sun2018/circular_orbit": ("tracking", ["initial.position_m"]),
    "shi2020/docking": ("iobc", ["initial.*"]),
    "huang2020/slew": ("funnel_pinv", ["initial.rate_rad_per_s", "scheme.funnel_pinv.law.rate_gain"]),
    "satellites/slew": ("pd", ["initial.axis", "initial.angle_deg"]),
}
#: Schemes whose allocation is an expression, in both modes, and what they are differentiated by.
FLIGHTS = {
    "huang2020/detumble": ("observer_pinv", ["initial.rate_rad_per_s", "scheme.observer_pinv.law.rate_gain"]),
    "huang2020/detumble continuous": ("damping_pinv", ["initial.rate_rad_per_s", "truth.inertia_factor"]),
}


#: Of others, a hundredth away from the file's own numbers: where these are symmetric, wheels reach a limit in pairs,
#: and a slope is one to either side.
AWAY = {
    "satellites/flexible_slew": ("pd", ["initial.axis", "initial.angle_deg"]),
    "huang2019/fault_free": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2020/slew_as_printed": ("pd_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2020/slew_chaser_model": ("pd_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "satellites/detumble_bdot": ("bdot", ["initial.rate_deg_per_s"]),
    "satellites/earth_pointing": ("mrp", ["initial.euler_321_deg", "initial.rate_deg_per_s"]),
    "satellites/safe_mode": ("modes", ["initial.euler_321_deg", "initial.rate_deg_per_s"]),
    "huang2019/free_axes": ("pd_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/free_axes_two_observers": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/nominal": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/tough": ("finite_time_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/vertices": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2019/wheel_faults": ("observers_pinv", ["initial.mrp", "initial.rate_rad_per_s"]),
    "huang2020/detumble_chaser_model": ("observer_pinv", ["initial.rate_rad_per_s"]),
    "satellites/earth_pointing_day": ("mrp", ["initial.euler_321_deg", "initial.rate_deg_per_s"]),
    "satellites/slew_and_track": (
        "eigenaxis",
        ["scheme.eigenaxis.law.frequency", "scheme.eigenaxis.law.damping_ratio"],
    ),
    "shi2020/docking_as_printed": ("dobc", ["initial.position_m"]),
    "sun2018/as_printed": ("literal", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "sun2018/fast_tumble": ("tracking", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "sun2018/quarter_limits": ("tracking", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "sun2018/without_observer": ("neither", ["initial.attitude_error", "initial.rate_error_rad_per_s"]),
    "tao2019/as_printed": ("corrected", ["initial.mrp", "initial.position_m"]),
    "tao2019/case2": ("bounded", ["initial.mrp", "initial.position_m"]),
    "tao2019/sweeps": ("auxiliary", ["initial.mrp", "initial.position_m"]),
    "tao2019/wide_funnel_10ms": ("sampled", ["initial.mrp", "initial.position_m"]),
}
#: Steps of the differences, as shares of a number. One craft flies on its reference, with errors of the size of what
#: doubles lose of an orbit's position: there a step has to stand out.
STEPS = {"satellites/slew_and_track": [1e-2, 3e-3]}


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FLIGHTS, *(pytest.param(one, marks=pytest.mark.long) for one in MORE | AWAY)])
def test_tangents_and_adjoints_of_the_first_1000_samples(name, monkeypatch):
    """Truth: differences of the same flight in long double, extrapolated, of steps in which no decision turns."""
    scheme, keys = (FLIGHTS | MORE | AWAY)[name]
    varied, engine, p, places, record, weights = flown(name, scheme, keys, away=0.01 if name in AWAY else 0.0)
    seed = varied.nominal.noise.seed
    found = engine.values(p, seed)
    assert np.array_equal(found.asked, record)  # word for word
    back = engine.adjoint(p, seed, weights, found)
    along = engine.along(p, seed, np.eye(len(p)))
    assert along is not None
    assert np.array_equal(along.asked, record)
    np.testing.assert_allclose(along.gradient(weights), back, rtol=1e-9, atol=1e-12)
    monkeypatch.setattr(engines, "_ROOM", 100 * along.asked.shape[1] * len(p))  # in parts of 100 samples
    assert engine.along(p, seed, np.eye(len(p))) is None
    np.testing.assert_allclose(engine.tangents(p, seed, weights, np.eye(len(p))), back, rtol=1e-9, atol=1e-12)
    if not long_double_flight.FINER:
        pytest.skip("long double is no finer than double here")
    finer = long_double_flight.LongDoubleFlights(varied)
    for i, direction in enumerate(np.eye(len(p), dtype=np.longdouble)):
        slopes = [
            float(richardson(
                lambda at: (weights * finer.record(at, seed)[:, places]).sum(), p, direction, np.longdouble(step)
            )[0])
            for step in max(abs(p[i]), 1e-3) * np.array(STEPS.get(name, [1e-7, 1e-8, 1e-9]))
        ]  # fmt: skip
        assert min(abs(back[i] / slope - 1) for slope in slopes) < 1e-6, varied.parameters.keys[i]


KEYS = ["initial.rate_rad_per_s", "scheme.observer_pinv.law.rate_gain"]


@pytest.mark.slow
def test_a_whole_flight():
    """Metrics have the values that the flight tells, and slopes that its differences have."""
    mission = casadi_gnc.load("huang2020/detumble")
    flight = casadi_gnc.vary(mission, KEYS, "observer_pinv").fly()
    for of in ("settling_time", "steady_rate", "torque_sample_sum"):
        slopes = casadi_gnc.sensitivities(mission, KEYS, of, "observer_pinv")
        found = slopes.at(temperature=1e-5)
        assert found.exact == pytest.approx(flight.metrics[of], rel=1e-12)
        assert abs(found.value - found.exact) <= found.slack + 1e-12 * abs(found.exact)
        back = slopes.at(temperature=1e-5, method="adjoint").gradient
        np.testing.assert_allclose(found.gradient, back, rtol=1e-10)
        nominal = slopes.varied.parameters.nominal
        for i, direction in enumerate(np.eye(len(nominal))):
            slope, _ = richardson(
                lambda p, s=slopes: s.at_row(p, temperature=1e-5).value, nominal, direction, 1e-6 * abs(nominal[i])
            )
            assert found.gradient[i] == pytest.approx(slope, rel=1e-5)
    assert found[KEYS[1]] == found.gradient[-1]
    assert found[KEYS[0]].shape == (3,)


def test_bad_input():
    mission = casadi_gnc.load("huang2020/detumble")
    for of, told in (("settling", "no metric and no requirement 'settling'"), ("A-1", "settling_time, steady_rate")):
        with pytest.raises(FlightError, match=told):
            casadi_gnc.sensitivities(mission, KEYS, of, "observer_pinv")
    with pytest.raises(FlightError, match="leads nowhere"):
        casadi_gnc.sensitivities(mission, "truth.mass", "settling_time", "observer_pinv")
    asked = Requirement("A", formula="always(duality_gap <= 1)")
    with pytest.raises(FlightError, match="report of itself, which has no derivative"):
        casadi_gnc.sensitivities(mission, "truth.inertia_factor", asked, "observer_robust")
