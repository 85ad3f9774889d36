"""A mission: a craft, how it is timed, and one or more schemes that could fly it."""

from __future__ import annotations

import dataclasses
import hashlib
import pickle
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from typing import Any

import casadi as ca

from casadi_gnc import guests
from casadi_gnc.checks import Check
from casadi_gnc.errors import FlightError, offer
from casadi_gnc.guests import GuestFile
from casadi_gnc.mathematics.exact import array
from casadi_gnc.missions import fitting, functions, probing
from casadi_gnc.missions.craft import Craft
from casadi_gnc.missions.describing import on_one_screen
from casadi_gnc.missions.fault_handling import FaultHandling
from casadi_gnc.missions.linear_plant import LinearPlant, linear_plant
from casadi_gnc.missions.origin import Origin, keys_of_timing
from casadi_gnc.missions.parts import Parts
from casadi_gnc.missions.plant import Plant
from casadi_gnc.missions.requirements import Requirement
from casadi_gnc.missions.scheme import Funnel, Metric, Scheme
from casadi_gnc.missions.stepper import Stepper
from casadi_gnc.missions.timing import Noise, Timing
from casadi_gnc.tables.part import plain

#: Changes of `with_scheme` that are of the scheme; all others are gains of its law.
_OF_A_SCHEME = ("law", "feedback", "actuation", "title")


