"""A unit of FMI 3.0 flies in another tool with the package's words. Truth: fmpy, its headers, the vectors."""

import re
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu
from packages import STRICT, made, run

from casadi_gnc.delivery.fmu import generate_fmu
from casadi_gnc.delivery.verifying import read_vectors
from casadi_gnc.embedded import compare
from casadi_gnc.embedded.fmu import platform_folder
from casadi_gnc.errors import PackageError

pytestmark = pytest.mark.slow
PROBLEM, SCHEME, GAINS, PERIOD = "huang2020/slew", "pd_pinv", ("rate_gain",), 0.1


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    target = tmp_path_factory.mktemp("fmu3") / "unit.fmu"
    return generate_fmu(PROBLEM, target, scheme=SCHEME, real="float32", tunable=GAINS, fmi=3)


@pytest.fixture(scope="module")
def folder(unit, tmp_path_factory):
    return Path(fmpy.extract(str(unit), str(tmp_path_factory.mktemp("unit"))))


class Slave:
    """A unit by the names of its variables."""

    def __init__(self, unit, folder, start=0.0, **parameters):
        about = fmpy.read_model_description(str(unit))
        rows = about.modelVariables
        self.references = {one.name: one.valueReference for one in rows}
        self.inputs = [one.valueReference for one in rows if one.causality == "input"]
        self.outputs = [one.valueReference for one in rows if one.causality == "output" and one.type == "Float64"]
        name = about.coSimulation.modelIdentifier
        self.said = []
        self.fmu = FMU3Slave(
            guid=about.guid, unzipDirectory=str(folder), modelIdentifier=name, instanceName="one"
        )  # fmt: skip
        self.fmu.instantiate(logMessage=lambda *said: self.said.append(said[3].decode()))
        for parameter, value in parameters.items():
            self.fmu.setFloat64([self.references[parameter]], [value])
        self.fmu.enterInitializationMode(startTime=start)
        self.fmu.exitInitializationMode()

    def step(self, k, measured, length=PERIOD):
        self.fmu.setFloat64(self.inputs, list(measured))
        assert self.fmu.doStep(k * length, length) == (False, False, False, pytest.approx((k + 1) * length))
        return [*self.fmu.getFloat64(self.outputs), *self.fmu.getUInt32([self.references["status"]])]


def test_is_valid_and_has_every_function_of_the_standard(unit, folder):
    assert validate_fmu(str(unit)) == []
    library = next((folder / "binaries" / platform_folder(3)).iterdir())
    there = set(subprocess.run(["nm", "-D", library], capture_output=True, text=True).stdout.split())
    headers = Path(fmpy.__file__).parent / "c-code"
    asked = set(re.findall(r"\b(fmi3\w+)TYPE\b", (headers / "fmi3FunctionTypes.h").read_text()))
    assert len(asked) > 70
    assert asked - there == set()


def test_flies_with_the_words_of_the_package(unit, folder):
    inputs, expected = read_vectors(made(PROBLEM, SCHEME, "float32", GAINS), "float32")
    rows = compare.as_numbers(inputs)[:, 1:].astype(float)
    slave = Slave(unit, folder)
    found = np.array([slave.step(k, row) for k, row in enumerate(rows)])
    assert (compare.as_words(found[:, :-1], inputs.dtype) == expected[:, :-1]).all()
    assert (found[:, -1].astype(int) == expected[:, -1].astype(int)).all()
    slave.fmu.terminate()
    with pytest.raises(FMICallException):
        slave.fmu.doStep(len(rows) * PERIOD, PERIOD)
    assert slave.said[-1] == "the simulation is over: fmi3Reset begins anew"


def test_state_is_kept_stored_and_taken_back(unit, folder):
    rows = compare.as_numbers(read_vectors(made(PROBLEM, SCHEME, "float32", GAINS), "float32")[0])[:, 1:].astype(float)
    slave = Slave(unit, folder, rate_gain=1.5)
    for k in range(20):
        slave.step(k, rows[k])
    kept = slave.fmu.getFMUState()
    stored = slave.fmu.serializeFMUState(kept)
    first = [slave.step(k, rows[k]) for k in range(20, 40)]
    other = Slave(unit, folder)  # the bytes mean the same to another instance, gains too
    other.fmu.setFMUState(other.fmu.deserializeFMUState(stored))
    assert [other.step(k, rows[k]) for k in range(20, 40)] == first
    damaged = bytearray(stored)
    damaged[100] ^= 1
    with pytest.raises(FMICallException):
        other.fmu.deserializeFMUState(bytes(damaged))
    assert other.said == ["the stored state is damaged"]
    assert [Slave(unit, folder).step(0, rows[0])] != [first[0]]


def test_what_is_refused(unit, folder):
    with pytest.raises(FMICallException):
        Slave(unit, folder, rate_gain=-1.0)
    slave = Slave(unit, folder)
    for call, told in (
        (lambda: slave.fmu.setFloat64([slave.outputs[0]], [1.0]), "an output cannot be set"),
        (lambda: slave.fmu.getFloat64([999]), "there is no real variable of this value reference"),
        (lambda: slave.fmu.getFloat32([0]), "the unit has no variables of this type"),
        (slave.fmu.enterEventMode, "the unit is one for co-simulation without events, clocks and derivatives"),
        (lambda: slave.fmu.doStep(5.0, 0.1), "the communication step does not begin where the last one ended"),
    ):
        with pytest.raises(FMICallException):
            call()
        assert slave.said[-1] == told
    with pytest.raises(PackageError, match="expected 2 or 3"):
        generate_fmu(PROBLEM, folder / "a.fmu", fmi=1)


def test_another_tool_simulates_it(unit):
    signals = np.array([(0.0, 0.1), (1.0, 0.1)], dtype=[("time", float), ("mrp[1]", float)])
    result = fmpy.simulate_fmu(str(unit), stop_time=1.0, step_size=0.1, output_interval=0.1, input=signals)
    force = np.array([result[f"force[{i}]"] for i in range(1, 13)])
    assert (force[:, 0] == 0.0).all()  # before the first sample
    assert 0.0 < force.max() <= 3.75e-3


def test_sources_are_strict_c(unit, tmp_path):
    with zipfile.ZipFile(unit) as archive:
        archive.extractall(tmp_path)
    strict = [flag for flag in STRICT if flag != "-Wdouble-promotion"]
    done = run(
        "gcc", "-std=c99", *strict, "-Wmissing-prototypes", "-c", tmp_path / "sources" / "fmu.c", "-o", tmp_path / "o.o"
    )
    assert done.returncode == 0, done.stderr[:2000]
