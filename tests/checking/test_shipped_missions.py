"""Checks of shipped missions: what the papers take as met, numbers by hand, no fault but where one is shown."""

import numpy as np
import pytest
from found_checks import only

import casadi_gnc
from casadi_gnc.checking import check, geometry
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load_document

WORSE = (
    "huang2020/slew funnel_pinv funnel.flown.mrp",
    "huang2020/slew pd_pinv settling.settling_time",
    "huang2019/free_axes pd_pinv settling.settling_time",
)


@pytest.mark.parametrize(
    "problem",
    [
        "huang2020/detumble",
        "huang2020/slew",
        "huang2019/free_axes",
        "sun2018/circular_orbit",
        "tao2019/wide_funnel_10ms",
        "shi2020/docking",
    ],
)
def test_the_corrected_missions_have_nothing_wrong_but_what_they_compare_with(problem):
    found = check(casadi_gnc.load(problem))
    wrong = {f"{problem} {each.scheme} {each.name}" for each in found if each.verdict in ("warn", "fail")}
    assert wrong == {each for each in WORSE if each.startswith(f"{problem} ")}
    assert all(each.source for each in found)
    assert all(each.consequence.endswith(".") and each.remedy.endswith(".") for each in found)


@pytest.mark.parametrize(
    ("problem", "name", "value", "limit"),
    [
        ("huang2019/nominal", "gains.theorem1.observer", 1.6, 2.0),  # lambda k2
        ("sun2018/as_printed", "gains.theorem2.coupling", 1.13e-3, 3.63),  # (28)
        ("huang2020/slew_as_printed", "gains.theorem1.compensation", 0.5, 12.49),  # 2 k4 k2, 3 k5^2
        ("huang2020/slew_as_printed", "gains.theorem1.filter", 2.4, 4.6e11),  # 16 k1, 3 r^2 tau
    ],
)
def test_conditions_that_the_papers_take_as_met(problem, name, value, limit):
    """Numbers computed from the papers by hand; a theorem's condition is a note."""
    mission = casadi_gnc.load(problem)
    schemes = [each.name for each in mission.schemes if hasattr(type(each.law), "errata") and list(each.law.checks())]
    found = only(check(mission, schemes[0]), name)
    assert found.value == pytest.approx(value, rel=5e-3)
    assert found.limit == pytest.approx(limit, rel=1e-2)
    assert found.verdict == "note"


@pytest.mark.parametrize(
    ("corner", "torque"),
    [((-1, -1, -1), 0.542), ((1, -1, -1), 0.640), ((1, -1, 1), 0.528), ((1, 1, -1), 0.544), ((-1, 1, 1), None)],
)
def test_torque_that_the_corners_of_the_mass_centre_ask_for(corner, torque):
    """Huang and Duan, section IV.B, by hand with the load at its largest; on the last corner it is less than 0.472 N m.

    The check looks from 15 s on, when the load has fallen by 1 %.
    """
    mission = casadi_gnc.load("huang2019/vertices", {"truth.centre_of_mass_error_m": [0.65 * sign for sign in corner]})
    found = only(check(mission, "observers_pinv"), "authority.allocated_demand")
    if torque is None:
        assert found.value < 0.472 / 0.5
    else:
        assert found.value == pytest.approx(torque / 0.5, rel=0.01)
    assert found.verdict == ("ok" if torque is None else "fail")
    assert only(check(mission, "observers_robust"), "authority.allocated_demand").verdict == "ok"


def test_faults_that_pass_are_not_borne_for_good():
    """For ten seconds 0.2 N m at 0.3 of the effectiveness would ask for 0.67 of 0.5 N m."""
    corner = {"truth.centre_of_mass_error_m": [-0.65, 0.65, 0.65]}
    plain, weak = (
        only(check(casadi_gnc.load("huang2019/vertices", changes), "observers_pinv"), "authority.allocated_demand")
        for changes in (corner, {**corner, "fault.4.effectiveness": 0.3})
    )
    assert weak.value == pytest.approx(plain.value, rel=1e-12)
    for_good = {**corner, "fault.4.effectiveness": 0.3, "fault.4.until_s": 1e3}
    lasting = only(
        check(casadi_gnc.load("huang2019/vertices", for_good), "observers_pinv"), "authority.allocated_demand"
    )
    assert lasting.verdict == "fail"


