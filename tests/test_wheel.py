"""The built wheel, installed in a clean environment with nothing of the source tree in reach; from the lock file."""

import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"]
    subprocess.run([*command, "--wheel-dir", str(folder), str(ROOT)], check=True, capture_output=True, timeout=600)
    (built,) = folder.glob("*.whl")
    return built


def test_assets_and_licences_are_inside(wheel):
    names = set(zipfile.ZipFile(wheel).namelist())
    for tracked in (
        "codegen/runtime/gnc_math.h",
        "codegen/templates/flight.c.j2",
        "codegen/LICENSE",
        "problems/huang2020/detumble.toml",
    ):
        assert f"casadi_gnc/_assets/{tracked}" in names
    assert not [name for name in names if name.startswith(("tests/", "codegen/", "problems/", "examples/"))]
    assert any(name.endswith("licenses/LICENSE") for name in names)


@pytest.mark.slow
def test_wheel_flies_in_a_clean_environment(wheel, tmp_path):
    home = tmp_path / "venv"
    venv.create(home, with_pip=True)
    python = home / "bin" / "python"
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV", "PYTHONHOME")}

    def run(*command: str) -> str:
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=900)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    install = (str(python), "-m", "pip", "install", "--quiet")
    run(*install, "--require-hashes", "--requirement", str(ROOT / "requirements.lock"))
    run(*install, "--no-deps", str(wheel))
    run(str(python), "-m", "pip", "check")
    program = str(home / "bin" / "casadi-gnc")
    assert "huang2020/detumble" in run(program, "problems")
    run(program, "problems", "copy", "huang2020/detumble", ".")
    file = tmp_path / "detumble.toml"
    file.write_text(file.read_text().replace("duration_s = 1500.0", "duration_s = 20.0"))
    summary = json.loads(run(program, "fly", "detumble.toml", "--out", "out", "--json"))
    assert len(summary["schemes"]) == 3
    assert run(str(python), "-c", "import casadi_gnc; print(casadi_gnc.__file__)").startswith(str(home))
