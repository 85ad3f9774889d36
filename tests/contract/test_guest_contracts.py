"""The contract tests that guests are given are kept by everything of ours, and tell what does not keep them."""

import subprocess
import sys
from dataclasses import dataclass, replace
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest
from shipped_missions import missions

import casadi_gnc as gnc
from casadi_gnc import synthesis, testing
from casadi_gnc.allocation import AllocationProblem, backends
from casadi_gnc.allocation.backends import BackEnd, Capability, Found
from casadi_gnc.checking import authority, check
from casadi_gnc.errors import RegistryError
from casadi_gnc.laws import REGISTRY as LAWS
from casadi_gnc.missions.checks import REGISTRY as CHECKS
from casadi_gnc.missions.craft import REGISTRY as CRAFTS
from casadi_gnc.problem_files.synthesis_file import load_synthesis
from casadi_gnc.registry import Registry
from casadi_gnc.starters.craft import StarterCraft


@pytest.mark.parametrize("name", CRAFTS.shipped())
def test_every_craft_of_ours(name):
    testing.check_mission(missions()[CRAFTS.find(name).example])


@pytest.mark.parametrize("name", [name for name in backends.names() if name != "sdp_scs"])
def test_every_back_end_of_ours(name):
    if not backends.missing(name):
        testing.check_allocation_backend(name, problems=6)


@pytest.mark.parametrize("name", synthesis.backends.names())
def test_every_lmi_back_end_of_ours(name):
    testing.check_lmi_backend(name)


def test_a_recipe_of_ours():
    testing.check_recipe(load_synthesis("shi2020/synthesis").recipe)


@pytest.mark.parametrize("name", CHECKS.shipped())
def test_every_family_of_ours(name):
    testing.check_family(CHECKS.find(name), missions()["huang2020/slew"])