@dataclass(frozen=True, eq=False, repr=False)
class Mission:
    """Everything needed to fly: read by `casadi_gnc.load`, or made from objects.

    `casadi.Function`s for analysis come from `plant`, `law`, `step` and `closed_loop`; `controller` steps one
    scheme by hand. It pickles, with the user's own code that it needs.

    Parameters
    ----------
    craft : what flies.
    schemes : at least one; laws are given the sample period of `timing`.
    timing : when things happen.
    name : of files that are written.
    metrics : numbers asked of every flight.
    requirements : what every flight must meet: bounds on metrics, and formulas over signals.
    funnels : bounds that the mission sets measured signals.
    noise : how random numbers are drawn.
    title, source : for whoever reads the results.
    start_from : states that begin otherwise than the craft says, by signal.
    checks : functions (mission, scheme) that yield further checks of this mission.
    parts : of the craft, where it has been asked for them.
    dispersions : what differs from case to case of a campaign (`casadi_gnc.campaigns.cases.Dispersion`).
    fault_handling : what flight packages do with faults beside telling them.
    origin : the file that it was read from, if it was; `dataclasses.replace`, which may change anything, forgets it.

    Raises
    ------
    FlightError
        For schemes of one name, a start that the plant does not have, a metric or a funnel of no signal.
    RequirementError
        For a requirement on a metric or a signal that is not there, and two of one id.

    Examples
    --------
    >>> import casadi_gnc
    >>> mission = casadi_gnc.load("huang2020/detumble").with_scheme("observer_pinv", rate_gain=0.5)
    >>> mission.scheme().law.rate_gain
    0.5
    """

    craft: Craft
    schemes: Sequence[Scheme]
    timing: Timing
    name: str = "mission"
    metrics: Sequence[Metric] = ()
    funnels: Sequence[Funnel] = ()
    noise: Noise = Noise()
    title: str = ""
    source: str = ""
    start_from: Mapping[str, Sequence[float]] = field(default_factory=dict)
    checks: Sequence[Callable[[Mission, Scheme], Iterable[Check]]] = ()
    requirements: Sequence[Requirement] = ()
    dispersions: Sequence[Any] = ()
    fault_handling: FaultHandling | None = None
    parts: InitVar[Parts | None] = None
    origin: Origin | None = field(default=None, init=False)

    def __post_init__(self, parts: Parts | None) -> None:
        fitting.refuse_strangers(self)
        if parts is not None:
            self.__dict__["parts_asked"] = parts
        hold = self.timing.sample_period if self.timing.mode == "sampled" else 0.0
        object.__setattr__(self, "schemes", tuple(_held(each, hold) for each in self.schemes))
        object.__setattr__(self, "funnels", tuple(self.funnels))
        fitting.refuse(self)
        probing.probe(self)
        object.__setattr__(self, "metrics", tuple(fitting.complete(self, metric) for metric in self.metrics))
        object.__setattr__(self, "requirements", tuple(self.requirements))
        fitting.refuse_requirements(self)
        fitting.refuse_fault_handling(self, self.fault_handling)

    @cached_property
    def parts_asked(self) -> Parts:
        """What the craft has answered."""
        return Parts(self.craft)

    @cached_property
    def truth(self) -> Plant:
        """The plant: what truly moves, and what the sensors say."""
        hold = self.timing.sample_period if self.timing.mode == "sampled" else 0.0
        return self.parts_asked.plant.timed(hold, hold / self.timing.substeps)

    @cached_property
    def start(self) -> list[Any]:
        """The plant's state at t = 0, in its order."""
        by_signal = {**self.parts_asked.start, **self.start_from}
        return [value for name in self.truth.state.names for value in array(plain(by_signal[name])).elements()]

    @cached_property
    def target(self) -> Mapping[str, Sequence[float]]:
        """The states that the laws regulate, by name, and the values that they bring them to."""
        return fitting.goals(self)

    @property
    def swinging(self) -> Mapping[str, Sequence[float]]:
        """The states that move beside what is regulated, by name, and where they rest."""
        return fitting.goals(self, "swinging")

    @property
    def digest(self) -> str:
        """Hash of what the mission was made of: its file with changes and guests, or its data and classes."""
        return self.origin.digest if self.origin is not None else _digest(self)

    def quiet(self) -> ca.DM:
        """Return noise that is zero."""
        return ca.DM.zeros(self.truth.noise.size)

    def first_measurement(self) -> ca.DM:
        """Return what perfect sensors say at t = 0, in the plant's order."""
        return ca.DM(self.truth.measure(0.0, ca.DM(self.start), self.quiet()))

    def scheme(self, name: str | None = None) -> Scheme:
        """Return a scheme by name, the first one by default."""
        if name is None:
            return self.schemes[0]
        for scheme in self.schemes:
            if scheme.name == name:
                return scheme
        known = [scheme.name for scheme in self.schemes]
        raise FlightError(f"no scheme {name!r} in {self.name}; {offer(name, known)}")

    def with_timing(self, **changes: Any) -> Mission:
        """Return the mission with changes of `mode`, `sample_period`, `duration` or `substeps`.

        Raises `LawError` where a law cannot work at that sample period.
        """
        changed = self._noting(
            replace(self, timing=replace(self.timing, **changes), parts=self.parts_asked),
            keys_of_timing(self.timing, changes),
        )
        for scheme in changed.schemes:
            scheme.law.check_hold()
        return changed

    def with_scheme(self, name: str | None = None, **changes: Any) -> Mission:
        """Return the mission with one scheme only; changes are `law`, `feedback`, `actuation`, or gains by name."""
        scheme = self.scheme(name)
        own = {key: changes.pop(key) for key in _OF_A_SCHEME if key in changes}
        law = own.get("law", scheme.law)
        known = {own_field.name for own_field in dataclasses.fields(law)}
        for key in changes:
            if key not in known:
                raise FlightError(f"scheme {scheme.name!r} has no {key!r}; its law has {', '.join(sorted(known))}")
        paths = {f"scheme.{scheme.name}.law.{key}": value for key, value in changes.items()}
        paths |= {f"scheme.{scheme.name}.{key}": value for key, value in own.items()}
        if "actuation" in own:
            own["keys"] = None  # they made the one that it had
        changed = replace(scheme, **{**own, "law": replace(law, **changes) if changes else law})
        return self._noting(replace(self, schemes=(changed,), parts=self.parts_asked), paths)

    def _noting(self, changed: Mission, paths: Mapping[str, Any]) -> Mission:
        """Return a changed mission that has the file of this one, with the changes."""
        return changed if self.origin is None else changed.read_from(self.origin.with_changes(paths))

    def measured_by(self, metrics: Sequence[Metric]) -> Mission:
        """Note the metrics, completed, of a mission that was just made, and return the mission."""
        object.__setattr__(self, "metrics", tuple(metrics))
        return self

    def held_to(self, requirements: Sequence[Requirement]) -> Mission:
        """Note the requirements, looked at, of a mission that was just made, and return the mission."""
        object.__setattr__(self, "requirements", tuple(requirements))
        return self

    def handling(self, faults: FaultHandling) -> Mission:
        """Note what packages of a mission that was just made do with faults, looked at, and return the mission."""
        object.__setattr__(self, "fault_handling", faults)
        return self

    def read_from(self, origin: Origin | None) -> Mission:
        """Note the file of a mission that was just made, and return the mission."""
        object.__setattr__(self, "origin", origin)
        return self

    def with_craft(self, craft: Craft) -> Mission:
        """Return the mission of another craft; what the schemes believe stays."""
        return replace(self, craft=craft)

    def controller(self, scheme: str | None = None) -> Stepper:
        """Return the sampled controller of a scheme, to be stepped with measurements from elsewhere.

        Examples
        --------
        >>> import casadi_gnc
        >>> controller = casadi_gnc.load("huang2020/detumble").controller("observer_pinv")
        >>> controller.step(0.0, mrp=[0.1, 0.0, 0.0], rate=[0.02, -0.01, 0.0])["wanted"].shape
        (3,)
        """
        return Stepper(self, scheme)

    def plant(self) -> ca.Function:
        """Return x' as a function (t, x, actuators) -> rate without noise, with the ports of the plant's layouts."""
        return functions.plant_rate(self)

    def linearised(self, scheme: str | None = None, at_s: float = 0.0) -> LinearPlant:
        """Return A and B of the plant at its target at a time `at_s`, by the efforts of a scheme; see `LinearPlant`.

        Raises
        ------
        FlightError
            Where the mission has no target, or the plant no slope there.
        """
        return linear_plant(self, self.scheme(scheme), at_s)

    def law(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return the law as (t, y, m, achieved, [p]) -> (wanted, rate of memory, shown signals).

        `parameters` are symbols that were put in place of gains by `with_scheme`; where there are
        any, the function has them as its last port, p.
        """
        return functions.law_function(self, self.scheme(scheme), parameters)

    def step(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return one sample of the controller: (t, y, good, m, actuators, [p]) -> (actuators_next, m_next, ...).

        p has the `parameters`, symbols that the mission has in the place of numbers.
        """
        return functions.step_function(self, self.scheme(scheme), parameters)

    def loop_start(self, scheme: str | None = None) -> dict[str, ca.DM]:
        """Return x, m, actuators and good at t = 0, as `closed_loop` takes them."""
        return functions.loop_start(self, self.scheme(scheme))

    def closed_loop(self, scheme: str | None = None, parameters: Sequence[ca.SX] = ()) -> ca.Function:
        """Return one sample period of the loop: (t, x, m, actuators, good, [p]) -> the same, later.

        Ports: `t` [s]; `x`, the plant's state in the order of `truth.state`; `m`, the law's memory;
        `actuators`, what they were last told; `good`, the last good measurement. Results: `x_next`,
        `m_next`, `actuators_next`, `good_next`, `wanted`, `limited`. `loop_start` gives the first values.
        Noise is zero. Only schemes whose allocation is an expression have a closed loop. The last port, `p`, has the
        `parameters`, symbols that the mission has in the place of numbers.
        """
        return functions.closed_loop_function(self, self.scheme(scheme), parameters)

    def __repr__(self) -> str:
        return on_one_screen(self)

    def __reduce__(self) -> Any:
        own = {each.name: getattr(self, each.name) for each in dataclasses.fields(self)}
        try:
            content = pickle.dumps(own)
        except Exception as error:  # whatever objects of the user's own do
            raise FlightError(
                f"the mission cannot go to another process: {error}. Use methods and classes in the place of lambdas, "
                "and numbers in the place of symbols"
            ) from error
        return _restored, (self.guests(), content)

    def guests(self) -> tuple[GuestFile, ...]:
        """Return the files of the user's own code from which classes of the mission come."""
        parts = [
            (each.law, each.law.belief, each.actuation, each.actuation.allocator, each.navigation)
            for each in self.schemes
        ]
        found = guests.files_of(self.craft, self.truth, *(part for each in parts for part in each))
        named = () if self.origin is None else self.origin.guests
        # The same text is the same code, wherever another mission has it.
        return tuple({file.module: file for file in (*found, *named)}.values())


def _held(scheme: Scheme, hold: float) -> Scheme:
    """Return a scheme whose law and navigation have this sample period [s]."""
    law, navigation = scheme.law, scheme.navigation
    if law.hold == hold and (navigation is None or navigation.hold == hold):
        return scheme
    moved = None if navigation is None else replace(navigation, hold=hold)
    return replace(scheme, law=replace(law, hold=hold), navigation=moved)


def _restored(files: tuple[GuestFile, ...], content: bytes) -> Mission:
    """Return a mission from a pickle; the code that it needs is run first."""
    guests.run_all(files)
    own = pickle.loads(content)
    origin = own.pop("origin")
    return Mission(**own).read_from(origin)


def _digest(mission: Mission) -> str:
    """Return the hash of a mission that was made from objects: names of classes, data, and guests' code."""
    told = [f"{type(mission.craft).__qualname__} {mission.craft.model_dump_json()}", repr(mission.timing)]
    told += [repr(each) for each in (mission.noise, *mission.metrics, *mission.funnels, dict(mission.start_from))]
    told += [repr(each) for each in mission.requirements]
    told += [] if mission.fault_handling is None else [repr(mission.fault_handling)]
    for scheme in mission.schemes:
        told.append(f"{scheme.name} {scheme.law!r} {scheme.actuation!r} {scheme.feedback}")
        told += [] if scheme.navigation is None else [repr(scheme.navigation)]
    told += [f"{file.path} {file.sha256}" for file in mission.guests()]
    # Functions show where they lie in memory, which says nothing.
    return hashlib.sha256(re.sub(r" at 0x[0-9a-f]+", "", "\n".join(told)).encode()).hexdigest()
