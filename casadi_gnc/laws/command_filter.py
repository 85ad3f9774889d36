"""Follow a signal by a first-order lag, whose rate is then known without differentiation.

    time_constant x' + x = target

Huang, Biggs, Duan (2020), eq. (32): the dynamic surface of the method's name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class CommandFilter:
    """Lag a signal; `time_constant` is tau, [s]."""

    time_constant: Any

    def rate(self, x: Any, target: Any) -> Any:
        """Return x'."""
        return (target - x) / self.time_constant
