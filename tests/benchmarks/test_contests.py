"""Contests of inequalities, steps and flights: judged by what is known, and wrong answers caught."""

from pathlib import Path

import numpy as np
import pytest

from casadi_gnc.benchmarks import Settings, flight, run, step, synthesis
from casadi_gnc.benchmarks.summary import ALL, overview
from casadi_gnc.errors import BenchmarkError
from casadi_gnc.synthesis.backends import Claim, Found

ONCE = Settings(passes=1, cold_passes=0, time_limit=60.0, run_limit=120.0)


def whole(results):
    return {row["contestant"]: row for row in overview(results).rows if row["family"] == ALL}


@pytest.mark.parametrize("kind", ["feasible_3", "infeasible_3", "bounded_real_2", "regulator_4"])
def test_inequalities_are_judged_by_what_is_known_of_them(kind):
    (family,) = synthesis.families([f"lmis/{kind}"], 3)
    runner = synthesis.runner("clarabel", family, "mid")
    for k in range(family.count):
        said = runner.run(k)
        assert runner.judge(k, said).good, kind
        # The same answer with another claim is still right, or still not; a spoilt one never is.
        spoilt = Found(said.point + 0.1 * (1 + np.abs(said.point)), 0 * said.dual, said.claim)
        judged = runner.judge(k, spoilt)
        assert not judged.good or kind == "feasible_3"  # whose set is wide
        nothing = Found(np.full_like(said.point, np.nan), np.full_like(said.dual, np.nan), Claim.SOLVED)
        assert not runner.judge(k, nothing).good


def test_a_wrong_optimum_with_a_dual_bound_of_its_own_is_caught():
    """An answer that is certified for other data: everything fits but the known optimum."""
    (family,) = synthesis.families(["lmis/regulator_4"], 2)
    runner = synthesis.runner("clarabel", family, "mid")
    runner._samples[0] = type(runner._samples[0])(
        runner._samples[0].data, runner._samples[0].expected, runner._samples[1].objective
    )
    assert not runner.judge(0, runner.run(0)).good


def test_synthesis_runs_every_back_end(tmp_path):
    results = run("synthesis", ["lmis/feasible_3", "lmis/infeasible_3"], tmp_path, settings=Settings(
        samples=1, passes=1, cold_passes=1, time_limit=60.0
    ))  # fmt: skip
    assert set(whole(results)) == set(synthesis.contestants(None)) >= {"clarabel", "barrier"}
    rows = overview(results).rows
    feasible = [
        row["success"] for row in rows if row["family"].endswith("feasible_3") and "infeasible" not in row["family"]
    ]
    assert feasible == [1.0] * len(whole(results))
    # Proofs of infeasibility come out at the edge of rounding: which back end lacks a digit is up to the BLAS kernel.
    proofs = [row["success"] for row in rows if row["family"].endswith("infeasible_3")]
    assert sum(proofs) >= len(proofs) - 1
    with pytest.raises(BenchmarkError, match="no LMI back end 'none'"):
        synthesis.contestants(["none"])


@pytest.fixture(scope="module")
def steps():
    (family,) = step.families(["huang2020/detumble"], 2)
    return family


@pytest.mark.parametrize("way", step.contestants(None))
def test_every_way_to_run_a_step_gives_the_step(steps, way):
    runner = step.runner(way, steps, "mid")
    for k in range(steps.count):
        judged = runner.judge(k, runner.run(k))
        assert judged.good
        assert judged.gap <= (1e-4 if "float" in way else 1e-12)  # what single and double precision leave
    if way != "empty_call":
        said = runner.run(0) * (1 + 1e-2)
        assert not runner.judge(0, said).good
        said[0] = np.nan
        assert runner.judge(0, said).violation > 0


def test_a_step_that_is_no_expression_is_refused():
    with pytest.raises(BenchmarkError, match="no such scheme whose allocation is an expression"):
        step.families(["huang2020/detumble:observer_robust"], 1)
    with pytest.raises(BenchmarkError, match="no way turbo to run a step; there is numpy"):
        step.contestants(["turbo"])


@pytest.mark.slow
def test_engines_end_where_each_other_does(tmp_path):
    problems = ["huang2020/detumble:observer_pinv", "huang2020/detumble:observer_robust"]
    families = flight.families(problems, 40)
    for family in families:
        for engine in (who for who in flight.contestants(None) if flight.able(who, family)):
            runner = flight.runner(engine, family, "mid")
            end = runner.run(0)
            assert runner.judge(0, end).good, (family.name, engine)
            # Every flight begins at the start; a warm allocator may end it in other last bits.
            assert np.allclose(end, runner.run(0), rtol=0, atol=1e-9)
            assert not runner.judge(0, end + 1e-3).good
            assert runner.calls == 40
    assert not flight.able("mapaccum", families[1])


def test_a_flight_has_steps_per_second(tmp_path):
    from casadi_gnc.benchmarks.report import write_report

    results = run("flight", ["huang2020/detumble:observer_pinv"], tmp_path, contestants=["c"], settings=ONCE)
    write_report(overview(results))
    text = Path(tmp_path / "report.md").read_text()
    assert "Steps per second: `c` " in text
