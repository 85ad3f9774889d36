"""A tuning from the command to the file: what it promises is flown again here, by the virtual machine and NumPy."""

import dataclasses
import json
import subprocess
import sys
import tomllib

import numpy as np
import pytest
from braked_block import written

import casadi_gnc as gnc
from casadi_gnc.errors import GncError
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load

pytestmark = pytest.mark.slow

MORE = """
[[requirement]] # of the turn
id = "ACS-1"
formula = "always[20, 40](norm(mrp) <= 0.05)"

[[requirement]]
id = "ACS-2"
metric = "largest_wheel_speed"
at_most = 250.0

[[dispersion]]
key = "spacecraft.inertia_kg_m2.1.1"
uniform = [70.0, 100.0]

[[dispersion]]
key = "initial.angle_deg"
normal = { mean = 60.0, deviation = 5.0, truncate = 3.0 }
"""

DISPERSED = """[[dispersion]]
key = "spacecraft.wind_N"
uniform = [-0.5, 0.5]

[[dispersion]]
key = "spacecraft.speed_m_per_s"
normal = { mean = 1.0, deviation = 0.1 }
"""


@pytest.fixture(scope="module")
def mission(tmp_path_factory):
    """Return a slew of 40 s, its gains three times too small and three times too large."""
    text = read("satellites/slew").text.replace("duration_s = 300.0", "duration_s = 40.0 # short")
    text = text.replace("attitude_gain = 4.0, rate_gain = 18.0 }", "attitude_gain = 1.33, rate_gain = 54.0 } # detuned")
    path = tmp_path_factory.mktemp("tuned") / "mission.toml"
    path.write_text(text + MORE)
    return path


def run(*arguments):
    program = [sys.executable, "-m", "casadi_gnc.cli.main", *arguments]
    return subprocess.run(program, capture_output=True, text=True, timeout=300)


def cost_flown(path):
    """Return the time integral of the norm of the attitude, flown by CasADi's virtual machine."""
    flight = gnc.fly(path, engine="vm", maths="libm", decimation=1)
    return np.linalg.norm(flight["mrp"], axis=1).mean() * flight.time[-1]


def test_the_command_writes_better_gains_and_says_what_moved(mission):
    out, page = mission.with_name("nominal.toml"), mission.with_name("nominal.html")
    done = run("tune", str(mission), "--free", "attitude_gain,rate_gain", "--cost", "integral(mrp)",
               "--iterations", "8", "--threads", "1", "--out", str(out), "--json", "--report")  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    law = tomllib.loads(out.read_text())["scheme"][0]["law"]
    assert {one["name"]: one["after"] for one in found["gains"]} == {key: law[key] for key in law if key != "type"}
    assert all(float(f"{law[key]:.3g}") == law[key] for key in law if key != "type")
    changed = [line for line in out.read_text().splitlines() if line not in mission.read_text().splitlines()]
    assert len(changed) == 1
    assert changed[0].endswith("# detuned")
    before, after = cost_flown(mission), cost_flown(out)
    assert found["terms"][0]["before"] == pytest.approx(before, rel=1e-9)
    assert found["terms"][0]["after"] == pytest.approx(after, rel=1e-9)
    assert before > 2 * after
    assert found["disagreement"] < 1e-9
    flights = [gnc.fly(path) for path in (mission, out)]
    for one in found["requirements"]:
        now = [flight.verdicts[one["name"]].robustness for flight in flights]
        assert [one["before"], one["after"]] == pytest.approx(now, nan_ok=True)
        assert (one["name"] in found["worse"]) == (now[1] < now[0])
    bad = [{each.name for each in gnc.check(path) if each.verdict in ("warn", "fail")} for path in (mission, out)]
    assert bad[1] <= bad[0]
    assert not out.with_name("nominal.toml.journal").exists()
    assert "Norm of mrp" in page.read_text()


def test_the_worst_case_of_fresh_dispersions_is_better(mission):
    """Of 200 cases of a campaign that the tuning never saw, the worst costs less than half of what it did."""
    options = {"against": "worst", "cost": "integral(mrp)", "iterations": 8, "threads": 1}
    found = gnc.tune(mission, ["attitude_gain", "rate_gain"], **options)
    assert len(found.cases) > 1
    attitude = gnc.Metric("attitude", "mean", "mrp", norm="two")
    worst = []
    for gains in ({}, found.values):
        read_again = load(mission, gains)
        measured = dataclasses.replace(read_again, metrics=[*read_again.metrics, attitude])
        worst.append(max(gnc.campaign(measured, 200, seed=5).column("metric.attitude")) * 40.0)
    assert worst[1] < 0.5 * worst[0]
    # A search that draws and then climbs finds a case at least nearly as bad as the worst of 200 that are drawn.
    assert found.terms[0].worst_after > 0.97 * worst[1]
    assert found.terms[0].worst_before > found.terms[0].before


