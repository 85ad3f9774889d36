"""A Cortex-M that knows addresses and counters and no data: what instructions do to what is known."""

from __future__ import annotations

from casadi_gnc.embedded import thumb
from casadi_gnc.embedded.intervals import Value, Values, logic, word
from casadi_gnc.embedded.known_state import Memory, State
from casadi_gnc.embedded.thumb import Instruction
from casadi_gnc.errors import TargetError


class Processor:
    """Carry out instructions on states.

    Parameters
    ----------
    constants : bytes of the image from address 0 on, where constants lie.
    """

    def __init__(self, constants: bytes) -> None:
        self._values = Values()
        self._memory = Memory(constants, self._values)

    def _merge(self, a: State, b: State) -> State:
        return self._memory.merge(a, b)

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
            first, rest = (given[1], given[2:]) if thumb.names_three(given) else (given[0], given[1:])
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
                result = logic(name, a, b, values, narrowed)
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
                self._memory.store(here, width, value, state)
                if place[0].startswith("[sp") and isinstance(here, int):
                    state.saved |= {here}
            return
        at = self._literal(one, place[0]) if literal else self._address(place, state, width)
        signed = name in ("ldrsb", "ldrsh")
        for index, target in enumerate(targets):
            here = self._values.plus(at, 4 * index, state.narrowed)
            state.registers[target] = self._memory.load(here, width, signed, state)

    def _block(self, one: Instruction, state: State) -> None:
        """Load or store several registers."""
        name, given = one.name, one.arguments
        stack = name in ("push", "pop")
        base = 13 if stack else thumb.register(given[0].rstrip("!"))
        written = stack or given[0].endswith("!")
        targets = thumb.listed(given[-1])
        down = name in ("push", "stmdb", "ldmdb")
        size = 4 * len(targets)
        first = self._values.plus(state.registers[base], -size if down else 0, state.narrowed)
        after = self._values.plus(state.registers[base], -size if down else size, state.narrowed)
        for index, target in enumerate(targets):
            at = self._values.plus(first, 4 * index, state.narrowed)
            if name in ("push", "stm", "stmia", "stmdb"):
                self._memory.store(at, 4, state.registers[target], state)
                if base == 13 and isinstance(at, int):
                    state.saved |= {at}
            elif target != 15:
                state.registers[target] = self._memory.load(at, 4, False, state)
        if written and base not in (targets if name[0] in "pl" and not stack else []):
            state.registers[base] = after

    def _real(self, one: Instruction, state: State) -> None:
        """Carry out an instruction on reals, whose values are unknown."""
        kind, given = thumb.kind_of(one.name), one.arguments
        if kind in ("vcmp", "vcmpe", "vmrs"):
            state.flags = None
        elif kind in ("vldr", "vstr"):
            width = 8 if given[0][0] == "d" else 4
            if given[1].startswith("[pc"):
                return
            at = self._address(given[1:], state, width)
            if kind == "vstr":
                self._memory.store(at, width, None, state)
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
        count = sum(thumb.span_of(text.strip()) for text in texts)
        size = count * (8 if texts[0].strip()[0] == "d" else 4)
        down = kind in ("vpush", "vldmdb", "vstmdb")
        first = self._values.plus(state.registers[base], -size if down else 0, state.narrowed)
        if kind in ("vpush", "vstmia", "vstmdb"):
            self._memory.store(first, size, None, state)
        if stack or given[0].endswith("!"):
            state.registers[base] = self._values.plus(state.registers[base], -size if down else size, state.narrowed)


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
