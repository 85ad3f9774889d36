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

import functools
import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

from casadi_gnc.embedded import thumb
from casadi_gnc.embedded.intervals import Unknown, Value, Values, join, word
from casadi_gnc.embedded.thumb import Function, Instruction
from casadi_gnc.errors import TargetError

#: Where the objects of the call lie, far from each other, and the top of the stack.
OBJECTS, APART, STACK = 0x40000000, 0x1000000, 0x20300000
#: Address that ends the call.
_BACK = 0x7FFF0000
#: Instructions after which the search gives up: some loop has no bound.
_PATIENCE = 30_000_000


@dataclass
class State:
    """Hold what is known at one moment: registers, memory by address and size, narrowed intervals, flags.

    Flags are of a comparison of two words, of a result (with 0), or of a result with its carry.
    """

    registers: list[Value]
    memory: dict[int, tuple[int, Value]] = field(default_factory=dict)
    saved: frozenset[int] = frozenset()
    narrowed: dict[int, tuple[int, int]] = field(default_factory=dict)
    flags: tuple[str, Value, Value] | None = None

    def copy(self) -> State:
        """Return a state that may be changed."""
        return State(list(self.registers), dict(self.memory), self.saved, dict(self.narrowed), self.flags)

    def forget(self, first: int, size: int) -> None:
        """Drop what is known of bytes in memory."""
        memory = self.memory
        if size > 64:
            for at in [at for at, (width, _) in memory.items() if at < first + size and at + width > first]:
                del memory[at]
            return
        for at in range(first - 3, first + size):
            known = memory.get(at)
            if known is not None and at + known[0] > first:
                del memory[at]


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


