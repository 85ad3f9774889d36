"""What every control law is: frozen gains, a named memory, and pure methods.

A law is written once and runs in two ways from the same methods. *Continuous* (`hold = 0`): its
command and the rate of its memory are evaluated in every stage of the integrator. *Sampled*: the
measurement is taken every `hold` seconds, the command is held, and `casadi_gnc.laws.sampling`
advances the memory over the hold.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, get_type_hints

import casadi as ca

from casadi_gnc.checks import Check
from casadi_gnc.errors import LawError
from casadi_gnc.mathematics import exact
from casadi_gnc.signals import Layout
from casadi_gnc.status import StepStatus


def gain(
    unit: str,
    note: str,
    *,
    symbol: str = "",
    size: int | tuple[int, int] = 1,
    minimum: float | None = None,
    above: float | None = None,
    default: Any = dataclasses.MISSING,
) -> Any:
    """Declare a number of a law that a problem file gives.

    Parameters
    ----------
    unit, note, symbol : shown in the schema; `symbol` is the paper's.
    size : 1, the number of elements of a list, or (rows, columns) of a matrix.
    minimum, above : closed or open lower bound of every element.
    default : value when the file is silent; without one the key is required.
    """
    about = {"unit": unit, "note": note, "symbol": symbol, "size": size, "minimum": minimum, "above": above}
    return dataclasses.field(metadata=about, default=default, kw_only=True)


def option(note: str, *choices: str, default: Any = dataclasses.MISSING) -> Any:
    """Declare a choice of a law that a problem file makes: one of some words, or without `choices` true or false.

    Parameters
    ----------
    note : what it decides, in a few words.
    choices : the words.
    default : what holds where the file is silent; without one the file must choose.
    """
    about = {"note": note, "symbol": "", "unit": "", "choices": choices or (True, False)}
    return dataclasses.field(metadata=about, default=default, kw_only=True)


@dataclass(frozen=True, eq=False)
class Law:
    """Base of all laws; `eq=False` because == on symbols is no bool.

    A law that models the craft has a field `body`: it receives what the craft's software believes. Its methods take t,
    the time [s]; y, the measurement, a column of `inputs`; m, the memory, a column of `memory`.

    Parameters
    ----------
    hold : sample period [s]; 0 means continuous.
    printed : names of the paper's errata to keep as printed (see `errata`).
    """

    hold: float = dataclasses.field(default=0.0, kw_only=True)
    printed: frozenset[str] = dataclasses.field(default=frozenset(), kw_only=True)

    #: Errata of the source that this law corrects: name -> one sentence.
    errata: ClassVar[dict[str, str]] = {}
    #: Measured signals that the law reads, by the plant's names; a signal without frame is taken in any.
    inputs: ClassVar[Layout] = Layout()
    #: What `command` is made of, one signal a kind, in order; None: whatever the craft makes, in its order.
    effort: ClassVar[Layout | None] = None
    #: Memory, what the law carries from one sample to the next.
    memory: ClassVar[Layout] = Layout()
    #: Funnels that the law keeps to: name of the field that takes it -> measured signal that it bounds.
    funnels: ClassVar[dict[str, str]] = {}
    #: What the law shows besides its command, for records and plots.
    outputs: ClassVar[Layout] = Layout()

    def __post_init__(self) -> None:
        for name, declared in gains_of(type(self)).items():
            value, about = getattr(self, name), declared.metadata
            if "choices" in about:
                if value not in about["choices"]:
                    raise LawError(f"{name} is {value!r}, expected one of {', '.join(map(repr, about['choices']))}")
                continue
            if value is None or not exact.is_number(value):
                continue
            numbers = ca.DM(value).nonzeros()
            low, above = about["minimum"], about["above"]
            sound = all(
                math.isfinite(n) and (low is None or n >= low) and (above is None or n > above) for n in numbers
            )
            if not sound:
                expected = (
                    f"more than {above:g}"
                    if above is not None
                    else f"at least {low:g}"
                    if low is not None
                    else "finite"
                )
                raise LawError(f"{name} is {value}, expected {expected}")

    @classmethod
    def reads(cls, belief: Any) -> Layout:
        """Return the measured signals that the law reads on a craft of which the software believes `belief`."""
        return cls.inputs

    @classmethod
    def belief_kind(cls) -> Any:
        """Return the class that a craft's belief must have, that of the field `body`; None without such a field."""
        if "body" not in {field.name for field in dataclasses.fields(cls)}:
            return None
        kind = get_type_hints(cls)["body"]
        return object if kind is Any else kind

    def covers(self) -> Mapping[str, tuple[float, float]]:
        """Return the ranges of the craft's true numbers for which the law's theorem holds, by name; none if left out.

        The law names what it knows (`mass`, `inertia.1.2`); a craft says by `claimed` which keys of a file these are.
        """
        return {}

    @property
    def belief(self) -> Any:
        """What the software believes of the craft: the field `body` of laws that have one, else None."""
        return getattr(self, "body", None)

    def believed_inertia(self) -> Any:
        """Return the inertia that the law works with, (3, 3), [kg m^2], or None if it works with none."""
        return getattr(self.belief, "inertia", None)

    def sign(self, erratum: str) -> int:
        """Return -1 where the sign of an erratum is kept as printed (`printed`), +1 where it is corrected."""
        return -1 if erratum in self.printed else 1

    def check_hold(self) -> None:
        """Raise `LawError` if the law cannot work at its sample period; say which one it could keep."""

    def keeps(self, signal: str) -> bool:
        """Return whether the law means to keep a measured signal inside its funnel."""
        return signal in self.funnels.values()

    def checks(self) -> Iterable[Check]:
        """Return what can be said of the gains alone: the conditions of the source's theorems."""
        return ()

    def start(self, t: Any, y: Any) -> Any:
        """Return the memory at the first measurement y: every estimate is zero."""
        return ca.DM.zeros(self.memory.size)

    def jump(self, t: Any, y: Any, m: Any) -> Any:
        """Return the memory after a discrete change (switching, re-initialisation) at a sample."""
        return m

    def command(self, t: Any, y: Any, m: Any) -> Any:
        """Return the wanted effort, (R,), in the units of the craft's efforts, before any limit."""
        raise TypeError(f"{type(self).__name__} defines no command")

    def rate(self, t: Any, y: Any, m: Any, wanted: Any, achieved: Any) -> Any:
        """Return d(memory)/dt.

        `wanted` is `command` as it was, `achieved` what is taken to have been done about it.
        """
        return ca.DM.zeros(self.memory.size)

    def status(self, t: Any, y: Any, m: Any) -> dict[StepStatus, Any]:
        """Return flags (0 or 1 expressions) by status bit."""
        return {}

    def show(self, t: Any, y: Any, m: Any) -> dict[str, Any]:
        """Return the signals of `outputs`."""
        return {}


def gains_of(law: type[Law]) -> dict[str, dataclasses.Field]:
    """Return the gains and options of a law that a problem file gives, by name.

    Raises
    ------
    LawError
        For a class whose fields were declared and never made: one without the decorator.
    """
    loose = [name for name, value in vars(law).items() if isinstance(value, dataclasses.Field)]
    if loose:
        raise LawError(
            f"{law.__name__} declares {', '.join(loose)} and is no dataclass; write @dataclass(frozen=True, eq=False) "
            f"above class {law.__name__}"
        )
    return {field.name: field for field in dataclasses.fields(law) if "unit" in field.metadata}
