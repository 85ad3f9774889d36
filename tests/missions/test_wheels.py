"""The numbers of Huang and Duan (2019) as re-derived, and an oracle written by hand."""

from dataclasses import replace
from functools import cache
from itertools import product

import casadi as ca
import numpy as np
import pytest
import wheels_numpy as oracle
from other_truths import with_plant

import casadi_gnc
from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.allocation.faults import with_faults, worst_alignment
from casadi_gnc.mathematics.noise import uniforms
from casadi_gnc.mechanics import reaction_wheels
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.status import StepStatus

#: A scheme or more of every mission: all laws, both allocations, both modes.
FLIGHTS = [
    ("nominal", "observers_robust"),
    ("nominal", "pd_pinv"),
    ("nominal", "finite_time_pinv"),
    ("tough", "observers_pinv"),
    ("vertices", "observers_robust"),
    ("wheel_faults", "observers_soft"),
    ("fault_free", "observers_pinv"),
    ("free_axes", "observer_pinv"),
]
PRINTED_NOISE = {
    "mrp_deviation": 2e-3,
    "mrp_factor_deviation": 5e-3,
    "rate_deviation_rad_per_s": 2e-3,
    "rate_factor_deviation": 5e-3,
}
#: Effectiveness on the wheels, C_0 Jw, of the paper's configuration.
C0_JW = oracle.R_PRINTED @ (oracle.C_BAR - 2.0) * oracle.JW


def mission(name: str, edit=lambda data: None) -> casadi_gnc.Mission:
    """Return a shipped mission whose data were edited."""
    document = read(f"huang2019/{name}")
    data = document.data
    edit(data)
    return load_document(document)


def fly(craft: casadi_gnc.Mission, scheme: str, **options):
    """Fly on the virtual machine: for one flight of a minute that is quicker than a compiler."""
    return casadi_gnc.fly(craft, scheme, engine="vm", **options)


@cache
def flown(name: str, scheme: str):
    return fly(casadi_gnc.load(f"huang2019/{name}"), scheme)


def set_deviations(data, values) -> None:
    data["sensors"] = dict(values)


# The loop written by hand.


def test_flight_is_the_hand_written_one():
    """The whole of IV.A without noise. Saturation and faults amplify rounding some 1e3 times."""
    flight = fly(mission("nominal", lambda d: set_deviations(d, {})), "observers_pinv")
    by_hand = oracle.fly(1201)
    for ours, theirs, tolerance in (("mrp", "mrp", 1e-11), ("rate", "rate", 1e-11), ("wheel_speed", "speed", 1e-9)):
        assert np.allclose(flight[ours], by_hand[theirs], rtol=0, atol=tolerance), ours
    assert np.allclose(flight["limited"], -by_hand["uc"], atol=1e-9)  # on the body, not on the wheels


def drawn(seed: int, samples: int) -> np.ndarray:
    """Normal numbers of every sample by Box and Muller's formula: scale and axes of attitude, then of rate."""
    rows = []
    for k in range(samples):
        u = uniforms(seed, k, 8).reshape(4, 2)
        radius, angle = np.sqrt(-2 * np.log(u[:, 0])), 2 * np.pi * u[:, 1]
        rows.append(np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]).ravel())
    return np.array(rows)


def test_noisy_flight_is_the_hand_written_one():
    """Noise is held over a sample, all stages of the integrator included."""
    scaled = {key: 0.05 * value for key, value in PRINTED_NOISE.items()}
    flight = fly(mission("vertices", lambda d: set_deviations(d, scaled)), "observers_pinv")
    deviations = np.array([2.5e-4, 1e-4, 1e-4, 1e-4] * 2)
    by_hand = oracle.fly(
        1501, centre_error=[-0.65] * 3, j0=0.6 * oracle.J, umax=0.5, scale=10, noise=drawn(1, 1501) * deviations
    )
    assert np.allclose(flight["mrp"], by_hand["mrp"], rtol=0, atol=1e-9)
    assert np.allclose(flight["wheel_speed"], by_hand["speed"], rtol=0, atol=1e-7)


