"""Pulses of thrusters: what is delivered stays with what is asked, in formulas, in a long flight and on board."""

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from pydantic import ValidationError

import casadi_gnc
from casadi_gnc.allocation.pulses import Pulse, PulseModulation, Valves
from casadi_gnc.campaigns.engines import CompiledBatch, best_vectors
from casadi_gnc.errors import AllocationError, FlightError, ProblemError
from casadi_gnc.mathematics.jumps import Timed
from casadi_gnc.mechanics.firing import STANDARD_GRAVITY, FiringThrusters
from casadi_gnc.missions.parameters import vary
from casadi_gnc.problem_files.document import read
from casadi_gnc.vehicles.satellite import part_tables, pointing_checks
from casadi_gnc.vehicles.satellite.part_tables import ThrusterTable

PULSES = "satellites/thruster_pulses"
#: Whose forces are worked out here by another way.
PINV = {"scheme.1.allocation": {"method": "pinv"}}
PERIOD, MOST, LEAST, QUANTUM = 0.2, 1.0, 0.02, 0.005


@pytest.mark.parametrize(
    ("pulse", "bit"), [(Pulse(0.028, 0.007), 0.028), (Pulse(0.0, 0.02), 0.02), (Pulse(0.02, 0.01), 0.02), (Pulse(), 0)]
)
def test_what_is_carried_over_stays_within_half_a_bit(pulse, bit):
    most, asked = 2.5, ca.SX.sym("asked", 2)
    modulation, carried = PulseModulation((None, pulse), [9.0, most]), ca.SX.sym("carried")
    told, left = modulation(asked, modulation.memory.split(carried), PERIOD)
    step = ca.Function("step", [asked, carried], [told, left])
    generator = np.random.default_rng(3)
    wanted = generator.uniform(0, 1, 400) ** generator.choice([1, 6], 400) * most
    wanted[::37], wanted[::41] = 0.0, most
    found, rest = _run(step, wanted)
    widths = found[:, 1] * PERIOD / most
    assert np.array_equal(found[:, 0], wanted)  # it makes what it is told
    delivered = np.cumsum(found[:, 1]) * PERIOD
    assert np.abs(np.cumsum(wanted) * PERIOD - delivered - rest).max() < 1e-12
    assert np.abs(rest).max() <= 0.5 * bit * most + 1e-12
    assert widths.min() >= 0
    assert widths.max() <= PERIOD + 1e-15
    assert widths[widths > 0].min() >= pulse.least_on
    if pulse.quantum:
        steps = widths / pulse.quantum
        ends = np.isclose(widths, pulse.least_on) | np.isclose(widths, PERIOD)
        assert np.all(ends | np.isclose(steps, np.round(steps), atol=1e-9))


def _run(step, wanted):
    told, carried = [], [0.0]
    for each in wanted:
        pulses, left = step([each, each], carried[-1])
        told.append(np.array(pulses).ravel())
        carried.append(float(left))
    return np.array(told), np.array(carried[1:])


def test_width_alone_carries_nothing_over():
    modulation = PulseModulation((Pulse(0.02, 0.01, carries=False),), [1.0])
    told, left = modulation(ca.DM([0.049]), SimpleNamespace(impulse_carry=ca.DM([0.0])), PERIOD)
    assert float(ca.DM(told)) == 0.0  # 9.8 ms of 20 ms at least
    assert float(ca.DM(left)) == 0.0