@pytest.mark.parametrize("kind", ["craft", "law"])
def test_starting_points_pass_as_they_are_written(kind, tmp_path):
    command = [sys.executable, "-m", "casadi_gnc.cli.main", "new", kind, "NewThing"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    mission = gnc.load(tmp_path / "new_thing.toml")
    testing.check_mission(mission)
    assert not [each for each in check(mission) if each.verdict in ("warn", "fail")]
    assert gnc.fly(mission).metrics["settling_time"] is not None
    again = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert again.returncode == 2
    assert "exists and was left alone" in again.stderr


INERTIA = [[12.0, 0.0, 0.0], [0.0, 14.0, 0.0], [0.0, 0.0, 9.0]]


def mission_with(law: gnc.Law) -> gnc.Mission:
    initial = {"mrp": [0.1, 0.0, 0.0], "rate_rad_per_s": [0.0, 0.0, 0.0]}
    craft = StarterCraft(inertia_kg_m2=INERTIA, max_torque_N_m=0.05, initial=initial)
    return gnc.Mission(craft, [gnc.Scheme("one", law, craft.actuation())], gnc.Timing("sampled", 0.1, 10.0))


@dataclass(frozen=True, eq=False)
class Drifting(gnc.Law):
    """Remember something that is not what its rate says."""

    rate_gain: float = gnc.gain("N m s", "torque per rate", above=0.0)
    inputs = gnc.Layout((gnc.Signal("rate", 3, "rad/s"),))
    memory = gnc.Layout((gnc.Signal("count", 1, "-"),))

    def jump(self, t, y, m):
        return m + 1

    def command(self, t, y, m):
        return -self.rate_gain * y + 0 * m

    def rate(self, t, y, m, wanted, achieved):
        return ca.if_else(self.hold < 1e-3, 5.0, 0.0) * ca.SX.ones(1)


@dataclass(frozen=True, eq=False)
class Unnamed(gnc.Law):
    rate_gain: float = gnc.gain("", "torque per rate", above=0.0)
    inputs = gnc.Layout((gnc.Signal("rate", 3, "rad/s"),))

    def command(self, t, y, m):
        return -self.rate_gain * y


def test_a_law_that_says_too_little_is_told():
    with pytest.raises(testing.ContractError, match="the gain rate_gain of Unnamed has no unit"):
        testing.check_law(mission_with(Unnamed(rate_gain=1.0)))


def test_a_back_end_that_lies_or_leaves_its_bounds_is_told():
    def solver(forces):
        return lambda problem: SimpleNamespace(find=lambda *sample: Found(forces(problem), claimed=True))

    lazy = BackEnd(Capability.EXACT, (), (1e-6, 1e-10), solver(lambda problem: 0 * problem.lower))
    with pytest.raises(testing.ContractError, match="the certificate's gap is"):
        testing.check_allocation_backend(lazy)
    with pytest.raises(RegistryError, match="is an object of type int, which is no allocation back end; expected a"):
        testing.check_allocation_backend(3)


def test_a_family_without_reasons_is_told():
    def vague(mission, scheme):
        yield gnc.Check("vague.thing", 1.0, 0.0, "-", "note", "Something is not well.", "Do better.")

    with pytest.raises(testing.ContractError, match="vague.thing does not say where its limit comes from"):
        testing.check_family(vague, missions()["huang2020/slew"])


# Actuators that do not span.

ONE_SIDED = {
    # Eight thrusters in the plane, all of whose torques have a part along +z: three rows of full rank.
    "positions_m": [[0.2, 0.1 * s, 0.1 * u] for s in (-1, 1) for u in (-1, 1)]
    + [[-0.2, 0.1 * s, 0.1 * u] for s in (-1, 1) for u in (-1, 1)],
    "directions": [[0, 1, 0]] * 4 + [[0, -1, 0]] * 4,
}


def one_sided(problem: str = "huang2020/detumble") -> gnc.Mission:
    changes = {f"spacecraft.thrusters.{key}": value for key, value in ONE_SIDED.items()}
    return gnc.load(problem, {**changes, "scheme.*.torque_limit_N_m": [1e-3] * 3}, strict=False)


def test_thrusters_that_turn_one_way_only_fail():
    """Truth: every column of the effectiveness has a positive z entry, so no torque about -z is made."""
    mission = one_sided()
    matrix = np.array(mission.schemes[0].actuation.effectiveness)
    tilt = np.array(ca.DM(mission.craft.matrix()))  # the craft's frame is turned; +z of the chaser is seen from there
    assert (tilt.T @ matrix)[2].min() > 0 or (tilt.T @ matrix)[2].max() < 0
    (found,) = [each for each in check(mission, "damping_pinv") if each.name == "authority.span"]
    assert (found.verdict, found.value) == ("fail", 0.0)


@dataclass(frozen=True, eq=False)
class Damping(gnc.Law):
    """Damp the rate."""

    inputs = gnc.Layout((gnc.Signal("rate", 3, "rad/s"),))

    def command(self, t, y, m):
        return -y


class Lopsided(StarterCraft):
    """Push to one side of a plane."""

    def actuators(self):
        return gnc.Actuators(ca.DM.eye(3), [0.0] * 3, [1.0] * 3)


def test_a_guest_is_failed_too():
    initial = {"mrp": [0.1, 0.0, 0.0], "rate_rad_per_s": [0.0, 0.0, 0.0]}
    craft = Lopsided(inertia_kg_m2=INERTIA, max_torque_N_m=0.05, initial=initial)
    mission = gnc.Mission(craft, [gnc.Scheme("one", Damping(), craft.actuation())], gnc.Timing("sampled", 0.1, 10.0))
    (found,) = [each for each in gnc.check(mission) if each.name == "authority.span"]
    assert found.verdict == "fail"
    both = replace(mission.schemes[0].actuation, lower=[-1.0] * 3)
    assert authority.spanned(mission, replace(mission.schemes[0], actuation=both)) > 0


# The registry.


class Thing:
    pass


def registry(**shipped: str) -> Registry:
    home = {"dumps": "json:dumps", **shipped}
    return Registry("thing", "casadi_gnc.test_things", home, is_one=lambda t: t is not None, expected="something")


def test_names_lead_to_one_thing_only(monkeypatch):
    import json

    found = registry()
    assert found.find("dumps") is json.dumps
    thing = Thing()
    assert found.find(thing) is thing
    with pytest.raises(RegistryError, match="no thing 'dump'; did you mean 'dumps'\\? There is dumps"):
        found.find("dump")
    found.register("mine", thing)
    assert found.find("mine") is thing
    assert found.name_of(thing) == "mine"
    with pytest.raises(RegistryError, match="the thing 'dumps' is a shipped one already; register yours under another"):
        found.register("dumps", thing)
    with pytest.raises(RegistryError, match="the thing 'mine' is registered already"):
        found.register("mine", Thing())
    with pytest.raises(RegistryError, match="'my thing' is no name for a thing"):
        found.register("my thing", thing)


class Point:
    """An entry point of a package that is not there."""

    def __init__(self, name, value, package, thing):
        self.name, self.value, self.dist, self._thing = name, value, SimpleNamespace(name=package), thing

    def load(self):
        if isinstance(self._thing, Exception):
            raise self._thing
        return self._thing


def test_packages_offer_things(monkeypatch):
    thing = Thing()
    offered = [
        Point("theirs", "pack:Thing", "pack", thing),
        Point("twice", "one:Thing", "one", thing),
        Point("twice", "two:Thing", "two", thing),
        Point("dumps", "three:Thing", "three", thing),
        Point("broken", "four:Thing", "four", ImportError("no module named gone")),
        Point("none", "five:Thing", "five", None),
    ]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: offered)
    found = registry()
    assert found.names() == ["dumps", "theirs", "twice", "broken", "none"]
    assert found.find("theirs") is thing
    with pytest.raises(RegistryError, match="two packages offer a thing 'twice': one and two; remove one of them"):
        found.find("twice")
    with pytest.raises(
        RegistryError, match=r"'broken' of the package four \(four:Thing\) cannot be loaded: ImportError"
    ):
        found.find("broken")
    with pytest.raises(
        RegistryError, match="'none' of the package five is an object of type NoneType, which is no thing"
    ):
        found.find("none")
    import json

    assert found.find("dumps") is json.dumps  # a shipped name stays what it is
    told = found.problems()
    assert any("three offers a thing 'dumps', a shipped one's name" in each for each in told)
    assert any("two packages offer a thing 'twice'" in each for each in told)


