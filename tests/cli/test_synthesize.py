"""`casadi-gnc synthesize`: gains with a certificate, or the constraint that makes them impossible."""

import json
import subprocess
import sys

import numpy as np
import pytest
from scipy.linalg import expm

from casadi_gnc.errors import ProblemError
from casadi_gnc.problem_files.document import read
from casadi_gnc.problem_files.loading import load
from casadi_gnc.problem_files.synthesis_checks import check
from casadi_gnc.problem_files.synthesis_file import load_synthesis, synthesize
from casadi_gnc.problem_files.synthesis_into import target_of

PROGRAM = [sys.executable, "-m", "casadi_gnc.cli.main", "synthesize"]


def run(*arguments: str) -> subprocess.CompletedProcess:
    return subprocess.run([*PROGRAM, *arguments], capture_output=True, text=True, timeout=300)


def test_repaired_synthesis_is_certified():
    """Derived independently: certified 3.21, true norm 2.30 at s = 0.3. The loop is stable by the gains printed."""
    done = run("shi2020/synthesis", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["status"] == "CERTIFIED"
    assert found["promised_norm"] == pytest.approx(3.21, abs=5e-3)
    assert found["norm"]["upper"] == pytest.approx(2.30, abs=5e-3)
    assert all(one["holds"] and one["smallest"] >= 0.5 * one["margin"] for one in found["constraints"])
    assert all(one["rounding"] < one["smallest"] for one in found["constraints"])
    assert found["norm"]["lower"] <= found["norm"]["upper"] <= found["promised_norm"]
    assert max(pole[0] for pole in found["poles_rad_s"]) < 0
    recipe = read("shi2020/synthesis").data["recipe"]
    closed = np.array(recipe["A"]) - np.array(recipe["B"]) @ np.array(found["gains"]["K"])
    assert np.linalg.eigvals(closed).real.max() < 0
    # Simulated apart: the command from the worst vertex, and the loop with the input matrix r times the assumed one.
    K, L, A, B = (np.array(m) for m in (found["gains"]["K"], found["gains"]["L"], recipe["A"], recipe["B"]))

    def loop(r):
        known = np.hstack([L, A - L - B @ K, np.zeros((6, 3))])
        estimate = 200.0 * B.T @ np.hstack([L, -L, np.zeros((6, 3))])
        return np.vstack([np.hstack([A, -r * B @ K, -r * B]), known, estimate])

    start = np.concatenate([found["peak"]["start"]])
    assert np.abs(start[:6]).tolist() == [2.0, 3.0, 4.0, 0.0, 0.0, 0.0]
    path = [
        np.linalg.norm(np.hstack([np.zeros((3, 6)), K, np.eye(3)]) @ expm(loop(1) * t) @ start)
        for t in np.linspace(0, 4, 400)
    ]
    assert max(path) <= found["peak"]["bound"] <= 1.02 * max(path)
    assert found["peak"]["limit"] is None
    low = found["stable_ratios"][0]
    for r, stable in ((1.001 * low, True), (0.999 * low, False), (1.0, True), (10.0, True)):
        assert (np.linalg.eigvals(loop(r)).real.max() < 0) == stable


@pytest.mark.slow
def test_gains_are_written_into_a_mission_that_then_flies(tmp_path):
    """What is written is what was certified, to the last digit; the other scheme and every comment stay."""
    path = tmp_path / "docking.toml"
    path.write_text(read("shi2020/docking").text)
    done = run("shi2020/synthesis", "--into", str(path), "--scheme", "iobc", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    before, after = read("shi2020/docking"), read(path)
    old, new = ({one["name"]: one["law"] for one in each.data["scheme"]} for each in (before, after))
    assert new["iobc"]["controller_gain"] == found["gains"]["K"]
    assert new["iobc"]["observer_gain"] == found["gains"]["L"]
    assert new["iobc"]["disturbance_gain"] == 200.0  # varpi, which the recipe was given
    assert new["iobc_printed"] == old["iobc_printed"]
    assert [line.partition("#")[2] for line in before.text.splitlines()] == [
        line.partition("#")[2] for line in after.text.splitlines()
    ]
    assert found["written"]["checks"] == {}
    assert vars(load(path).scheme("iobc").law)["controller_gain"].full().tolist() == found["gains"]["K"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (
            ["--into", "nowhere.toml"],
            "--into is 'nowhere.toml', which is no file; `casadi-gnc problems",
        ),
        (["--scheme", "iobc"], "--scheme names one of the file that --into names; give --into too"),
        (["--into", "docking.toml"], "docking.toml: has the schemes iobc, iobc_printed; name one by --scheme"),
        (["--into", "docking.toml", "--scheme", "x"], "docking.toml: has no scheme 'x'; there is iobc, iobc_printed"),
    ],
)
def test_where_gains_cannot_go_is_told_before_they_are_sought(tmp_path, arguments, told):
    (tmp_path / "docking.toml").write_text(read("shi2020/docking").text)
    done = subprocess.run(
        [*PROGRAM, "shi2020/synthesis", *arguments], capture_output=True, text=True, timeout=300, cwd=tmp_path
    )
    assert done.returncode == 2
    assert told in done.stderr
    assert "looking for gains" not in done.stderr


def test_a_law_without_such_a_gain_is_told(tmp_path):
    path = tmp_path / "slew.toml"
    path.write_text(read("satellites/slew").text)
    target = target_of(path, None)
    with pytest.raises(ProblemError, match=r"flies by AttitudePD, which has no gain K, L; its symbols are"):
        target.changes(load_synthesis("shi2020/synthesis"), {"K": [[1.0]], "L": [[1.0]]})


@pytest.mark.parametrize("backend", ["clarabel", pytest.param("barrier", marks=pytest.mark.slow)])
def test_printed_theorem_is_infeasible_and_named(backend):
    done = run("shi2020/as_printed", "--json", "--backend", backend)
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert found["status"] == "INFEASIBLE"
    assert found["gains"] == {}
    assert "(26) input" in found["sentence"]
    assert found["conflict"] == ["(26) input"]
    assert next(iter(found["multipliers"])) == "(26) input"  # carries most of the proof


@pytest.mark.slow
def test_text_names_gains_and_constraints():
    done = run("shi2020/synthesis")
    assert "K =" in done.stdout
    assert "certified 3.21" in done.stdout
    assert "smallest eigenvalue" in done.stdout
    assert "peak command from the worst start: at most" in done.stdout
    assert "stable for (assumed mass)/(true mass) above 0.17" in done.stdout


STATE_FEEDBACK = """
format = 1
kind = "synthesis"
[recipe]
type = "state_feedback"
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [1.0]]
E = [[0.0], [1.0]]
C = [[1.0, 0.0], [0.0, 0.0]]
D = [[0.0], [1.0]]
"""


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("B = [[0.0], [1.0]]", "B = [[0.0]]"), "B"),
        (("A = [[0.0, 1.0], [0.0, 0.0]]", "A = [[0.0, 1.0], [0.0]]"), "rows of 1 and 2 entries, expected"),
        (("D = [[0.0], [1.0]]", ""), "recipe.D: is missing"),
        (('type = "state_feedback"', 'type = "magic"'), "recipe.type: no recipe 'magic'; there is state_feedback"),
        (("A = [[0.0, 1.0]", "A = [[nan, 1.0]"), "recipe.A[1][1]"),
        (("D = ", "limit = 1.0\nD = "), "needs vertices to start from"),
        (("D = ", "half_widths = [1.0, 1.0]\nvertices = [[1.0, 1.0]]\nD = "), "either vertices or half_widths"),
        (('kind = "synthesis"', 'kind = "mission"'), 'takes a file of kind "synthesis"'),
    ],
)
def test_bad_files_are_told(tmp_path, change, message):
    path = tmp_path / "bad.toml"
    assert change[0] in STATE_FEEDBACK
    path.write_text(STATE_FEEDBACK.replace(*change, 1))
    done = run(str(path))
    assert done.returncode == 2, done.stdout
    # On a slow machine a line before it says what takes long.
    told = [line for line in done.stderr.splitlines() if "--time-limit" not in line]
    assert len(told) == 1
    assert message in told[0]


