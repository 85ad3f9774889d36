"""Calls that FMI 2.0 does not allow: fmi2Error, a sentence by the logger, and nothing has changed.

Truth: the table of the standard that says which function may be called when (section 4.2.4), the ways into each of its
states, and words of a unit that nobody misused.
"""

import ctypes

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import (
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
)

from casadi_gnc.delivery.fmu import generate_fmu
from casadi_gnc.embedded.fmu import platform_folder

OK, ERROR = 0, 3
NAN, INF = float("nan"), float("inf")
REAL, BOOLEAN, TEXT = ctypes.c_double, ctypes.c_int, ctypes.c_char_p


class Unit:
    """A unit behind its bare C functions; what it says is kept in `said`."""

    def __init__(self, path, folder):
        about = fmpy.read_model_description(str(path))
        place = fmpy.extract(str(path), str(folder))
        self.c = ctypes.CDLL(f"{place}/binaries/{platform_folder()}/slew.so")
        self.c.fmi2Instantiate.restype = ctypes.c_void_p
        self.guid, self.said, self.blocks = about.guid.encode(), [], {}
        self.references = {one.name: one.valueReference for one in about.modelVariables}
        self.callbacks = fmi2CallbackFunctions()
        self.callbacks.logger = fmi2CallbackLoggerTYPE(self._log)
        self.callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(self._allocate)
        self.callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(self._free)

    def _log(self, _environment, name, status, category, message, *_):
        self.said.append((name, status, message.decode()))

    def _allocate(self, count, size):
        block = ctypes.create_string_buffer(count * size)
        self.blocks[ctypes.addressof(block)] = block
        return ctypes.addressof(block)

    def _free(self, address):
        del self.blocks[address]

    def instantiate(self, kind=1, guid=None):
        return self.c.fmi2Instantiate(
            b"one", kind, self.guid if guid is None else guid, b"", ctypes.byref(self.callbacks), 0, 0
        )

    def call(self, name, instance, *arguments):
        """Return status and sentences of a call."""
        self.said.clear()
        status = getattr(self.c, f"fmi2{name}")(ctypes.c_void_p(instance), *arguments)
        return status, [message for _, _, message in self.said]

    def setup(self, instance, start=0.0, stops=0, stop=0.0):
        return self.call("SetupExperiment", instance, BOOLEAN(0), REAL(0.0), REAL(start), BOOLEAN(stops), REAL(stop))

    def step(self, instance, at, length=0.1):
        return self.call("DoStep", instance, REAL(at), REAL(length), BOOLEAN(1))

    def set_real(self, instance, reference, value):
        return self.call("SetReal", instance, (ctypes.c_uint * 1)(reference), ctypes.c_size_t(1), (REAL * 1)(value))

    def get_real(self, instance, references):
        count = len(references)
        values = (REAL * count)()
        given = (ctypes.c_uint * count)(*references)
        return *self.call("GetReal", instance, given, ctypes.c_size_t(count), values), list(values)

    def state(self, instance):
        kept = ctypes.c_void_p()
        assert self.call("GetFMUstate", instance, ctypes.byref(kept)) == (OK, [])
        return kept

    def stored(self, instance):
        kept, size = self.state(instance), ctypes.c_size_t()
        assert self.call("SerializedFMUstateSize", instance, kept, ctypes.byref(size))[0] == OK
        content = ctypes.create_string_buffer(size.value)
        assert self.call("SerializeFMUstate", instance, kept, content, size)[0] == OK
        assert self.call("FreeFMUstate", instance, ctypes.byref(kept))[0] == OK
        return content.raw

    def brought(self, phase):
        """Return an instance in a state of the standard's machine."""
        made = self.instantiate()
        ways = {
            "instantiated": [],
            "initialising": ["setup", "EnterInitializationMode"],
            "stepping": ["setup", "EnterInitializationMode", "ExitInitializationMode"],
            "terminated": ["setup", "EnterInitializationMode", "ExitInitializationMode", "Terminate"],
        }
        for way in ways[phase]:
            done = self.setup(made) if way == "setup" else self.call(way, made)
            assert done == (OK, [])
        return made


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    folder = tmp_path_factory.mktemp("misuse")
    path = generate_fmu("huang2020/slew", folder / "slew.fmu", scheme="funnel_pinv", name="slew", tunable=["rate_gain"])
    return Unit(path, folder / "unit")


