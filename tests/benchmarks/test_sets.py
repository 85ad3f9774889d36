"""Sets are data: shipped ones load, those from outside are read as documented, defects are told."""

import numpy as np
import pytest
from scipy.io import savemat
from scipy.sparse import csc_matrix

from casadi_gnc.benchmarks import allocation, synthesis
from casadi_gnc.benchmarks.families import random_family
from casadi_gnc.benchmarks.outside import read_outside
from casadi_gnc.benchmarks.sets import Random
from casadi_gnc.errors import BenchmarkError, GncError, ProblemError

B = np.array([[1.0, -1.0, 0.5], [0.2, 0.3, -1.0]])
LIMITS = np.array([[-1.0, 2.0], [0.0, 1.0], [-0.5, 0.5]])
V = np.array([[0.1, 0.2, 0.3, 0.4], [0.0, -0.1, -0.2, -0.3]])


def test_shipped_sets_have_what_the_default_run_promises():
    """At least ten contestants where nothing is uncertain, six where something is; N from 4 to 24."""
    families = allocation.families(list(allocation.SETS), None)
    by_group = {group: [f for f in families if f.group == group] for group in allocation.SETS}
    everyone = allocation.contestants(None)
    for group, least in (("plain", 10), ("robust", 6)):
        for family in by_group[group]:
            assert family.data.problem.is_robust is (group == "robust")
            assert sum(allocation.able(who, family) for who in everyone) >= least
    sizes = {family.data.problem.count for family in families}
    assert min(sizes) == 4
    assert max(sizes) == 24
    assert {12, 4} <= sizes  # the two papers' geometries
    assert len({family.digest for family in families}) == len(families)
    for family in families:
        samples = family.data
        assert np.all(samples.lower <= samples.upper)
        assert family.count == len(samples.commands) == len(samples.previous) >= 10


def test_recorded_forces_are_inside_the_bounds_and_change_from_sample_to_sample():
    for family in allocation.families(["plain/detumble", "plain/slew", "plain/wheel_faults"], None):
        problem, before = family.data.problem, family.data.previous
        # Tables have seven digits.
        slack = 1e-6 * np.maximum(np.abs(problem.lower), np.abs(problem.upper))
        assert np.all(before >= problem.lower - slack)
        assert np.all(before <= problem.upper + slack)
        assert np.ptp(family.data.commands, axis=0).min() > 0


def test_a_family_is_the_same_for_the_same_seed():
    given = Random(seed=3, actuators=6, centre_error_m=0.01, samples=5)
    first, again = (random_family(given) for _ in range(2))
    assert np.array_equal(first[1], again[1])
    assert np.array_equal(first[0].errors, again[0].errors)
    other = random_family(Random(seed=4, actuators=6, centre_error_m=0.01, samples=5))
    assert not np.array_equal(first[1], other[1])
    # Torques of forces inside the bounds can be made: the least distance is zero, to the solver's 1e-10.
    from scipy.optimize import lsq_linear

    problem, commands, _ = random_family(Random(seed=5, actuators=6, samples=5))
    for command in commands:
        assert lsq_linear(problem.effectiveness, command, (problem.lower, problem.upper)).cost < 1e-15


def write_folder(folder, **arrays):
    folder.mkdir()
    for name, array in arrays.items():
        np.savetxt(folder / f"{name}.csv", np.atleast_2d(array), delimiter=",")
    return folder