@pytest.mark.parametrize(("name", "scheme"), FLIGHTS)
def test_virtual_machine_and_c_agree_word_for_word(name, scheme):
    """Noise and faults included: 20 s see every fault begin, and one end."""
    short = casadi_gnc.load(f"huang2019/{name}").with_timing(duration=20.0)
    machine = casadi_gnc.fly(short, scheme, engine="vm")
    compiled = casadi_gnc.fly(short, scheme, maths="libm")
    assert compiled.made["engine"] == "c"
    assert np.array_equal(machine.samples.view(np.uint64), compiled.samples.view(np.uint64))
    assert machine.metrics == compiled.metrics
    assert machine.statuses == compiled.statuses


# Section IV.A.


@pytest.mark.parametrize("scheme", ["observers_robust", "observers_pinv"])
def test_nominal_settles_as_printed_with_a_twentieth_of_the_noise(scheme):
    """Printed: |sigma| < 2e-4 and |omega| < 1e-3 after 50 s. An independent simulation: 49.2 to 52.1 s over seeds."""
    flight = flown("nominal", scheme)
    assert 49 <= flight.metrics["settling_time"] <= 51
    assert flight.metrics["steady_attitude"] < 1.3e-4
    still = np.abs(flight["rate"]).max(axis=1) < 1e-3
    assert flight.time[still][0] < 50
    assert np.all(still[flight.time > 52])


@pytest.mark.parametrize("scheme", ["observers_robust", "observers_pinv"])
def test_nominal_is_not_kept_with_the_printed_noise(scheme):
    """Standard deviations of 0.002 at 10 Hz leave some 1e-2, 50 to 300 times what is printed."""
    flight = fly(mission("nominal", lambda d: set_deviations(d, PRINTED_NOISE)), scheme)
    assert flight.metrics["settling_time"] is None
    assert flight.metrics["steady_attitude"] > 5e-3
    assert np.sqrt(np.mean(flight["mrp"][600:] ** 2)) > 10 * 2e-4


def test_pd_is_left_with_the_static_error_that_the_fault_forces():
    """0.2 N m over half of 14 N m: 2.86e-2; printed 6e-3."""
    error = flown("nominal", "pd_pinv").metrics["steady_attitude"]
    assert error == pytest.approx(0.2 / (0.5 * 14), rel=0.05)
    assert error > 4 * 6e-3


def test_reconstructed_finite_time_law_is_of_the_printed_order():
    """Printed < 4e-4; the reconstruction 7e-4 (ours) to 8e-4 (independently)."""
    assert 4e-4 < flown("nominal", "finite_time_pinv").metrics["steady_attitude"] < 1e-3


def test_robust_allocation_costs_more_and_not_less():
    """Tables 2 and 3: a mean torque of 0.2435 N m is below the 0.4 N m that cancel the bias; and the ratio of wheel
    acceleration to torque, printed as 15.6 to 18.6, cannot exceed the norm of the pseudo-inverse."""
    robust, pinv = (flown("nominal", name).metrics for name in ("observers_robust", "observers_pinv"))
    assert min(robust["mean_torque"], pinv["mean_torque"]) > 0.4
    assert pinv["mean_acceleration"] / pinv["mean_torque"] < np.linalg.norm(np.linalg.pinv(C0_JW), 2) < 3
    assert robust["mean_acceleration"] / pinv["mean_acceleration"] == pytest.approx(2.7, abs=0.2)


def test_tough_condition():
    """Printed 75 s and 5e-4; PD 0.015. Independently simulated: 77 to 83 s; PD 2.4e-2 to 2.9e-2."""
    assert flown("tough", "observers_robust").metrics["settling_time"] == pytest.approx(80, abs=4)
    assert flown("tough", "observers_robust").metrics["steady_attitude"] < 2.5e-4
    assert 2e-2 < flown("tough", "pd_pinv").metrics["steady_attitude"] < 3e-2
    assert 3e-4 < flown("tough", "finite_time_pinv").metrics["steady_attitude"] < 1e-3


