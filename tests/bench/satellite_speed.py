"""Time the same closed loop in Basilisk and here, in one run: a slew on four wheels, every sample recorded.

Basilisk flies its spacecraft, wheels, perfect navigation, attitude error, `mrpFeedback` and `rwMotorTorque` at one
rate; ours is one C call. What is set up once is not timed; the shortest of several runs counts.
`python tests/bench/satellite_speed.py [seconds of flight] [Coulomb friction, N m]`
"""

import sys
import time
from typing import Any

import numpy as np

import casadi_gnc
from casadi_gnc.laws.mrp_feedback import MrpFeedback
from casadi_gnc.missions import tapes
from casadi_gnc.missions.engines import CompiledEngine
from casadi_gnc.missions.flying import begin

ASKED = sys.argv[1:] if __name__ == "__main__" else []
DURATION = float(ASKED[0]) if ASKED else 6000.0
COULOMB = float(ASKED[1]) if len(ASKED) > 1 else 0.0
GAINS = {"attitude_gain": 4.0, "rate_gain": 18.0}
RUNS = 5


def mission() -> casadi_gnc.Mission:
    """Return the shipped slew from rest, flown by the law that Basilisk has too."""
    told: dict[str, Any] = {f"wheel.{i}.coulomb_N_m": COULOMB for i in (1, 2, 3, 4)}
    told["initial.rate_rad_per_s"] = [0.0, 0.0, 0.0]
    slew = casadi_gnc.load("satellites/slew", told).with_timing(duration=DURATION)
    return slew.with_scheme("pd", law=MrpFeedback(body=slew.craft.belief(), **GAINS))


def here(flown: casadi_gnc.Mission) -> float:
    """Return the processor time of a flight in C, [s]."""
    scheme = flown.scheme()
    built = tapes.tapes_of(flown, scheme)
    engine, record = CompiledEngine(flown, scheme, built, "gnc"), np.zeros((flown.timing.samples, built.row.size))
    spent = []
    for _ in range(RUNS):
        carried = begin(flown, built, engine)
        start = time.process_time()
        engine.run(carried, 0, flown.timing.samples, 1, record)
        spent.append(time.process_time() - start)
    return min(spent)


def in_basilisk(flown: casadi_gnc.Mission, *, recorded: bool = True) -> Any:
    """Return the same flight as a simulation of Basilisk, ready to run; it has `craft` and `recorders`."""
    from Basilisk.architecture import messaging
    from Basilisk.fswAlgorithms import attTrackingError, inertial3D, mrpFeedback, rwMotorTorque
    from Basilisk.simulation import reactionWheelStateEffector, simpleNav, spacecraft
    from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW

    known: Any = flown.craft
    start, column = known.start(), lambda values: [[float(value)] for value in values]
    simulation: Any = SimulationBaseClass.SimBaseClass()
    craft = spacecraft.Spacecraft()
    period = macros.sec2nano(flown.timing.sample_period)
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", period))
    craft.hub.mHub, craft.hub.IHubPntBc_B, craft.hub.r_BcB_B = known.mass_kg, known.inertia_kg_m2, column([0.0] * 3)
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = column(start["mrp"]), column(start["rate"])
    factory, wheels = simIncludeRW.rwFactory(), reactionWheelStateEffector.ReactionWheelStateEffector()
    for each in known.wheel:
        keys = {"Js": float(each.spin_inertia), "Omega": 0.0, "u_max": each.max_torque_N_m, "useMaxTorque": True}
        made = factory.create("custom", each.axis, **keys)
        made.cViscous, made.fCoulomb = each.viscous_N_m_s_per_rad, each.coulomb_N_m
    factory.addToSpacecraft("wheels", wheels, craft)
    seen, wanted, error = simpleNav.SimpleNav(), inertial3D.inertial3D(), attTrackingError.attTrackingError()
    law, sharing, rows = mrpFeedback.mrpFeedback(), rwMotorTorque.rwMotorTorque(), factory.getConfigMessage()
    inertia = messaging.VehicleConfigMsgPayload(ISCPntB_B=np.ravel(known.inertia_kg_m2).tolist())
    body = messaging.VehicleConfigMsg().write(inertia)
    law.K, law.P, law.Ki = GAINS["attitude_gain"], GAINS["rate_gain"], -1.0
    wanted.sigma_R0N, sharing.controlAxes_B = [0.0] * 3, np.eye(3).ravel().tolist()
    for listener, message in (
        (seen.scStateInMsg, craft.scStateOutMsg),
        (error.attNavInMsg, seen.attOutMsg),
        (error.attRefInMsg, wanted.attRefOutMsg),
        (law.guidInMsg, error.attGuidOutMsg),
        (law.vehConfigInMsg, body),
        (law.rwParamsInMsg, rows),
        (law.rwSpeedsInMsg, wheels.rwSpeedOutMsg),
        (sharing.rwParamsInMsg, rows),
        (sharing.vehControlInMsg, law.cmdTorqueOutMsg),
        (wheels.rwMotorCmdInMsg, sharing.rwMotorTorqueOutMsg),
    ):
        listener.subscribeTo(message)
    for priority, module in enumerate((craft, wheels, sharing, law, error, wanted, seen), 10):
        simulation.AddModelToTask("task", module, priority)
    messages = (craft.scStateOutMsg, wheels.rwSpeedOutMsg, sharing.rwMotorTorqueOutMsg) if recorded else ()
    recorders = [each.recorder() for each in messages]
    for recorder in recorders:
        simulation.AddModelToTask("task", recorder)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(flown.timing.duration))
    simulation.craft, simulation.recorders = craft, recorders
    simulation.others = (factory, wheels, sharing, law, error, wanted, seen, rows, body)  # Basilisk keeps none of them
    return simulation


def there(flown: casadi_gnc.Mission) -> float:
    """Return the processor time of a flight in Basilisk, [s]."""
    simulation = in_basilisk(flown)
    begun = time.process_time()
    simulation.ExecuteSimulation()
    spent = time.process_time() - begun
    final = np.array(simulation.recorders[0].sigma_BN)[-1]
    assert np.abs(final).max() < 1e-4, final  # it has turned there
    return spent


def main() -> None:
    """Print the times of a sample, and their ratio."""
    flown = mission()
    ours, theirs = here(flown), min(there(flown) for _ in range(RUNS))
    samples = flown.timing.samples
    print(f"{samples} samples, Coulomb friction {COULOMB:g} N m")
    each = [seconds / samples * 1e6 for seconds in (ours, theirs)]
    print(f"casadi-gnc {each[0]:.2f} us a sample, Basilisk {each[1]:.2f}, ratio {theirs / ours:.0f}")


if __name__ == "__main__":
    main()
