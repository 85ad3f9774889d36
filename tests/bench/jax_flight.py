"""The tapes of a sampled flight in JAX: every scalar an array over the flights, whole flights one compiled `scan`.

A formulation of its own of what `flight.c.j2` does, to compare speed with; JAX computes other words.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import jax
import jax.numpy as jnp
import numpy as np

from casadi_gnc.missions import metrics
from casadi_gnc.missions.parameters import Varied

jax.config.update("jax_enable_x64", True)

_TWO: dict[int, Callable[[Any, Any], Any]] = {
    ca.OP_ADD: jnp.add,
    ca.OP_SUB: jnp.subtract,
    ca.OP_MUL: jnp.multiply,
    ca.OP_DIV: jnp.divide,
    ca.OP_LT: lambda x, y: (x < y).astype(float),
    ca.OP_LE: lambda x, y: (x <= y).astype(float),
    ca.OP_EQ: lambda x, y: (x == y).astype(float),
    ca.OP_NE: lambda x, y: (x != y).astype(float),
    ca.OP_AND: lambda x, y: ((x != 0) & (y != 0)).astype(float),
    ca.OP_OR: lambda x, y: ((x != 0) | (y != 0)).astype(float),
    ca.OP_IF_ELSE_ZERO: lambda x, y: jnp.where(x != 0, y, 0.0),
    ca.OP_POW: jnp.power,
    ca.OP_CONSTPOW: jnp.power,
    ca.OP_ATAN2: jnp.arctan2,
    ca.OP_COPYSIGN: jnp.copysign,
    ca.OP_FMOD: jnp.fmod,
}
_ONE: dict[int, Callable[[Any], Any]] = {
    ca.OP_ASSIGN: lambda x: x,
    ca.OP_NEG: jnp.negative,
    ca.OP_SQ: lambda x: x * x,
    ca.OP_TWICE: lambda x: x + x,
    ca.OP_INV: lambda x: 1.0 / x,
    ca.OP_NOT: lambda x: (x == 0).astype(float),
    ca.OP_FABS: jnp.abs,
    ca.OP_SIGN: jnp.sign,
    ca.OP_FLOOR: jnp.floor,
    ca.OP_CEIL: jnp.ceil,
    **{
        getattr(ca, f"OP_{name.upper()}"): getattr(jnp, theirs)
        for name, theirs in (
            *((same, same) for same in ("exp", "log", "expm1", "log1p", "sqrt", "sin", "cos", "tan")),
            *((same, same) for same in ("sinh", "cosh", "tanh")),
            *((f"a{same}", f"arc{same}") for same in ("sin", "cos", "tan")),
        )
    },
}


def tape(function: ca.Function) -> Callable[[dict[str, list[Any]]], dict[str, list[Any]]]:
    """Return a tape as a function of columns, a list of arrays each."""
    steps = [
        (function.instruction_id(k), function.instruction_input(k), function.instruction_output(k))
        for k in range(function.n_instructions())
    ]
    constants = {k: function.instruction_constant(k) for k, step in enumerate(steps) if step[0] == ca.OP_CONST}
    given, made = function.name_in(), function.name_out()

    def run(columns: dict[str, list[Any]]) -> dict[str, list[Any]]:
        work: dict[int, Any] = {}
        results: dict[str, list[Any]] = {name: [0.0] * function.numel_out(name) for name in made}
        for k, (code, sources, targets) in enumerate(steps):
            if code == ca.OP_INPUT:
                work[targets[0]] = columns[given[sources[0]]][sources[1]]
            elif code == ca.OP_OUTPUT:
                results[made[targets[0]]][targets[1]] = work[sources[0]]
            elif code == ca.OP_CONST:
                work[targets[0]] = jnp.float64(constants[k])
            elif code in _ONE:
                work[targets[0]] = _ONE[code](work[sources[0]])
            else:
                work[targets[0]] = _TWO[code](work[sources[0]], work[sources[1]])
        return results

    return run


def flights(varied: Varied) -> Callable[[np.ndarray], np.ndarray]:
    """Return a compiled function from parameters (cases, P) to tallies (cases, columns).

    The mission is sampled, its allocation an expression, and its plant has no noise.
    """
    mission, tapes = varied.mission, varied.tapes
    run = {name: tape(function) for name, function in tapes.functions.items()}
    timing, plant = mission.timing, mission.truth
    assert timing.mode == "sampled"
    assert tapes.symbolic
    assert not plant.noise.size
    fresh = metrics.fresh(tuple(mission.metrics), tapes.tally, tapes.watches)
    step = timing.sample_period / timing.substeps

    def fly(values: Any) -> Any:
        zero = jnp.zeros(values.shape[0])

        def whole(column: list[Any]) -> tuple[Any, ...]:
            return tuple(zero + each for each in column)

        begun = run["configure"]({"p": list(values.T)})
        always: dict[str, list[Any]] = {"derived": begun["derived"], "noise": []}
        first = run["sense"]({"t": [zero], "x": begun["x"], **always})
        memory = run["start"]({**first, **always})["m"]
        carried = (begun["x"], memory, [0.0] * plant.inputs.size, first["y"], list(fresh))

        def sample(carried: Any, k: Any) -> tuple[Any, None]:
            x, m, actuators, good, tally = map(list, carried)
            t = k * timing.sample_period
            s: dict[str, list[Any]] = {**always, "t": [t], "x": x, "m": m, "actuators": actuators, "good": good}
            s |= run["sense"](s)
            s |= run["before"](s)
            s |= run["allocate"](s)
            s["report"] = [zero] * plant.inputs.size
            tally = run["tally"]({**run["observe"](s), "tally": tally})["tallied"]
            m = run["after"](s)["m"]
            for i in range(timing.substeps):
                x = run["plant"]({**s, "t": [t + i * step], "x": x})["stepped"]
            x = run["settle"]({**s, "x": x})["settled"]
            return tuple(map(whole, (x, m, s["told"], s["accepted"], tally))), None

        last, _ = jax.lax.scan(sample, tuple(map(whole, carried)), jnp.arange(timing.samples, dtype=float))
        return jnp.stack(last[4], axis=1)

    compiled = jax.jit(fly)
    return lambda values: np.asarray(compiled(values))
