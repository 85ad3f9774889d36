"""A satellite in Basilisk, by the keys that our craft takes: balanced wheels, liquids on springs, hinged
panels, thrusters, gravity.

Basilisk integrates position and velocity of the body's origin besides; its wheels' Coulomb friction is a sign where
ours is a tanh, so wheels must not cross zero.
"""

from __future__ import annotations

from typing import Any

import numpy as np


def fly(
    keys: dict[str, Any], start: dict[str, Any], *, h: float, duration: float, told: dict[str, list[float]]
) -> dict:
    """Return mrp, rate, wheel_speed, slosh, panel_angle at the samples of a flight under constant commands.

    Parameters
    ----------
    keys : of our craft.
    start : state at t = 0 by signal, as our craft gives it.
    told : commands: wheel_torque, force.
    """
    from Basilisk.architecture import messaging
    from Basilisk.simulation import (
        GravityGradientEffector,
        extForceTorque,
        gravityEffector,
        hingedRigidBodyStateEffector,
        linearSpringMassDamper,
        reactionWheelStateEffector,
        spacecraft,
    )
    from Basilisk.utilities import SimulationBaseClass, macros, simIncludeRW

    kept: list[Any] = []  # what Basilisk does not keep alive
    simulation, craft = SimulationBaseClass.SimBaseClass(), spacecraft.Spacecraft()
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(h)))
    simulation.AddModelToTask("task", craft, 1)
    column = lambda values: [[float(value)] for value in values]  # noqa: E731
    craft.hub.mHub, craft.hub.IHubPntBc_B = keys["mass_kg"], keys["inertia_kg_m2"]
    craft.hub.r_BcB_B = column(keys.get("centre_of_mass_m", [0.0] * 3))
    craft.hub.sigma_BNInit, craft.hub.omega_BN_BInit = column(start["mrp"]), column(start["rate"])
    craft.hub.r_CN_NInit = column(start.get("position", [0.0] * 3))
    craft.hub.v_CN_NInit = column(start.get("velocity", [0.0] * 3))
    if "orbit" in keys:
        earth = gravityEffector.GravBodyData()
        earth.planetName, earth.mu, earth.isCentralBody = "earth_planet_data", 3.986004418e14, True
        craft.gravField.gravBodies = spacecraft.GravBodyVector([earth])
        gradient = GravityGradientEffector.GravityGradientEffector()
        gradient.addPlanetName(earth.planetName)
        craft.addDynamicEffector(gradient)
        simulation.AddModelToTask("task", gradient, 2)
        kept += [earth, gradient]
    recorders = {"craft": craft.scStateOutMsg.recorder()}
    if keys.get("wheel"):
        wheels, factory = reactionWheelStateEffector.ReactionWheelStateEffector(), simIncludeRW.rwFactory()
        for wheel, speed in zip(keys["wheel"], start["wheel_speed"], strict=True):
            made = factory.create("custom", wheel["axis"], Js=wheel["inertia_kg_m2"], Omega=0.0, useMaxTorque=False)
            made.gsHat_B, made.Omega = column(np.array(wheel["axis"]) / np.linalg.norm(wheel["axis"])), float(speed)
            made.cViscous, made.fCoulomb = wheel.get("viscous_N_m_s_per_rad", 0.0), wheel.get("coulomb_N_m", 0.0)
        factory.addToSpacecraft("wheels", wheels, craft)
        command = messaging.ArrayMotorTorqueMsg().write(
            messaging.ArrayMotorTorqueMsgPayload(motorTorque=list(told["wheel_torque"]))
        )
        wheels.rwMotorCmdInMsg.subscribeTo(command)
        simulation.AddModelToTask("task", wheels, 3)
        recorders["wheels"] = wheels.rwSpeedOutMsg.recorder()
        kept += [wheels, factory, command]
    liquids = []
    for i, liquid in enumerate(keys.get("slosh", [])):
        mass, turn = linearSpringMassDamper.LinearSpringMassDamper(), 2 * np.pi * liquid["frequency_Hz"]
        mass.massInit, mass.k = liquid["mass_kg"], liquid["mass_kg"] * turn**2
        mass.c = 2 * liquid["damping"] * liquid["mass_kg"] * turn
        mass.r_PB_B, mass.pHat_B = column(liquid["position_m"]), column(liquid["axis"])
        mass.rhoInit, mass.rhoDotInit = float(start["slosh"][i]), 0.0
        craft.addStateEffector(mass)
        liquids.append(mass)
    panels = []
    for i, table in enumerate(keys.get("hinged_panel", [])):
        panel = hingedRigidBodyStateEffector.HingedRigidBodyStateEffector()
        # Its frame at rest: from the centre of mass to the hinge, along the hinge, and what completes them.
        arm = np.subtract(table["centre_m"], table["hinge_m"])
        first, second = -arm / np.linalg.norm(arm), np.array(table["axis"])
        frame = np.array([first, second, np.cross(first, second)])
        panel.mass, panel.d = table["mass_kg"], float(np.linalg.norm(arm))
        panel.IPntS_S = (frame @ np.array(table["inertia_kg_m2"]) @ frame.T).tolist()
        panel.dcm_HB, panel.r_HB_B = frame.tolist(), column(table["hinge_m"])
        panel.k, panel.c = table["stiffness_N_m_per_rad"], table.get("damping_N_m_s_per_rad", 0.0)
        panel.thetaInit, panel.thetaDotInit = float(start["panel_angle"][i]), float(start["panel_rate"][i])
        panel.ModelTag = f"panel_{i}"
        craft.addStateEffector(panel)
        simulation.AddModelToTask("task", panel, 5)
        recorders[panel.ModelTag] = panel.hingedRigidBodyOutMsg.recorder()
        panels.append(panel)
    if keys.get("thruster"):
        force = sum(f * np.array(one["direction"]) for f, one in zip(told["force"], keys["thruster"], strict=True))
        torque = sum(
            f * np.cross(one["position_m"], one["direction"])
            for f, one in zip(told["force"], keys["thruster"], strict=True)
        )
        push = extForceTorque.ExtForceTorque()  # a thruster that burns steadily: force, and torque about the origin
        push.extForce_B, push.extTorquePntB_B = column(force), column(torque)
        craft.addDynamicEffector(push)
        simulation.AddModelToTask("task", push, 4)
        kept.append(push)
    for recorder in recorders.values():
        simulation.AddModelToTask("task", recorder)
    simulation.InitializeSimulation()
    logged = [craft.dynManager.getStateObject(mass.nameOfRhoState) for mass in liquids]
    simulation.ConfigureStopTime(macros.sec2nano(duration))
    simulation.ExecuteSimulation()
    found = {"mrp": np.array(recorders["craft"].sigma_BN), "rate": np.array(recorders["craft"].omega_BN_B)}
    if "wheels" in recorders:
        found["wheel_speed"] = np.array(recorders["wheels"].wheelSpeeds)[:, : len(keys["wheel"])]
    if liquids:
        found["slosh"] = np.array([each.getState()[0][0] for each in logged])  # at the end
    if panels:
        found["panel_angle"] = np.stack([np.array(recorders[each.ModelTag].theta) for each in panels], axis=1)
    return found