def test_a_search_ends_at_its_time_limit(tmp_path):
    path = tmp_path / "slow.toml"
    path.write_text(STATE_FEEDBACK)
    done = run(str(path), "--time-limit", "0.01", "--json")
    assert done.returncode == 1, done.stderr
    found = json.loads(done.stdout)
    assert found["status"] == "UNDECIDED"
    assert found["sentence"].startswith("No answer within 0.01 s: neither gains nor a proof that there are none.")
    assert not found["certified"]
    assert not found["gains"]


@pytest.mark.slow
def test_other_recipes_run_from_files(tmp_path):
    path = tmp_path / "feedback.toml"
    path.write_text(STATE_FEEDBACK)
    found = json.loads(run(str(path), "--json").stdout)
    assert found["certified"]
    assert found["norm"]["upper"] <= found["promised_norm"]
    path.write_text(
        'format = 1\nkind = "synthesis"\n[recipe]\ntype = "input_ellipsoid"\nA = [[0.0, 1.0], [0.0, 0.0]]\n'
        "B = [[0.0], [1.0]]\nhalf_widths = [1.0, 0.1]\nlimit = 5.0\ndecay_1_s = 0.2\n"
    )
    found = json.loads(run(str(path), "--json").stdout)
    assert found["certified"]
    assert found["peak"]["bound"] <= 5.0