@pytest.mark.parametrize(
    "valves", [Valves(((1, 2),)), Valves((), 2), Valves(((1, 2), (2, 4)), 2)], ids=["a pair", "two open", "both"]
)
def test_valves_wait_for_their_turn(valves):
    """Sample by sample against the same choice in Python; the impulse is all there, delivered or carried."""
    pulse, most, asked = Pulse(0.02, 0.005), 2.0, ca.SX.sym("asked", 5)
    modulation, carried = PulseModulation((None, *[pulse] * 4), [9.0] + [most] * 4, valves), ca.SX.sym("carried", 4)
    step = ca.Function("step", [asked, carried], modulation(asked, modulation.memory.split(carried), PERIOD))
    generator, left = np.random.default_rng(4), np.zeros(4)
    for each in generator.uniform(0, 0.25, (200, 5)) * most:
        wanted = each[1:] * PERIOD + left
        told, after = (np.array(part).ravel() for part in step(each, left))
        due = [i for i in np.argsort(-wanted, kind="stable") if wanted[i] / most >= 0.5 * pulse.least_on]
        opened: list[int] = []
        for i in due:
            forbidden = any({i + 1, j + 1} in ({*pair} for pair in valves.never_together) for j in opened)
            if not forbidden and len(opened) < (valves.open_at_most or 4):
                opened.append(int(i))
        assert sorted(opened) == np.flatnonzero(told[1:]).tolist()
        assert told[0] == each[0]
        assert np.abs(wanted - told[1:] * PERIOD - after).max() < 1e-12
        assert np.abs(after[opened]).max(initial=0.0) <= 0.5 * pulse.least_on * most + 1e-12
        left = after
    assert np.abs(left).max() <= most * PERIOD


def test_what_is_asked_beyond_all_turns_is_lost():
    """Two that exclude each other, both asked for all: c stops at one sample's worth."""
    modulation = PulseModulation([Pulse(), Pulse()], [1.0, 1.0], Valves(((0, 1),)))
    left = np.zeros(2)
    for _ in range(50):
        told, after = modulation(ca.DM([1.0, 1.0]), modulation.memory.split(ca.DM(left)), PERIOD)
        left = np.array(ca.DM(after)).ravel()
        assert sorted(np.array(ca.DM(told)).ravel()) == [0.0, 1.0]
    assert left.max() == pytest.approx(PERIOD)


@pytest.mark.parametrize(
    ("valves", "told"),
    [
        ({"never_together": [[1, 1]]}, "thruster 1 is paired with itself"),
        ({"never_together": [[1, 9]]}, "thruster 9 is not one of 8"),
        ({"open_at_most": 0}, "is 0, expected a number >= 1"),
        ({"open_at_most": 2, "choice": "together"}, "expected 3 or more for pulses chosen together"),
    ],
)
def test_bad_valves(valves, told):
    with pytest.raises(ProblemError, match=told):
        casadi_gnc.load(PULSES, changes={"valves": valves})


def test_open_time_of_each_step_is_exact_also_over_the_end_of_a_sample():
    """Pulses of any width and delay against the overlap of their intervals, worked out by interval arithmetic."""
    late, substeps = 0.033, 4
    zeros = ca.DM.zeros(3, 1)
    part = FiringThrusters(zeros, ca.DM([1, 0, 0]), [MOST], [0.0], [0.0], (True,), [late]).timed(PERIOD, PERIOD / 4)
    t, force, left = ca.SX.sym("t"), ca.SX.sym("force"), ca.SX.sym("left")
    opened = part.thrust(t, SimpleNamespace(pulse_left=left), SimpleNamespace(force=force))
    timed = Timed(opened, t, {"force": force, "left": left})
    middle = ca.SX.sym("middle")
    mean = ca.Function("mean", [t, middle, force, left], [timed.at(t, middle, {"force": force, "left": left})])
    step, before = PERIOD / substeps, 0.0
    for k, width in enumerate([0.19, 0.0, 0.005, 0.2, 0.2, 0.07]):
        for i in range(substeps):
            begin = k * PERIOD + i * step
            spans = [(k * PERIOD + late, width), ((k - 1) * PERIOD + late, before)]
            right = sum(max(0, min(a + w, begin + step) - max(a, begin)) for a, w in spans) / step
            for at in (begin, begin + step / 2, begin + step):  # the stages of a step, its end not the next one's begin
                assert abs(float(mean(at, begin + step / 2, MOST * width / PERIOD, before)) - right) < 1e-12
        before = width


def test_bad_pulses():
    pulse = {"position_m": [0.0, 0.0, 1.0], "direction": [1.0, 0.0, 0.0], "max_force_N": 1.0, "pulse": {}}
    with pytest.raises(ValidationError, match="a thruster that makes pulses is off in between; leave min_force_N out"):
        ThrusterTable.model_validate({**pulse, "min_force_N": 0.1})
    part = part_tables.thrusters([ThrusterTable.model_validate({**pulse, "pulse": {"delay_s": 0.2}})])
    with pytest.raises(FlightError, match=r"a pulse begins 0\.2 s late, expected less than the sample period, 0\.2 s"):
        part.timed(0.2, 0.1)
    with pytest.raises(FlightError, match='thrusters make one pulse a sample; fly in mode "sampled"'):
        part.timed(0.0, 0.0)


