"""Ways through a function of machine code: what may follow an instruction, loops, and where ways join."""

from __future__ import annotations

from casadi_gnc.embedded.thumb import Function, Instruction
from casadi_gnc.errors import TargetError

#: The node of a function's graph that stands for its end.
END = -1


def followers(function: Function, one: Instruction) -> list[int]:
    """Return where control may go from an instruction, within its function; `END` for out of it."""
    inside = one.target is not None and one.target in function.code
    if one.name in ("cbz", "cbnz"):
        return [one.next, one.target or END]
    if one.name == "b":
        there = one.target if inside and one.target is not None else END
        return [one.next, there] if one.condition else [there]
    if one.is_return:
        return [one.next, END] if one.condition else [END]
    if one.name in ("tbb", "tbh", "blx") or (one.name == "bx" and not one.is_return):
        raise TargetError(f"{function.name} jumps through a register at {one.at:x}: its ways cannot be counted")
    return [one.next] if one.next in function.code else [END]


def find_loops(function: Function) -> None:
    """Find the order of a function's instructions, its loops, and where ways join.

    Of a loop that is entered in two places one instruction lies on every way round: it is taken as the last.

    Raises
    ------
    TargetError
        Where there is no such instruction.
    """
    after = {at: followers(function, one) for at, one in function.code.items()}
    order = _reverse_postorder(function.start, after)
    place = {at: number for number, at in enumerate(order)}
    before: dict[int, list[int]] = {}
    for at in order:
        for one in after[at]:
            before.setdefault(one, []).append(at)
    function.joins = frozenset(at for at, many in before.items() if len(many) > 1)
    above = _dominators(order, before, place)
    bodies: dict[int, set[int]] = {}
    for at in order:
        for head in after[at]:
            if head != END and place[head] <= place[at] and _is_above(head, at, above):
                function.back[at, head] = head
                bodies.setdefault(head, {head}).update(_body(head, at, before))
    rest = {at: [one for one in after[at] if one != END and (at, one) not in function.back] for at in order}
    for knot in _knots(order, rest):
        last = _last_of(knot, rest, function.name)
        head = min(knot, key=lambda at: place[at])
        bodies[-head] = set(knot)
        for one in list(rest[last]):
            if one in knot:
                function.back[last, one] = -head
                rest[last].remove(one)
    order = _reverse_postorder(function.start, rest)
    function.place = {at: number for number, at in enumerate(order)}
    for head in [head for head in bodies if head < 0]:
        function.place[head] = min(function.place[at] for at in bodies[head])
    heads = sorted(bodies, key=lambda head: (-len(bodies[head]), function.place[head]))
    function.nest = {at: tuple(head for head in heads if at in bodies[head]) for at in order}


def _knots(order: list[int], after: dict[int, list[int]]) -> list[set[int]]:
    """Return what is still strongly connected when loops with one entry are cut (Tarjan, 1972, without recursion)."""
    number: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    inside: set[int] = set()
    found: list[set[int]] = []
    for root in order:
        if root in number:
            continue
        todo = [(root, iter(after[root]))]
        number[root] = low[root] = len(number)
        stack.append(root)
        inside.add(root)
        while todo:
            node, rest = todo[-1]
            for one in rest:
                if one not in number:
                    number[one] = low[one] = len(number)
                    stack.append(one)
                    inside.add(one)
                    todo.append((one, iter(after[one])))
                    break
                if one in inside:
                    low[node] = min(low[node], number[one])
            else:
                todo.pop()
                if todo:
                    low[todo[-1][0]] = min(low[todo[-1][0]], low[node])
                if low[node] == number[node]:
                    cut = stack.index(node)
                    knot, stack[cut:] = set(stack[cut:]), []
                    inside -= knot
                    found += [knot] if len(knot) > 1 else []
    return found


def _last_of(knot: set[int], after: dict[int, list[int]], name: str) -> int:
    """Return an instruction of a knot that is on every way round."""
    for last in sorted(knot, reverse=True):
        inner = {at: [one for one in after[at] if one in knot and one != last] for at in knot if at != last}
        if not _knots(list(inner), inner):
            return last
    raise TargetError(f"{name} has loops with several entries: its rounds cannot be counted")


def _reverse_postorder(start: int, after: dict[int, list[int]]) -> list[int]:
    order, seen, todo = [], {start}, [(start, iter(after[start]))]
    while todo:
        node, rest = todo[-1]
        for one in rest:
            if one not in seen and one != END:
                seen.add(one)
                todo.append((one, iter(after[one])))
                break
        else:
            order.append(node)
            todo.pop()
    return order[::-1]


def _dominators(order: list[int], before: dict[int, list[int]], place: dict[int, int]) -> dict[int, int]:
    """Return of each instruction the nearest one that every way to it passes (Cooper, Harvey and Kennedy, 2001)."""
    above = {order[0]: order[0]}
    changed = True
    while changed:
        changed = False
        for node in order[1:]:
            best: int | None = None
            for one in before[node]:
                if one in above:
                    best = one if best is None else _common(one, best, above, place)
            if best is not None and above.get(node) != best:
                above[node] = best
                changed = True
    return above


def _common(a: int, b: int, above: dict[int, int], place: dict[int, int]) -> int:
    while a != b:
        while place[a] > place[b]:
            a = above[a]
        while place[b] > place[a]:
            b = above[b]
    return a


def _is_above(a: int, b: int, above: dict[int, int]) -> bool:
    while b != a and above[b] != b:
        b = above[b]
    return a == b


def _body(head: int, latch: int, before: dict[int, list[int]]) -> set[int]:
    found, todo = {latch}, [latch]
    while todo:
        at = todo.pop()
        if at != head:
            new = [one for one in before[at] if one not in found]
            found.update(new)
            todo += new
    return found
