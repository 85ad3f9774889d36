"""The functional mock-up unit flies in another tool, with the package's words. Truth: fmpy, an independent importer."""

import shutil
import zipfile

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu
from packages import STRICT, made, run

import casadi_gnc
from casadi_gnc.delivery.fmu import generate_fmu
from casadi_gnc.delivery.verifying import read_vectors
from casadi_gnc.embedded import compare
from casadi_gnc.errors import CompilerError, OutputError

CASES = [
    ("huang2020/slew", "funnel_pinv", "float64", ()),
    ("huang2020/slew", "funnel_robust", "float64", ("attitude_gain", "rate_gain")),
    ("sun2018/circular_orbit", "tracking", "float32", ()),
]


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """Return the path of a unit by case, each generated once."""
    known = {}

    def of(case):
        if case not in known:
            problem, scheme, real, tunable = case
            target = tmp_path_factory.mktemp("fmu") / "unit.fmu"
            known[case] = generate_fmu(problem, target, scheme=scheme, real=real, tunable=tunable)
        return known[case]

    return of


class Slave:
    """A unit, unpacked and instantiated, by the names of its variables."""

    def __init__(self, path):
        self.folder = fmpy.extract(str(path))
        about = fmpy.read_model_description(str(path))
        self.references = {one.name: one.valueReference for one in about.modelVariables}
        self.inputs = [one.valueReference for one in about.modelVariables if one.causality == "input"]
        reals = [one for one in about.modelVariables if one.causality == "output" and one.type == "Real"]
        self.outputs = [one.valueReference for one in reals]
        self.fmu = FMU2Slave(
            guid=about.guid, unzipDirectory=self.folder, modelIdentifier=about.coSimulation.modelIdentifier,
            instanceName="one",
        )  # fmt: skip
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)

    def begin(self):
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        return self

    def step(self, k, period, measured):
        self.fmu.setReal(self.inputs, list(measured))
        self.fmu.doStep(currentCommunicationPoint=k * period, communicationStepSize=period)
        status = self.fmu.getInteger([self.references["status"]])
        return [*self.fmu.getReal(self.outputs), *status]

    def close(self):
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[1]}-{case[2]}")
def test_is_valid(case, unit):
    assert validate_fmu(str(unit(case))) == []


@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case[1]}-{case[2]}")
def test_flies_with_the_words_of_the_package(case, unit):
    problem, scheme, real, tunable = case
    inputs, expected = read_vectors(made(problem, scheme, real, tunable), real)
    rows, period = compare.as_numbers(inputs), casadi_gnc.load(problem).timing.sample_period
    slave = Slave(unit(case)).begin()
    found = np.array([slave.step(k, period, row[1:].astype(float)) for k, row in enumerate(rows)])
    slave.close()
    words = compare.as_words(found[:, :-1], inputs.dtype)
    assert (words == expected[:, :-1]).all()
    assert (found[:, -1].astype(int) == expected[:, -1].astype(int)).all()


def test_is_simulated_by_another_tool(unit):
    """By fmpy's own loop, with its input interpolation: a constant measurement."""
    signals = np.array(
        [(0.0, 0.1, 0.01), (2.0, 0.1, 0.01)], dtype=[("time", float), ("mrp[1]", float), ("rate[2]", float)]
    )
    result = fmpy.simulate_fmu(
        str(unit(CASES[0])), stop_time=2.0, step_size=0.1, output_interval=0.1, input=signals, validate=True
    )
    assert len(result) == 21
    force = np.array([result[f"force[{i}]"] for i in range(1, 13)])
    assert (force[:, 0] == 0.0).all()  # before the first sample
    assert force.min() >= 0.0
    assert 0.0 < force.max() <= 3.75e-3