@pytest.mark.slow
def test_a_thousand_seconds_of_pulses():
    """Every thruster within half a least bit of what was asked, at every sample; what is asked is worked out here."""
    mission = casadi_gnc.load(PULSES, changes=PINV)
    flight = casadi_gnc.fly(mission, decimation=1)
    step = mission.timing.sample_period
    assert flight.time[-1] >= 1000.0 - step
    made: Any = mission.scheme().actuation.effectiveness
    asked = np.clip(np.linalg.pinv(np.array(made)) @ flight["limited"].T, 0.0, MOST).T
    told, carry = flight["force"], flight["impulse_carry"]
    widths = told * PERIOD / MOST
    assert widths[widths > 0].min() >= LEAST - 1e-15
    assert np.abs(widths / QUANTUM - np.round(widths / QUANTUM)).max() < 1e-9
    behind = np.cumsum(asked, axis=0) * step - np.cumsum(told, axis=0) * step
    assert np.abs(behind - carry).max() < 1e-9  # the sums' own rounding
    assert np.abs(behind).max() <= 0.5 * LEAST * MOST + 1e-9
    # What truly came out: all pulses ended in their sample, but for the force that still falls from the last.
    delivered = flight["impulse"]
    falling = 0.006 * flight["thrust"]
    due = np.vstack([np.zeros(8), np.cumsum(told, axis=0)[:-1] * step])
    assert np.abs(delivered + falling - due).max() < 1e-9
    assert (widths.max(axis=1) <= step - 0.01).all()
    assert np.abs(np.vstack([np.zeros(8), np.cumsum(asked, axis=0)[:-1] * step]) - delivered).max() <= 0.0101
    used = delivered.sum(axis=1) / (220.0 * STANDARD_GRAVITY)
    assert np.abs(flight["propellant"].ravel() - used).max() < 1e-15 + 1e-12 * used[-1]
    assert flight.metrics["propellant_kg"] == pytest.approx(used[-1], rel=1e-12)
    assert flight["pointing_error_deg"][-500:].max() < 0.2
    # On board the pulses are the same words.
    controller = mission.controller()
    for t, mrp, rate, pulses in zip(flight.time[:300], flight["mrp"], flight["rate"], told, strict=False):
        assert np.array_equal(controller.step(t, mrp=mrp, rate=rate)["force"], pulses)


@pytest.mark.slow
def test_a_flight_keeps_the_rules_of_its_valves():
    """At every sample, and on board in the same words; the attitude is held with three valves at most."""
    valves = {"never_together": [[1, 2], [5, 6]], "open_at_most": 3}
    mission = casadi_gnc.load(PULSES, changes={**PINV, "valves": valves, "timing.duration_s": 100.0})
    flight = casadi_gnc.fly(mission, decimation=1)
    opened = flight["force"] > 0
    assert opened.sum(axis=1).max() == 3
    for first, second in valves["never_together"]:
        assert not np.any(opened[:, first - 1] & opened[:, second - 1])
        assert opened[:, first - 1].any()
        assert opened[:, second - 1].any()
    assert flight["pointing_error_deg"][-50:].max() < 0.2
    controller = mission.controller()
    for t, mrp, rate, pulses in zip(flight.time[:300], flight["mrp"], flight["rate"], flight["force"], strict=False):
        assert np.array_equal(controller.step(t, mrp=mrp, rate=rate)["force"], pulses)
    craft: Any = mission.craft
    said = pointing_checks.checks(craft, mission, mission.scheme(), np.radians(0.2))
    assert "authority.pulse_limit_cycle" not in [check.name for check in said]  # nothing is promised of those that wait