def test_data_from_outside_is_read_from_mat_and_csv_alike(tmp_path):
    rates = np.array([[-1.0, 2.0], [-3.0, 3.0], [-0.1, 0.1]])
    arrays = {"B": B, "v": V, "plim": LIMITS, "rlim": rates, "T": 0.1, "wu": [1.0, 2.0, 3.0], "gamma": 1e4}
    savemat(tmp_path / "data.mat", arrays)
    for samples in (read_outside(tmp_path / "data.mat"), read_outside(write_folder(tmp_path / "csv", **arrays))):
        assert np.array_equal(samples.problem.effectiveness, B)
        assert np.array_equal(samples.commands, V.T)
        assert samples.problem.effort_weight.tolist() == [1.0, 2.0, 3.0]
        assert samples.problem.accuracy_weight == 1e4
        # The boxes are amplitude and rate about the position before, which is feasible.
        for before, lower, upper in zip(samples.previous, samples.lower, samples.upper, strict=True):
            assert np.allclose(lower, np.maximum(LIMITS[:, 0], before + 0.1 * rates[:, 0]), atol=1e-15)
            assert np.allclose(upper, np.minimum(LIMITS[:, 1], before + 0.1 * rates[:, 1]), atol=1e-15)
            assert np.all((lower <= before) & (before <= upper))
    given = np.array([[0.1, 0.2, 0.3]] * 4)
    with_positions = read_outside(write_folder(tmp_path / "u", B=B, v=V, plim=LIMITS, u=given))
    assert np.array_equal(with_positions.previous, given)
    (family,) = allocation.families([str(tmp_path / "data.mat")], 3)
    assert (family.name, family.count) == ("data", 3)


def test_the_names_of_the_f18_are_read_as_they_are(tmp_path):
    """QCAT's file of the F-18 has two periods and the times; its examples allocate with the first."""
    rates = np.array([[-1.0, 2.0], [-3.0, 3.0], [-0.1, 0.1]])
    f18 = {"B": B, "v": V, "plim": LIMITS, "rlim": rates, "T1": 0.02, "T2": 0.1, "tn": 0.02 * np.arange(4.0)}
    savemat(tmp_path / "f18.mat", f18)
    savemat(tmp_path / "admire.mat", {"B": B, "v": V, "plim": LIMITS, "rlim": rates, "T": 0.02, "t": f18["tn"]})
    found, same = read_outside(tmp_path / "f18.mat"), read_outside(tmp_path / "admire.mat")
    assert np.array_equal(found.lower, same.lower)
    assert np.array_equal(found.upper, same.upper)
    savemat(tmp_path / "none.mat", {name: f18[name] for name in ("B", "v", "plim", "T1")})
    assert read_outside(tmp_path / "none.mat").problem.count == 3  # no rates: the period does not matter


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"B": None}, "lacks B; it has v, plim"),
        ({"plim": LIMITS[:2]}, r"plim has shape \(2, 2\), expected \(3, 2\)"),
        ({"plim": LIMITS[:, ::-1]}, "lower bound 2.0 exceeds upper -1.0"),
        ({"v": np.ones((5, 4))}, r"v has shape \(5, 4\); neither side is 2"),
        ({"v": np.zeros((2, 0))}, "v has no commands"),
        ({"v": V * np.nan}, "v has entries that are not finite"),
        ({"rlim": LIMITS}, "T, the sample period in seconds, is missing: it belongs to rlim; give both or neither$"),
        ({"rlim": LIMITS, "T2": 0.04, "tn": V[0]}, "there is T2, tn: save one of them as T"),
        ({"T": 0.02}, "rlim is missing"),
        ({"B": np.array([["a"]], dtype=object)}, "B is no array of numbers"),
        ({"u": np.ones((3, 2))}, "u has 2 samples, v 4"),
        ({"wu": np.ones(2)}, "wu has 2 entries, expected 1 or 3"),
    ],
)
def test_defects_of_data_from_outside_are_told(tmp_path, changes, message):
    arrays = {name: value for name, value in ({"B": B, "v": V, "plim": LIMITS} | changes).items() if value is not None}
    savemat(tmp_path / "data.mat", arrays)
    with pytest.raises(BenchmarkError, match=message):
        read_outside(tmp_path / "data.mat")


def test_a_sparse_matrix_is_the_matrix_that_it_stands_for(tmp_path):
    savemat(tmp_path / "data.mat", {"B": csc_matrix(B), "v": V, "plim": LIMITS})
    assert np.array_equal(read_outside(tmp_path / "data.mat").problem.effectiveness, B)


