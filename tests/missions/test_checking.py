"""Truth: closed forms of simple plants, zero-order-hold theory, and the commands as a user runs them."""

import json
import os
import re
import subprocess
import sys
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from scipy import signal

import casadi_gnc
from casadi_gnc.allocation import Direct
from casadi_gnc.checking import authority, check, funnels, geometry, noise, sampling
from casadi_gnc.checking.linear import LinearLoop, spectral_radius
from casadi_gnc.checks import Check, worst
from casadi_gnc.laws import Law, PerformanceFunnel
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.scheme import Funnel, Scheme
from casadi_gnc.missions.timing import Timing
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load_document
from casadi_gnc.signals import Layout, Signal

TURNED = ca.DM([[1.0, -1.0], [1.0, 1.0]]) / 2**0.5
STATE = Layout((Signal("place", 1, "m", limit=1e3), Signal("speed", 1, "m/s", limit=1e3)))
EFFORT = Layout((Signal("force", 1, "N"),))


@dataclass(frozen=True, eq=False)
class Cart(Plant):
    """A unit mass on a line, pushed by a constant force and a slow wave."""

    push: float = 0.0
    deviation: float = 0.0

    state = measurement = STATE
    inputs = EFFORT

    @property
    def noise(self):
        return Layout((Signal("sensor", 2),)) if self.deviation else Layout()

    def measure(self, t, x, noise):
        return x + self.deviation * noise if self.deviation else x

    def rate(self, t, x, actuators, noise):
        return ca.vertcat(x[1], actuators + self.push * ca.sin(0.01 * t))


class CartCraft(Craft):
    """The cart, pushed by at most 1 N, and where it begins."""

    push: float = 0.0
    deviation: float = 0.0
    begin: list[float] = [0.9, 0.0]

    def plant(self):
        return Cart(self.push, self.deviation)

    def start(self):
        return {"place": self.begin[:1], "speed": self.begin[1:]}

    def actuators(self):
        return Actuators(ca.DM.eye(1), [-1.0], [1.0], effort=EFFORT)

    def regulated(self, mission):
        return {"place": [0.0], "speed": [0.0]}


@dataclass(frozen=True, eq=False)
class Spring(Law):
    """Pull the cart home."""

    stiffness: float = 1.0
    damping: float = 2.0
    inputs = STATE

    def command(self, t, y, m):
        return -self.stiffness * y[0] - self.damping * y[1]


def mission(law=None, funnel=(), start=(0.9, 0.0), h=0.1, mode="sampled", **plant) -> Mission:
    craft = CartCraft(begin=start, **plant)
    actuation = Actuation.of(craft.actuators(), [1.0], Direct())
    made = law or Spring(hold=h if mode == "sampled" else 0.0)
    return Mission(
        name="cart",
        craft=craft,
        timing=Timing(mode, h, 100.0),
        schemes=(Scheme("spring", made, actuation),),
        funnels=funnel,
    )


def only(found: list[Check], name: str) -> Check:
    return next(each for each in found if each.name == name)


@pytest.mark.parametrize("damping", [0.5, 2.0, 19.0, 21.0])
def test_sampled_poles_are_those_of_zero_order_hold(damping):
    """Damping h > 2 is where the held loop of a unit mass with weak spring turns unstable."""
    a, b = np.array([[0.0, 1.0], [0.0, 0.0]]), np.array([[0.0], [1.0]])
    discrete, into, *_ = signal.cont2discrete((a, b, np.eye(2), np.zeros((2, 1))), 0.1)
    gain = np.array([[1.0, damping]])
    expected = np.abs(np.linalg.eigvals(discrete - into @ gain)).max()
    chosen = mission(Spring(damping=damping, hold=0.1))
    loop = LinearLoop(chosen, chosen.schemes[0], 0.0)
    assert spectral_radius(loop.matrix) == pytest.approx(expected, rel=1e-12)
    verdict = only(check(chosen), "sampling.closed_loop").verdict
    assert verdict == ("fail" if damping > 20 else "ok")
    # One sample late: the command that acts now was computed from the last state.
    late = np.block([[discrete, into], [-gain, np.zeros((1, 1))]])
    assert spectral_radius(loop.delayed) == pytest.approx(np.abs(np.linalg.eigvals(late)).max(), rel=1e-12)


def test_runge_kutta_limit_is_that_of_the_real_axis():
    """The method of order 4 is stable on the real axis to -2.785293563405282 (a root of its polynomial)."""
    edge = 2.785293563405282
    assert abs(sampling.amplification(np.array([-edge]))[0]) == pytest.approx(1.0, abs=1e-12)
    for share, verdict in ((0.99, "ok"), (1.01, "fail")):
        fast = share * edge / 0.1
        chosen = mission(Spring(stiffness=fast, damping=fast + 1.0), mode="continuous")  # poles -1 and -fast
        assert only(check(chosen), "sampling.runge_kutta").verdict == verdict