@pytest.mark.parametrize(
    ("change", "status", "words"),
    [
        (("D = [[0.0], [1.0]]", "D = [[0.0], [0.0]]"), "RUNS_AWAY", "z prices 0 of 1 commands"),
        (("B = [[0.0], [1.0]]", "B = [[0.0], [0.0]]"), "INFEASIBLE", "'bounded real' cannot be met by itself"),
        (("D = ", "vertices = [[9.0, 0.0]]\nlimit = 1.0\nD = "), "INPUT_EXCEEDED", "limit 1."),
    ],
)
def test_a_synthesis_that_fails_exits_with_1_and_gives_no_gains(tmp_path, change, status, words):
    path = tmp_path / "fails.toml"
    assert change[0] in STATE_FEEDBACK
    path.write_text(STATE_FEEDBACK.replace(*change, 1))
    done = run(str(path), "--json")
    found = json.loads(done.stdout)
    assert done.returncode == 1, done.stderr
    assert found["status"] == status
    assert words in found["sentence"]
    assert not found["certified"]
    assert found["gains"] == {}


def test_unknown_back_end_is_told():
    done = run("shi2020/synthesis", "--backend", "magic")
    assert done.returncode == 2
    assert "no LMI back end 'magic'; there is clarabel" in done.stderr


MIXED = """
format = 1
kind = "synthesis"
[recipe]
type = "mixed_state_feedback"
A = [[0.0, 1.0], [0.0, 0.0]]
B = [[0.0], [0.05]]
E = [[0.0], [0.05]]
C = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
D = [[0.0], [0.0], [1.0]]
C2 = [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]
D2 = [[0.0], [0.0], [1.0]]
gamma = 1.5
"""


def test_a_mixed_recipe_with_regions_of_poles_is_answered(tmp_path):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED + "damping = 0.9\nfastest_rad_s = 4.0\ndecay_1_s = 0.15\n")
    found = synthesize(load_synthesis(path))
    assert found["status"] == "CERTIFIED"
    assert found["h2_norm"]["lower"] <= found["h2_norm"]["upper"] <= found["h2_norm"]["promised"]
    assert found["norm"]["upper"] <= found["promised_norm"] == 1.5
    assert set(found["pole_depths_rad_s"]) == {"fastest pole", "decay", "damping"}
    for real, imaginary in found["poles_rad_s"]:
        assert real < -0.15
        assert -real > 0.9 * np.hypot(real, imaginary)
    names = {one.name: one.verdict for one in check(path)[1]}
    assert {"synthesis.h2_norm", "synthesis.region.damping"} < set(names)
    assert set(names.values()) == {"ok"}