class Counter:
    """Count the instructions of functions of one image at their worst.

    Parameters
    ----------
    disassembly : text of `objdump -d --no-show-raw-insn`.
    constants : bytes of the image from address 0 on, where constants lie.
    """

    def __init__(self, disassembly: str, constants: bytes) -> None:
        self._functions = thumb.functions(disassembly)
        self._by_name = {one.name: one for one in self._functions.values()}
        self._constants = constants
        self._values = Values()
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

    # ---- control --------------------------------------------------------------------------------------

    def _call(self, function: Function, state: State) -> int:
        """Run a function to its end; return its instructions, and leave the state behind it."""
        if not function.nest:
            thumb.find_loops(function)
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
            self._left -= 1
            if self._left < 0:
                raise TargetError(f"{function.name} has a loop without a bound that the compiled text shows")
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

    def _merge(self, a: State, b: State) -> State:
        values = self._values
        narrowed = {
            key: (min(low, b.narrowed[key][0]), max(high, b.narrowed[key][1]))
            for key, (low, high) in a.narrowed.items()
            if key in b.narrowed
        }
        registers = [
            x if x == y else join(values, x, a.narrowed, y, b.narrowed)
            for x, y in zip(a.registers, b.registers, strict=True)
        ]
        memory = {}
        for at, known in a.memory.items():
            other = b.memory.get(at)
            if other is None or other[0] != known[0]:
                continue
            same = known[1] == other[1]
            memory[at] = known if same else (known[0], join(values, known[1], a.narrowed, other[1], b.narrowed))
        return State(registers, memory, a.saved & b.saved, narrowed, a.flags if a.flags == b.flags else None)

    # ---- conditions -----------------------------------------------------------------------------------

    def _decide(self, one: Instruction, state: State) -> bool | None:
        if one.name in ("cbz", "cbnz"):
            register = state.registers[thumb.register(one.arguments[0])]
            return self._values.holds("eq" if one.name == "cbz" else "ne", register, 0, state.narrowed)
        if not one.condition:
            return True
        return self._holds(one.condition, state)

    def _holds(self, condition: str, state: State) -> bool | None:
        if state.flags is None:
            return None
        kind, a, b = state.flags
        if kind == "carry" and condition in ("cs", "cc"):
            return (b == 1) == (condition == "cs")
        if kind != "compare" and condition not in ("eq", "ne", "mi", "pl"):
            return None
        if kind == "carry":
            b = 0
        return self._values.holds(condition, a, b, state.narrowed)

    def _suppose(self, one: Instruction, state: State, taken: bool) -> bool:
        """Narrow what is known by a branch taken or not; return whether that is possible."""
        pair: tuple[str, Value, Value] | None
        if one.name in ("cbz", "cbnz"):
            condition = "eq" if one.name == "cbz" else "ne"
            pair = ("compare", self._operand(one.arguments[0], state), 0)
        else:
            condition, pair = one.condition, state.flags
        return self._narrow(condition if taken else thumb.OPPOSITE[condition], pair, state)

    def _narrow(self, condition: str, pair: tuple[str, Value, Value] | None, state: State) -> bool:
        if pair is None or (pair[0] != "compare" and condition not in ("eq", "ne", "mi", "pl")):
            return True
        if pair[0] == "carry":
            pair = ("result", pair[1], 0)
        return self._values.narrow(condition, pair[1], pair[2], state.narrowed)

    # ---- instructions ---------------------------------------------------------------------------------

    def _apply(self, one: Instruction, state: State) -> None:
        """Carry out an instruction that is no branch; in an IT block, under its condition."""
        if one.condition and not one.is_return:
            holds = self._holds(one.condition, state)
            if holds is False:
                return
            if holds is None:
                other = state.copy()
                done = state.copy()
                if not self._narrow(one.condition, state.flags, done):
                    return
                self._carry_out(one, done)
                if self._narrow(thumb.OPPOSITE[one.condition], state.flags, other):
                    flags = state.flags
                    done = self._merge(done, other)
                    done.flags = flags
                state.registers, state.memory, state.flags = done.registers, done.memory, done.flags
                state.saved, state.narrowed = done.saved, done.narrowed
                return
        self._carry_out(one, state)

    def _carry_out(self, one: Instruction, state: State) -> None:
        name, given = one.name, one.arguments
        if name[0] == "v":
            self._real(one, state)
        elif name in ("cmp", "subs", "cmn", "tst", "teq"):
            a, b = self._operand(given[0], state), self._shifted(given[1:], state)
            if name == "cmp":
                state.flags = ("compare", a, b)
            elif name == "tst" and isinstance(a, int) and isinstance(b, int):
                state.flags = ("result", word(a & b), 0)
            else:
                state.flags = None
        elif name in _ARITHMETIC:
            self._arithmetic(one, state)
        elif name in ("ldr", "ldrb", "ldrh", "ldrsb", "ldrsh", "ldrd", "str", "strb", "strh", "strd"):
            self._move(one, state)
        elif name in ("push", "pop", "ldm", "ldmia", "ldmdb", "stm", "stmia", "stmdb"):
            self._block(one, state)
        elif name in ("nop", "it", "pld", "dsb", "isb", "dmb", "bx"):
            return
        elif name in _UNKNOWN:
            for target in given[: _UNKNOWN[name]]:
                state.registers[thumb.register(target)] = self._values.fresh()
        else:
            raise TargetError(f"the instruction {name} {', '.join(given)} at {one.at:x} is not known")

    def _operand(self, text: str, state: State) -> Value:
        if text[0] == "#":
            return word(int(text[1:], 0))
        place = thumb.register(text)
        if place < 0:
            raise TargetError(f"the operand {text} is not known")
        return state.registers[place]

    def _shifted(self, texts: tuple[str, ...], state: State) -> Value:
        """Return an operand with its shift, if any."""
        value = self._operand(texts[0], state)
        if len(texts) == 1:
            return value
        kind, _, amount = texts[1].partition(" ")
        shift = self._operand(amount, state) if amount else None
        return self._shift(kind, value, shift, state)

    def _shift(self, kind: str, value: Value, amount: Value | None, state: State) -> Value:
        values = self._values
        if not isinstance(amount, int):
            return values.fresh()
        if kind == "lsl":
            return values.times(value, 1 << amount, state.narrowed)
        low, high = values.limits(value, state.narrowed)
        if isinstance(value, int):
            return word(value >> amount if kind == "asr" else (value & 0xFFFFFFFF) >> amount)
        if kind in ("lsr", "asr") and (low >= 0 or kind == "asr"):
            return values.fresh(low >> amount, high >> amount)
        return values.fresh(0, 0xFFFFFFFF >> amount) if kind == "lsr" and amount else values.fresh()

    def _arithmetic(self, one: Instruction, state: State) -> None:
        name, given, values = one.name, one.arguments, self._values
        target = thumb.register(given[0])
        narrowed, flags = state.narrowed, None
        if name in ("mov", "movw"):
            result = self._shifted(given[1:], state)
        elif name == "movt":
            low = state.registers[target]
            high = self._operand(given[1], state)
            known = isinstance(low, int) and isinstance(high, int)
            result = word((low & 0xFFFF) | (high << 16)) if known else values.fresh()  # type: ignore[operator]
        elif name == "mvn":
            inner = self._shifted(given[1:], state)
            result = values.plus(-1, values.times(inner, -1, narrowed), narrowed)
        elif name in ("lsl", "lsr", "asr"):
            first, second = given[-2], given[-1]
            moved, amount = self._operand(first, state), self._operand(second, state)
            result = self._shift(name, moved, amount, state)
            if isinstance(moved, int) and isinstance(amount, int) and 0 < amount < 32:
                out = 32 - amount if name == "lsl" else amount - 1
                flags = ("carry", result, moved >> out & 1)
        elif name in ("mla", "mls"):
            product = self._product(given[1], given[2], state)
            signed = values.times(product, 1 if name == "mla" else -1, narrowed)
            result = values.plus(self._operand(given[3], state), signed, narrowed)
        else:
            first, rest = (given[1], given[2:]) if _three(given) else (given[0], given[1:])
            a, b = self._operand(first, state), self._shifted(rest, state)
            if name in ("add", "addw"):
                result = values.plus(a, b, narrowed)
                if isinstance(a, int) and isinstance(b, int):
                    flags = ("carry", result, int((a & 0xFFFFFFFF) + (b & 0xFFFFFFFF) > 0xFFFFFFFF))
            elif name in ("sub", "subw"):
                result, flags = values.plus(a, values.times(b, -1, narrowed), narrowed), ("compare", a, b)
            elif name == "rsb":
                result, flags = values.plus(b, values.times(a, -1, narrowed), narrowed), ("compare", b, a)
            elif name == "mul":
                result = self._product(first, rest[0], state)
            else:
                result = _logic(name, a, b, values, narrowed)
        state.registers[target] = result
        if one.sets_flags:
            state.flags = flags or ("result", result, 0)

    def _product(self, first: str, second: str, state: State) -> Value:
        a, b = self._operand(first, state), self._operand(second, state)
        if isinstance(b, int):
            return self._values.times(a, b, state.narrowed)
        return self._values.times(b, a, state.narrowed) if isinstance(a, int) else self._values.fresh()

    # ---- memory ---------------------------------------------------------------------------------------

    def _address(self, texts: tuple[str, ...], state: State, width: int) -> Value:
        """Return the address of `[base, offset]` with its write-back."""
        inside = texts[0]
        written = inside.endswith("!")
        parts = thumb.arguments_of(inside.rstrip("!")[1:-1])
        base = thumb.register(parts[0])
        at = state.registers[base]
        if parts[0] == "pc":
            raise TargetError("a load relative to pc has no address")
        if len(parts) > 1:
            at = self._values.plus(at, self._shifted(parts[1:], state), state.narrowed)
        if written:
            state.registers[base] = at
        if len(texts) > 1:
            state.registers[base] = self._values.plus(at, self._shifted(texts[1:], state), state.narrowed)
        return at

    def _literal(self, one: Instruction, text: str) -> int:
        """Return the address of `[pc, #n]`."""
        offset = int(text.strip("[]").partition("#")[2] or "0", 0)
        return ((one.at + 4) & ~3) + offset

    def _move(self, one: Instruction, state: State) -> None:
        name, given = one.name, one.arguments
        count = 2 if name.endswith("d") and name != "ldrd.w" and name[:3] in ("ldr", "str") and name[3:] == "d" else 1
        width = {"b": 1, "h": 2}.get(name[-1], 4) if count == 1 else 4
        targets = [thumb.register(text) for text in given[:count]]
        place = given[count:]
        literal = place[0].startswith("[pc")
        if name[0] == "s":
            kept = [state.registers[target] for target in targets]
            at = self._address(place, state, width)
            for index, value in enumerate(kept):
                here = self._values.plus(at, 4 * index, state.narrowed)
                self._store(here, width, value, state)
                if place[0].startswith("[sp") and isinstance(here, int):
                    state.saved |= {here}
            return
        at = self._literal(one, place[0]) if literal else self._address(place, state, width)
        signed = name in ("ldrsb", "ldrsh")
        for index, target in enumerate(targets):
            state.registers[target] = self._load(self._values.plus(at, 4 * index, state.narrowed), width, signed, state)

    def _load(self, at: Value, width: int, signed: bool, state: State) -> Value:
        half = 1 << (8 * width - 1)
        low, high = (-half, half - 1) if signed or width == 4 else (0, 2 * half - 1)
        if not isinstance(at, int):
            return self._values.fresh(low, high)
        known = state.memory.get(at)
        if known is not None and known[0] == width:
            return known[1]
        if 0 <= at < len(self._constants) - width:
            return word(int.from_bytes(self._constants[at : at + width], "little", signed=signed or width == 4))
        value = self._values.fresh(low, high)
        if STACK - APART < at <= STACK:  # a variable of the program, which it may look at again
            state.forget(at, width)
            state.memory[at] = (width, value)
        return value

    def _store(self, at: Value, width: int, value: Value | None, state: State) -> None:
        if isinstance(at, int):
            state.forget(at, width)
            if value is not None and width <= 4:
                if width < 4 and not isinstance(value, int):
                    return
                state.memory[at] = (width, value)
            return
        low, high = self._values.limits(at, state.narrowed)
        if high - low < APART:
            state.forget(low, high - low + width)
            return
        for place in [place for place in state.memory if place not in state.saved]:
            del state.memory[place]

    def _block(self, one: Instruction, state: State) -> None:
        """Load or store several registers."""
        name, given = one.name, one.arguments
        stack = name in ("push", "pop")
        base = 13 if stack else thumb.register(given[0].rstrip("!"))
        written = stack or given[0].endswith("!")
        targets = _listed(given[-1])
        down = name in ("push", "stmdb", "ldmdb")
        size = 4 * len(targets)
        first = self._values.plus(state.registers[base], -size if down else 0, state.narrowed)
        after = self._values.plus(state.registers[base], -size if down else size, state.narrowed)
        for index, target in enumerate(targets):
            at = self._values.plus(first, 4 * index, state.narrowed)
            if name in ("push", "stm", "stmia", "stmdb"):
                self._store(at, 4, state.registers[target], state)
                if base == 13 and isinstance(at, int):
                    state.saved |= {at}
            elif target != 15:
                state.registers[target] = self._load(at, 4, False, state)
        if written and base not in (targets if name[0] in "pl" and not stack else []):
            state.registers[base] = after

    def _real(self, one: Instruction, state: State) -> None:
        """Carry out an instruction on reals, whose values are unknown."""
        kind, given = _kind(one.name), one.arguments
        if kind in ("vcmp", "vcmpe", "vmrs"):
            state.flags = None
        elif kind in ("vldr", "vstr"):
            width = 8 if given[0][0] == "d" else 4
            if given[1].startswith("[pc"):
                return
            at = self._address(given[1:], state, width)
            if kind == "vstr":
                self._store(at, width, None, state)
        elif kind in ("vpush", "vpop", "vldmia", "vldmdb", "vstmia", "vstmdb"):
            self._real_block(kind, given, state)
        elif kind == "vmov":
            for text in given[: 2 if len(given) == 3 else 1]:
                if thumb.register(text) >= 0:
                    state.registers[thumb.register(text)] = self._values.fresh()

    def _real_block(self, kind: str, given: tuple[str, ...], state: State) -> None:
        stack = kind in ("vpush", "vpop")
        base = 13 if stack else thumb.register(given[0].rstrip("!"))
        texts = given[-1].strip("{}").split(",")
        count = sum(_span(text.strip()) for text in texts)
        size = count * (8 if texts[0].strip()[0] == "d" else 4)
        down = kind in ("vpush", "vldmdb", "vstmdb")
        first = self._values.plus(state.registers[base], -size if down else 0, state.narrowed)
        if kind in ("vpush", "vstmia", "vstmdb"):
            self._store(first, size, None, state)
        if stack or given[0].endswith("!"):
            state.registers[base] = self._values.plus(state.registers[base], -size if down else size, state.narrowed)


