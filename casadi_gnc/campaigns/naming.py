"""Plans by name, made for what varies.

=============================  =====================================================================================
name                           plan
=============================  =====================================================================================
independent                    every number by itself
latin_hypercube                one case in each of as many cells of every dimension
sobol                          the cube filled evenly
corners                        every combination of low and high
one_at_a_time                  one dimension after the other, low and high, the others in the middle
grid:LEVELS                    every combination of so many levels
importance:SHIFT:KEY,KEY=-2    most cases moved SHIFT deviations along a direction: parts 1 and -2 of these keys
pick_freeze                    blocks for first-order and total sensitivity indices
=============================  =====================================================================================
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from casadi_gnc.campaigns.correlated import Correlated
from casadi_gnc.campaigns.designs import Corners, Grid, OneAtATime
from casadi_gnc.campaigns.distributions import Distribution, LogUniform, Normal, Uniform
from casadi_gnc.campaigns.importance import Importance
from casadi_gnc.campaigns.orientations import Direction, Rotation
from casadi_gnc.campaigns.pick_freeze import PickFreeze
from casadi_gnc.campaigns.plan import Plan
from casadi_gnc.campaigns.plans import Independent, LatinHypercube, Sobol
from casadi_gnc.errors import CampaignError, offer

#: Names of plans, for messages.
PLANS = (
    "independent",
    "latin_hypercube",
    "sobol",
    "corners",
    "one_at_a_time",
    "grid:LEVELS",
    "importance:SHIFT:KEY=PART,...",
    "pick_freeze",
)


@dataclass(frozen=True, eq=False)
class Parts:
    """Say which numbers and which dimensions of the cube each dispersion has.

    Parameters
    ----------
    given : the key of each dispersion.
    keys : the whole path of each number, one dispersion after the other.
    distributions : of each dispersion.
    """

    given: tuple[str, ...]
    keys: tuple[str, ...]
    distributions: tuple[Distribution, ...]

    @property
    def dimensions(self) -> int:
        """Of the cube; 1 where nothing varies but noise."""
        return max(1, sum(each.dimensions for each in self.distributions))

    @property
    def groups(self) -> tuple[tuple[str, int], ...]:
        """Name and number of dimensions of what varies by itself: single numbers, and blocks that are drawn as one."""
        found: list[tuple[str, int]] = []
        at = 0
        for key, each in zip(self.given, self.distributions, strict=True):
            own = self.keys[at : at + each.values]
            at += each.values
            whole = isinstance(each, (Correlated, Direction, Rotation)) or each.dimensions != each.values
            found += [(key, each.dimensions)] if whole else [(one, 1) for one in own]
        return tuple(found)

    def direction(self, told: str) -> tuple[float, ...]:
        """Return the direction in the cube that a text such as "truth.inertia_factor,initial.rate.2=-1" says.

        Raises
        ------
        CampaignError
            For a key that does not vary, or not by itself, and a part that is no number.
        """
        found = [0.0] * self.dimensions
        for part in told.split(","):
            key, _, number = part.strip().partition("=")
            try:
                size = float(number) if number else 1.0
            except ValueError:
                size = math.nan
            if not math.isfinite(size):
                raise CampaignError(f"the direction has {part.strip()!r}; expected KEY or KEY=NUMBER")
            places = self._places(key)
            if not places:
                raise CampaignError(f"{key!r} does not vary; {offer(key, self.keys)}")
            for place in places:
                found[place] = size
        return tuple(found)

    def _places(self, key: str) -> list[int]:
        """Return the dimensions of a key: of a dispersion, of one of its numbers, or of all below a table."""
        places, value, dimension = [], 0, 0
        for given, each in zip(self.given, self.distributions, strict=True):
            own = self.keys[value : value + each.values]
            chosen = [i for i, one in enumerate(own) if key in (given, one) or one.startswith(f"{key}.")]
            if chosen and not isinstance(each, (Normal, Uniform, LogUniform)):
                raise CampaignError(
                    f"{key!r} has no direction: it is a {type(each).__name__.lower()}; expected numbers that are "
                    "normal, uniform or log_uniform, each by itself"
                )
            places += [dimension + i for i in chosen]
            value, dimension = value + each.values, dimension + each.dimensions
        return places


def plan_of(name: str, parts: Parts, flights: int) -> Plan:
    """Return the plan of a name for what varies; raise `CampaignError` where there is none."""
    dimensions = parts.dimensions
    kind, _, rest = name.partition(":")
    if kind == "grid" and rest.isdecimal():
        return Grid((int(rest),) * dimensions)
    if kind == "importance":
        return _importance(name, rest, parts)
    made = {
        "independent": lambda: Independent(dimensions),
        "latin_hypercube": lambda: LatinHypercube(dimensions, flights),
        "sobol": lambda: Sobol(dimensions),
        "corners": lambda: Corners(dimensions),
        "one_at_a_time": lambda: OneAtATime(dimensions),
        "pick_freeze": lambda: _pick_freeze(parts, flights),
    }
    if name not in made:
        raise CampaignError(f"no plan {name!r}; {offer(name, PLANS)}")
    return made[name]()


def _importance(name: str, rest: str, parts: Parts) -> Importance:
    shift, _, direction = rest.partition(":")
    try:
        size = float(shift)
    except ValueError:
        size = math.nan
    if not direction or math.isnan(size):
        raise CampaignError(
            f"the plan is {name!r}; expected importance:SHIFT:KEY=PART,..., by how many deviations and along which "
            "keys, such as importance:2.5:truth.inertia_factor=1"
        )
    return Importance(parts.direction(direction), size)


def _pick_freeze(parts: Parts, flights: int) -> PickFreeze:
    if not parts.groups:
        raise CampaignError("pick_freeze compares what varies, and nothing does; add a [[dispersion]]")
    made = PickFreeze(Sobol(2 * parts.dimensions), tuple(size for _, size in parts.groups))
    if flights % made.block:
        whole = flights - flights % made.block
        near = f"{whole} or {whole + made.block}" if whole else f"{made.block}"
        raise CampaignError(
            f"{flights} flights are asked for; pick_freeze flies blocks of {made.block}, two and one for each of "
            f"{len(parts.groups)} inputs, so expected a multiple, such as {near}"
        )
    return made
