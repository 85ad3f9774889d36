"""Missions, flights and controllers as objects: made without a file, changed, pickled, stepped, written."""

import csv
import pickle
import re
import subprocess
import sys
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.io import loadmat

import casadi_gnc as gnc
from casadi_gnc import problem_files
from casadi_gnc.delivery import making
from casadi_gnc.delivery.vectors import CompiledPlant
from casadi_gnc.embedded import saving
from casadi_gnc.embedded.controller import Options
from casadi_gnc.embedded.machine import Machine
from casadi_gnc.errors import FlightError, LawError, OutputError, PackageError
from casadi_gnc.laws import AttitudePD, RateDamping
from casadi_gnc.mechanics import RigidBody
from casadi_gnc.missions import onboard
from casadi_gnc.starters.craft import StarterCraft

INERTIA = [[12.0, 0.0, 0.0], [0.0, 14.0, 0.0], [0.0, 0.0, 9.0]]
INITIAL = {"mrp": [0.1, -0.05, 0.08], "rate_rad_per_s": [0.002, 0.0, -0.001]}
SHIPPED = ("huang2020/detumble", "huang2019/wheel_faults", "shi2020/docking", "sun2018/circular_orbit", "tao2019/case1")


def craft(**changes) -> StarterCraft:
    return StarterCraft(**{"inertia_kg_m2": INERTIA, "max_torque_N_m": 0.05, "initial": INITIAL, **changes})


def made(craft: gnc.Craft, **changes) -> gnc.Mission:
    law = AttitudePD(body=RigidBody(ca.DM(INERTIA)), attitude_gain=0.4, rate_gain=3.0)
    schemes = [gnc.Scheme("pd", law=law, actuation=craft.actuation())]
    return gnc.Mission(craft, schemes, gnc.Timing("sampled", 0.1, 20.0), **changes)


def test_a_mission_without_any_file_does_everything(tmp_path):
    mission = made(craft(), metrics=[gnc.Metric("peak", "peak", "mrp")])
    assert mission.scheme().law.hold == 0.1
    assert {each.verdict for each in gnc.check(mission)} == {"ok"}
    flight = gnc.fly(mission)
    assert flight.metrics["peak"] == pytest.approx(0.1, rel=1e-2)  # it starts so, and drifts on for a moment
    assert gnc.generate(mission, tmp_path / "pd", steps=60)["problem"]["made_of"] == "objects"
    found = gnc.verify(tmp_path / "pd")
    assert (found["words"], found["edited"], found["not_regenerated"]) == (0, [], [])
    assert gnc.generate_fmu(mission, tmp_path / "pd.fmu").is_file()


def test_the_same_by_a_file_and_by_objects_flies_the_same_words(tmp_path):
    from casadi_gnc.cli.main import app  # noqa: F401 - the command writes what is loaded here

    subprocess.run([sys.executable, "-m", "casadi_gnc.cli.main", "new", "craft", "Mine"], cwd=tmp_path, check=True)
    by_file = gnc.load(tmp_path / "mine.toml", {"timing.duration_s": 20.0})
    by_objects = made(craft(disturbance_N_m=[1e-4, 0.0, -1e-4]))
    assert np.array_equal(gnc.fly(by_file).samples, gnc.fly(by_objects).samples)


def test_arrays_and_tuples_are_lists_to_a_craft():
    assert craft(inertia_kg_m2=np.array(INERTIA)).inertia_kg_m2 == INERTIA
    assert craft(inertia_kg_m2=ca.DM(INERTIA)).inertia_kg_m2 == INERTIA
    with pytest.raises(gnc.GncError, match="max_torque_N_m: is -1, expected a number > 0; mass: unknown key"):
        craft(max_torque_N_m=-1, mass=3.0)


def test_what_does_not_fit_is_told():
    whole = craft()
    law = AttitudePD(body=RigidBody(ca.DM(INERTIA)), attitude_gain=0.4, rate_gain=3.0)
    scheme = gnc.Scheme("pd", law=law, actuation=whole.actuation())
    timing = gnc.Timing("sampled", 0.1, 20.0)
    with pytest.raises(FlightError, match="two schemes of mission are named 'pd'"):
        gnc.Mission(whole, [scheme, scheme], timing)
    with pytest.raises(FlightError, match="has no scheme"):
        gnc.Mission(whole, [], timing)
    bounds = gnc.load("huang2020/slew").funnels[0].bounds
    with pytest.raises(FlightError, match="a funnel of 'angle', which is not measured"):
        gnc.Mission(whole, [scheme], timing, funnels=[gnc.Funnel("angle", bounds)])
    with pytest.raises(FlightError, match="'angle' of the metric 'peak' is no signal of scheme pd; there is time, mrp"):
        gnc.Mission(whole, [scheme], timing, metrics=[gnc.Metric("peak", "peak", "angle")])
    with pytest.raises(FlightError, match="start_from names 'angle', which is no state"):
        gnc.Mission(whole, [scheme], timing, start_from={"angle": [1.0]})
    docking = gnc.load("shi2020/docking")
    with pytest.raises(FlightError, match=r"the law IntermediateObserver .* does not fit StarterCraft: it reads pos"):
        gnc.Mission(whole, [gnc.Scheme("far", docking.scheme().law, whole.actuation())], timing)
    with pytest.raises(FlightError, match=r"limit_below has 0 numbers, expected 3"):
        gnc.Actuation(ca.DM.eye(3), [-1.0] * 3, [1.0] * 3, allocator=scheme.actuation.allocator)


