"""Shipped flights and packages keep their words: hashes of what was flown before, on any machine and compiler.

The hashes are no truth of their own: what is right is tested elsewhere. They tell a change that was not meant to
change an answer from one that was. An erratum of ours changes them, and then the commit says which.
`python tests/missions/test_words_stay.py` writes them anew.
"""

import hashlib
import json
import re
import sys
import tempfile
from pathlib import Path

import numpy as np
import pytest

import casadi_gnc

FILE = Path(__file__).with_name("words_of_shipped_missions.json")
WORDS = json.loads(FILE.read_text())
#: Samples that are flown, every one recorded; and steps of a package's flight.
SAMPLES, STEPS = 200, 64
#: One scheme of each craft is enough for every day; all are in the long run.
FEW = (
    "huang2019/wheel_faults:observers_robust",
    "huang2020/slew:funnel_robust",
    "shi2020/docking:iobc",
    "sun2018/circular_orbit:tracking",
    "tao2019/case1:funnels",
)


def record_of(name: str) -> str:
    """Return the hash of the first samples of a scheme's flight in our own arithmetic."""
    problem, scheme = name.split(":")
    mission = casadi_gnc.load(problem, strict=False)
    short = mission.with_timing(duration=mission.timing.sample_period * SAMPLES, record_every=1)
    return hashlib.sha256(np.ascontiguousarray(casadi_gnc.fly(short, scheme).samples).tobytes()).hexdigest()


def vectors_of(name: str) -> str:
    """Return the hash of the words of a scheme's package, in and out."""
    problem, scheme = name.split(":")
    with tempfile.TemporaryDirectory() as folder:
        casadi_gnc.generate(problem, Path(folder) / "package", scheme=scheme, steps=STEPS)
        text = (Path(folder) / "package" / "test" / "vectors.c").read_text()
    return hashlib.sha256(" ".join(re.findall(r"0x[0-9a-f]+u[l]*", text)).encode()).hexdigest()


def cases() -> list:
    return [pytest.param(name, marks=() if name in FEW else pytest.mark.slow) for name in WORDS]


@pytest.mark.parametrize("name", cases())
def test_records(name):
    assert record_of(name) == WORDS[name]["record"]


@pytest.mark.parametrize("name", cases())
def test_packages(name):
    assert vectors_of(name) == WORDS[name]["vectors"]


def test_every_scheme_is_there():
    shipped = {
        f"{problem}:{scheme.name}"
        for problem in casadi_gnc.shipped()
        if casadi_gnc.problem_files.read(problem).data["kind"] == "mission"
        for scheme in casadi_gnc.load(problem, strict=False).schemes
    }
    assert shipped == set(WORDS)


if __name__ == "__main__":
    found = {name: {"record": record_of(name), "vectors": vectors_of(name)} for name in WORDS}
    FILE.write_text(json.dumps(found, indent=1) + "\n")
    sys.exit(0 if found == WORDS else 1)
