"""What authors of craft, laws, checks and boards are told in one sentence where things are not what they must be."""

from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

import casadi_gnc as gnc
from casadi_gnc.embedded import boards
from casadi_gnc.errors import AllocationError, FlightError, LawError, TargetError
from casadi_gnc.missions.asking import ask
from casadi_gnc.missions.checks import REGISTRY as CHECKS
from casadi_gnc.problem_files.synthesis_checks import check as check_synthesis
from casadi_gnc.reports import flight_pictures
from casadi_gnc.system import assets

TIMING = gnc.Timing("sampled", sample_period=0.1, duration=2.0)


@dataclass(frozen=True, eq=False)
class Mass(gnc.Plant):
    """Push a unit mass along three axes by some actuators."""

    effectiveness: Any

    state = gnc.Layout((gnc.Signal("place", 3, "m"), gnc.Signal("speed", 3, "m/s")))
    measurement = gnc.Layout((gnc.Signal("place", 3, "m", limit=10.0), gnc.Signal("speed", 3, "m/s", limit=10.0)))

    @property
    def inputs(self):
        return gnc.Layout((gnc.Signal("pusher", self.effectiveness.shape[1], "N"),))

    def rate(self, t, x, actuators, noise):
        return ca.vertcat(x[3:], ca.mtimes(self.effectiveness, actuators))


class Pushed(gnc.Craft):
    """A mass with pushers along the columns of a matrix."""

    matrix: list[list[float]]

    def plant(self):
        return Mass(ca.DM(self.matrix))

    def start(self):
        return {"place": [0.1, 0.1, 0.1], "speed": [0.0, 0.0, 0.0]}

    def actuators(self):
        count = len(self.matrix[0])
        return gnc.Actuators(ca.DM(self.matrix), [-1.0] * count, [1.0] * count, effort=gnc.FORCE)

    def regulated(self, mission):
        return {"place": [0.0] * 3, "speed": [0.0] * 3}


@dataclass(frozen=True, eq=False)
class Pull(gnc.Law):
    """Pull the mass home."""

    stiffness: Any = gnc.gain("N/m", "force per distance", default=1.0, above=0.0)
    effort = gnc.FORCE
    inputs = Mass.measurement

    def command(self, t, y, m):
        now = self.inputs.split(y)
        return -self.stiffness * now.place - 2 * now.speed


def mission(craft, law=None) -> gnc.Mission:
    keys = gnc.EffortKeys(effort_limit=[1.0, 1.0, 1.0])
    return gnc.Mission(craft, [gnc.Scheme("pull", law or Pull(), craft.actuation(keys))], TIMING)


EYE = np.eye(3).tolist()
#: Columns in a plane, one column thrice, and no third row at all.
LEFT_OUT = {
    "a plane": [[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 2.0]],
    "a line": [[1.0, 1.0, 1.0]] * 3,
    "an axis": [[1.0, 0.0, 0.6], [0.0, 1.0, 0.8], [0.0, 0.0, 0.0]],
}


@pytest.mark.parametrize("matrix", LEFT_OUT.values(), ids=LEFT_OUT)
def test_actuators_that_leave_an_effort_out_are_a_finding(matrix):
    made = mission(Pushed(matrix=matrix))
    failed = {each.name for each in gnc.check(made) if each.verdict == "fail"}
    assert {"geometry.effectiveness", "authority.span"} <= failed
    rank = np.linalg.matrix_rank(np.array(matrix))
    with pytest.raises(AllocationError, match=f"the effectiveness has rank {rank}, expected 3"):
        gnc.fly(made)


def test_every_effort_that_is_made_is_no_finding():
    """A unit mass under x'' = -x - 2x' has the double pole -1: the sampled one at 0.1 s lies inside the circle."""
    found = {each.name: each for each in gnc.check(mission(Pushed(matrix=EYE)))}
    assert found["authority.span"].verdict == found["sampling.closed_loop"].verdict == "ok"


def test_a_law_without_its_decorator_is_told_so():
    class Loose(gnc.Law):
        """Declare a gain and forget the decorator."""

        stiffness: Any = gnc.gain("N/m", "force per distance", default=1.0)
        effort, inputs = gnc.FORCE, Mass.measurement

    with pytest.raises(LawError, match="Loose declares stiffness and is no dataclass; write @dataclass"):
        Loose()


def test_a_choice_of_python_on_a_symbol_names_what_to_take():
    @dataclass(frozen=True, eq=False)
    class Chosen(Pull):
        """Choose by a symbol."""

        def command(self, t, y, m):
            return -y[:3] if y[0] > 0 else y[:3]

    with pytest.raises(LawError, match=r"Chosen\.command failed: Python's if, and, or, .* take casadi\.if_else"):
        mission(Pushed(matrix=EYE), Chosen())


