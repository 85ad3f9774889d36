"""Faults and profiles that jump in time: every stage of a step is on the same side, and order 4 stays."""

import itertools
from dataclasses import dataclass, replace

import casadi as ca
import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from scipy.integrate import solve_ivp

import casadi_gnc as gnc
from casadi_gnc.campaigns.engines import CompiledBatch, best_vectors
from casadi_gnc.checking import sampling
from casadi_gnc.delivery.vectors import CompiledPlant
from casadi_gnc.mathematics.jumps import Timed
from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.one_build import fly_case
from casadi_gnc.missions.parameters import vary

# A guest that jumps in every way that there is, and whose law does too.

JUMPS = (0.0, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0)


def push(t, middle):
    """Return what pushes the guest, between jumps: a pulse, a staircase, a sawtooth, a change of sign."""
    pulse = 2.0 * np.sin(3 * t) if 1.0 < middle <= 2.5 else 0.0
    return pulse + 0.3 * np.floor(middle) + (t - np.floor(middle)) + np.copysign(t, 1.5 - middle)


@dataclass(frozen=True, eq=False)
class Tank(gnc.Plant):
    late: float = 2.5
    state = gnc.Layout((gnc.Signal("level", 1, "m"),))
    measurement = gnc.Layout((gnc.Signal("level", 1, "m", limit=1e3),))
    inputs = gnc.Layout((gnc.Signal("pump", 1, "m/s"),))

    def rate(self, t, x, actuators, noise):
        pulse = ca.if_else(ca.logic_and(t > 1.0, t <= self.late), 2.0 * ca.sin(3 * t), 0.0)
        return -x + actuators + pulse + 0.3 * ca.floor(t) + ca.fmod(t, 1.0) + ca.copysign(t, 1.5 - t)


class TankCraft(gnc.Craft):
    late: float = 2.5

    def plant(self):
        return Tank(self.late)

    def start(self):
        return {"level": [0.5]}

    def belief(self):
        return None

    def actuators(self):
        return gnc.Actuators(ca.DM.eye(1), [-9.0], [9.0])


@dataclass(frozen=True, eq=False)
class Stepping(gnc.Law):
    """Command one thing before 2 s and another one after it, and remember what was measured."""

    pull: float = gnc.gain("1/s", "command per level", above=0.0)
    inputs = gnc.Layout((gnc.Signal("level", 1, "m"),))
    memory = gnc.Layout((gnc.Signal("sum", 1, "m s"),))

    def command(self, t, y, m):
        return ca.if_else(t >= 2.0, 1.0, -0.5) - self.pull * m

    def rate(self, t, y, m, wanted, achieved):
        return y - ca.if_else(t < 1.5, 0.0, t)


def tank(mode="continuous", period=0.1, **craft) -> gnc.Mission:
    made = gnc.Actuation.direct(gnc.Layout((gnc.Signal("flow", 1, "m/s"),)), [9.0])
    scheme = gnc.Scheme("one", Stepping(pull=0.4), made)
    return gnc.Mission(TankCraft(**craft), [scheme], gnc.Timing(mode, period, 4.0))