def test_sampled_controller_settles_too():
    """What flies: 0.1 s between samples."""
    for name, scheme in product(("nominal", "tough"), ("observers_robust", "observers_pinv")):
        flight = fly(casadi_gnc.load(f"huang2019/{name}"), scheme, mode="sampled")
        assert flight.metrics["settling_time"] < 70, (name, scheme)


def test_printed_bracket_loses_the_flight():
    """(36) as it stands adds accelerations to a torque: the loop's gain lacks the inertia."""

    def printed(data):
        set_deviations(data, {})
        data["scheme"][1]["as_printed"] = ["inertia_bracket"]

    assert fly(mission("nominal", printed), "observers_pinv").metrics["steady_attitude"] > 0.1


@pytest.mark.parametrize("mode", ["sampled", "continuous"])
def test_a_turn_through_the_shadow_set_claims_no_drift(mode):
    """MRPs that grow past 1 change to -s/n; without a fresh start of its observer that is a drift of 10/s and more."""

    def outwards(data):
        set_deviations(data, {})
        data.pop("fault")
        data["initial"] = {"mrp": [0.5, -0.4, 0.72], "rate_rad_per_s": [0.12, -0.1, 0.15]}

    flight = fly(mission("nominal", outwards), "observers_pinv", mode=mode)
    s = flight["mrp"]
    assert np.einsum("ij,ij->i", s[1:], s[:-1]).min() < -0.9  # it did change
    assert np.abs(flight["attitude_drift"]).max() < 5e-3  # the motion within a hold, sampled
    assert flight.metrics["settling_time"] < 40


def test_strange_measurements_leave_bounded_commands_and_recovery(rng):
    """2000 steps, a third of them with strange numbers; then good ones: memory finite, no bad status."""
    step = casadi_gnc.load("huang2019/free_axes_two_observers").step("observers_pinv")
    calm = np.zeros(10)
    state = {"good": calm, "m": np.zeros(15), "actuators": np.zeros(4)}
    for k in range(2000):
        y = rng.uniform(-0.5, 0.5, 10)
        if k % 3 == 0:
            y[rng.integers(10)] = rng.choice([np.nan, np.inf, -np.inf, 1e300, -1e300, 5e-324, 0.0, 2.0, 1e5])
        found = step(t=0.1 * k, y=y, **state)
        assert np.all(np.abs(np.array(found["actuators_next"])) <= 7.0), k
        state = {name: np.array(found[f"{name}_next"]).ravel() for name in state}
    for k in range(50):
        found = step(t=200 + 0.1 * k, y=calm, **state)
        state = {name: np.array(found[f"{name}_next"]).ravel() for name in state}
    assert np.all(np.isfinite(state["m"]))
    assert not int(found["status"]) & (StepStatus.MEASUREMENT_REPLACED | StepStatus.MEMORY_RESET)


# Section IV.B.

CORNERS = list(product((-0.65, 0.65), repeat=3))
FAILING = {(-0.65, -0.65, -0.65), (0.65, -0.65, -0.65), (0.65, -0.65, 0.65)}


def at_corner(corner, name="vertices", edit=lambda data: None) -> casadi_gnc.Mission:
    def change(data):
        data["truth"]["centre_of_mass_error_m"] = list(corner)
        edit(data)

    return mission(name, change)


@pytest.mark.parametrize("corner", CORNERS)
def test_robust_allocation_settles_at_every_corner_and_the_pseudo_inverse_not(corner):
    """Independently simulated: robust < 5e-4 at 77 to 82 s (76.2 to 81.9 s with this seed); pinv lost at three."""
    craft = at_corner(corner)
    robust, pinv = (fly(craft, name) for name in ("observers_robust", "observers_pinv"))
    assert 74 <= robust.metrics["settling_time"] <= 84
    assert robust.metrics["steady_attitude"] < 2.5e-4
    if corner in FAILING:
        assert pinv.metrics["steady_attitude"] > 0.3
    else:
        assert pinv.metrics["steady_attitude"] < 0.03