@pytest.mark.parametrize("pulse", [Pulse(0.3), Pulse(0.0, 0.3)])
def test_pulses_longer_than_a_period_are_refused(pulse):
    modulation = PulseModulation([pulse], [1.0])
    with pytest.raises(AllocationError, match=r"thruster 1: the .* is 0.3 s, expected 0 to the period, 0.2 s"):
        modulation(ca.DM([0.5]), modulation.memory.split(ca.DM([0.0])), PERIOD)


@pytest.mark.parametrize(
    ("pulse", "near"),
    [
        (Pulse(0.03, 0.007), "0.028 or 0.035"),
        (Pulse(0.004, 0.006), "0.006"),
        (Pulse(0.1, 1 / 32768), "0.0999755859 or"),
    ],
)
def test_a_quantum_that_cannot_make_the_least_width_is_refused(pulse, near):
    with pytest.raises(AllocationError, match=f"no whole number of quanta of .* s makes the least width.*give {near}"):
        PulseModulation([pulse], [1.0]).check(PERIOD)


def test_a_least_width_of_whole_quanta_is_taken_as_it_is_written():
    PulseModulation([Pulse(0.0999755859, 1 / 32768), Pulse(0.06, 0.02), Pulse(0.07, 0.01)], [1.0] * 3).check(PERIOD)


def test_a_mission_of_pulses_longer_than_a_period_is_refused_and_fails_the_check(tmp_path):
    own, shipped = tmp_path / "long.toml", read(PULSES).path.read_text(encoding="utf-8")
    own.write_text(shipped.replace("least_on_s = 0.02", "least_on_s = 0.5"))
    with pytest.raises(ProblemError, match=r"thruster 1: the least width is 0.5 s, expected 0 to the period, 0.2 s"):
        casadi_gnc.load(own)
    (found,) = [each for each in casadi_gnc.check(own) if each.name == "sampling.pulse_width"]
    assert (found.verdict, found.value, found.limit) == ("fail", 0.5, PERIOD)


@pytest.mark.slow
@pytest.mark.parametrize("choice", ["each", "together"])
def test_pulses_have_the_same_words_on_both_engines(choice):
    valves = {"never_together": [[1, 2]], "choice": choice}
    mission = casadi_gnc.load(PULSES, changes={**PINV, "valves": valves}).with_timing(duration=10.0)
    c, vm = (casadi_gnc.fly(mission, engine=engine, maths="libm").samples for engine in ("c", "vm"))
    assert np.array_equal(c, vm)


@pytest.mark.slow
@pytest.mark.parametrize("least_on", [LEAST, 0.12])
def test_the_limit_cycle_that_is_checked_bounds_the_flown_one(least_on):
    """About its mean the attitude stays within the bound, and comes near: pulses six times as long swing more."""
    changes = {f"thruster.{i}.pulse.least_on_s": least_on for i in range(1, 9)} | {
        "slosh.1.mass_kg": 0.1,
        "slosh.2.mass_kg": 0.1,
    }
    mission = casadi_gnc.load(PULSES, changes={**PINV, **changes})
    craft: Any = mission.craft
    (check,) = pointing_checks.checks(craft, mission, mission.scheme(), np.radians(0.2))
    assert check.verdict == ("ok" if least_on == LEAST else "warn")
    late = casadi_gnc.fly(mission, decimation=1)["mrp"][1500:]
    swing = 4 * np.degrees(np.linalg.norm(late - late.mean(axis=0), axis=1).max())
    assert 0.05 * check.value < swing <= check.value


@pytest.mark.slow
def test_pulses_have_the_same_words_in_vector_lanes():
    """Flights side by side, each with pulses of its own."""
    mission = casadi_gnc.load(PULSES, changes={**PINV, "timing.duration_s": 60.0})
    varied = vary(mission, ["thruster.1.pulse.quantum_s", "thruster.2.pulse.least_on_s"])
    values = np.array([[0.005, 0.02], [0.003, 0.01], [0.02, 0.05], [0.007, 0.03], [0.005, 0.02]])
    seeds = np.full(len(values), 7, dtype=np.uint64)
    lanes = CompiledBatch(varied, vectors=best_vectors(), threads=1).fly(values, seeds)
    alone = CompiledBatch(varied, vectors="none", threads=1).fly(values, seeds)
    assert (lanes.words == alone.words).all()
    assert len(np.unique(lanes.words, axis=0)) == 4
