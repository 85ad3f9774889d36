"""Remember the effort that was asked for and not made, so that a law can ask for less.

    zeta' = -decay zeta + (achieved - wanted)

Huang, Biggs, Duan (2020), eq. (38). While a command is cut, zeta leans against it; added to the
command it unloads the loop. Subtracted, as eqs (36) and (43) print it, it is positive feedback.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, eq=False)
class SaturationCompensator:
    """Filter the missing effort; `decay` is k4, [1/s]."""

    decay: Any

    def rate(self, zeta: Any, wanted: Any, achieved: Any) -> Any:
        """Return zeta', unit of the effort."""
        return achieved - wanted - self.decay * zeta