def test_a_scheme_takes_another_law():
    mission = made(craft())
    damped = mission.with_scheme(law=RateDamping(body=RigidBody(ca.DM(INERTIA)), rate_gain=3.0))
    assert damped.scheme().law.hold == 0.1
    assert gnc.fly(damped)["rate"][-1] == pytest.approx(np.zeros(3), abs=1e-3)
    assert mission.with_scheme(attitude_gain=0.8).scheme().law.attitude_gain == 0.8
    with pytest.raises(FlightError, match="has no 'attitude_gian'; its law has attitude_gain"):
        mission.with_scheme(attitude_gian=0.8)


@pytest.mark.slow
def test_changes_of_a_loaded_mission_are_paths_of_its_file(tmp_path):
    """So that a package can keep the file and say what was changed."""
    loaded = gnc.load("huang2020/detumble")
    changed = loaded.with_scheme("observer_pinv", rate_gain=0.5).with_timing(sample_period=0.05)
    assert changed.origin.changes == {"scheme.observer_pinv.law.rate_gain": 0.5, "timing.sample_period_s": 0.05}
    assert changed.digest != loaded.digest
    again = gnc.load("huang2020/detumble", changed.origin.changes)
    assert again.digest == changed.digest
    about = gnc.generate(changed, tmp_path / "changed", scheme="observer_pinv", steps=60)
    assert about["problem"]["changes"] == changed.origin.changes
    assert gnc.verify(tmp_path / "changed")["words"] == 0
    assert loaded.with_scheme("observer_pinv", law=loaded.scheme("damping_pinv").law).origin is None


def test_what_may_change_anything_forgets_the_file():
    """The digest of a mission that is no longer its file is no longer the file's; a pickle's still is."""
    from dataclasses import replace

    loaded = gnc.load("huang2020/detumble")
    law = replace(loaded.scheme().law, rate_gain=0.7)
    other = replace(loaded, schemes=[replace(loaded.scheme(), law=law)])
    assert other.origin is None
    assert other.digest != loaded.digest
    assert pickle.loads(pickle.dumps(loaded)).origin == loaded.origin


@pytest.mark.parametrize("name", ["a b/c", "../up", "", "1st", "lineend\n"])
def test_a_scheme_has_a_name_that_files_can_have(name):
    with pytest.raises(FlightError, match="expected letters, digits and _, the first a letter"):
        gnc.Scheme(name, RateDamping(body=RigidBody(ca.DM(INERTIA)), rate_gain=3.0), craft().actuation())


def test_a_mission_that_is_no_longer_its_file_keeps_its_controller(tmp_path):
    from dataclasses import replace

    loaded = gnc.load("huang2020/detumble").with_scheme("observer_pinv")
    scheme = loaded.scheme()
    other = replace(loaded, schemes=[replace(scheme, law=replace(scheme.law, rate_gain=0.7))])
    controller, options = onboard.describe(other), Options("detumble")
    files, about = making.kept(other, controller, options, fresh=False)
    assert about["made_of"] == "objects"
    assert list(files) == ["controller.json"]


@pytest.mark.parametrize(("problem", "scheme"), [("huang2020/slew", "funnel_robust"), ("sun2018/circular_orbit", None)])
def test_a_controller_that_was_written_down_gives_the_same_words(problem, scheme, rng):
    mission = gnc.load(problem)
    controller = onboard.describe(mission, scheme)
    again = saving.from_text(saving.to_text(controller))
    start = np.array(mission.first_measurement()).ravel()
    rows = np.array([np.r_[k * controller.period, start * (1 + 0.01 * rng.normal(size=start.size))] for k in range(20)])
    assert np.array_equal(Machine(controller).replay(rows), Machine(again).replay(rows))
    with pytest.raises(PackageError, match="the controller cannot be read"):
        saving.from_text('{"format": 1}')


