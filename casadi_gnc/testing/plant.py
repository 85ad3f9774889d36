"""What every plant keeps, whoever wrote it."""

from __future__ import annotations

import casadi as ca
import numpy as np

from casadi_gnc.missions.loop import Loop
from casadi_gnc.missions.mission import Mission
from casadi_gnc.testing.asserting import must, numbers


def check_plant(mission: Mission) -> None:
    """Test a mission's plant at the mission's start.

    Tested: columns of the declared sizes, numbers that are finite; signals with units and measurements with a
    largest credible value; settling twice is settling once; noise that moves something; inertias that bodies have.

    Raises
    ------
    ContractError, LawError
        Saying what is not kept.
    """
    plant, loop, x = mission.truth, Loop(mission, mission.scheme()), ca.DM(mission.start)
    name, actuators = type(plant).__name__, ca.DM.zeros(plant.inputs.size)
    measured = numbers(loop.sensed(0.0, x, mission.quiet()))
    must(np.isfinite(measured).all(), f"{name}.measure is not finite at the start")
    rate = numbers(loop.moved(0.0, x, actuators, mission.quiet()))
    must(np.isfinite(rate).all(), f"{name}.rate is not finite at the start with actuators at rest")
    shown = set(plant.show(0.0, x, actuators))
    must(shown == set(plant.outputs.names), f"{name}.show gives {sorted(shown)}, its outputs are {plant.outputs.names}")
    _check_units(mission)
    once = numbers(loop.settled(x * 1.1))
    again = numbers(loop.settled(ca.DM(once)))
    must(np.allclose(again, once, rtol=1e-14, atol=1e-300), f"{name}.settle changes what it has settled")
    _check_noise(mission)
    for whose, inertia in plant.inertias().items():
        moments = np.linalg.eigvalsh(np.array(ca.DM(inertia)))
        must(moments[0] > 0, f"the {whose} inertia of {name} has the principal moment {moments[0]:.3g} kg m^2")
    for state, goal in mission.target.items():
        must(state in plant.state, f"{type(mission.craft).__name__}.regulated names {state}, which is no state")
        size = plant.state.signal(state).size
        must(
            len(goal) == size, f"{type(mission.craft).__name__}.regulated gives {len(goal)} numbers of {state} ({size})"
        )


def _check_units(mission: Mission) -> None:
    plant, name = mission.truth, type(mission.truth).__name__
    for layout in (plant.state, plant.inputs, plant.outputs):
        for signal in layout.signals:
            must(signal.unit or signal.size == 1, f"the signal {signal.name} of {name} has no unit; write '-' for none")
    for signal in plant.measurement.signals:
        told = f"the measurement {signal.name} of {name} has no limit: give the largest magnitude that can be true"
        must(0 < signal.limit < np.inf, told)


def _check_noise(mission: Mission) -> None:
    plant, x = mission.truth, ca.DM(mission.start)
    if not plant.noise.size:
        return
    noise, actuators = plant.noise.symbol("noise"), ca.DM.zeros(plant.inputs.size)
    everything = ca.vertcat(plant.measure(0.0, x, noise), plant.rate(0.0, x, actuators, noise))
    slope = np.array(ca.DM(ca.substitute(ca.jacobian(everything, noise), noise, 0.1)))
    dead = np.flatnonzero(np.abs(slope).max(axis=0) == 0)
    must(not dead.size, f"noise number {dead[0] + 1 if dead.size else 0} of {type(plant).__name__} moves nothing")