def test_files_that_are_none_are_told(tmp_path):
    (tmp_path / "bad.mat").write_text("hello")
    with pytest.raises(BenchmarkError, match="cannot be read as a .mat file"):
        read_outside(tmp_path / "bad.mat")
    folder = write_folder(tmp_path / "csv", B=B, v=V, plim=LIMITS)
    (folder / "v.csv").write_text("0.1,0.2\n0.3,x\n")
    with pytest.raises(ProblemError, match=r"v\.csv, line 2, column 2: 'x' is no number"):
        read_outside(folder)
    (folder / "v.csv").write_text("0.1,0.2\n0.3\n")
    with pytest.raises(ProblemError, match="line 2: 1 entry, expected 2"):
        read_outside(folder)


HEAD = 'format = 1\nkind = "benchmark"\ntitle = "t"\ncontest = "allocation"\n'
FAMILY = '[[family]]\nname = "a"\ntitle = "b"\n'
RANDOM = "random = { seed = 1, actuators = 4 }\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD, "the set is empty"),
        (HEAD + FAMILY, r"give either \[family.random\] or commands"),
        (HEAD + (FAMILY + RANDOM) * 2, "two families have the same name"),
        (HEAD + FAMILY + RANDOM + 'mood = "good"\n', "mood: unknown key"),
        (HEAD + FAMILY + 'commands = "nowhere.csv"\nproblem = "huang2020/allocation"\n', "nowhere.csv: cannot be read"),
        (HEAD + FAMILY + 'commands = "c.csv"\nproblem = "hua#g2020/x"\n', "set.toml, family 'a': no problem file"),
        (HEAD.replace("benchmark", "mission") + FAMILY + RANDOM, "this takes a file of kind"),
        (HEAD.replace('"allocation"', '"synthesis"') + FAMILY + RANDOM, "is not for the contest 'synthesis'"),
    ],
)
def test_defects_of_sets_are_told(tmp_path, text, message):
    path = tmp_path / "set.toml"
    path.write_text(text)
    with pytest.raises(GncError, match=message):
        allocation.families([str(path)], None)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("u1,u2\n1,2\n", "columns are u1, u2; expected u1 to u3, and p1 to p12 or none"),
        ("u1,u2,u3\n", "has no commands"),
        ("", "is empty"),
        ("u1,u2,u3\n1,2,nan\n", "line 2: has an entry that is not finite"),
    ],
)
def test_defects_of_tables_of_commands_are_told(tmp_path, table, message):
    (tmp_path / "c.csv").write_text(table)
    (tmp_path / "set.toml").write_text(HEAD + FAMILY + 'commands = "c.csv"\nproblem = "huang2020/allocation"\n')
    with pytest.raises(GncError, match=message):
        allocation.families([str(tmp_path / "set.toml")], None)


def test_unknown_sets_and_families_are_told():
    with pytest.raises(ProblemError, match="no problem file 'nowhere'"):
        allocation.families(["nowhere"], None)
    with pytest.raises(BenchmarkError, match="has no family 'nobody'; it has detumble, slew"):
        allocation.families(["plain/nobody"], None)
    with pytest.raises(BenchmarkError, match=r"is a set for `bench synthesis`, not for `bench allocation`"):
        allocation.families(["lmis"], None)
    with pytest.raises(BenchmarkError, match="has no family 'nobody'; it has feasible_3"):
        synthesis.families(["lmis/nobody"], None)
    with pytest.raises(BenchmarkError, match="named twice: slew"):
        allocation.families(["plain/slew", "plain/slew"], None)


def test_an_allocation_file_is_a_family_of_its_own():
    (family,) = allocation.families(["huang2020/allocation"], 5)
    assert family.count == 5
    assert family.data.problem.is_robust


def test_no_extra_installs_a_solver_under_the_gpl():
    import tomllib
    from pathlib import Path

    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [package for extra in project["optional-dependencies"].values() for package in extra]
    wanted = " ".join([*project["dependencies"], *extras]).lower()
    assert "scs" in wanted
    for name in ("quadprog", "cvxopt", "kvxopt", "ecos", "qpswift"):
        assert name not in wanted