@pytest.mark.parametrize("problem", SHIPPED)
def test_missions_pickle(problem):
    mission = gnc.load(problem)
    again = pickle.loads(pickle.dumps(mission))
    assert again.digest == mission.digest
    short = mission.timing.sample_period * 20
    flights = [gnc.fly(each.with_timing(duration=short, record_every=1), engine="vm") for each in (mission, again)]
    assert np.array_equal(flights[0].samples, flights[1].samples)


def test_what_cannot_pickle_says_why():
    mission = gnc.load("huang2020/detumble").with_scheme("observer_pinv", rate_gain=ca.SX.sym("k"))
    with pytest.raises(FlightError, match="(?s)cannot go to another process: .*numbers in the place of symbols"):
        pickle.dumps(mission)


@pytest.mark.parametrize(
    ("problem", "scheme"), [("huang2020/slew", "funnel_robust"), ("huang2020/detumble", "observer_pinv")]
)
def test_a_stepped_controller_has_the_words_of_the_package(problem, scheme, tmp_path):
    """The shipped vectors of a package, stepped by hand, bad measurements at their end included."""
    mission = gnc.load(problem)
    gnc.generate(mission, tmp_path / "package", scheme=scheme, steps=80)
    from casadi_gnc.delivery.verifying import read_vectors

    given, expected = (words.view(float) for words in read_vectors(tmp_path / "package", "float64"))
    controller = mission.controller(scheme)
    assert controller.compiled
    layout, outputs = mission.truth.measurement, expected[:, :-1]
    for k, row in enumerate(given):
        found = controller.step(row[0], **vars(layout.split(row[1:])))
        told = np.concatenate([np.atleast_1d(found[name]) for name in found if name != "status"])
        assert np.array_equal(told.view(np.uint64), outputs[k].view(np.uint64)), k
        assert int(found["status"]) == int(expected[k, -1:].view(np.uint64)[0]), k
    controller.reset()
    again = controller.step(given[0][0], **vars(layout.split(given[0][1:])))
    assert np.array_equal(again["force"], expected[0, :12])


def test_a_controller_flies_a_plant_of_ones_own():
    """Closed by hand with the mission's plant: the flight of the engine, word for word."""
    mission = gnc.load("huang2020/detumble").with_scheme("observer_pinv")
    controller, plant = mission.controller(), CompiledPlant(mission, mission.scheme())
    flight = gnc.fly(mission.with_timing(duration=3.0))
    for k in range(30):
        t, *y = plant.measure(k)
        force = controller.step(t, **vars(mission.truth.measurement.split(np.array(y))))["force"]
        assert np.array_equal(force, flight["force"][k]), k
        plant.advance(k, force)


def test_a_controller_refuses_what_it_cannot_step():
    controller = gnc.load("huang2020/detumble").controller("observer_pinv")
    with pytest.raises(FlightError, match="step was given mrp; expected each of mrp, rate"):
        controller.step(0.0, mrp=[0, 0, 0])
    with pytest.raises(FlightError, match="rate has 2 numbers, expected 3"):
        controller.step(0.0, mrp=[0, 0, 0], rate=[0, 0])
    controller.step(0.0, mrp=[0, 0, 0], rate=[0, 0, 0])
    with pytest.raises(FlightError, match="the time 0 s is not after the last one"):
        controller.step(0.0, mrp=[0, 0, 0], rate=[0, 0, 0])
    found = controller.step(0.1, mrp=[np.nan] * 3, rate=[0, 0, 0])
    assert gnc.StepStatus.MEASUREMENT_REPLACED in found["status"]


@pytest.fixture(scope="module")
def flight():
    return gnc.fly(gnc.load("huang2020/detumble").with_timing(duration=5.0), "damping_pinv", engine="vm")


def test_a_flight_behaves_like_a_mapping(flight):
    assert "rate" in flight
    assert "angle" not in flight
    assert list(flight) == list(flight.keys()) == flight._ipython_key_completions_()
    assert len(flight) == len(flight.keys())
    assert dict(zip(flight, (flight[name] for name in flight), strict=True)).keys() == flight.signals.keys()
    assert re.match(r"Flight\(detumble, damping_pinv: 51 samples of \d+ numbers; settling_time never", repr(flight))
    assert "<td>settling_time</td><td>never</td>" in flight._repr_html_()


def test_a_flight_is_written_as_table_and_for_matlab(flight, tmp_path):
    with flight.to_csv(tmp_path / "out" / "flight.csv").open() as file:
        names, units, *rows = csv.reader(file)
    assert names[:4] == ["time", "mrp_1", "mrp_2", "mrp_3"]
    assert units[names.index("rate_1")] == "rad/s"
    assert np.array_equal(np.array(rows, dtype=float), flight.samples)
    content = loadmat(flight.to_mat(tmp_path / "flight.mat"))
    assert np.array_equal(content["rate"], flight["rate"])
    assert content["units"]["rate"].item().item() == "rad/s"
    with pytest.raises(OutputError, match=r"flight.txt does not end in .csv"):
        flight.to_csv(tmp_path / "flight.txt")
    assert not (tmp_path / "flight.txt").exists()


