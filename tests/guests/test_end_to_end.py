"""A stranger's folder and a stranger's package, with the wheel in a clean environment and nothing edited.

examples/sail is the folder: a craft with its own plant, a flexible mode, a gyro with bias, a law with an estimator
inside. The same is then done through the entry points of a second, small wheel.
"""

import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SAIL = ROOT / "examples" / "sail"

PROJECT = """
[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "mysail"
version = "1.0"

[project.entry-points."casadi_gnc.crafts"]
sail = "mysail.sail:SailCraft"

[project.entry-points."casadi_gnc.laws"]
nadir_pid = "mysail.sail:NadirPid"
"""

COMPARE = """
import pickle, subprocess, sys
import numpy as np
import casadi_gnc as gnc

mission = gnc.load("mission.toml").with_timing(duration=30.0)
flights = [gnc.fly(mission, engine=engine, maths="libm") for engine in ("c", "vm")]
words = [flight.samples.view(np.uint64) for flight in flights]
assert flights[0].made["engine"] == "c"
assert (words[0] == words[1]).all()
with open("mission.pickle", "wb") as file:
    pickle.dump(mission, file)
other = "import pickle, casadi_gnc; flight = casadi_gnc.fly(pickle.load(open(r'FILE', 'rb')));"
other = other.replace("FILE", sys.argv[1]) + "print(flight.samples.tobytes().hex()[-64:])"
found = subprocess.run([sys.executable, "-c", other], cwd="/", capture_output=True, text=True)
assert found.returncode == 0, found.stderr
assert found.stdout.strip() == gnc.fly(mission).samples.tobytes().hex()[-64:]
"""

UNIT = """
import fmpy, numpy as np, sys
import casadi_gnc as gnc

period, steps = 0.1, 50
controller = gnc.load("mission.toml").controller()
angle, gyro = np.array([0.2, -0.1, 0.1]), np.array([1e-3, -5e-4, 2e-4])
names = [f"{name}[{i}]" for name in ("angle", "gyro") for i in (1, 2, 3)]
signals = np.zeros(steps + 1, dtype=[("time", float), *((name, float) for name in names)])
signals["time"] = period * np.arange(steps + 1)
for i, name in enumerate(names):
    signals[name] = np.concatenate([angle, gyro])[i]
told = fmpy.simulate_fmu("nadir.fmu", stop_time=period * steps, step_size=period, output_interval=period,
                         input=signals, output=["torque[1]", "torque[2]", "torque[3]"])
for k in range(steps):
    expected = controller.step(k * period, angle=angle, gyro=gyro)["torque"]
    assert [told[f"torque[{i}]"][k + 1] for i in (1, 2, 3)] == list(expected), k
"""


class Home:
    """A clean environment with the wheel, and a folder that is not the source tree."""

    def __init__(self, folder: Path, wheel: Path) -> None:
        self.folder = folder / "mysat"
        shutil.copytree(SAIL, self.folder)
        venv.create(folder / "venv", with_pip=True)
        self.bin = folder / "venv" / "bin"
        kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")}
        self.environment = {**kept, "CASADI_GNC_CACHE": str(folder / "cache")}
        self.run("python", "-m", "pip", "install", "--quiet", str(wheel), "fmpy", "hatchling")

    def run(self, program: str, *arguments: str) -> str:
        command = [str(self.bin / program), *arguments]
        done = subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True, text=True, timeout=900
        )
        assert done.returncode == 0, f"{arguments}\n{done.stdout}{done.stderr}"
        return done.stdout

    def gnc(self, *arguments: str) -> str:
        return self.run("casadi-gnc", *arguments)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    dist = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(dist), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True, timeout=600)
    (wheel,) = dist.glob("*.whl")
    return Home(tmp_path_factory.mktemp("home"), wheel)


def everything(home: Home, package: str) -> None:
    """Check, fly on both engines, generate, verify on the host, fly as a mock-up unit, pickle."""
    home.gnc("check", "mission.toml")
    summary = json.loads(home.gnc("fly", "mission.toml", "--out", "out", "--figures", "out", "--json"))
    assert summary["schemes"][0]["metrics"]["settling_time"]["value"] == pytest.approx(90.7, abs=0.2)
    assert (home.folder / "out" / "nadir.png").stat().st_size > 10_000
    home.run("python", "-c", COMPARE, str(home.folder / "mission.pickle"))
    home.gnc("generate", "mission.toml", "--out", package, "--force")
    found = json.loads(home.gnc("verify", package, "--json"))
    assert (found["words"], found["edited"], found["not_regenerated"]) == (0, [], [])
    home.gnc("generate", "mission.toml", "--format", "fmu", "--out", "nadir.fmu")
    home.run("python", "-c", UNIT)


@pytest.mark.slow
def test_a_folder_of_ones_own(home):
    assert len((home.folder / "sail.py").read_text().splitlines()) <= 120
    everything(home, "flight/nadir")
    # The package keeps the code: it is verified where the folder is not.
    elsewhere = home.folder.parent / "elsewhere"
    shutil.copytree(home.folder / "flight" / "nadir", elsewhere)
    assert json.loads(home.gnc("verify", str(elsewhere), "--json"))["words"] == 0
    schema = json.loads(home.gnc("schema", "mission.toml"))
    assert "area_m2" in schema["properties"]["spacecraft"]["properties"]
    laws = schema["properties"]["scheme"]["items"]["properties"]["law"]["anyOf"]
    assert any("observer_pole" in law["properties"] for law in laws)


@pytest.mark.slow
@pytest.mark.tools("arm-none-eabi-gcc", "qemu-system-arm")
def test_the_words_on_a_cortex_m7(home):
    home.gnc("generate", "mission.toml", "--out", "flight/board", "--force")
    found = json.loads(home.gnc("verify", "flight/board", "--target", "host,cortex-m7", "--json"))
    assert found["words"] == 0
    assert found["targets"][0]["target"] == "cortex-m7"


@pytest.mark.slow
def test_the_same_through_entry_points(home):
    project = home.folder.parent / "project"
    (project / "mysail").mkdir(parents=True)
    (project / "pyproject.toml").write_text(PROJECT)
    (project / "mysail" / "__init__.py").write_text("")
    shutil.copy(SAIL / "sail.py", project / "mysail" / "sail.py")
    home.run("python", "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation", str(project))
    text = (SAIL / "mission.toml").read_text()
    text = text.replace("./sail.py:SailCraft", "sail").replace("./sail.py:NadirPid", "nadir_pid")
    (home.folder / "mission.toml").write_text(text)
    (home.folder / "sail.py").unlink()
    everything(home, "flight/installed")
    assert "nadir_pid" in home.gnc("laws", "--show", "nadir_pid")
    assert "nadir_pid" in home.gnc("crafts", "--show", "sail")