def test_state_can_be_kept_and_taken_back(unit):
    """Get, set, serialise: from each kept state the same words follow."""
    case = CASES[1]
    inputs, _ = read_vectors(made(case[0], case[1], case[2], case[3]), case[2])
    rows = compare.as_numbers(inputs)[:, 1:]
    slave = Slave(unit(case)).begin()
    for k in range(40):
        slave.step(k, 0.1, rows[k])
    kept = slave.fmu.getFMUstate()
    stored = slave.fmu.serializeFMUstate(kept)
    first = [slave.step(k, 0.1, rows[k]) for k in range(40, 80)]
    slave.fmu.setFMUstate(kept)
    assert [slave.step(k, 0.1, rows[k]) for k in range(40, 80)] == first
    slave.fmu.freeFMUstate(kept)
    again = slave.fmu.deSerializeFMUstate(stored)
    slave.fmu.setFMUstate(again)
    assert [slave.step(k, 0.1, rows[k]) for k in range(40, 80)] == first
    slave.fmu.freeFMUstate(again)
    other = Slave(unit(case)).begin()  # the bytes mean the same to another instance
    taken = other.fmu.deSerializeFMUstate(stored)
    other.fmu.setFMUstate(taken)
    assert [other.step(k, 0.1, rows[k]) for k in range(40, 80)] == first
    other.fmu.freeFMUstate(taken)
    slave.fmu.reset()
    slave.fmu.setupExperiment(startTime=0.0)
    slave.begin()
    fresh = Slave(unit(case)).begin()
    assert slave.step(0, 0.1, rows[0]) == fresh.step(0, 0.1, rows[0])
    for one in (slave, other, fresh):
        one.close()


def test_gains_are_parameters(unit):
    case = CASES[1]
    inputs, _ = read_vectors(made(case[0], case[1], case[2], case[3]), case[2])
    rows, wanted = compare.as_numbers(inputs)[:, 1:], []
    for gain in (2.0, 2.5):
        slave = Slave(unit(case))
        slave.fmu.setReal([slave.references["rate_gain"]], [gain])
        slave.begin()
        first = slave.references["wanted[1]"] - slave.inputs[-1] - 1
        wanted.append([slave.step(k, 0.1, rows[k])[first] for k in range(20)][-1])
        slave.close()
    assert wanted[0] != wanted[1]
    slave = Slave(unit(case))
    slave.fmu.setReal([slave.references["rate_gain"]], [-1.0])
    with pytest.raises(FMICallException):
        slave.begin()
    slave.close()


def test_long_and_short_communication_steps(unit):
    """Samples are taken at multiples of the period, however the master divides the time."""
    case = CASES[0]
    inputs, _ = read_vectors(made(case[0], case[1], case[2], case[3]), case[2])
    row = compare.as_numbers(inputs)[5, 1:]
    results = []
    for length, count in ((0.1, 10), (0.5, 2), (0.025, 40)):
        slave = Slave(unit(case)).begin()
        for k in range(count):
            last = slave.step(k, length, row)
        results.append(last)
        slave.close()
    assert results[0] == results[1] == results[2]


@pytest.mark.parametrize("language", ["-std=c99", "-std=c11"])
def test_sources_are_strict_c(language, unit, tmp_path, compiler):
    with zipfile.ZipFile(unit(CASES[1])) as archive:
        archive.extractall(tmp_path)
    strict = [flag for flag in STRICT if flag != "-Wdouble-promotion"]
    folder = tmp_path / "sources"
    for source in sorted(folder.glob("*.c")):
        done = run(
            *compiler.command, language, *strict, "-Wmissing-prototypes", "-c", source, "-o", tmp_path / "unit.o"
        )
        assert done.returncode == 0, done.stderr[:2000]


def test_the_same_bytes_again(unit, tmp_path):
    problem, scheme, real, tunable = CASES[0]
    again = generate_fmu(problem, tmp_path / "again.fmu", scheme=scheme, real=real, tunable=tunable)
    with zipfile.ZipFile(again) as a, zipfile.ZipFile(unit(CASES[0])) as b:
        assert a.namelist() == b.namelist()
        texts = [name for name in a.namelist() if not name.startswith("binaries/")]
        assert all(a.read(name) == b.read(name) for name in texts)


def test_what_is_refused(tmp_path, monkeypatch):
    with pytest.raises(OutputError, match=r"does not end in \.fmu"):
        generate_fmu("huang2020/slew", tmp_path / "slew.zip")
    monkeypatch.setenv("CC", "false")
    with pytest.raises(CompilerError):
        generate_fmu("huang2020/slew", tmp_path / "slew.fmu")
    assert not list(tmp_path.iterdir())