def test_rounding_of_an_undamped_mode_does_not_hide_the_integrator():
    """A mode of 50 rad/s at 0.1 s: the step multiplies it by some 20, whichever way its damping is rounded."""
    for damping in (0.0, -1e-9):
        chosen = mission(Spring(stiffness=2500.0, damping=damping), mode="continuous")
        assert only(check(chosen), "sampling.runge_kutta").value == pytest.approx(21.5, rel=0.02)


def test_a_growing_loop_fails_in_both_modes():
    for mode in ("sampled", "continuous"):
        chosen = mission(Spring(stiffness=-1.0, hold=0.1 if mode == "sampled" else 0.0), mode=mode)
        assert only(check(chosen), "sampling.closed_loop").verdict == "fail"


def box(width: float) -> Funnel:
    return Funnel("place", PerformanceFunnel(*(ca.DM([v]) for v in (width, width, 0.05, 1.0, 1.0))))


def test_braking_in_a_box_needs_v_squared_over_two_distances():
    """From 0.5 with speed 0.4 towards the wall at 1: 0.4^2 / (2 x 0.5) = 0.16 of the 1 N that there is."""
    chosen = mission(funnel=(box(1.0),), start=(0.5, 0.4))
    share = funnels.needed_share(chosen, chosen.schemes[0], chosen.funnels[0])
    assert share == pytest.approx(0.16, rel=0.05)  # the wall is watched on a grid of 1.2 s


def test_constant_push_bends_a_spring_by_push_over_stiffness():
    chosen = mission(funnel=(box(0.5),), push=0.3)
    use = funnels.floor_use(chosen, chosen.schemes[0], chosen.funnels[0])
    # sin(0.01 t) peaks inside the last half of 100 s at sin(1) = 0.841; the lag is damping/stiffness x 0.01.
    assert use == pytest.approx(0.3 * np.sin(1.0) / 0.5, rel=0.03)


def test_static_demand_is_the_push_over_the_limit():
    for push, verdict in ((0.5, "ok"), (1.3, "fail")):
        chosen = mission(push=push)
        found = only(check(chosen), "authority.static_demand")
        assert found.value == pytest.approx(push * np.sin(1.0), rel=1e-2)
        assert found.verdict == verdict


def test_static_demand_looks_between_the_extremes_of_single_axes():
    """A load that turns at 0.8 N before two actuators of 0.7 N at 45 degrees: worst along an actuator, 0.8/0.7."""

    @dataclass(frozen=True, eq=False)
    class Plane(Cart):
        state = measurement = Layout((Signal("place", 2, "m", limit=1e3), Signal("speed", 2, "m/s", limit=1e3)))
        inputs = Layout((Signal("push", 2, "N"),))

        def rate(self, t, x, actuators, noise):
            load = 0.8 * ca.vertcat(ca.cos(0.0628 * t), ca.sin(0.0628 * t))
            return ca.vertcat(x[2:], ca.mtimes(TURNED, actuators) + load)

    @dataclass(frozen=True, eq=False)
    class Springs(Spring):
        inputs = Plane.state

        def command(self, t, y, m):
            return -y[:2] - 2 * y[2:]

    class PlaneCraft(Craft):
        def plant(self):
            return Plane()

        def start(self):
            return {"place": [0.0] * 2, "speed": [0.0] * 2}

        def actuators(self):
            return Actuators(TURNED, [-0.7] * 2, [0.7] * 2, effort=Layout((Signal("force", 2, "N"),)))

        def regulated(self, mission):
            return self.start()

    craft = PlaneCraft()
    actuation = Actuation.of(craft.actuators(), [5.0] * 2, Direct())
    chosen = replace(mission(), craft=craft, schemes=(Scheme("springs", Springs(hold=0.1), actuation),))
    found = only(check(chosen), "authority.static_demand")
    assert found.value == pytest.approx(0.8 / 0.7, rel=1e-3)  # the grid of times passes within 1 degree of it
    assert found.verdict == "fail"


def test_noise_share_is_gain_times_deviation():
    chosen = mission(Spring(stiffness=3.0, damping=4.0, hold=0.1), deviation=0.1)
    assert noise.command_deviation(chosen, chosen.schemes[0]) == pytest.approx([0.5], rel=1e-12)
    assert only(check(chosen), "noise.authority").verdict == "warn"
    assert noise.measurement_deviation(chosen) == pytest.approx([0.1, 0.1], rel=1e-12)


