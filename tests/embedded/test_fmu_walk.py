"""Legal calls of FMI 2.0 in any order: the unit against a small model of the standard.

The model knows what was set, when samples are taken (in exact fractions) and with which inputs and gains each was; what
the controller answers to that history, the package's C says, called without the unit. Truth: the standard's text.
"""

import ctypes
import subprocess
import time
from dataclasses import dataclass, replace
from fractions import Fraction

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from casadi_gnc.delivery.fmu import generate_fmu

PERIOD = Fraction(1, 10)
GAINS = ("attitude_gain", "rate_gain")
STARTS = (0, Fraction(-35, 100), Fraction(5, 100), Fraction(12345678, 10000), 90_000_000, 1_700_000_000)
HISTORY = r"""
#include "slew.h"
int history(long count, const double *rows, double *outputs);
/* A row a sample: time, inputs, gains. The outputs are those after the last. */
int history(long count, const double *rows, double *outputs)
{
    slew_params params;
    slew_state state;
    slew_output out;
    long k;
    int i, refused = slew_init(&params);
    slew_reset(&state);
    for (k = 0; k < count; k++, rows += 9) {
        slew_input in;
        in.time = (slew_real)rows[0];
        for (i = 0; i < 3; i++) in.mrp[i] = (slew_real)rows[1 + i];
        for (i = 0; i < 3; i++) in.rate[i] = (slew_real)rows[4 + i];
        params.attitude_gain = (slew_real)rows[7];
        params.rate_gain = (slew_real)rows[8];
        refused |= slew_configure(&params);
        (void)slew_step(&state, &params, &in, &out);
    }
    for (i = 0; i < 12; i++) outputs[i] = (double)out.force[i];
    for (i = 0; i < 3; i++) outputs[12 + i] = (double)out.wanted[i];
    for (i = 0; i < 3; i++) outputs[15 + i] = (double)out.limited[i];
    outputs[18] = (double)out.status;
    return refused;
}
"""


class Unit:
    """A unit, unpacked, and the controller's C by itself."""

    def __init__(self, folder, real):
        self.real = real
        path = generate_fmu(
            "huang2020/slew", folder / "slew.fmu", scheme="funnel_pinv", real=real, tunable=list(GAINS), name="slew"
        )
        self.about = fmpy.read_model_description(str(path))
        self.folder = fmpy.extract(str(path), str(folder / "unit"))
        places = {one.name: one.valueReference for one in self.about.modelVariables}
        self.inputs = [places[f"{name}[{i}]"] for name in ("mrp", "rate") for i in (1, 2, 3)]
        self.gains = [places[name] for name in GAINS]
        self.outputs = [places[f"force[{i}]"] for i in range(1, 13)]
        self.outputs += [places[f"{name}[{i}]"] for name in ("wanted", "limited") for i in (1, 2, 3)]
        self.status = places["status"]
        (folder / "history.c").write_text(HISTORY)
        sources = folder / "unit" / "sources"
        flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fno-math-errno", "-fPIC", "-shared", f"-I{sources}"]
        library = folder / "history.so"
        subprocess.run(["gcc", *flags, folder / "history.c", sources / "slew.c", "-o", library, "-lm"], check=True)
        self.c = ctypes.CDLL(str(library))

    def instance(self, name="one"):
        made = FMU2Slave(
            guid=self.about.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.about.coSimulation.modelIdentifier,
            instanceName=name,
        )
        made.instantiate()
        return made

    def started(self, start=0.0, stop=None):
        made = self.instance()
        made.setupExperiment(startTime=float(start), stopTime=stop)
        made.enterInitializationMode()
        made.exitInitializationMode()
        return made

    def answer(self, samples):
        """Return outputs and status after a history of samples; zeros before the first."""
        found = np.zeros(19)
        if samples:
            rows = np.array(samples, dtype=float)
            assert (
                self.c.history(len(rows), rows.ctypes.data_as(ctypes.c_void_p), found.ctypes.data_as(ctypes.c_void_p))
                == 0
            )
        return found.tolist()

    def read(self, fmu):
        return [*fmu.getReal(self.outputs), *fmu.getInteger([self.status])]


@pytest.fixture(scope="module", params=["float64", "float32"])
def unit(request, tmp_path_factory):
    return Unit(tmp_path_factory.mktemp("unit"), request.param)