def torques_of_mrp_feedback(
    guidance: dict[str, Any],
    gains: dict[str, float],
    inertia: Any,
    axes: Any,
    spin: Any,
    speeds: Any,
    steps: int,
    h: float,
) -> tuple[Any, Any]:
    """Return what `mrpFeedback` commands at the last of some steps, (3,), and what `rwMotorTorque` makes of it, (N,).

    Parameters
    ----------
    guidance : sigma_BR, omega_BR_B, omega_RN_B, domega_RN_B; the same at every step.
    gains : K, P, Ki, integralLimit, controlLawType.
    inertia, axes, spin, speeds : what the law believes of body and wheels: (3, 3); (3, N); (N,); (N,).
    """
    from Basilisk.architecture import messaging
    from Basilisk.fswAlgorithms import mrpFeedback, rwMotorTorque
    from Basilisk.utilities import SimulationBaseClass, macros

    simulation, law, sharing = (
        SimulationBaseClass.SimBaseClass(),
        mrpFeedback.mrpFeedback(),
        rwMotorTorque.rwMotorTorque(),
    )
    simulation.CreateNewProcess("process").addTask(simulation.CreateNewTask("task", macros.sec2nano(h)))
    for name, value in gains.items():
        setattr(law, name, value)
    messages = [
        messaging.AttGuidMsg().write(messaging.AttGuidMsgPayload(**guidance)),
        messaging.VehicleConfigMsg().write(messaging.VehicleConfigMsgPayload(ISCPntB_B=np.ravel(inertia).tolist())),
        messaging.RWSpeedMsg().write(messaging.RWSpeedMsgPayload(wheelSpeeds=list(speeds))),
        messaging.RWArrayConfigMsg().write(
            messaging.RWArrayConfigMsgPayload(
                GsMatrix_B=np.ravel(np.array(axes).T).tolist(), JsList=list(spin), numRW=len(spin)
            )
        ),
    ]
    law.guidInMsg.subscribeTo(messages[0])
    law.vehConfigInMsg.subscribeTo(messages[1])
    law.rwSpeedsInMsg.subscribeTo(messages[2])
    law.rwParamsInMsg.subscribeTo(messages[3])
    sharing.controlAxes_B = np.eye(3).ravel().tolist()
    sharing.rwParamsInMsg.subscribeTo(messages[3])
    sharing.vehControlInMsg.subscribeTo(law.cmdTorqueOutMsg)
    simulation.AddModelToTask("task", law, 2)
    simulation.AddModelToTask("task", sharing, 1)
    asked, shared = law.cmdTorqueOutMsg.recorder(), sharing.rwMotorTorqueOutMsg.recorder()
    simulation.AddModelToTask("task", asked)
    simulation.AddModelToTask("task", shared)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano((steps - 1) * h))
    simulation.ExecuteSimulation()
    return np.array(asked.torqueRequestBody)[-1], np.array(shared.motorTorque)[-1, : len(spin)]