def test_the_worst_case_is_that_which_follows_by_hand(tmp_path):
    """A block, v' = (1 - k h) v + h w: the mean of v grows with wind and start, so the worst is at the end of both.

    Wind is uniform up to 0.5, the start normal and looked at up to four deviations: 0.5 and 1 + 4 * 0.1. After n
    samples v is (1 - k h)^n (v0 - w/k) + w/k, which stays above zero.
    """
    path = written(tmp_path, 2.0, DISPERSED)
    found = gnc.tune(path, ["brake_gain=1:4"], cost="integral(speed)", against="worst", iterations=2, threads=1)
    worst = found.cases[-1]
    assert worst.values == pytest.approx([0.5, 1.4], rel=1e-3)
    means = []
    for k in (found.gains[0].before, found.gains[0].after):
        decay, rest = (1 - 0.1 * k) ** np.arange(51), 0.5 / k
        means.append(5.0 * np.mean(decay * (1.4 - rest) + rest))
    assert [found.terms[0].worst_before, found.terms[0].worst_after] == pytest.approx(means, rel=1e-3)
    assert found.gains[0].after == 4.0


def test_poles_that_are_to_be_kept_are(mission):
    """The smallest integral over 40 s oscillates; with a bound on the damping of J s^2 + k s + a/4 it does not."""
    options = {"cost": "integral(mrp)", "iterations": 4, "threads": 1}
    damping = []
    for keep in (None, {"damping": 0.9}):
        found = gnc.tune(mission, ["attitude_gain", "rate_gain"], keep=keep, **options)
        stiffness, rate = (one.after for one in found.gains)
        damping.append(0.5 * rate / np.sqrt(110.0 * stiffness / 4.0))
        assert found.ratio > 1
    assert damping[0] < 0.85
    assert damping[1] > 0.89


def test_a_killed_run_goes_on_and_comes_to_the_same(mission):
    class KilledError(Exception):
        pass

    def killed(sentence):
        if sentence.startswith("iteration 3"):
            raise KilledError

    free, options = ["attitude_gain", "rate_gain"], {"cost": "integral(mrp)", "iterations": 5, "threads": 1}
    whole = gnc.tune(mission, free, out=mission.with_name("whole.toml"), **options)
    halves = mission.with_name("halves.toml")
    with pytest.raises(KilledError):
        gnc.tune(mission, free, out=halves, told=killed, **options)
    assert not halves.exists()
    told = []
    again = gnc.tune(mission, free, out=halves, told=told.append, **options)
    assert told[0] == "goes on after iteration 3"
    assert (again.values, again.course) == (whole.values, whole.course)
    assert again.flights < whole.flights
    assert halves.read_bytes() == mission.with_name("whole.toml").read_bytes()


def test_a_flat_cost_and_a_target_that_cannot_be_are_told(mission):
    with pytest.raises(GncError, match="the cost is flat: rate_gain do not change it"):
        gnc.tune(mission, ["rate_gain"], cost="reaching(mrp, 10)", threads=1)
    with pytest.raises(GncError, match="is the problem file itself; write beside it"):
        gnc.tune(mission, ["rate_gain"], out=mission)
    with pytest.raises(GncError, match=r"expected a name that ends in \.toml"):
        gnc.tune(mission, ["rate_gain"], out=mission.with_suffix(".txt"))


LAW = '''
from dataclasses import dataclass
from typing import Any

import casadi_gnc as gnc
from casadi_gnc.checks import sufficient


@dataclass(frozen=True, eq=False)
class Turn(gnc.Law):
    """Turn the MRPs to zero."""

    stiffness: Any = gnc.gain("N m", "torque per MRP", above=0.0)
    damping: Any = gnc.gain("N m s/rad", "torque per rate", above=0.0)

    effort = gnc.TORQUE
    inputs = gnc.Layout((gnc.Signal("mrp", 3, "-"), gnc.Signal("rate", 3, "rad/s")))

    def checks(self):
        yield sufficient("gains.damped", self.damping, 9.0 * self.stiffness**0.5, "N m s", "mine")

    def command(self, t, y, m):
        now = self.inputs.split(y)
        return -self.stiffness * now.mrp - self.damping * now.rate
'''


def test_a_guests_law_against_a_campaign_keeps_its_own_condition(mission):
    """The mean that is promised is that of the campaign of the same plan and seed; the condition stops the descent."""
    mission.with_name("turn.py").write_text(LAW)
    mine, out = mission.with_name("mine.toml"), mission.with_name("mine_tuned.toml")
    own = {'"attitude_pd"': '"./turn.py:Turn"', "attitude_gain": "stiffness", "rate_gain": "damping"}
    text = mission.read_text()
    for theirs, name in own.items():
        text = text.replace(theirs, name)
    mine.write_text(text)
    options = {"cost": "integral(mrp)", "iterations": 5, "threads": 1}
    found = gnc.tune(mine, ["stiffness", "damping"], against="campaign", cases=8, seed=3, out=out, **options)
    assert found.ratio > 2
    law = load(out).scheme().law
    (check,) = law.checks()
    assert check.holds
    assert check.margin < 0.02 * check.limit
    written = load(out)
    attitude = gnc.Metric("attitude", "mean", "mrp", norm="two")
    flown = gnc.campaign(dataclasses.replace(written, metrics=[*written.metrics, attitude]), 8, plan="sobol", seed=3)
    mean = float(np.mean(flown.column("metric.attitude"))) * 40.0
    assert found.cost_after == pytest.approx(mean / found.terms[0].before, rel=1e-9)