CALLS = {
    "SetupExperiment": lambda unit, made: unit.setup(made),
    "EnterInitializationMode": lambda unit, made: unit.call("EnterInitializationMode", made),
    "ExitInitializationMode": lambda unit, made: unit.call("ExitInitializationMode", made),
    "Terminate": lambda unit, made: unit.call("Terminate", made),
    "Reset": lambda unit, made: unit.call("Reset", made),
    "DoStep": lambda unit, made: unit.step(made, 0.0),
    "SetReal": lambda unit, made: unit.set_real(made, unit.references["mrp[1]"], 0.1),
    "GetReal": lambda unit, made: unit.get_real(made, [0])[:2],
}
#: When each may be called. Enter comes after the experiment is set up, which `EnterInitializationMode` lacks here.
ALLOWED = {
    "SetupExperiment": {"instantiated"},
    "EnterInitializationMode": set(),
    "ExitInitializationMode": {"initialising"},
    "Terminate": {"stepping"},
    "Reset": {"instantiated", "initialising", "stepping", "terminated"},
    "DoStep": {"stepping"},
    "SetReal": {"instantiated", "initialising", "stepping"},
    "GetReal": {"instantiated", "initialising", "stepping", "terminated"},
}


@pytest.mark.parametrize("phase", ["instantiated", "initialising", "stepping", "terminated"])
@pytest.mark.parametrize("name", CALLS)
def test_each_call_in_each_state(name, phase, unit):
    made = unit.brought(phase)
    before = unit.stored(made)
    status, said = CALLS[name](unit, made)
    if phase in ALLOWED[name]:
        assert (status, said) == (OK, [])
    else:
        assert status == ERROR
        assert len(said) == 1
        assert len(said[0]) > 20
        assert "%" not in said[0]
        assert unit.stored(made) == before  # nothing has changed
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))
    assert unit.blocks == {}


def test_what_is_refused_says_why(unit):
    made = unit.brought("instantiated")
    assert unit.step(made, 0.0) == (ERROR, ["a step needs the initialisation, entered and left, before it"])
    assert unit.said == [(b"one", ERROR, "a step needs the initialisation, entered and left, before it")]
    assert "fmi2SetupExperiment" in unit.call("EnterInitializationMode", made)[1][0]
    assert unit.setup(made)[0] == OK
    for way in ("EnterInitializationMode", "ExitInitializationMode"):
        assert unit.call(way, made) == (OK, [])
    assert unit.step(made, 0.0) == (OK, [])
    assert unit.call("Terminate", made) == (OK, [])
    assert unit.step(made, 0.1) == (ERROR, ["the simulation is over: fmi2Reset begins anew"])
    assert unit.call("Reset", made) == (OK, [])
    assert unit.step(made, 0.0)[0] == ERROR
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))


@pytest.mark.parametrize("time", [NAN, INF, -INF, 1e300])
def test_times_that_are_none(time, unit):
    made = unit.brought("instantiated")
    assert unit.setup(made, start=time)[0] == ERROR
    assert len(unit.said) == 1
    assert unit.setup(made, 0.0, 1, time)[0] == (ERROR if time != 1e300 else OK)
    assert unit.setup(made, 1.0, 1, 0.5)[0] == ERROR
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))
    made = unit.brought("stepping")
    for at, length in ((time, 0.1), (0.0, time), (time, time)):
        status, said = unit.step(made, at, length)
        assert (status, len(said)) == (ERROR, 1)
    assert unit.step(made, 0.0) == (OK, [])
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))


def restored(unit, made, content):
    kept = ctypes.c_void_p()
    done = unit.call("DeSerializeFMUstate", made, bytes(content), ctypes.c_size_t(len(content)), ctypes.byref(kept))
    return *done, kept