def test_the_torque_box_fails_and_not_stability():
    """The torque map keeps eigenvalues of 0.60 to 1.40, and with 0.75 N m the worst corner settles too."""
    pinv = np.linalg.pinv(C0_JW)
    maps = [oracle.R_PRINTED @ (oracle.C_BAR - 2 - np.array(v)[:, None]) * oracle.JW @ pinv for v in CORNERS]
    eigenvalues = np.array([np.linalg.eigvals(each) for each in maps])
    assert eigenvalues.real.min() == pytest.approx(0.60, abs=0.01)
    assert eigenvalues.real.max() == pytest.approx(1.40, abs=0.01)

    def roomier(data):
        for scheme in data["scheme"]:
            scheme["torque_limit_N_m"] = [0.75] * 3

    flight = fly(at_corner((-0.65,) * 3, edit=roomier), "observers_pinv")
    assert flight.metrics["steady_attitude"] < 1e-3


@pytest.mark.parametrize(("weight", "least", "most"), [(1e2, 0.1, 2.0), (1e3, 1e-3, 0.1), (1e4, 0, 2e-4)])
def test_the_claim_needs_a_large_weight(weight, least, most):
    """Not printed: h. Independently simulated: lost at 100, 2e-2 at 1e3 (ours 2e-3), 9e-5 at 1e4."""

    def weigh(data):
        data["scheme"][0]["allocation"]["accuracy_weight"] = weight

    flight = fly(at_corner((-0.65,) * 3, edit=weigh), "observers_robust")
    assert least <= flight.metrics["steady_attitude"] <= most


@pytest.mark.parametrize("corner", [CORNERS[0], CORNERS[5]])
def test_without_faults_the_allocation_makes_no_difference(corner):
    craft = at_corner(corner, "fault_free")
    for scheme in ("observers_robust", "observers_pinv"):
        assert fly(craft, scheme).metrics["steady_attitude"] < 1.5e-4


# Faults on the wheels.


def test_faults_on_the_wheels_reverse_the_claim():
    assert flown("wheel_faults", "observers_robust").metrics["steady_attitude"] > 0.3
    assert flown("wheel_faults", "observers_soft").metrics["steady_attitude"] < 2e-4
    assert flown("wheel_faults", "observers_pinv").metrics["steady_attitude"] < 2e-4

    def weigh(data):
        data["scheme"][0]["allocation"]["accuracy_weight"] = 300.0

    assert fly(mission("wheel_faults", weigh), "observers_robust").metrics["steady_attitude"] > 0.1


def test_faults_on_the_wheels_turn_the_torque_around():
    """Where h is large and no bound is met x = [C_0 Jw; 1']^-1 [u; 0] = B u.

    With two wheels at half strength C_0 Jw E B has an eigenvalue of -1.44; with the pseudo-inverse for B
    none is negative. `worst_alignment` tells the two apart before the flight.
    """
    balanced = np.linalg.inv(np.vstack([C0_JW, np.ones(4)]))[:, :3]
    half = np.diag([0.5, 0.5, 1.0, 1.0])
    assert np.linalg.eigvals(C0_JW @ half @ balanced).real.min() == pytest.approx(-1.44, abs=0.01)
    assert np.linalg.eigvals(C0_JW @ half @ np.linalg.pinv(C0_JW)).real.min() > 0
    robust = casadi_gnc.load("huang2019/wheel_faults").scheme("observers_robust").actuation.allocator.problem
    plain = AllocationProblem(robust.effectiveness, robust.lower, robust.upper, accuracy_weight=1e6, change_weight=0)
    weak = with_faults(plain, degraded={1: (0.5, 1.0), 2: (0.5, 1.0)})
    assert worst_alignment(robust, weak, directions=50).share < -0.5
    assert worst_alignment(plain, weak, directions=50).share > -0.3


