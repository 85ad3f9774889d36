"""The statements of a program in an order in which everything is known before it is used."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

import casadi as ca

from casadi_gnc.embedded.programs import Call, Program
from casadi_gnc.embedded.scalars import uses

#: From so many numbers on, what lies side by side is copied by a loop.
_RUN = 8
_PLACE = re.compile(r"(\w+)\[(\d+)\]")


@dataclass(frozen=True)
class Copy:
    """Copy numbers that lie side by side."""

    target: str
    at: int
    source: str
    start: int
    count: int


@dataclass(frozen=True)
class Store:
    """Store a scalar in a result."""

    target: str
    at: int
    node: int


Item = int | Call | Copy | Store


class Order:
    """Put the statements of a program in order.

    Parameters
    ----------
    program : whose scalars that nothing needs are left out.

    Attributes
    ----------
    nodes : of the program.
    compared : scalars that nothing but comparisons use.
    place : array and index of each scalar that is read from one.
    """

    def __init__(self, program: Program) -> None:
        self._program, self.nodes = program, program.nodes
        wanted = [node for *_, node in program.stores]
        wanted += [node for call in program.calls for argument in call.arguments for node in argument]
        used, self.compared = uses(self.nodes, wanted)
        self.place: dict[int, tuple[str, int]] = {}
        for k in used:
            found = _PLACE.fullmatch(self.nodes[k].place)
            if found is not None:
                self.place[k] = found[1], int(found[2])

    def items(self) -> list[Item]:
        """Return the statements in an order in which everything is known before it is used."""
        done: set[int] = set()
        items: list[Item] = []
        copies, copied = self._copies()
        stores: dict[int, list[Store]] = {}
        for target, at, node in self._program.stores:
            if (target, at) not in copied:
                stores.setdefault(node, []).append(Store(target, at, node))

        def need(wanted: Iterable[int]) -> None:
            todo, fresh = [k for k in wanted if k not in done], set()
            while todo:
                k = todo.pop()
                if k not in done and k not in fresh:
                    fresh.add(k)
                    todo += self.nodes[k].operands
            for k in sorted(fresh):
                items.append(k)
                items.extend(stores.pop(k, ()))
            done.update(fresh)

        for call in self._program.calls:
            for argument in call.arguments:
                if self.source(argument) is None and not self.is_table(argument):
                    need(argument)
            items.append(call)
        need(node for _, at, node in self._program.stores if node in stores)
        for each in stores.values():
            items.extend(each)
        return items + copies

    def _copies(self) -> tuple[list[Item], set[tuple[str, int]]]:
        """Return the copies of whole runs of inputs or results into results, and which elements they fill."""
        copies: list[Item] = []
        filled: set[tuple[str, int]] = set()
        run: list[tuple[str, int, int]] = []

        def close() -> None:
            if len(run) >= _RUN:
                (target, at, _), (source, start) = run[0], self.place[run[0][2]]
                copies.append(Copy(target, at, source, start, len(run)))
                filled.update((target, i) for target, i, _ in run)
            run.clear()

        for store in sorted(self._program.stores):
            if store[2] not in self.place:
                close()
                continue
            if run:
                (target, at, _), (source, start) = run[-1], self.place[run[-1][2]]
                if (target, at + 1, (source, start + 1)) != (*store[:2], self.place[store[2]]):
                    close()
            run.append(store)
        close()
        return copies, filled

    def source(self, argument: tuple[int, ...]) -> tuple[str, int] | None:
        """Return where an argument already lies as an array, if it does."""
        places = [self.place.get(k) for k in argument]
        if not places or places[0] is None:
            return None
        name, start = places[0]
        return (name, start) if places == [(name, start + i) for i in range(len(places))] else None

    def is_table(self, argument: tuple[int, ...]) -> bool:
        """Tell whether an argument is constants alone, and so many that they are a table."""
        return len(argument) > 3 and all(self.nodes[k].code == ca.OP_CONST for k in argument)