@dataclass(frozen=True)
class Model:
    """What a state of the unit is, by the standard."""

    gains: tuple[float, float]
    inputs: tuple[float, ...] = (0.0,) * 6
    time: Fraction = Fraction(0)
    next: int = 0
    samples: tuple[tuple[float, ...], ...] = ()

    def begun(self, start):
        return replace(self, time=Fraction(start), next=-((-Fraction(start)) // PERIOD))

    def stepped(self, length):
        """A sample belongs to the step that begins at it; a thousandth of a period is no sample."""
        end, number, taken = self.time + length, self.next, list(self.samples)
        while number * PERIOD < end - PERIOD / 1000:
            taken.append((float(number) * 0.1, *self.inputs, *self.gains))
            number += 1
        return replace(self, time=end, next=number, samples=tuple(taken))


@pytest.mark.parametrize("seed", range(8))
def test_walk(unit, seed):
    rng = np.random.default_rng(seed)
    late = [start for start in STARTS if start < 1e4 or unit.real == "float64"]
    fmu = [unit.instance("a"), unit.instance("b")]
    fresh = Model(tuple(fmu[0].getReal(unit.gains)))
    model, phase = [fresh, fresh], ["instantiated", "instantiated"]
    kept = []  # (state of the unit or its bytes, model)
    done = dict.fromkeys(("step", "set", "take", "give", "store", "reset", "refused"), 0)
    for _ in range(150):
        who = int(rng.integers(2))
        one = fmu[who]
        if phase[who] == "instantiated" and rng.random() < 0.5:
            start = late[rng.integers(len(late))]
            one.setupExperiment(startTime=float(start))
            model[who] = model[who].begun(start)
            one.enterInitializationMode()
            if rng.random() < 0.5:
                model[who] = replace(model[who], gains=_gains(rng))
                one.setReal(unit.gains, list(model[who].gains))
            one.exitInitializationMode()
            phase[who] = "stepping"
        what = rng.choice(["step", "step", "step", "inputs", "gains", "keep", "store", "restore", "reset", "wrong"],
                          p=[0.2, 0.1, 0.1, 0.15, 0.12, 0.1, 0.08, 0.1, 0.02, 0.03])  # fmt: skip
        if what == "step" and phase[who] == "stepping":
            length = Fraction(int(rng.choice([1, 3, 10, 25, 70])), 100)
            one.doStep(float(model[who].time), float(length))
            model[who] = model[who].stepped(length)
            done["step"] += 1
        elif what == "inputs":
            model[who] = replace(model[who], inputs=tuple((0.05 * rng.standard_normal(6)).astype(np.float32).tolist()))
            one.setReal(unit.inputs, list(model[who].inputs))
        elif what == "gains":
            model[who] = replace(model[who], gains=_gains(rng))
            one.setReal(unit.gains, list(model[who].gains))
            done["set"] += 1
        elif what == "keep" and phase[who] == "stepping":
            kept.append((one.getFMUState(), model[who], who))
            done["take"] += 1
        elif what == "store" and phase[who] == "stepping":
            state = one.getFMUState()
            kept.append((one.serializeFMUState(state), model[who], None))
            one.freeFMUState(state)
            done["store"] += 1
        elif what == "restore" and phase[who] == "stepping":
            mine = [entry for entry in kept if entry[2] in (None, who)]
            if mine:
                state, model[who], owner = mine[rng.integers(len(mine))]
                given = state if owner is not None else one.deserializeFMUState(state)
                one.setFMUState(given)
                done["give"] += 1
        elif what == "reset":
            one.reset()
            model[who], phase[who] = fresh, "instantiated"
            done["reset"] += 1
        elif what == "wrong" and phase[who] == "stepping" and kept:
            one.setReal(unit.gains[1:], [-1.0])
            with pytest.raises(FMICallException):
                one.doStep(float(model[who].time), 0.1)
            one.reset()  # what the standard allows after an error
            model[who], phase[who] = fresh, "instantiated"
            done["refused"] += 1
        assert one.getReal(unit.gains) == list(model[who].gains)
        assert one.getReal(unit.inputs) == list(model[who].inputs)
        assert unit.read(one) == unit.answer(model[who].samples)
    for one in fmu:
        one.freeInstance()
    assert done["step"] >= 10
    assert done["give"] >= 1


def _gains(rng):
    """Numbers that a float holds, so that they read back as they were set."""
    return tuple((np.array([0.25, 2.0]) * rng.uniform(0.5, 3.0, 2)).astype(np.float32).astype(float).tolist())


def test_a_pending_gain_is_part_of_the_state(unit):
    """Set, take the state, step, give it back, step: the same words, in another unit too."""
    a = unit.started()
    a.setReal(unit.inputs, [0.01, 0.02, -0.03, 1e-3, -2e-3, 5e-4])
    a.doStep(0.0, 0.1)
    gains = a.getReal(unit.gains)
    a.setReal(unit.gains[:1], [3 * gains[0]])
    kept = a.getFMUState()
    stored = a.serializeFMUState(kept)
    a.doStep(0.1, 0.1)
    right = unit.read(a)
    a.setFMUState(kept)
    a.doStep(0.1, 0.1)
    assert unit.read(a) == right
    b = unit.started()
    b.setFMUState(b.deserializeFMUState(stored))
    b.doStep(0.1, 0.1)
    assert unit.read(b) == right
    a.setReal(unit.gains, gains)
    a.setFMUState(kept)
    a.setReal(unit.gains, gains)  # the pending change is taken back before it is used
    a.doStep(0.1, 0.1)
    assert unit.read(a) != right


@pytest.mark.parametrize("start", [1.7e9, -1.7e9, 9e7, 1e12, 1e300, -1e300, float("inf"), float("nan")])
def test_any_start_is_quick_or_refused(unit, start):
    """One multiple of 0.1 s lies in [start, start + 0.1), whatever the start; finding it takes no counting."""
    since = time.perf_counter()
    good = abs(start) <= (1e12 if unit.real == "float64" else 1e4)
    if not good:
        with pytest.raises(FMICallException):
            unit.started(start)
    else:
        one = unit.started(start)
        one.setReal(unit.inputs, [0.01, 0.02, -0.03, 1e-3, -2e-3, 5e-4])
        before = unit.read(one)
        one.doStep(start, 0.1)
        assert unit.read(one) != before
    assert time.perf_counter() - since < 1.0


@pytest.mark.parametrize(
    ("at", "length"),
    [
        (0.0, 0.0),
        (0.0, -0.1),
        (0.0, float("nan")),
        (0.0, float("inf")),
        (0.0, 1e9),
        (0.2, 0.1),
        (1e9, 0.1),
        (float("nan"), 0.1),
    ],
)
def test_steps_that_are_refused(unit, at, length):
    """Not positive, endless, or not where the last one ended: refused at once, and nothing has changed."""
    one, since = unit.started(), time.perf_counter()
    with pytest.raises(FMICallException):
        one.doStep(at, length)
    assert time.perf_counter() - since < 1.0
    one.doStep(0.0, 0.1)
    assert one.getRealStatus(2) == 0.1  # the last successful time


def test_past_the_stop_is_refused(unit):
    one = unit.started(0.0, 1.0)
    for k in range(10):
        one.doStep(0.1 * k, 0.1)
    with pytest.raises(FMICallException):
        one.doStep(1.0, 0.1)


def test_bytes_of_another_unit_are_refused(unit):
    one = unit.started()
    stored = one.serializeFMUState(one.getFMUState())
    with pytest.raises(FMICallException):
        one.deserializeFMUState(stored[:-8])
    with pytest.raises(FMICallException):
        one.deserializeFMUState(b"0" * 32 + stored[32:])
    one.setFMUState(one.deserializeFMUState(stored))


def test_a_list_of_values_is_set_as_a_whole(unit):
    one = unit.started()
    before = one.getReal(unit.inputs)
    with pytest.raises(FMICallException):
        one.setReal([*unit.inputs[:2], unit.outputs[0]], [0.5, 0.5, 0.5])
    assert one.getReal(unit.inputs) == before


def test_outputs_are_calculated(unit):
    """By the standard they have no start, and are listed among the unknowns of the initialisation."""
    outputs = [one for one in unit.about.modelVariables if one.causality == "output"]
    assert all(one.initial == "calculated" and one.start is None for one in outputs)
    assert {one.variable.name for one in unit.about.initialUnknowns} == {one.name for one in outputs}