def test_no_accuracy_weight_bears_faults_of_wheels_and_a_far_mass_centre():
    """h of some 1e4 for 65 cm, of less than 100 for the faults (worst eigenvalues -1.44 and -3.65 at large h)."""
    soft, stiff = (
        casadi_gnc.load("huang2019/wheel_faults", {"scheme.observers_robust.allocation.accuracy_weight": h})
        for h in (30.0, 1e6)
    )
    assert only(check(soft, "observers_robust"), "allocation.sign").verdict == "ok"
    turned = only(check(stiff, "observers_robust"), "allocation.sign")
    assert (turned.verdict, turned.value) == ("fail", pytest.approx(-3.65, abs=0.01))
    assert only(check(soft, "observers_robust"), "allocation.weight_window").verdict == "ok"
    far = {
        "scheme.observers_robust.allocation.centre_of_mass_error_m": [0.65] * 3,
        "scheme.observers_robust.torque_limit_N_m": [0.5] * 3,
    }
    window = only(check(casadi_gnc.load("huang2019/wheel_faults", far), "observers_robust"), "allocation.weight_window")
    assert window.verdict == "fail"
    assert window.value < 0.1


def test_inertias_and_rotations():
    assert geometry.triangle("a", np.diag([1.0, 1.0, 2.0])).value == pytest.approx(0.0, abs=1e-15)  # a plate
    assert geometry.triangle("a", np.diag([1.0, 1.0, 2.1])).verdict == "fail"
    assert geometry.triangle("a", np.diag([-0.1, 1.0, 1.0])).verdict == "fail"
    assert geometry.rotation("a", np.eye(3), "", "").verdict == "ok"
    assert geometry.rotation("a", np.diag([1.0, 1.0, -1.0]), "", "").value == pytest.approx(2.0)  # a mirror
    printed = only(check(casadi_gnc.load("huang2019/nominal"), "pd_pinv"), "geometry.configuration")
    assert (printed.verdict, printed.value) == ("warn", pytest.approx(0.764, abs=1e-3))


def test_wheels_store_what_pushes_for_long():
    """A torque of 0.01 N m about an axis of three orthogonal wheels of 0.338 kg m^2 for 120 s: 3.55 rad/s."""
    axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    document = read("huang2019/free_axes")
    data = document.data
    data["spacecraft"] |= {"wheels": {**data["spacecraft"]["wheels"], "axes": axes}}
    data["spacecraft"].pop("rotation_321_rad")
    data.pop("fault")
    data["environment"] = {"constant_torque_N_m": [0.01, 0.0, 0.0]}
    found = only(check(load_document(document), "pd_pinv"), "authority.wheel_speed")
    assert found.value == pytest.approx(0.01 * 120 / 0.338, rel=1e-6)


def test_actuators_that_turn_too_slowly_for_the_turn():
    """|omega(0)| = 0.88 rad/s under half a stroke of 3.75 mN: 1.65 mN/s."""
    found = only(
        check(
            casadi_gnc.load("huang2020/detumble", {"spacecraft.thrusters.max_force_rate_N_per_s": 1e-3}), "damping_pinv"
        ),
        "allocation.rate",
    )
    rate = np.linalg.norm(casadi_gnc.load("huang2020/detumble").start[3:])
    assert found.value == pytest.approx(rate * 3.75e-3 / 2, rel=1e-12)


def test_memory_that_rests_is_left_out_of_the_poles():
    """Of TwoObserverAttitude, the last attitude is only kept; a pole of zero would hide the slowest true one."""
    mission = casadi_gnc.load("huang2019/nominal")
    assert only(check(mission, "observers_pinv"), "sampling.closed_loop").value < -0.3
