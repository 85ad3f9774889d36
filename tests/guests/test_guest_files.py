"""What goes wrong in code of a user's own is one sentence with its place, exit code 2, and no traceback of ours."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import casadi_gnc as gnc
from casadi_gnc import guests
from casadi_gnc.delivery.verifying import verify
from casadi_gnc.errors import PackageError

FOLDER = Path(__file__).parents[2] / "examples" / "sail"
SAIL, MISSION = (FOLDER / "sail.py").read_text(), (FOLDER / "mission.toml").read_text()
COMMAND = "return -self.attitude_gain * now.angle"
INPUTS = 'inputs = gnc.Layout((gnc.Signal("angle", 3, "rad"), gnc.Signal("gyro", 3, "rad/s")))'

#: (changed file, what, by what, the sentence after its place)
IN_THE_MISSION = {
    "no file": ("./sail.py:SailCraft", "./sale.py:SailCraft", "there is no file sale.py in test_"),
    "no class": ("./sail.py:SailCraft", "./sail.py:Saleboat", "no 'Saleboat'; it defines Sail, SailCraft, NadirPid"),
    "a law for a craft": ("./sail.py:SailCraft", "./sail.py:NadirPid", "which is no craft; expected a class derived"),
    "out of the folder": ("./sail.py:SailCraft", "./../sail.py:SailCraft", "leads out of the problem file's folder"),
    "an absolute path": ("./sail.py:SailCraft", "/opt/sail.py:SailCraft", 'write "./file.py:Class"'),
    "a module of ours": ("./sail.py:SailCraft", "casadi_gnc", "no craft 'casadi_gnc'; there is combined_spacecraft"),
    "a wrong key": ("area_m2 = 32.0", "mode_hz = 3.0", "unknown key; did you mean mode_Hz?"),
    "a wrong number": ("area_m2 = 32.0", "area_m2 = -1.0", "is -1.0, expected a number > 0"),
    "a gain that is none": ("attitude_gain = 0.4", "attitude_gain = nan", "is nan, expected a finite number"),
    "an unknown law": ("./sail.py:NadirPid", "nadir_pid", "no law 'nadir_pid'; there is rate_damping"),
}
IN_THE_CODE = {
    "raises": ("INERTIA = [", "1 / 0\nINERTIA = [", "cannot be run: ZeroDivisionError: division by zero\n"),
    "is no Python": ("INERTIA = [", "def (:\nINERTIA = [", "cannot be run: SyntaxError"),
    "ends the program": ("INERTIA = [", "raise SystemExit(3)\nINERTIA = [", "cannot be run: SystemExit: 3"),
    "wants a neighbour": ("import casadi as ca\n", "import casadi as ca\nimport helper\n", "a guest is one file"),
    "lacks a command": ("def command(", "def commando(", "NadirPid.command failed: TypeError: NadirPid defines no command"),
    "lacks a plant": ("def plant(", "def plants(", "SailCraft.plant failed: TypeError: SailCraft defines no plant"),
    "lacks a state": ("    state = gnc", "    states = gnc", "Sail defines no state"),
    "two for three": (COMMAND, "return now.angle[:2]\n        " + COMMAND, "command returned 2 x 1 numbers, expected a column of 3"),
    "a list": (COMMAND, "return [now.angle[0], 0, 0]\n        " + COMMAND, "command returned a list of 3, expected a column of 3"),
    "nothing": (COMMAND, "return None\n        " + COMMAND, "command returned nothing, expected a column of 3"),
    "no such signal": (COMMAND, "return now.angel\n        " + COMMAND, "has no attribute 'angel'\n"),
    "sizes of a product": (COMMAND, "return ca.mtimes(ca.DM.eye(4), now.angle)\n        " + COMMAND, "Matrix product with incompatible dimensions"),
    "no form in C": (COMMAND, "return ca.erfinv(now.angle)\n        " + COMMAND, "NadirPid.command: operation 'erfinv' has no C form"),
    "what is not measured": (INPUTS, INPUTS.replace("gyro", "gyros"), "it reads gyros, which is not measured; there is angle, gyro"),
    "another unit": (INPUTS, INPUTS.replace('"rad/s"', '"deg/s"'), "it reads gyro in deg/s, and it is measured in rad/s"),
    "another size": (INPUTS, INPUTS.replace('"gyro", 3', '"gyro", 2'), "it reads gyro with 2 elements, and 3 are measured"),
    "another effort": ("gnc.TORQUE", "gnc.FORCE", "it commands force, and the craft makes torque"),
    "shows another name": ('return {"bias_estimate"', 'return {"bias_guess"', "show returned bias_guess; expected the signals"),
    "a name that is taken": ('"bias_estimate"', '"rate"', "NadirPid.outputs names a signal 'rate', and so does Sail.state"),
    "a start of another name": ('"angle": self.angle_rad', '"angles": self.angle_rad', "SailCraft.start gives angles, rate"),
    "a start of another size": ('"rate": [0.0] * 3', '"rate": [0.0] * 2', "SailCraft.start gives 2 numbers of rate, expected 3"),
    "a name that is none": ('"bending", 1', '"ben ding", 1', "signal name 'ben ding' is not an identifier"),
    "two bounds for three": ("most = [self.max_torque_N_m] * 3", "most = [self.max_torque_N_m] * 2", "the effectiveness has shape 3 x 3, expected 3 (torque) x 2"),
    "a plant that raises": ("torque = actuators", "raise RuntimeError('boom')\n        torque = actuators", "Sail.rate failed: RuntimeError: boom\n"),
}  # fmt: skip


def folder_with(tmp_path: Path, sail: str = SAIL, mission: str = MISSION) -> Path:
    (tmp_path / "sail.py").write_text(sail)
    (tmp_path / "mission.toml").write_text(mission)
    return tmp_path / "mission.toml"


@pytest.mark.parametrize("case", IN_THE_MISSION)
def test_a_mission_that_names_it_wrongly(case, tmp_path):
    old, new, message = IN_THE_MISSION[case]
    assert old in MISSION
    with pytest.raises(gnc.GncError) as found:
        gnc.load(folder_with(tmp_path, mission=MISSION.replace(old, new)))
    assert message in str(found.value)
    assert str(found.value).startswith("mission.toml, line ")


@pytest.mark.parametrize("case", IN_THE_CODE)
def test_code_that_is_wrong(case, tmp_path):
    old, new, message = IN_THE_CODE[case]
    assert old in SAIL
    (tmp_path / "helper.py").write_text("")
    with pytest.raises(gnc.GncError) as found:
        gnc.load(folder_with(tmp_path, sail=SAIL.replace(old, new)))
    told = str(found.value)
    assert message in told
    assert told.startswith("mission.toml, line ")
    # Below the sentence stand the guest's own lines, never ours.
    assert all("sail.py" in line or "helper.py" in line for line in told.splitlines()[1:])


def test_a_link_that_leads_out(tmp_path):
    inside = tmp_path / "inside"
    inside.mkdir()
    path = folder_with(inside)
    (inside / "sail.py").unlink()
    (tmp_path / "outside.py").write_text(SAIL)
    os.symlink(tmp_path / "outside.py", inside / "sail.py")
    with pytest.raises(gnc.GncError, match="is a link that leads out of the problem file's folder"):
        gnc.load(path)


def test_below_the_folder_is_fine(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "sail.py").write_text(SAIL)
    path = tmp_path / "mission.toml"
    path.write_text(MISSION.replace("./sail.py", "./parts/sail.py"))
    mission = gnc.load(path)
    assert [file.path for file in mission.guests()] == ["parts/sail.py"]


def test_every_error_at_once(tmp_path):
    wrong = MISSION.replace("area_m2 = 32.0", "area_m2 = -1.0\nmode_hz = 3").replace(
        "rate_gain = 3.0", "rate_gain = -3.0"
    )
    wrong = wrong.replace("duration_s = 600.0", "duration_s = 600.03").replace('kind = "settling"', 'kind = "setling"')
    with pytest.raises(gnc.GncError) as found:
        gnc.load(folder_with(tmp_path, mission=wrong))
    lines = [line.split(":")[0] for line in str(found.value).splitlines()]
    assert lines == [
        "mission.toml, line 7, spacecraft.area_m2",
        "mission.toml, line 8, spacecraft.mode_hz",
        "mission.toml, line 10, timing",
        "mission.toml, line 17, scheme[1].law.rate_gain",
        "mission.toml, line 21, metric[1].kind",
    ]


def test_the_command_line_says_what_runs_and_ends_with_two(tmp_path):
    folder_with(tmp_path, sail=SAIL.replace("INERTIA = [", "1 / 0\nINERTIA = ["))
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "check", "mission.toml"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    first, *rest = done.stderr.splitlines()
    assert first.startswith("casadi-gnc: running the code of sail.py (sha256 ")
    assert rest[0].startswith(
        "casadi-gnc: mission.toml, line 6, spacecraft.model: sail.py cannot be run: ZeroDivisionError"
    )
    assert "Traceback" not in done.stderr


def test_the_digest_is_of_the_code_too(tmp_path):
    first = gnc.load(folder_with(tmp_path)).digest
    assert gnc.load(folder_with(tmp_path)).digest == first
    assert gnc.load(folder_with(tmp_path, sail=SAIL.replace("0.005", "0.006"))).digest != first


def test_one_text_is_one_class_and_another_text_another(tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    one.mkdir()
    two.mkdir()
    first, again = gnc.load(folder_with(one)), gnc.load(folder_with(two))
    assert type(first.craft) is type(again.craft)
    other = gnc.load(folder_with(two, sail=SAIL.replace("0.8", "0.7")))
    assert type(first.craft) is not type(other.craft)
    # Two guests of one name in one process: each flies its own.
    assert other.truth.coupling == 0.7
    assert first.truth.coupling == 0.8


@pytest.mark.slow
def test_a_package_tells_that_its_code_was_changed(tmp_path):
    package = tmp_path / "package"
    gnc.generate(folder_with(tmp_path), package, steps=40)
    assert verify(package)["words"] == 0
    (package / "sail.py").write_text(SAIL.replace("0.8", "0.7"))
    with pytest.raises(PackageError, match=r"sail.py was changed since the package was generated \(sha256 .*generate"):
        verify(package)


def test_told_is_one_sentence():
    assert guests.told(KeyError("x")) == "KeyError: 'x'"