def test_stored_states_that_are_garbage(unit):
    """Any byte changed, any length, any rubbish: refused, and no memory is taken."""
    made = unit.brought("stepping")
    unit.step(made, 0.0)
    good = unit.stored(made)
    rng = np.random.default_rng(7)
    spoiled = [b"", b"\0", good[:-1], good + b"\0", good[8:], bytes(len(good)), b"\xff" * len(good)]
    spoiled += [rng.bytes(len(good)) for _ in range(20)]
    for place in [*range(0, len(good), 37), len(good) - 1]:
        spoiled.append(good[:place] + bytes([good[place] ^ 1 << rng.integers(8)]) + good[place + 1 :])
    for content in spoiled:
        status, said, kept = restored(unit, made, content)
        assert (status, kept.value) == (ERROR, None)
        assert said in (["the stored state is of another unit"], ["the stored state is damaged"])
    status, said, kept = restored(unit, made, good)
    assert (status, said) == (OK, [])
    assert unit.call("SetFMUstate", made, kept) == (OK, [])
    assert unit.step(made, 0.1) == (OK, [])
    assert unit.call("FreeFMUstate", made, ctypes.byref(kept)) == (OK, [])
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))
    assert unit.blocks == {}


def test_a_state_brings_its_place_in_the_life_of_a_unit(unit):
    """Taken while stepping and given back after the end: the simulation goes on, with the same words."""
    made = unit.brought("stepping")
    unit.set_real(made, unit.references["mrp[1]"], 0.01)
    kept = unit.state(made)
    outputs = [unit.references[f"force[{i}]"] for i in range(1, 13)]
    assert unit.step(made, 0.0) == (OK, [])
    first = unit.get_real(made, outputs)
    assert unit.call("Terminate", made) == (OK, [])
    assert unit.call("SetFMUstate", made, kept) == (OK, [])
    assert unit.step(made, 0.0) == (OK, [])
    assert unit.get_real(made, outputs) == first
    foreign = ctypes.create_string_buffer(4096)
    assert unit.call("SetFMUstate", made, foreign) == (ERROR, ["the state is none of this unit"])
    assert unit.call("SetFMUstate", made, None)[0] == ERROR
    unit.call("FreeFMUstate", made, ctypes.byref(kept))
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))


def test_variables_that_there_are_none(unit):
    made = unit.brought("stepping")
    one = ctypes.c_size_t(1)
    for reference in (10_000, 2**32 - 1, unit.references["status"]):
        place = (ctypes.c_uint * 1)(reference)
        assert unit.call("GetReal", made, place, one, (REAL * 1)())[0] == ERROR
        assert unit.set_real(made, reference, 1.0)[0] == ERROR
        if reference != unit.references["status"]:
            assert unit.call("GetInteger", made, place, one, (BOOLEAN * 1)())[0] == ERROR
    assert unit.set_real(made, unit.references["force[1]"], 1.0) == (ERROR, ["an output cannot be set"])
    for kind, word in (("Boolean", BOOLEAN), ("String", TEXT)):
        for verb in ("Get", "Set"):
            assert unit.call(f"{verb}{kind}", made, None, ctypes.c_size_t(0), None) == (OK, [])
            status, said = unit.call(f"{verb}{kind}", made, (ctypes.c_uint * 1)(0), one, (word * 1)())
            assert (status, len(said)) == (ERROR, 1)
    assert unit.call("GetReal", made, None, one, None) == (ERROR, ["no array was given"])
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))


def test_a_parameter_out_of_range_can_be_put_right(unit):
    """Told when it is taken into use; the initialisation is still open then."""
    made = unit.brought("initialising")
    for wrong in (NAN, INF, -1.0):
        assert unit.set_real(made, unit.references["rate_gain"], wrong) == (OK, [])
        status, said = unit.call("ExitInitializationMode", made)
        assert (status, said) == (ERROR, ["a parameter is not finite or out of its range"])
    assert unit.set_real(made, unit.references["rate_gain"], 2.0) == (OK, [])
    assert unit.call("ExitInitializationMode", made) == (OK, [])
    assert unit.step(made, 0.0) == (OK, [])
    unit.c.fmi2FreeInstance(ctypes.c_void_p(made))


def test_instances_that_cannot_be_made_say_why(unit):
    unit.said.clear()
    assert unit.instantiate(guid=b"another") is None
    assert unit.instantiate(kind=0) is None
    assert [status for _, status, _ in unit.said] == [ERROR, ERROR]
    assert "guid" in unit.said[0][2]
    assert "co-simulation" in unit.said[1][2]
    assert unit.blocks == {}


def test_nothing_at_all_is_refused(unit):
    """A null instance has no logger; it is an error and no crash."""
    for name, call in CALLS.items():
        assert call(unit, 0) == (ERROR, []), name
    assert unit.call("CancelStep", 0)[0] == ERROR
    unit.c.fmi2FreeInstance(ctypes.c_void_p(0))
