"""Where in the tapes of a controller a named expression is computed.

Scalars that are the same operation on the same scalars have one number, whichever tape they stand in; what one tape
hands to the next is the scalar that was handed over.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import casadi as ca

from casadi_gnc.embedded.scalars import Node, graph

#: Title, and the scalars of a tape that it names, in the order of `casadi_gnc.embedded.scalars.graph`.
Mark = tuple[str, tuple[int, ...]]
#: Result of a tape -> the port under which later tapes take it.
_HANDED = {"derived": "e", "carried": "carried"}


def marks(
    tapes: Mapping[str, ca.Function], named: Iterable[tuple[str, ca.SX]], symbols: Mapping[str, ca.SX]
) -> dict[str, tuple[Mark, ...]]:
    """Return for each tape which of its scalars have a name.

    Parameters
    ----------
    tapes : in the order in which they hand over.
    named : titles and expressions, in the order in which they were made; what depends on other symbols is left out.
    symbols : the columns that the expressions are made of, by their names as ports.
    """
    known = {each.element_hash() for column in symbols.values() for each in ca.symvar(ca.SX(column))}
    mine = [(title, ca.densify(value)) for title, value in named]
    mine = [(title, value) for title, value in mine if {each.element_hash() for each in ca.symvar(value)} <= known]
    numbers: dict[object, int] = {}
    handed: dict[str, int] = {}
    numbered = {}
    for name, tape in tapes.items():
        _, own, results = _numbered(tape, numbers, handed)
        numbered[name] = own
        for place, k in results:
            port, _, element = place.partition("[")
            if port in _HANDED:
                handed[f"{_HANDED[port]}[{element}"] = own[k]
    values, columns = [value for _, value in mine], [ca.SX(column) for column in symbols.values()]
    whole = ca.Function("named", columns, values, list(symbols), [f"r{i}" for i in range(len(values))])
    nodes, own, results = _numbered(whole, numbers, {})
    ways: list[list[list[int]]] = [[] for _ in values]
    for place, k in results:
        way = [own[k]]
        while len(nodes[k].operands) == 1:  # what is -x here may be subtracted there, so that x is what is named
            k = nodes[k].operands[0]
            way.append(own[k])
        ways[int(place[1:].partition("[")[0])].append(way)
    wanted = [(title, way) for (title, _), way in zip(mine, ways, strict=True)]
    return {name: tuple(_found(each, wanted)) for name, each in numbered.items()}


def _found(own: Sequence[int], wanted: Iterable[tuple[str, list[list[int]]]]) -> Iterator[Mark]:
    where = {number: k for k, number in reversed(list(enumerate(own)))}
    for title, ways in wanted:
        met = (next((where[number] for number in way if number in where), None) for way in ways)
        if nodes := tuple(dict.fromkeys(k for k in met if k is not None)):
            yield title, nodes


def _numbered(
    tape: ca.Function, numbers: dict[object, int], handed: Mapping[str, int]
) -> tuple[list[Node], list[int], list[tuple[str, int]]]:
    """Return the scalars of a tape, the number of each, and for each result its place and its scalar."""
    sides = ((tape.name_in(), tape.numel_in), (tape.name_out(), tape.numel_out))
    places = {name: [f"{name}[{i}]" for i in range(count(name))] for names, count in sides for name in names}
    nodes, results = graph(tape, places)
    own: list[int] = []
    for node in nodes:
        own.append(handed[node.place] if node.place in handed else _number(node, own, numbers))
    return nodes, own, results


def _number(node: Node, own: Sequence[int], numbers: dict[object, int]) -> int:
    key = (node.code, tuple(own[i] for i in node.operands), node.place, node.number)
    return numbers.setdefault(key, len(numbers))