def tank_truth() -> float:
    """Return the level at 4 s, by an integrator that stops at the jumps and never looks across one."""
    z = np.array([0.5, 0.0])
    for begin, end in itertools.pairwise(JUMPS):
        middle = (begin + end) / 2

        def slope(t, z, middle=middle):
            wanted = (1.0 if middle >= 2.0 else -0.5) - 0.4 * z[1]
            return [-z[0] + wanted + push(t, middle), z[0] - (0.0 if middle < 1.5 else t)]

        z = solve_ivp(slope, (begin, end), z, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    return float(z[0])


def test_order_4_across_jumps_of_plant_and_law():
    truth = tank_truth()
    error = [abs(gnc.fly(tank(period=h))["level"][-1] - truth) for h in (0.1, 0.05, 0.025)]
    assert error[0] < 2e-5
    assert np.log2(np.divide(error[:-1], error[1:])) == pytest.approx([4, 4], abs=0.3)


@pytest.mark.parametrize("mode", ["sampled", "continuous"])
def test_engines_agree_on_every_jump(mode):
    mission = tank(mode)
    compiled = gnc.fly(mission, maths="libm", decimation=1)
    machine = gnc.fly(mission, engine="vm", decimation=1)
    assert compiled.made["engine"] == "c"
    assert np.array_equal(compiled.samples, machine.samples)
    if mode == "sampled":
        loop, at = mission.closed_loop(), mission.loop_start()
        for k in range(40):
            found = loop(t=0.1 * k, **at)
            at = {name: found[f"{name}_next"] for name in at}
        assert float(at["x"]) == pytest.approx(machine["level"][-1], rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("period", [0.1, 0.15], ids=["jumps at samples", "and inside steps"])
def test_what_steps_on_board_has_the_words_of_the_flight_across_jumps(period, tmp_path):
    """The controller by hand and as a unit in another tool, fed with what the flight measured; the law itself jumps."""
    mission = tank("sampled", period)
    flight = gnc.fly(mission, decimation=1)
    controller, plant = mission.controller(), CompiledPlant(mission, mission.scheme())
    path = gnc.generate_fmu(mission, tmp_path / "tank.fmu", name="tank")
    about = fmpy.read_model_description(str(path))
    places = {one.name: one.valueReference for one in about.modelVariables}
    unit = FMU2Slave(
        guid=about.guid, unzipDirectory=fmpy.extract(str(path), str(tmp_path / "unit")), modelIdentifier="tank",
        instanceName="one",
    )  # fmt: skip
    unit.instantiate()
    unit.setupExperiment(startTime=0.0)
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    commands = []
    for k in range(round(4.0 / period)):
        t, level = plant.measure(k)
        pump = controller.step(t, level=level)["pump"]
        unit.setReal([places["level"]], [level])
        unit.doStep(currentCommunicationPoint=k * period, communicationStepSize=period)
        assert pump == unit.getReal([places["pump"]])[0] == flight["pump"][k], (k, t)
        plant.advance(k, np.atleast_1d(pump))
        commands.append(pump)
    assert np.abs(np.diff(commands)).max() > 1.0  # the jump at 2 s is among them
    unit.terminate()
    unit.freeInstance()


# The shipped ones that jump.


def wheels(h, **changes) -> gnc.Mission:
    return gnc.load("huang2019/wheel_faults", changes).with_timing(mode="sampled", sample_period=h)


def advanced(mission, told, until) -> np.ndarray:
    """Return the plant's state after steps under a held command."""
    s, loop, h = (loop := Loop(mission, mission.scheme())).symbols(), loop, mission.timing.sample_period
    step = ca.Function("step", [s.x, s.t], [loop.held(s.t, s.x, ca.DM(told), mission.quiet())])
    count = round(until / h)
    return np.array(step.mapaccum(count)(ca.DM(mission.start), ca.DM(np.arange(count) * h).T))[:, -1]


def stopping(rate, start, ends) -> np.ndarray:
    """Return the state at the last end; `rate` is asked for a time, a state, and the middle of a piece."""
    x = np.array(start)
    for begin, end in itertools.pairwise(ends):
        middle = (begin + end) / 2
        found = solve_ivp(
            lambda t, x, m=middle: rate(t, x, m), (begin, end), x, method="DOP853", rtol=1e-12, atol=1e-13
        )
        x = found.y[:, -1]
    return x


def test_order_4_across_faults_of_wheels():
    """Wheel 3 is dead, with a bias, from 5 to 15 s; others are weak or biased for good: eqs (20), (21) by hand."""
    told = np.array([0.5, -0.3, 0.2, 0.1])
    sound, faulty = wheels(0.1, fault=[]), wheels(0.1)
    rate = sound.plant()

    def slope(t, x, middle):
        made = told.copy()
        for fault in faulty.craft.fault:
            until = np.inf if fault.until_s is None else fault.until_s
            if fault.from_s < middle < until:
                grown = 1 - np.exp(-fault.growth_per_s * (t - fault.from_s))
                made[fault.index - 1] -= (1 - fault.effectiveness) * grown * told[fault.index - 1]
                made[fault.index - 1] += fault.bias_rad_per_s2 * grown
        return np.array(rate(t, x, made)).ravel()

    truth = stopping(slope, sound.start, (0.0, 5.0, 10.0, 15.0, 20.0))
    error = [np.abs(advanced(wheels(h), told, 20.0) - truth).max() for h in (0.25, 0.125)]
    assert {fault.until_s for fault in faulty.craft.fault} == {None, 15.0}
    assert np.log2(error[0] / error[1]) == pytest.approx(4, abs=0.3)


def test_order_4_across_the_pieces_of_table_1():
    told = [0.0] * 3

    def docking(h, **changes):
        own = {"spacecraft.actuator": "force", "spacecraft.max_moment_A_m2": None, **changes}
        mission = gnc.load("shi2020/docking_as_printed", own, strict=False)
        return replace(mission, timing=gnc.Timing("sampled", h, 20.0))  # too slow for any law; none flies

    with_fault = docking(1.0)
    free, profile = docking(1.0, **{"fault.piece": []}), with_fault.truth.fault

    def slope(t, x, middle):
        rate = np.array(free.plant()(t, x, told)).ravel()
        for piece in profile.pieces:
            if piece.start < middle < piece.stop:
                share = piece.constant + piece.amplitude * np.sin(piece.rate * t + piece.phase)
                rate[3:6] += share * np.array(profile.force) / with_fault.truth.model.mass
        return rate

    truth = stopping(slope, free.start, (0.0, 2.0, 5.0, 10.0, 13.0, 15.0, 20.0))
    error = [np.abs(advanced(docking(h), told, 20.0) - truth).max() for h in (1.0, 0.5)]
    assert np.log2(error[0] / error[1]) == pytest.approx(4, abs=0.3)


def test_lanes_have_the_words_of_single_flights_across_jumps():
    mission = gnc.load("huang2019/wheel_faults", {"fault.4.from_s": 0.5, "timing.duration_s": 3.0})
    varied = vary(mission, ["fault.4.until_s", "fault.1.effectiveness"])
    values = np.array([[1.0, 0.5], [1.5, 0.4], [2.04, 0.6], [2.06, 0.5], [2.0, 0.5]])
    seeds = np.full(len(values), 7, dtype=np.uint64)
    lanes = CompiledBatch(varied, vectors=best_vectors(), threads=1).fly(values, seeds)
    assert (lanes.words == CompiledBatch(varied, vectors="none", threads=1).fly(values, seeds).words).all()
    alone = [fly_case(varied, case, 7, decimation=1).block("wheel_speed")[-1] for case in values]
    # A step of 0.1 s decides in its middle: 2.04 s is taken for 2.0 s, and 2.06 s for 2.1 s.
    first, later = alone[4][2], alone[3][2]
    assert alone[2][2] == first != later


# Where a jump lies inside a step.


def jumps(mission, scheme=None):
    found = list(sampling._jumps(mission, mission.scheme(scheme)))
    return found[0] if found else None


@pytest.mark.parametrize("until", [15.0, 14.999999999999998, 15.03, 14.1])
def test_check_tells_a_jump_inside_a_step(until):
    check = jumps(gnc.load("huang2019/wheel_faults", {"fault.4.until_s": until}))
    assert (check.verdict, check.value) == (("warn", 1.0) if until == 15.03 else ("ok", 0.0))
    assert ("changes at 15.03 s, inside a step of 0.1 s" in check.consequence) == (until == 15.03)


def test_check_looks_at_what_a_guest_decides():
    assert jumps(tank()).verdict == "ok"
    # Of 1, 1.5, 2, 2.5 and 3 s all but 2 s lie inside steps of 0.4 s, each in another one.
    assert jumps(tank(period=0.4)).value == 4
    assert jumps(tank(late=2.525)).value == 1
    assert jumps(gnc.load("huang2020/detumble")) is None


def test_only_decisions_on_time_alone_are_moved():
    t, x, p = ca.SX.sym("t"), ca.SX.sym("x"), ca.SX.sym("p")
    now, middle = ca.SX.sym("now"), ca.SX.sym("middle")

    def at(expression):
        timed = Timed(expression, t, {"x": x})
        found = timed.at(now, middle, {"x": x})
        return timed.decides, float(ca.Function("f", [now, middle, x, p], [found])(2.0, 0.9, 3.0, 1.0))

    assert at(ca.if_else(t > p, t, -t)) == (True, -2.0)
    assert at(ca.if_else(t > x, t, -t)) == (False, -2.0)
    assert at(ca.fmod(t, 1.0)) == (True, 2.0)
    assert at(ca.fmod(1.0, t)) == (False, 1.0)
    assert at(ca.remainder(t, 1.0)) == (True, 1.0)
    assert at(ca.floor(t) + ca.ceil(t)) == (True, 1.0)
    assert at(ca.copysign(x, t - p)) == (True, -3.0)
    assert at(ca.fabs(t - p) + ca.if_else(x > p, 1, 0)) == (False, 2.0)