def test_attainable_share_is_that_of_the_attainable_set():
    """The largest cube of the paper's thrusters, as the room of allocation finds it by other means."""
    from casadi_gnc.allocation import AllocationProblem
    from casadi_gnc.allocation.attainable import attainable

    chosen = casadi_gnc.load("huang2020/slew")
    actuation = chosen.schemes[0].actuation
    problem = AllocationProblem(np.array(actuation.effectiveness), lower=actuation.lower, upper=actuation.upper)
    cube = attainable(problem, np.ones(3)).nominal.box[0]
    share = authority.attainable_share(chosen, chosen.schemes[0])
    assert share == pytest.approx(cube / actuation.limit_above[0], rel=1e-6)


def test_verdicts_are_computed():
    limit = Check("a", 1.0, 2.0, "", "fail", "", "")
    assert (limit.verdict, limit.margin) == ("ok", 1.0)
    assert replace(limit, value=3.0).verdict == "fail"
    assert replace(limit, value=float("nan")).verdict == "fail"
    assert replace(limit, at_least=True).verdict == "fail"
    assert worst([limit, replace(limit, value=3.0, otherwise="note")]) == "note"
    assert worst([]) == "ok"


#: What is flown beside the corrected schemes to show what goes wrong without them; their flights are in docs/.
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


def command(*arguments: str, columns: str = "100") -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "casadi_gnc.cli.main", "check", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "COLUMNS": columns, "PYTHONIOENCODING": "utf-8"},
    )


def test_command_finds_the_slew_as_printed_and_draws(tmp_path):
    told = command("huang2020/slew_as_printed", "--json", "--figures", str(tmp_path))
    assert told.returncode == 1
    assert (tmp_path / "checks.png").stat().st_size > 10_000
    found = {(c["scheme"], c["name"]): c for c in json.loads(told.stdout)["checks"]}
    for name in ("gains.anti_windup", "funnel.floor.mrp", "sampling.closed_loop"):
        assert found["funnel_pinv", name]["verdict"] == "fail"
    assert found["funnel_pinv", "funnel.floor.mrp"]["value"] == "inf"
    box_share = found["funnel_pinv", "authority.virtual_control"]
    assert box_share["verdict"] == "note"
    assert box_share["value"] == pytest.approx(5.16e-4 / 1.5e-3, rel=1e-2)
    for theorem in ("compensation", "filter"):
        assert found["funnel_pinv", f"gains.theorem1.{theorem}"]["verdict"] == "note"


@pytest.mark.slow
def test_command_keeps_names_and_numbers_whole_in_80_columns():
    told = command("sun2018/circular_orbit", columns="80")
    assert told.returncode == 0
    table = [line for line in told.stdout.splitlines() if line.startswith(("│", "┃"))]
    assert max(map(len, table)) <= 80
    assert "numbers.resolution.position_error" in told.stdout
    assert "…" not in told.stdout
    assert "…" not in command("sun2018/circular_orbit", columns="40").stdout


def test_command_says_what_a_law_refuses(tmp_path):
    """Shi et al.'s baseline at 10 Hz: its gain of 2519 N s/m bears 2 x 28.57/2519.5 = 22.7 ms at most."""
    text = read("shi2020/docking_as_printed").text
    path = tmp_path / "slow.toml"
    path.write_text(
        re.sub(r'mode = "continuous"\nsample_period_s = \S+', 'mode = "sampled"\nsample_period_s = 0.1', text)
    )
    told = command(str(path), "--scheme", "dobc", "--json")
    assert told.returncode == 1
    found = {c["name"]: c for c in json.loads(told.stdout)["checks"]}
    assert found["sampling.hold"]["limit"] == pytest.approx(2 * 28.571 / 2519.5, rel=0.02)
    assert found["sampling.closed_loop"]["value"] == pytest.approx(7.8, abs=0.05)


@pytest.mark.slow
def test_command_reads_a_synthesis_and_names_what_cannot_be_met():
    told = command("shi2020/as_printed")
    assert told.returncode == 1
    assert "'(26) input'" in told.stdout
    assert command("shi2020/synthesis").returncode == 0


@pytest.mark.slow
def test_command_refuses_what_it_cannot_check(tmp_path):
    told = command("huang2020/allocation")
    assert (told.returncode, told.stdout) == (2, "")
    assert 'check takes a file of kind "mission" or "synthesis"' in told.stderr
    told = command("huang2020/detumble", "--scheme", "nobody")
    assert told.returncode == 2
    assert "no scheme 'nobody'" in told.stderr
    told = command("huang2020/detumble", "--figures", str(tmp_path), "--format", "txt")
    assert told.returncode == 2
    assert "'txt' is not one of 'png', 'svg', 'pdf'" in told.stderr
