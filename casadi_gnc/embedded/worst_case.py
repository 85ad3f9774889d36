"""The most instructions that a function can take, whatever its data: an abstract execution of the compiled text.

Numbers in memory that the caller provides are unknown, and so is all arithmetic of reals; addresses, counters and what
follows from them are known or lie in an interval. Where a branch depends on what is unknown both ways are taken, up to
the next instruction where ways join, and there the dearer one counts and what the two know is joined. A loop so ends
when its counter says so: what is returned is a bound for every input, and no sample.

Assumed is what the tests of the runtime show by other means: no access out of the bounds of an array (sanitizers,
fuzzing), so that a store to an address that is not known leaves alone what the compiler keeps on the stack; and the
objects given do not overlap.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable

from casadi_gnc.embedded import thumb
from casadi_gnc.embedded.control_flow import find_loops
from casadi_gnc.embedded.intervals import Unknown
from casadi_gnc.embedded.known_state import APART, OBJECTS, STACK, State
from casadi_gnc.embedded.processor import Processor
from casadi_gnc.embedded.thumb import Function, Instruction
from casadi_gnc.errors import TargetError

#: Address that ends the call.
_BACK = 0x7FFF0000
#: Work after which the search gives up, in instructions: a loop without a bound, or ways that know too much to join.
_PATIENCE = 24_000_000
#: Places in memory that two states know are joined at so many for the work of an instruction.
_JOINED = 8


class _Ways:
    """Hold the ways through a function that wait to be gone on with, each at an instruction and a round of its loops.

    The earliest goes on first, so that ways which can still join do: all of a round before the next, a loop before
    what follows it.
    """

    def __init__(self, function: Function, merge: Callable[[State, State], State]) -> None:
        self._function, self._merge = function, merge
        self._held: dict[tuple[int, ...], tuple[int, int, State]] = {}
        self.waiting: list[tuple[int, ...]] = []
        self.end: tuple[int, State] | None = None

    def add(self, key: tuple[int, ...], came: int, at: int, cost: int, state: State) -> None:
        """Let a way wait at an instruction; `came` is where it comes from, `key` that of the way so far."""
        place, back = self._function.place, self._function.back.get((came, at))
        found: list[int] = []
        same = True
        for level, head in enumerate(self._function.nest[at]):
            same = same and len(key) > 2 * level + 1 and key[2 * level] == place[head]
            again = same and back == head
            found += (place[head], key[2 * level + 1] + again if same else 0)
            same = same and not again
        new = (*found, place[at])
        if new in self._held:
            _, other_cost, other = self._held[new]
            self._held[new] = (at, max(cost, other_cost), self._merge(other, state))
        else:
            self._held[new] = (at, cost, state)
            heapq.heappush(self.waiting, new)

    def first(self) -> tuple[tuple[int, ...], int, int, State]:
        """Return the earliest way, and let it wait no longer."""
        key = heapq.heappop(self.waiting)
        return (key, *self._held.pop(key))

    def finish(self, cost: int, state: State) -> None:
        """Let a way end."""
        self.end = (cost, state) if self.end is None else (max(cost, self.end[0]), self._merge(self.end[1], state))


class Counter(Processor):
    """Count the instructions of functions of one image at their worst.

    Parameters
    ----------
    disassembly : text of `objdump -d --no-show-raw-insn`.
    constants : bytes of the image from address 0 on, where constants lie.
    """

    def __init__(self, disassembly: str, constants: bytes) -> None:
        self._functions = thumb.functions(disassembly)
        self._by_name = {one.name: one for one in self._functions.values()}
        super().__init__(constants)
        self._left = _PATIENCE
        self.calls: dict[str, int] = {}

    def has(self, name: str) -> bool:
        """Tell whether the image has a function."""
        return name in self._by_name

    def worst(self, name: str, objects: int) -> int:
        """Return the bound of a call whose arguments are pointers to so many objects.

        Raises
        ------
        TargetError
            Where an instruction is not known, a jump goes through a register, or a loop has no bound.
        """
        if not self.has(name):
            raise TargetError(f"the image has no function {name}")
        unknown = [self._values.fresh() for _ in range(16)]
        state = State(unknown)
        for place in range(objects):
            pointer = OBJECTS + place * APART
            if place < 4:
                state.registers[place] = pointer
            else:
                state.memory[STACK + 4 * (place - 4)] = (4, pointer)
        state.registers[13], state.registers[14] = STACK, _BACK
        return self._call(self._by_name[name], state)

    def _spend(self, work: int) -> None:
        self._left -= work
        if self._left < 0:
            raise TargetError("its text has a loop without a bound that shows, or more ways than can be followed")

    def _merge(self, a: State, b: State) -> State:
        self._spend(len(a.memory) // _JOINED)
        return super()._merge(a, b)

    # ---- control --------------------------------------------------------------------------------------

    def _call(self, function: Function, state: State) -> int:
        """Run a function to its end; return its instructions, and leave the state behind it."""
        if not function.nest:
            find_loops(function)
        ways = _Ways(function, self._merge)
        ways.add((), -1, function.start, 0, state)
        while ways.waiting:
            self._follow(function, ways, *ways.first())
        if ways.end is None:
            raise TargetError(f"{function.name} does not end")
        cost, last = ways.end
        bottom = last.registers[13]
        if isinstance(bottom, int):  # the frame of the function is gone
            last.memory = {at: known for at, known in last.memory.items() if not STACK - APART < at < bottom}
            last.saved = frozenset(at for at in last.saved if at >= bottom)
        used = {one.which for one in last.registers if isinstance(one, Unknown)}
        used.update(one.which for _, one in last.memory.values() if isinstance(one, Unknown))
        last.narrowed = {which: limits for which, limits in last.narrowed.items() if which in used}
        state.registers, state.memory, state.flags = last.registers, last.memory, last.flags
        state.saved, state.narrowed = last.saved, last.narrowed
        self.calls[function.name] = max(cost, self.calls.get(function.name, 0))
        return cost

    def _follow(self, function: Function, ways: _Ways, key: tuple[int, ...], at: int, cost: int, state: State) -> None:
        """Run from an instruction to the next branch that is not decided, or to where ways join."""
        while True:
            one = function.code.get(at)
            if one is None:
                raise TargetError(f"{function.name} leads to no instruction at {at:x}")
            cost += 1
            self._spend(1)
            if one.name in ("b", "cbz", "cbnz") or (one.is_return and one.condition):
                taken = self._decide(one, state)
                for way in (True, False) if taken is None else (taken,):
                    other = state.copy() if taken is None else state
                    if taken is None and not self._suppose(one, other, way):
                        continue
                    if not way:
                        ways.add(key, one.at, one.next, cost, other)
                    elif one.is_return or one.target not in function.code:
                        ways.finish(cost + self._leave(one, other), other)
                    else:
                        ways.add(key, one.at, one.target or 0, cost, other)
                return
            if one.is_return:
                self._apply(one, state)
                ways.finish(cost, state)
                return
            if one.name == "bl":
                called = self._functions.get(one.target or 0)
                if called is None:
                    raise TargetError(f"{function.name} calls what is no function at {at:x}")
                state.registers[14] = one.next
                cost += self._call(called, state)
            else:
                self._apply(one, state)
            at = one.next
            if at in function.joins:
                ways.add(key, one.at, at, cost, state)
                return

    def _leave(self, one: Instruction, state: State) -> int:
        """Return the instructions of a jump out of the function: a return, or a call that does not come back."""
        if one.is_return:
            self._apply(one, state)
            return 0
        called = self._functions.get(one.target or 0)
        if called is None:
            raise TargetError(f"a jump at {one.at:x} leads to no function")
        return self._call(called, state)
