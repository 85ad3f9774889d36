"""Every check that can fail is right about two flights: the one it fails misbehaves, the one it passes does not."""

import importlib.util
import json
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import casadi_gnc
from casadi_gnc.checking import check
from casadi_gnc.missions.flight import Flight
from casadi_gnc.status import StepStatus

DOCS = Path(__file__).parents[2] / "docs"
CASES = tomllib.loads((DOCS / "check_cases.toml").read_text(encoding="utf-8"))["case"]


def test_table_of_the_documentation_is_current():
    spec = importlib.util.spec_from_file_location("check_cases", DOCS / "check_cases.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    page = (DOCS / "check.md").read_text(encoding="utf-8")
    assert script.rendered(page, CASES) == page


@cache
def checked_and_flown(problem: str, scheme: str, changes: str) -> tuple[dict[str, str], Flight]:
    """Return verdicts by check, and the flight; several pairs pass by the same mission."""
    mission = casadi_gnc.load(problem, json.loads(changes), strict=False)
    return {each.name: each.verdict for each in check(mission, scheme)}, casadi_gnc.fly(mission, scheme)


def misbehaves(flight: Flight, shows: dict[str, Any]) -> bool:
    """Return whether the flight shows what it must not."""
    if flight.diverged:
        return True
    if "status" in shows:
        return StepStatus[shows["status"]] in flight.statuses
    if "metric" in shows:
        return flight.metrics[shows["metric"]] is None
    if "at_least" in shows:
        return not flight.block(shows["signal"]).min() >= shows["at_least"]
    late = np.abs(flight.block(shows["signal"])[flight.time >= shows["after_s"]])
    return not late.max() <= shows["at_most"]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case["check"])
@pytest.mark.parametrize("side", ["fails", "passes"])
def test_check_and_flight_agree(case, side):
    found, flight = checked_and_flown(case["problem"], case["scheme"], json.dumps(case[side]))
    if side == "fails":
        assert found[case["check"]] == "fail"
    else:
        assert "fail" not in found.values()
    assert misbehaves(flight, case["shows"]) == (side == "fails")
