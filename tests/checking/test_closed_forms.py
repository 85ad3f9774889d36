"""Truth of checks: closed forms of a cart on a line, and zero-order-hold theory."""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
import pytest
from found_checks import only
from scipy import signal

import casadi_gnc
from casadi_gnc.allocation import Direct
from casadi_gnc.checking import authority, check, funnels, noise, sampling
from casadi_gnc.checking.linear import LinearLoop, spectral_radius
from casadi_gnc.checks import Check, worst
from casadi_gnc.laws import Law, PerformanceFunnel
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.mission import Mission
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.scheme import Funnel, Scheme
from casadi_gnc.missions.timing import Timing
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
