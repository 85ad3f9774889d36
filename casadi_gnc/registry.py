"""Names that problem files and commands use: shipped ones, those that installed packages give, and a user's own.

One `Registry` stands behind each kind of thing that can be named: crafts, laws, back ends, recipes, checks.
A name is looked up in this order: `./file.py:Class` beside the problem file (`casadi_gnc.guests`); what is
shipped; what was registered in this process; what an installed package offers under the kind's entry point.
Nothing can take the name of another. Everything that takes a name also takes the object.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module, metadata
from pathlib import Path
from typing import Any

from casadi_gnc import guests
from casadi_gnc.errors import GncError, RegistryError, offer


class Registry:
    """Find things of one kind by name.

    Parameters
    ----------
    kind : what they are, in the singular: "law".
    group : the entry points' group: "casadi_gnc.laws".
    shipped : home of each shipped thing, "package.module" or "package.module:attribute", by name, in order.
    is_one : whether an object is of this kind; asked of everything that is not shipped.
    expected : what such an object is, for messages: "a class derived from casadi_gnc.Law".
    more : a sentence's end about further names that there are, for messages.
    error : what is raised for a name that leads nowhere.
    """

    def __init__(
        self,
        kind: str,
        group: str,
        shipped: Mapping[str, str],
        *,
        is_one: Callable[[Any], bool],
        expected: str,
        more: str = "",
        error: type[GncError] = RegistryError,
    ) -> None:
        self.kind, self.group, self._shipped, self._more = kind, group, dict(shipped), more
        self._is_one, self._expected, self._registered = is_one, expected, dict[str, Any]()
        self._error = error

    def shipped(self) -> list[str]:
        """Return the names of what comes with the installation, in order."""
        return list(self._shipped)

    def names(self) -> list[str]:
        """Return all names that can be used anywhere, shipped ones first."""
        return list(dict.fromkeys([*self._shipped, *self._registered, *self._offered()]))

    def register(self, name: str, thing: Any) -> Any:
        """Give an object a name in this process; return it. Names that are taken are refused.

        Raises
        ------
        RegistryError
            For a name that is taken or is no identifier, or an object of another kind.
        """
        if not name.isidentifier():
            raise RegistryError(f"{name!r} is no name for a {self.kind}: expected letters, digits and underscores")
        taken = self._taken(name, thing)
        if taken:
            raise RegistryError(f"the {self.kind} {name!r} is {taken} already; register yours under another name")
        self._registered[name] = self._checked(thing, f"registered as {name!r}")
        return thing

    def _taken(self, name: str, thing: Any) -> str:
        if name in self._shipped:
            return "a shipped one"
        if name in self._registered and self._registered[name] is not thing:
            return "registered"
        if name in self._offered():
            return f"offered by the package {', '.join(map(_package, self._offered()[name]))}"
        return ""

    def find(self, name: Any, beside: Path | None = None) -> Any:
        """Return what a name stands for; an object that is no name is returned as it is.

        Parameters
        ----------
        name : a name, "./file.py:Class", or the object itself.
        beside : folder in which a file of the user's own is looked for; the current one by default.

        Raises
        ------
        GncError
            For a name that leads nowhere (with the nearest one), one that two packages offer, and what is not
            of this kind.
        """
        if not isinstance(name, str):
            return self._checked(name, f"given as a {self.kind}")
        if guests.is_guest(name):
            return self._checked(guests.load(name, beside or Path()), repr(name))
        if name in self._shipped:
            home, _, attribute = self._shipped[name].partition(":")
            module = import_module(home)
            return getattr(module, attribute) if attribute else module
        if name in self._registered:
            return self._registered[name]
        offered = self._offered().get(name, [])
        if len(offered) > 1:
            packages = " and ".join(map(_package, offered))
            raise RegistryError(f"two packages offer a {self.kind} {name!r}: {packages}; remove one of them")
        if offered:
            return self._checked(_loaded(offered[0], self.kind), f"{name!r} of the package {_package(offered[0])}")
        raise self._error(self.unknown(name))

    def unknown(self, name: str) -> str:
        """Return the sentence about a name that leads nowhere."""
        return f"no {self.kind} {name!r}; {offer(name, self.names(), self._more)}"

    def name_of(self, thing: Any) -> str:
        """Return the name under which an object can be found, or that of its class."""
        for name in [*self._registered, *self._shipped]:
            if self.find(name) is thing:
                return name
        for name, points in self._offered().items():
            if len(points) == 1 and points[0].value == f"{thing.__module__}:{thing.__qualname__}":
                return name
        return str(getattr(thing, "__name__", type(thing).__name__))

    def _offered(self) -> dict[str, list[metadata.EntryPoint]]:
        """Return the entry points of installed packages by name, without those that name what is shipped."""
        found: dict[str, list[metadata.EntryPoint]] = {}
        for point in metadata.entry_points(group=self.group):
            if point.name in self._shipped:
                continue  # a shipped name stays what it is; `problems` says so
            if all(point.value != other.value for other in found.get(point.name, [])):
                found.setdefault(point.name, []).append(point)
        return found

    def problems(self) -> list[str]:
        """Return a sentence for each entry point that cannot be used: the name is shipped, or offered twice."""
        told = [
            f"the package {_package(point)} offers a {self.kind} {point.name!r}, a shipped one's name: it is not used"
            for point in metadata.entry_points(group=self.group)
            if point.name in self._shipped
        ]
        twice = {name: points for name, points in self._offered().items() if len(points) > 1}
        return told + [
            f"two packages offer a {self.kind} {name!r}: {' and '.join(map(_package, points))}"
            for name, points in twice.items()
        ]

    def _checked(self, thing: Any, where: str) -> Any:
        if not self._is_one(thing):
            raise RegistryError(f"{where} is {_described(thing)}, which is no {self.kind}; expected {self._expected}")
        return thing


def _described(thing: Any) -> str:
    return f"the class {thing.__name__}" if isinstance(thing, type) else f"an object of type {type(thing).__name__}"


def _package(point: metadata.EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.value


def _loaded(point: metadata.EntryPoint, kind: str) -> Any:
    try:
        return point.load()
    except Exception as error:  # whatever a foreign package does when it is imported
        raise RegistryError(
            f"the {kind} {point.name!r} of the package {_package(point)} ({point.value}) cannot be loaded: "
            f"{guests.told(error)}"
        ) from error
