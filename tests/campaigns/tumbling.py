"""A short de-tumble that the tests of campaigns share: flown many times, from Python and by the command line."""

from __future__ import annotations

import dataclasses
import hashlib
import subprocess
import sys
from pathlib import Path

import casadi_gnc
from casadi_gnc.campaigns import DispersionTable

INERTIA = DispersionTable(key="truth.inertia_factor", normal={"mean": 1.0, "deviation": 0.03, "truncate": 3.0})

RATES = DispersionTable(key="initial.rate_rad_per_s", uniform=[-0.05, 0.05])


def short(name, samples=200):
    mission = casadi_gnc.load(name)
    return mission.with_timing(duration=samples * mission.timing.sample_period)


def detumble(samples=400, **options):
    mission = short("huang2020/detumble", samples).with_scheme("observer_pinv")
    mission = dataclasses.replace(mission, metrics=(casadi_gnc.Metric("final_rate", "final", "rate"),))
    return {"mission": mission, "flights": 100, "dispersions": [INERTIA, RATES], **options}


def flown(**options):
    given = detumble(**options)
    return casadi_gnc.campaign(given.pop("mission"), given.pop("flights"), **given)


def tables(folder):
    return {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in folder.iterdir() if not p.name.startswith(".")}


def command(*arguments):
    return [str(Path(sys.executable).with_name("casadi-gnc")), *map(str, arguments)]


def run(*arguments):
    return subprocess.run(command(*arguments), capture_output=True, text=True, timeout=300)