def test_a_flight_becomes_a_table_of_pandas_where_there_is_pandas(flight, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(FlightError, match="pandas is not installed"):
        flight.to_pandas()

    class Frame:
        def __init__(self, samples, columns):
            self.samples, self.columns = samples, columns

        def set_index(self, name):
            assert name == "time"
            return self

    monkeypatch.setitem(sys.modules, "pandas", type("pandas", (), {"DataFrame": Frame}))
    assert flight.to_pandas().columns[0] == "time"


def test_a_mission_and_a_craft_print_on_one_screen():
    for problem in SHIPPED:
        mission = gnc.load(problem)
        for shown in (repr(mission), repr(mission.craft)):
            assert len(shown.splitlines()) <= 24
            assert max(map(len, shown.splitlines())) <= 110


def test_names_do_for_missions():
    assert gnc.fly("huang2020/detumble", "damping_pinv", engine="vm", mode="sampled", decimation=15000).scheme
    with pytest.raises(gnc.GncError, match="an object of type int is no mission; expected a casadi_gnc.Mission"):
        gnc.fly(3)
    with pytest.raises(FlightError, match="no engine 'cuda'; there is c, vm"):
        gnc.fly("huang2020/detumble", engine="cuda")


def test_a_law_that_gives_a_python_list_is_told_when_the_mission_is_made():
    from dataclasses import dataclass

    @dataclass(frozen=True, eq=False)
    class Wrong(gnc.Law):
        """Forget to stack."""

        inputs = gnc.Layout((gnc.Signal("rate", 3, "rad/s"),))

        def command(self, t, y, m):
            return [0.0, 0.0, 0.0]

    with pytest.raises(LawError, match="Wrong.command returned a list of 3, expected a column of 3 numbers"):
        made(craft()).with_scheme(law=Wrong())


def test_overrides_reach_where_the_file_is_silent():
    base = gnc.load("huang2020/slew")
    assert base.noise.seed == 1
    assert gnc.load("huang2020/slew", {"noise.seed": 3}).noise.seed == 3
    assert "noise" not in problem_files.read("huang2020/slew").data
    quiet = problem_files.read("huang2019/fault_free")
    quiet.data.pop("sensors", None)
    assert problem_files.load_document(quiet).truth.noise.size == 0
    assert problem_files.load_document(quiet, {"sensors.mrp_deviation": 1e-3}).truth.noise.size == 8
    quiet.data.pop("truth", None)
    moved = problem_files.load_document(quiet, {"truth.centre_of_mass_error_m.1": 0.01})
    assert moved.craft.truth.centre_of_mass_error_m == [0.01, 0.0, 0.0]
    pushed = gnc.load("huang2020/slew", {"environment.constant_torque_N_m.2": 1e-3})
    assert pushed.truth.disturbance.constant[1] == 1e-3
    with pytest.raises(gnc.GncError, match="'noise.sed' leads nowhere: noise has no 'sed'; did you mean seed"):
        gnc.load("huang2020/slew", {"noise.sed": 3})
    with pytest.raises(gnc.GncError, match="slew.toml: 'noize.seed' leads nowhere: the file has no 'noize'; did you"):
        gnc.load("huang2020/slew", {"noize.seed": 3})


def test_the_folder_of_a_craft_is_a_template(tmp_path, monkeypatch):
    """Copied outside under another name it is a craft of one's own, and flies the same words."""
    import shutil

    from casadi_gnc.missions.craft import REGISTRY
    from casadi_gnc.vehicles import wheel_spacecraft

    shutil.copytree(Path(wheel_spacecraft.__file__).parent, tmp_path / "my_wheels")
    monkeypatch.syspath_prepend(str(tmp_path))
    import my_wheels

    monkeypatch.setitem(REGISTRY._registered, "my_wheels", my_wheels.WheelSpacecraftCraft)
    ours = gnc.load("huang2019/wheel_faults", {"timing.duration_s": 5.0})
    theirs = gnc.load("huang2019/wheel_faults", {"timing.duration_s": 5.0, "spacecraft.model": "my_wheels"})
    assert type(theirs.craft).__module__ == "my_wheels.craft"
    for scheme in ("observers_pinv", "observers_robust"):
        flights = [gnc.fly(mission, scheme, engine="vm") for mission in (ours, theirs)]
        assert np.array_equal(flights[0].samples, flights[1].samples)