@functools.cache
def _kind(name: str) -> str:
    """Return the mnemonic of an instruction on reals without its types."""
    return name.split(".")[0]


_ARITHMETIC = {
    "mov", "movw", "movt", "mvn", "add", "addw", "sub", "subw", "rsb", "mul", "mla", "mls", "lsl", "lsr", "asr",
    "and", "orr", "orn", "eor", "bic",
}  # fmt: skip
#: Instructions whose results are not looked into, by how many they have.
_UNKNOWN = {
    "clz": 1, "rev": 1, "uxtb": 1, "sxtb": 1, "uxth": 1, "sxth": 1, "ubfx": 1, "sbfx": 1, "bfi": 1, "bfc": 1,
    "umull": 2, "smull": 2, "umlal": 2, "smlal": 2, "uadd8": 1, "sel": 1, "adc": 1, "sbc": 1, "rbit": 1, "udiv": 1,
    "sdiv": 1, "ror": 1,
}  # fmt: skip


def _is_shift(text: str, count: int, most: int) -> bool:
    return count == most and text.split(" ")[0] in ("lsl", "lsr", "asr", "ror")


def _three(given: tuple[str, ...]) -> bool:
    """Tell whether an instruction names a target and two operands."""
    return len(given) >= 3 and not _is_shift(given[2], 3, 3)


def _logic(name: str, a: Value, b: Value, values: Values, narrowed: dict[int, tuple[int, int]]) -> Value:
    if isinstance(a, int) and isinstance(b, int):
        return word({"and": a & b, "orr": a | b, "orn": a | ~b, "eor": a ^ b, "bic": a & ~b}[name])
    mask = b if isinstance(b, int) else a
    if name == "and" and isinstance(mask, int) and mask >= 0:
        return values.fresh(0, mask)
    low, high = values.limits(a, narrowed)
    if name == "bic" and low >= 0:
        return values.fresh(0, high)
    if name == "orr" and low >= 0 and values.limits(b, narrowed)[0] >= 0:
        top = max(high, values.limits(b, narrowed)[1])
        return values.fresh(low, (1 << top.bit_length()) - 1)
    return values.fresh()


def _listed(text: str) -> list[int]:
    """Return the registers of `{r4, r5-r7, pc}`."""
    found: list[int] = []
    for part in text.strip("{}^").split(","):
        first, _, last = part.strip().partition("-")
        found += range(thumb.register(first), thumb.register(last or first) + 1)
    return found


def _span(text: str) -> int:
    first, _, last = text.partition("-")
    return int((last or first)[1:]) - int(first[1:]) + 1
