"""What is known of a processor at one moment: registers, memory, flags; how two such join."""

from __future__ import annotations

from dataclasses import dataclass, field

from casadi_gnc.embedded.intervals import Value, Values, join, word

#: Where the objects of the call lie, far from each other, and the top of the stack.
OBJECTS, APART, STACK = 0x40000000, 0x1000000, 0x20300000


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


class Memory:
    """Join what is known on two ways, and look into and change what is known of memory.

    Parameters
    ----------
    constants : bytes of the image from address 0 on, where constants lie.
    values : the names of what is unknown.
    """

    def __init__(self, constants: bytes, values: Values) -> None:
        self._constants = constants
        self._values = values

    def merge(self, a: State, b: State) -> State:
        """Return what is known where two ways join: what both say."""
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
            if other is known:  # most are: a copy has the same pairs
                memory[at] = known
                continue
            if other is None or other[0] != known[0]:
                continue
            same = known[1] == other[1]
            memory[at] = known if same else (known[0], join(values, known[1], a.narrowed, other[1], b.narrowed))
        return State(registers, memory, a.saved & b.saved, narrowed, a.flags if a.flags == b.flags else None)

    def load(self, at: Value, width: int, signed: bool, state: State) -> Value:
        """Return the word at an address, of `width` bytes."""
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

    def store(self, at: Value, width: int, value: Value | None, state: State) -> None:
        """Keep a word at an address, None for what is unknown, and forget what it may have overwritten."""
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