@pytest.mark.parametrize(
    ("added", "told"),
    [
        ("damping = 1.5", "line 14, recipe.damping: is 1.5, expected a number < 1"),
        ("disc_rad_s = [1.0]", "recipe.disc_rad_s"),
        ("decay_1_s = 2.0\nfastest_rad_s = 1.0", "no pole meets both fastest_rad_s and decay_1_s"),
        ("E2 = [[1.0]]", r"E2 has shape (1, 1), expected (2, 1)"),
    ],
)
def test_regions_of_a_file_that_cannot_be_are_told(tmp_path, added, told):
    path = tmp_path / "mixed.toml"
    path.write_text(MIXED + added + "\n")
    with pytest.raises(ProblemError) as raised:
        synthesize(load_synthesis(path))
    assert told in str(raised.value)
    assert "mixed.toml" in str(raised.value)


@pytest.fixture
def docking(tmp_path):
    """Return where a recipe may name docking.toml, and its lines but for the plant: z = (x, u), twice."""
    (tmp_path / "docking.toml").write_text(read("shi2020/docking").text)
    rows = {name: np.eye(9)[:, :6].tolist() for name in ("C", "C2")} | {
        name: np.eye(9)[:, 6:].tolist() for name in ("D", "D2")
    }
    lines = [*(f"{name} = {value}" for name, value in rows.items()), "gamma = 1.5", "damping = 0.9"]
    return tmp_path, MIXED.partition("A =")[0] + "\n".join(lines) + "\n"


@pytest.mark.slow
def test_the_plant_of_a_mission_is_designed_for_and_gets_the_gains(docking):
    folder, text = docking
    path, mission = folder / "mixed.toml", folder / "docking.toml"
    path.write_text(text + 'mission = "docking.toml"\nscheme = "iobc"\n')
    case = load_synthesis(path)
    plant = load(mission).linearised("iobc")
    given = case.recipe.arguments()
    np.testing.assert_array_equal(given["A"], plant.A)
    np.testing.assert_array_equal(given["B"], plant.B)
    found = synthesize(case)
    assert found["certified"], found["sentence"]
    K = np.array(found["gains"]["K"])
    slowest = max(pole[0] for pole in found["poles_rad_s"])
    assert np.linalg.eigvals(plant.A - plant.B @ K).real.max() == pytest.approx(slowest, rel=1e-9)
    target_of(mission, "iobc").write(case, found["gains"])
    assert load(mission).scheme("iobc").law.controller_gain.full().tolist() == found["gains"]["K"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("added", "told"),
    [
        ('mission = "docking.toml"\nA = [[1.0]]', "recipe.mission: is given beside A; A and B come from one"),
        (
            'mission = "docking.toml"\nscheme = "x"',
            "recipe.scheme: no scheme 'x' in docking; there is iobc, iobc_printed",
        ),
        ('mission = "nowhere.toml"', "recipe.mission: cannot be read: no problem file 'nowhere.toml'"),
        ("A = [[1.0]]", "recipe.B: is missing beside A"),
        (
            'A = [[1.0]]\nB = [[1.0]]\nscheme = "x"',
            "recipe.scheme: names one of what the key mission names",
        ),
        ("", "recipe.A: is missing; give A and B, or mission, whose plant is then linearised"),
    ],
)
def test_plants_that_are_not_given_once_are_told(docking, added, told):
    folder, text = docking
    path = folder / "mixed.toml"
    path.write_text(text + added + "\n")
    with pytest.raises(ProblemError) as raised:
        load_synthesis(path)
    assert told in str(raised.value)
