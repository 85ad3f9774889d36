"""The craft: what flies, what its flight software believes of it, and what its actuators make.

A craft is a table. Its fields are the keys of [spacecraft] in a problem file, or, declared by `table()`, tables
of their own beside it ([initial], [truth], ...); the schema, the ranges and the messages follow from the
declaration, in a file as in Python. Its methods say what a mission needs. Whoever derives a class gives
`plant`, `start` and `actuators`, and what else differs from the defaults below. No registration is needed: a
file names a class as "./sail.py:SailCraft", Python takes an object.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from pydantic import Field, ValidationError

from casadi_gnc.allocation import AllocationProblem
from casadi_gnc.checks import Check
from casadi_gnc.errors import ProblemError
from casadi_gnc.missions.actuation import Actuation, Actuators
from casadi_gnc.missions.describing import shortened
from casadi_gnc.missions.panel import Panel
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.scene import Scene
from casadi_gnc.navigation import Navigation
from casadi_gnc.registry import Registry
from casadi_gnc.tables.allocation import Pinv, Robust
from casadi_gnc.tables.complaints import sentences
from casadi_gnc.tables.part import MisfitError, Part, Positive, plain

if TYPE_CHECKING:
    from casadi_gnc.missions.mission import Mission
    from casadi_gnc.missions.scheme import Scheme
    from casadi_gnc.missions.timing import Timing


class EffortKeys(Part):
    """The keys of a [[scheme]] that say how far a law may ask and how what it asks is shared out.

    Parameters
    ----------
    effort_limit : largest magnitude of each row of effort, in its unit; what the actuators make of it if left out.
    allocation : table of the method, {"method": "pinv"} if left out.
    """

    effort_limit: list[Positive] | None = Field(
        default=None, description="of each row of effort, in its unit; what the actuators make of it if left out"
    )
    allocation: Pinv | Robust = Field(default=Pinv(), discriminator="method")


class Craft(Part):
    """Base of all crafts: frozen data, and what a mission asks of them.

    Raises
    ------
    ProblemError
        On construction, with a sentence for each key that is wrong.
    """

    #: Further keys of a [[scheme]] that flies this craft; `actuation` takes them.
    scheme_keys: ClassVar[type[Part]] = EffortKeys
    #: A problem that flies this craft, for catalogues: a shipped one, or the path of a mission file of a package.
    #: None where a craft is made without arguments.
    example: ClassVar[str | None] = None
    #: Further ones with parts that the first has not: a law that reads what they measure fits the craft as in them.
    further_examples: ClassVar[tuple[str, ...]] = ()

    def __init__(self, **keys: Any) -> None:
        try:
            super().__init__(**{name: plain(value) for name, value in keys.items()})
        except ValidationError as error:
            told = "; ".join(f"{'.'.join(map(str, path))}: {text}" for path, text in sentences(error, type(self), keys))
            raise ProblemError(told, type(self).__name__) from error

    def __repr__(self) -> str:
        told = [shortened(f"  {name} = {value!r}") for name, value in self]
        return "\n".join([f"{type(self).__name__}:", *told])

    def plant(self) -> Plant:
        """Return the truth: what moves, and what the sensors say."""
        raise TypeError(f"{type(self).__name__} defines no plant")

    def start(self) -> Mapping[str, Sequence[float]]:
        """Return the plant's state at t = 0, by signal."""
        raise TypeError(f"{type(self).__name__} defines no start")

    def actuators(self) -> Actuators:
        """Return what the actuators make, as the flight software believes."""
        raise TypeError(f"{type(self).__name__} defines no actuators")

    def belief(self) -> Any:
        """Return what the flight software believes of the craft; laws that have a field `body` are given it."""
        return None

    def navigation(self) -> Navigation | None:
        """Return what stands between the measurement and the laws; None: laws read the measurement itself."""
        return None

    def actuation(self, keys: Part | None = None) -> Actuation:
        """Return how a scheme with these keys (`scheme_keys`) turns efforts into actuator commands.

        Raises
        ------
        GncError, ValueError
            Where the keys do not fit the craft; a `MisfitError` says which.
        """
        keys = type(self).scheme_keys() if keys is None else keys
        if not isinstance(keys, EffortKeys):
            raise TypeError(f"{type(self).__name__} has scheme_keys of its own and defines no actuation")
        actuators = self.actuators()
        limit = actuators.most() if keys.effort_limit is None else keys.effort_limit
        return Actuation.of(actuators, limit, _allocator(keys.allocation, actuators))

    def regulated(self, mission: Mission) -> Mapping[str, Sequence[float]]:
        """Return the states that the laws regulate, by name, and the values that they bring them to."""
        return {}

    def swinging(self, mission: Mission) -> Mapping[str, Sequence[float]]:
        """Return states that move beside what is regulated, and where they rest: bending modes, liquids.

        The linear loop has them, so that `check` and `casadi-gnc margins` say whether a law excites them.
        """
        return {}

    def held(self, mission: Mission) -> Mission | None:
        """Return the mission with its target held still, where the target moves; the linear checks look at that."""
        return None

    def panels(self, mission: Mission) -> Sequence[Panel]:
        """Return what a flight's picture shows: what is measured, the efforts, the actuators."""
        plant, effort, goals = mission.truth, mission.schemes[0].actuation.effort, self.regulated(mission)
        tracked = {name for name, goal in goals.items() if not any(goal)} | {one.signal for one in mission.funnels}
        seen = [
            Panel("tracked" if name in tracked else "lines", name, name.replace("_", " "))
            for name in plant.measurement.names
            if name in plant.state
        ]
        made = [Panel("effort", name, name.replace("_", " ")) for name in effort.names]
        others = [name for name in plant.inputs.names if name not in effort]
        told = [Panel("actuators", name, name.replace("_", " ")) for name in others]
        return (*seen, *made, *told)

    def scene(self, mission: Mission) -> Scene:
        """Return what the report's picture in space shows: what the kinds of the plant's signals tell."""
        return Scene.of(mission.truth.state)

    def checks(self, mission: Mission, scheme: Scheme) -> Iterable[Check]:
        """Yield what only this craft can say of a mission, flown by a scheme, before it flies."""
        return ()

    def rehearses(self, mission: Mission, scheme: Scheme) -> bool:
        """Return whether the checks of a scheme fly it: then it is built while other checks are made."""
        return False

    def true_effectivenesses(self, mission: Mission, scheme: Scheme) -> Mapping[str, Any]:
        """Return the effectivenesses, (R, N), that errors and faults may make true under a scheme, by what they are."""
        return {}

    def claimed(
        self, mission: Mission, scheme: Scheme, by: Literal["allocation", "theorem"]
    ) -> Mapping[str, tuple[float, float]]:
        """Return the ranges of keys of a file that a scheme's allocation is set up for, or its law's theorem covers.

        Parameters
        ----------
        mission, scheme : what is flown.
        by : who claims them.
        """
        return {}

    def flaws(self) -> Iterable[MisfitError]:
        """Yield what keeps the craft from flying at all, with the path of the key; `check` says more of it.

        Where tables have mistakes it is asked of a craft without them, and told if it can do without.
        """
        return ()

    def untimely(self, timing: Timing, *, strict: bool) -> Iterable[MisfitError]:
        """Yield what does not fit the times of a flight, with the path of the key.

        Where tables have mistakes it is asked of a craft whose others are right, as if there were none of those.

        Parameters
        ----------
        timing : of the flight; a sensor that is faster than its samples does not fit.
        strict : also what would fly, but not as meant: a mode that no sample can tell, a table that ends early.
        """
        return ()

    def notes(self) -> Sequence[str]:
        """Return sentences that a reader of every flight must see."""
        return ()

    def mass_centre_key(self) -> str:
        """Return the key, (3,), [m], of how far the true centre of mass is off the known one; "" without such.

        `casadi-gnc margins` says by it how far off that centre may be. It is for crafts that forces turn.
        """
        return ""

    def key_of(self, signal: str) -> tuple[str, ...]:
        """Return the path of the key of a file that gives a signal of the state its start, for messages."""
        return ("initial",)


def _allocator(keys: Pinv | Robust, actuators: Actuators) -> Any:
    if isinstance(keys, Pinv):
        return keys.allocator(None)
    problem = AllocationProblem(actuators.fixed.full(), lower=actuators.lower, upper=actuators.upper, **keys.weights())
    return keys.allocator(problem)


#: Crafts by the name that `spacecraft.model` gives: shipped ones, those of installed packages, a user's own.
REGISTRY = Registry(
    "craft",
    "casadi_gnc.crafts",
    {
        name: f"casadi_gnc.vehicles.{name}.craft:{kind}"
        for name, kind in {
            "combined_spacecraft": "CombinedSpacecraftCraft",
            "docking_pair": "DockingPairCraft",
            "wheel_spacecraft": "WheelSpacecraftCraft",
            "proximity_pair": "ProximityPairCraft",
            "drag_free_pair": "DragFreePairCraft",
            "satellite": "SatelliteCraft",
        }.items()
    },
    is_one=lambda thing: (isinstance(thing, type) and issubclass(thing, Craft)) or isinstance(thing, Craft),
    expected="a class derived from casadi_gnc.Craft",
)
