"""How long a law for a pair may hold its command, from the poles of its sampled loop.

One sample of the loop, without limits on force or speed, is linear in the pair's state and the
law's memory: jump, command, the pair under the held force, memory advanced. It is stable if all
eigenvalues of that map are smaller than one. The map is found by differentiating the law itself.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.errors import LawError
from casadi_gnc.laws._law import Law
from casadi_gnc.laws.sampling import advance, phi1
from casadi_gnc.mechanics.relative_motion import PairModel

#: Shortest sample period [s] that the search considers.
SHORTEST = 1e-4


def loop_matrix(law: Any, truth: PairModel) -> np.ndarray:
    """Return the map of (state, memory) over one hold, (n, n); `truth` is the pair that is flown."""
    law = replace(law, approach_speed=None, body=replace(law.body, port=(0.0, 0.0, 0.0)))
    eta, m = ca.SX.sym("eta", 6), law.memory.symbol("m")
    memory = law.jump(0.0, eta, m)
    force = law.command(0.0, eta, memory)
    slope = ca.jacobian(truth.rate(eta), eta)
    moved = eta + law.hold * ca.mtimes(phi1(slope * law.hold), truth.rate(eta, force))
    later = ca.vertcat(moved, advance(law, 0.0, eta, memory, force, force))
    at = ca.vertcat(eta, m)
    return np.array(ca.Function("loop", [at], [ca.jacobian(later, at)])(0.0))


def spectral_radius(law: Law, truth: PairModel) -> float:
    """Return the largest magnitude of an eigenvalue of the loop; below one it is stable."""
    return float(np.abs(np.linalg.eigvals(loop_matrix(law, truth))).max())


def longest_hold(law: Law, truth: PairModel, *, relative: float = 1e-4) -> float:
    """Return the end of the stable sample periods below the law's own, [s].

    It is the law's own sample period where that is stable, and 0 if none from `SHORTEST` on is.
    """
    high = law.hold
    if spectral_radius(law, truth) < 1:
        return high
    low = high / 2
    while spectral_radius(replace(law, hold=low), truth) >= 1:
        low, high = low / 2, low
        if high < SHORTEST:
            return 0.0
    while high - low > relative * high:
        middle = (low + high) / 2
        if spectral_radius(replace(law, hold=middle), truth) < 1:
            low = middle
        else:
            high = middle
    return low


def refuse_long_hold(law: Law, truth: PairModel, advice: str = "") -> None:
    """Raise `LawError` if the sample period, and not something else, makes the loop unstable.

    Nothing is refused in continuous mode, with symbolic gains, or where no sample period is short
    enough: then the gains or the mass are at fault, and the flight shows it.
    """
    if law.hold == 0 or loop_is_symbolic(law, truth):
        return
    longest = longest_hold(law, truth)
    if longest in (law.hold, 0.0):
        return
    radius = spectral_radius(law, truth)
    raise LawError(
        f"a sample period of {law.hold:g} s is too long: the sampled loop grows {radius:.3g} times a sample; "
        f"with these gains and {truth.mass:.4g} kg the longest is {1e3 * longest:.1f} ms; sample faster"
        + (f", {advice}" if advice else "")
    )


def loop_is_symbolic(law: Any, truth: PairModel) -> bool:
    """Return whether a gain or a mass is a symbol, so that there are no numbers to look at."""
    values = [getattr(law, name) for name in law.__dataclass_fields__]
    values += [law.body.mass, law.body.orbit_rate, truth.mass, truth.orbit_rate]
    return any(isinstance(value, (ca.SX, ca.MX)) for value in values)
