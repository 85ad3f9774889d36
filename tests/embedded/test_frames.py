"""Packages in the frames that others fly: the same words. Truth: the package's own vectors, Basilisk's spacecraft.

FreeRTOS, the timer and Simulink are stubs of `tests/stubs` that run what was printed; the node of ROS 2 is compiled.
"""

import importlib.util
import json
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from packages import C99, STRICT, run

from casadi_gnc.delivery.generating import generate
from casadi_gnc.delivery.verifying import verify
from casadi_gnc.embedded import compare
from casadi_gnc.embedded.host import HostPackage
from casadi_gnc.errors import PackageError
from casadi_gnc.system import assets

STUBS = Path(__file__).parents[1] / "stubs"
PROBLEM = "satellites/slew"


@pytest.fixture(scope="module")
def put(tmp_path_factory):
    """Return the folder of a package in a frame."""

    def into(frame, real="float64"):
        folder = tmp_path_factory.mktemp(frame) / "sat"
        generate(PROBLEM, folder, name="sat", steps=64, frame=frame, real=real)
        return folder

    return into


def built(folder, sources, *flags):
    """Return what a program of a package says."""
    include = [f"-I{path}" for path in (STUBS, folder, folder / "test")]
    units = [folder / "sat.c", folder / "test" / "vectors.c", *sources]
    done = run("gcc", *C99, *STRICT, *flags, *include, "-o", folder.parent / "run", *units, "-lm")
    assert done.returncode == 0, done.stderr[:3000]
    done = run(folder.parent / "run")
    assert done.returncode == 0
    return done.stdout.strip()


def test_templates_are_short():
    for path in (assets.folder("codegen") / "frames").iterdir():
        assert len(path.read_text().splitlines()) <= 100, path.name


@pytest.mark.slow
def test_a_task_and_a_timer_step_the_package(put):
    folder = put("freertos")
    told = built(folder, [STUBS / "drive_task.c", folder / "freertos" / "sat_task.c"])
    assert told == "64 steps, 0 words differ, 3 overruns, told 2 times"
    folder = put("timer", "float32")
    told = built(folder, [STUBS / "drive_timer.c", folder / "timer" / "sat_timer.c"])
    assert told == "64 steps, 0 words differ, 2 missed, told 1 times"


@pytest.mark.slow
def test_an_s_function_steps_the_package(put):
    folder = put("simulink", "float32")
    told = built(folder, [folder / "simulink" / "sat_sfun.c"])
    assert told == "64 steps, 0 words differ, 3 in, 11 out, 0.1 s"
    assert verify(folder)["is_sound"]
    (folder / "simulink" / "sat_sfun.c").write_text("int nothing;\n")  # a frame is part of the package
    found = verify(folder)
    assert not found["is_sound"]
    assert found["not_regenerated"] == ["simulink/sat_sfun.c"]


@pytest.mark.slow
@pytest.mark.tools("g++")
def test_a_node_compiles(tmp_path):
    strict = [flag for flag in STRICT if flag not in ("-Wdouble-promotion", "-Wshadow")]
    gains = {"scheme": "pd_pinv", "tunable": ("rate_gain",)}
    generate("huang2020/slew", tmp_path / "a", name="sat", steps=64, frame="ros2", **gains)
    x, u = ca.SX.sym("x", 2), ca.SX.sym("u")
    integral = ca.Function("i", [x, u], [x[0] * x[1], x + u], ["x", "u"], ["y", "after"])
    generate(integral, tmp_path / "b", name="sat", steps=64, frame="ros2", state={"x": "after"}, rate=10.0)
    for folder in (tmp_path / "a", tmp_path / "b"):
        include = [f"-I{STUBS}", f"-I{folder}"]
        node = folder / "ros2" / "sat_node.cpp"
        done = run("g++", "-std=c++17", *strict, *include, "-c", node, "-o", tmp_path / "o.o")
        assert done.returncode == 0, done.stderr[:3000]
        assert (folder / "ros2" / "CMakeLists.txt").read_text().count("../sat.c") == 1