def test_every_kind_has_its_registry():
    from casadi_gnc.embedded import boards
    from casadi_gnc.missions import engines
    from casadi_gnc.problem_files import synthesis_recipes

    kinds = [LAWS, CRAFTS, CHECKS, backends.REGISTRY, synthesis.backends.REGISTRY, synthesis_recipes.REGISTRY]
    groups = {each.group for each in (*kinds, engines.REGISTRY, boards.REGISTRY)}
    names = ("laws", "crafts", "checks", "allocation_backends", "synthesis_backends", "synthesis_recipes", "engines")
    assert groups == {f"casadi_gnc.{name}" for name in (*names, "targets")}
    for each in (*kinds, engines.REGISTRY):
        assert all(each.find(name) is not None for name in each.shipped())


def test_a_back_end_of_ones_own_flies_from_a_file(tmp_path):
    (tmp_path / "mine.py").write_text(
        "from casadi_gnc.allocation.backends import BackEnd, Capability, module\n"
        'CLARABEL = module("clarabel")\n'
        "MINE = BackEnd(Capability.ROBUST | Capability.EXACT, (), (1e-6, 1e-10), CLARABEL.set_up)\n"
    )
    text = gnc.problem_files.read("huang2020/slew").text
    assert 'method = "robust"' in text
    (tmp_path / "slew.toml").write_text(
        text.replace('method = "robust"', 'method = "robust", backend = "./mine.py:MINE"')
    )
    mission = gnc.load(tmp_path / "slew.toml").with_timing(duration=1.0)
    assert [file.path for file in mission.guests()] == ["mine.py"]
    ours = gnc.load("huang2020/slew", {"scheme.funnel_robust.allocation.backend": "clarabel"}).with_timing(duration=1.0)
    flights = [gnc.fly(each, "funnel_robust", engine="vm") for each in (mission, ours)]
    assert np.allclose(flights[0]["force"], flights[1]["force"], atol=1e-9)


def test_a_check_of_ones_own_is_told_with_the_others(tmp_path):
    (tmp_path / "mine.py").write_text(
        "import casadi_gnc as gnc\n\n"
        "def long(mission, scheme):\n"
        '    yield gnc.Check("mine.long", mission.timing.duration, 1e2, "s", "warn", "Long.", "Cut.", "me")\n'
    )
    text = gnc.problem_files.read("huang2020/detumble").text
    (tmp_path / "long.toml").write_text(text.replace("format = 1", 'format = 1\nchecks = ["./mine.py:long"]'))
    found = gnc.check(tmp_path / "long.toml", "damping_pinv")
    assert [each.verdict for each in found if each.name == "mine.long"] == ["warn"]


def test_problem_of_a_robust_allocation_stays_one():
    """The base class makes a plain problem of `robust` where a craft says nothing of errors."""
    initial = {"mrp": [0.1, 0.0, 0.0], "rate_rad_per_s": [0.0, 0.0, 0.0]}
    craft = StarterCraft(inertia_kg_m2=INERTIA, max_torque_N_m=0.05, initial=initial)
    keys = gnc.EffortKeys(effort_limit=[0.01, 0.02, 0.03], allocation={"method": "robust", "accuracy_weight": 1e4})
    actuation = craft.actuation(keys)
    assert actuation.limit_above == [0.01, 0.02, 0.03]
    assert isinstance(actuation.allocator.problem, AllocationProblem)
    assert not actuation.allocator.problem.is_robust