def test_robust_answers_are_those_of_the_linear_limit():
    """h = 1e4 leaves a sum of 1.5 % of the largest acceleration; each is within 15 % of that of h -> inf."""
    flight = flown("nominal", "observers_robust")
    x, u = flight["wheel_acceleration"], flight["limited"]
    free = (np.abs(x).max(axis=1) < 6.9) & (flight.time > 50)
    balanced = np.linalg.inv(np.vstack([-C0_JW, np.ones(4)]))[:, :3]
    largest = np.abs(x[free]).max(axis=1)
    assert free.sum() > 500
    assert np.all(np.abs(x[free].sum(axis=1)) < 0.015 * largest)
    assert np.all(np.abs(x[free] - u[free] @ balanced.T).max(axis=1) < 0.15 * largest)
    assert not {StepStatus.ALLOCATION_INEXACT, StepStatus.ALLOCATION_FAILED} & flight.statuses.keys()


# Free axes.


def test_free_axes_with_all_of_the_printed_noise():
    """Without the observer of the attitude 1e-3 is kept; with it, as printed, ten times worse."""
    good, printed = flown("free_axes", "observer_pinv"), flown("free_axes_two_observers", "observers_pinv")
    assert good.metrics["settling_time"] < 30
    assert good.metrics["steady_attitude"] < 1.5e-3
    assert printed.metrics["steady_attitude"] > 5 * good.metrics["steady_attitude"]


def test_true_axes_under_the_papers_matrix_lose_the_fault_free_flight():
    """The mass centre that the pseudo-inverse is told of turns the torque around in one direction."""
    craft = mission("nominal", lambda data: data.pop("fault") and set_deviations(data, {}))
    body = craft.truth.body
    axes = reaction_wheels.free_axes(ca.DM(oracle.R_PRINTED), ca.DM(oracle.C_BAR))
    truth = replace(craft.truth, body=replace(body, wheels=replace(body.wheels, axes=axes)))
    wrong = fly(with_plant(craft, truth), "observers_pinv")
    right = fly(craft, "observers_pinv")
    assert wrong.metrics["steady_attitude"] > 0.1
    assert right.metrics["steady_attitude"] < 2e-5


def test_wheels_stay_within_their_speed_limit():
    """24 rad/s are needed; with 8 a wheel meets its limit, is held there and reported.

    On board nobody knows of the bias of 0.6 rad/s^2, which takes a wheel 0.06 rad/s too far in a sample.
    """

    def slower(data):
        data["spacecraft"]["wheels"]["max_speed_rad_per_s"] = 8.0

    craft = mission("free_axes", slower)
    for mode in ("sampled", "continuous"):
        flight = fly(craft, "observer_pinv", mode=mode)
        assert np.abs(flight["wheel_speed"]).max() <= 8.06
        assert StepStatus.WHEEL_SATURATED in flight.statuses
        assert StepStatus.DIVERGED not in flight.statuses
    assert StepStatus.WHEEL_SATURATED not in flown("free_axes", "observer_pinv").statuses


def test_allocation_against_weak_wheels_is_certified():
    def robust(data):
        data["scheme"][0]["allocation"] = {"method": "robust", "wheel_effectiveness": [0.5, 1.0]}

    craft = mission("free_axes", robust).with_timing(duration=30.0)
    assert len(craft.scheme("observer_pinv").actuation.allocator.problem.errors) == 16
    flight = fly(craft, "observer_pinv")
    assert not {StepStatus.ALLOCATION_INEXACT, StepStatus.ALLOCATION_FAILED} & flight.statuses.keys()
    assert np.all(flight["duality_gap"] <= 1.01e-8 * flight["allocation_cost"] + 1e-10)