def test_a_class_in_the_place_of_an_object_is_told():
    craft = Pushed(matrix=EYE)
    scheme = gnc.Scheme("pull", Pull(), craft.actuation())
    with pytest.raises(FlightError, match="craft is the class Pushed, expected an object of a casadi_gnc.Craft"):
        gnc.Mission(Pushed, [scheme], TIMING)  # type: ignore[arg-type]
    with pytest.raises(FlightError, match="the law of 'pull' is the class Pull"):
        gnc.Mission(craft, [replace(scheme, law=Pull)], TIMING)  # type: ignore[arg-type]
    with pytest.raises(FlightError, match="schemes is an object of type Scheme, expected a list"):
        gnc.Mission(craft, scheme, TIMING)  # type: ignore[arg-type]
    with pytest.raises(FlightError, match="2 limits of the effort, expected 3, one for each row of force"):
        craft.actuation(gnc.EffortKeys(effort_limit=[1.0, 1.0]))


@pytest.mark.parametrize(
    ("goals", "told"),
    [({"plase": [0.0] * 3}, "names 'plase', which is no state"), ({"place": [0.0]}, "gives 1 numbers of place, not 3")],
)
def test_what_is_regulated_is_a_state(goals, told):
    kind = type("Strange", (Pushed,), {"regulated": lambda self, mission: goals})
    with pytest.raises(FlightError, match=f"Strange.regulated {told}"):
        gnc.check(mission(kind(matrix=EYE)))


def test_schemes_are_compared_where_no_picture_tracks_anything(tmp_path):
    untracked = type("Untracked", (Pushed,), {"regulated": lambda self, mission: {}})
    one = mission(untracked(matrix=EYE))
    two = replace(one, schemes=[*one.schemes, replace(one.schemes[0], name="other")])
    assert flight_pictures.plot_comparison(two, gnc.fly_all(two), tmp_path).stat().st_size > 1000


def test_a_check_that_a_file_and_a_package_name_is_run_once(monkeypatch):
    def family(mission, scheme):
        """Yield one check."""
        yield gnc.Check("own.check", 0.0, 1.0, "-", "warn", "Nothing.", "Nothing.")

    monkeypatch.setattr(CHECKS, "_registered", {"own": family})
    found = gnc.check(replace(mission(Pushed(matrix=EYE)), checks=[family]))
    assert [each.name for each in found].count("own.check") == 1


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("flags", '"-mcpu=cortex-m7"', "flags is '-mcpu=cortex-m7', expected a list of texts"),
        ("script", "3", "script is 3, expected a text"),
        ("emulator", "[]", "emulator is empty"),
    ],
)
def test_a_board_of_the_wrong_types_is_told(key, value, told, tmp_path):
    text = (assets.folder("codegen") / "targets" / "cortex-m7.toml").read_text()
    lines = [f"{key} = {value}" if line.startswith(f"{key} =") else line for line in text.splitlines()]
    (tmp_path / "board.toml").write_text("\n".join(lines))
    with pytest.raises(TargetError, match=f"the target board.toml: {told}".replace("[", r"\[")):
        boards.of_file(tmp_path / "board.toml")


def test_a_certified_recipe_without_gains_does_not_fail(tmp_path):
    """A'P + PA < 0 of a stable A has solutions: a certificate, and nothing that is a gain."""
    (tmp_path / "decay.py").write_text(
        "import casadi as ca\n"
        "from casadi_gnc.problem_files import Recipe\n"
        "from casadi_gnc.synthesis import Lmis\n"
        "class Decay(Recipe):\n"
        "    '''P of a falling x'Px.'''\n"
        "    A: list[list[float]]\n"
        "    def run(self, backend):\n"
        "        lmis, a = Lmis(), ca.DM(self.A)\n"
        "        p = lmis.symmetric('P', 2)\n"
        "        lmis.psd(p, margin=1, name='size')\n"
        "        lmis.nsd(a.T @ p + p @ a, margin=1e-6, name='decay')\n"
        "        lmis.minimize(ca.trace(p))\n"
        "        return lmis.solve(backend)\n"
    )
    (tmp_path / "decay.toml").write_text(
        'format = 1\nkind = "synthesis"\n[recipe]\ntype = "./decay.py:Decay"\nA = [[0.0, 1.0], [-1.0, -0.4]]\n'
    )
    _, found = check_synthesis(tmp_path / "decay.toml")
    assert [(each.name, each.verdict) for each in found] == [
        ("synthesis.lmi.size", "ok"),
        ("synthesis.lmi.decay", "ok"),
    ]


def test_a_number_that_overflows_is_told_without_words_of_python():
    class Owner:
        def rate(self):
            return 1e200**2

    with pytest.raises(LawError, match=r"Owner\.rate failed: a number overflows in it, one of its data is too large"):
        ask(Owner(), "rate")