def test_what_is_refused(tmp_path):
    x = ca.SX.sym("x")
    f = ca.Function("f", [x], [x * x])
    with pytest.raises(PackageError, match="a frame of ros2 needs a period, and f has none; a function"):
        generate(f, tmp_path / "f", frame="ros2")
    with pytest.raises(PackageError, match="the frame is 'simulator', expected basilisk, ros2"):
        generate(f, tmp_path / "f", frame="simulator")
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.packages("Basilisk")
def test_flies_a_satellite_of_basilisk(put):
    """Four wheels and attitude feedback: the package where mrpFeedback and rwMotorTorque would be."""
    from Basilisk.simulation import reactionWheelStateEffector, simpleNav, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW

    folder = put("basilisk")
    spec = importlib.util.spec_from_file_location("sat_module", folder / "basilisk" / "sat_module.py")
    made = importlib.util.module_from_spec(spec)
    sys.modules["sat_module"] = made
    spec.loader.exec_module(made)

    simulation, craft, nav = SimulationBaseClass.SimBaseClass(), spacecraft.Spacecraft(), simpleNav.SimpleNav()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(0.1)))
    craft.hub.mHub = 320.0
    craft.hub.IHubPntBc_B = [[85.0, 2.0, -1.5], [2.0, 110.0, 1.0], [-1.5, 1.0, 64.0]]
    craft.hub.sigma_BNInit = [[0.16], [0.0], [0.21]]
    craft.hub.omega_BN_BInit = [[0.0], [0.0], [0.0]]
    wheels, factory = reactionWheelStateEffector.ReactionWheelStateEffector(), simIncludeRW.rwFactory()
    for axis in ((1, 1, 1), (-1, 1, 1), (-1, -1, 1), (1, -1, 1)):
        factory.create("custom", axis, Js=12.0 / 628.0, Omega=0.0, u_max=0.2, useMaxTorque=True)
    factory.addToSpacecraft("wheels", wheels, craft)
    nav.scStateInMsg.subscribeTo(craft.scStateOutMsg)
    law = made.Sat()
    law.read("mrp", nav.attOutMsg, "sigma_BN")
    law.read("rate", nav.attOutMsg, "omega_BN_B")
    law.read("wheel_speed", wheels.rwSpeedOutMsg, "wheelSpeeds")
    torque = law.tell("wheel_torque", "ArrayMotorTorqueMsg", "motorTorque")
    wheels.rwMotorCmdInMsg.subscribeTo(torque)
    for priority, model in ((4, craft), (3, wheels), (2, nav), (1, law)):
        simulation.AddModelToTask("task", model, priority)
    recorders = [one.recorder() for one in (nav.attOutMsg, wheels.rwSpeedOutMsg, torque, craft.scStateOutMsg)]
    for recorder in recorders:
        simulation.AddModelToTask("task", recorder, -1)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(120.0))
    simulation.ExecuteSimulation()

    seen, speeds, told, flown = recorders
    inputs = np.column_stack(
        [np.array(told.times()) * 1e-9, seen.sigma_BN, seen.omega_BN_B, np.array(speeds.wheelSpeeds)[:, :4]]
    )  # what the module was given
    outputs = HostPackage(folder, "sat").replay(compare.as_words(inputs, np.dtype(np.uint64)), 11)
    found = compare.as_words(np.array(told.motorTorque)[:, :4], np.dtype(np.uint64))
    assert len(found) == 1201
    assert (found == outputs[:, :4]).all()
    assert outputs[-1, -1] == 0  # limited at first, then nothing unusual
    angle = 4.0 * np.degrees(np.arctan(np.linalg.norm(np.array(flown.sigma_BN), axis=1)))
    assert angle[0] > 59.0
    assert angle[-1] < 0.1
    assert np.abs(np.array(told.motorTorque)).max() <= 0.2
    about = json.loads((folder / "dictionary.json").read_text())
    assert [one["name"] for one in about["inputs"]] == ["time", "mrp", "rate", "wheel_speed"]
