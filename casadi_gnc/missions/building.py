"""Build a mission from a checked problem file: geometry, plant, laws, allocators, metrics."""

from __future__ import annotations

import dataclasses
import hashlib
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from casadi_gnc.allocation import AllocationProblem, OnlineInFlight, PseudoInverse, SolverInFlight
from casadi_gnc.errors import ProblemError
from casadi_gnc.laws import LAWS, PerformanceFunnel, gains_of
from casadi_gnc.missions import schema, tapes
from casadi_gnc.missions.mission import Actuation, Funnel, Metric, Mission, Scheme, Timing
from casadi_gnc.missions.toml_place import describe
from casadi_gnc.plants import BodyPart, CombinedSpacecraft, HarmonicTorque, compose_inertia
from casadi_gnc.rigid_body import RigidBody
from casadi_gnc.thrusters import ThrusterGeometry


def _inertia(craft: schema.Spacecraft) -> ca.DM:
    if craft.inertia_kg_m2 is not None:
        return ca.DM(craft.inertia_kg_m2)
    parts = []
    for part in craft.part:
        rotation = schema.orientation(part)
        turned = ca.DM.eye(3) if rotation is None else rotation
        parts.append(BodyPart(part.mass_kg, part.inertia_kg_m2, part.position_m, turned))
    return compose_inertia(parts)


class _Craft:
    """Geometry of one view of the craft: the known one, the true one or the believed one."""

    def __init__(self, craft: schema.Spacecraft, rotation: ca.DM, centre: list[float]) -> None:
        thrusters = craft.thrusters
        mounted = ThrusterGeometry.from_rows(thrusters.positions_m, thrusters.directions)
        self.rotation = rotation
        self.thrusters = mounted.seen_from(rotation, centre)
        self.engine_torque = [0.0, 0.0, 0.0]
        if craft.orbit_engine is not None:
            engine = craft.orbit_engine
            nozzle = ThrusterGeometry.from_rows([engine.position_m], [engine.direction]).seen_from(rotation, centre)
            self.engine_torque = [engine.force_N * entry for entry in np.array(nozzle.effectiveness).ravel()]


def build(model: schema.MissionModel, path: Path, text: str) -> Mission:
    """Return the mission that a checked file describes; path and text serve messages."""
    craft, truth, environment = model.spacecraft, model.truth, model.environment
    rotation = schema.orientation(craft)
    rotation = ca.DM.eye(3) if rotation is None else rotation
    inertia = _inertia(craft)
    centre = craft.centre_of_mass_m
    true_centre = [c + e for c, e in zip(centre, truth.centre_of_mass_error_m, strict=True)]
    real = _Craft(craft, rotation, true_centre)
    true_inertia = inertia * truth.inertia_factor if truth.inertia_kg_m2 is None else ca.DM(truth.inertia_kg_m2)
    plant = CombinedSpacecraft(
        RigidBody(true_inertia, tuple(real.engine_torque), environment.orbit_rate_rad_per_s),
        real.thrusters.effectiveness,
        HarmonicTorque(
            tuple(environment.constant_torque_N_m),
            tuple(harmonic.frequency_rad_per_s for harmonic in environment.harmonic),
            tuple(tuple(harmonic.amplitude_N_m) for harmonic in environment.harmonic),
        ),
        craft.rate_limit_rad_per_s,
    )
    believed = model.believed
    thought_rotation = schema.orientation(believed)
    thought = _Craft(
        craft,
        rotation if thought_rotation is None else thought_rotation,
        centre if believed.centre_of_mass_m is None else believed.centre_of_mass_m,
    )
    body = RigidBody(
        inertia if believed.inertia_kg_m2 is None else ca.DM(believed.inertia_kg_m2),
        tuple(thought.engine_torque),
        environment.orbit_rate_rad_per_s,
    )
    timing = Timing(
        model.timing.mode, model.timing.sample_period_s, model.timing.duration_s, model.timing.plant_substeps
    )
    start = [*model.initial.mrp, *model.initial.rate_rad_per_s]
    _check_start(start, plant, path, text)
    funnel = _funnel(model, plant, path, text)
    schemes = tuple(
        _scheme(scheme, i, craft, thought, body, funnel, timing, path, text) for i, scheme in enumerate(model.scheme)
    )
    mission = Mission(
        name=path.stem,
        truth=plant,
        start=start,
        timing=timing,
        schemes=schemes,
        funnel=funnel,
        title=model.title,
        source=model.source,
        digest=hashlib.sha256(text.encode()).hexdigest(),
    )
    return _with_metrics(mission, model, path, text)


def _with_metrics(mission: Mission, model: schema.MissionModel, path: Path, text: str) -> Mission:
    """Return the mission with its metrics; each must name a signal that every scheme records."""
    metrics = []
    for i, metric in enumerate(model.metric):
        for scheme in mission.schemes:
            row = tapes.row_layout(mission, scheme)
            if metric.signal not in row:
                message = f"{metric.signal!r} is no signal of scheme {scheme.name}; there is {', '.join(row.names)}"
                raise ProblemError(message, describe(path, text, ("metric", i, "signal")))
        unit = (
            "s"
            if metric.kind == "settling"
            else tapes.row_layout(mission, mission.schemes[0]).signal(metric.signal).unit
        )
        metrics.append(Metric(metric.name, metric.kind, metric.signal, metric.threshold or 0.0, metric.after_s, unit))
    return dataclasses.replace(mission, metrics=tuple(metrics))


def _check_start(start: list[float], plant: CombinedSpacecraft, path: Path, text: str) -> None:
    """Refuse a start that the sensors could not measure: a controller has no good value before it."""
    keys = {"mrp": "mrp", "rate": "rate_rad_per_s"}
    for signal in plant.measurement.signals:
        largest = max(abs(value) for value in start[plant.measurement.place(signal.name)])
        if largest > signal.limit:
            place = describe(path, text, ("initial", keys[signal.name]))
            raise ProblemError(f"{largest:g} is beyond the largest credible {signal.name}, {signal.limit:g}", place)


def _funnel(model: schema.MissionModel, plant: CombinedSpacecraft, path: Path, text: str) -> Funnel | None:
    """Return the mission's funnel; the start must lie inside."""
    table = model.funnel
    if table is None:
        return None
    if table.signal not in plant.measurement:
        known = ", ".join(plant.measurement.names)
        raise ProblemError(
            f"{table.signal!r} is not measured; there is {known}", describe(path, text, ("funnel", "signal"))
        )
    expected = plant.measurement.signal(table.signal).size
    if len(table.start) != expected:
        place = describe(path, text, ("funnel", "start"))
        raise ProblemError(f"{len(table.start)} axes, but {table.signal} has {expected}", place)
    start = [*model.initial.mrp, *model.initial.rate_rad_per_s][plant.measurement.place(table.signal)]
    for axis, (s, rho, below, above) in enumerate(zip(start, table.start, table.below, table.above, strict=True), 1):
        if not -below * rho < s < above * rho:
            raise ProblemError(
                f"axis {axis} starts at {s:g}, outside its funnel from {-below * rho:g} to {above * rho:g}; "
                "widen start, below or above",
                describe(path, text, ("funnel", "start")),
            )
    columns = (ca.DM(getattr(table, key)) for key in ("start", "floor", "decay_per_s", "below", "above"))
    return Funnel(table.signal, PerformanceFunnel(*columns))


def _scheme(
    model: schema.SchemeModel,
    index: int,
    craft: schema.Spacecraft,
    thought: _Craft,
    body: RigidBody,
    funnel: Funnel | None,
    timing: Timing,
    path: Path,
    text: str,
) -> Scheme:
    table: Any = model.law
    law: Any = LAWS[table.type]
    named = list(law.errata) if model.as_printed is True else model.as_printed or []
    for name in named:
        if name not in law.errata:
            known = ", ".join(law.errata) or "none"
            message = f"{table.type} has no erratum {name!r}; known: {known}"
            raise ProblemError(message, describe(path, text, ("scheme", index, "as_printed")))
    gains = {key: getattr(table, key) for key in gains_of(law)}
    gains = {key: ca.DM(value) if isinstance(value, list) else value for key, value in gains.items()}
    hold = timing.sample_period if timing.mode == "sampled" else 0.0
    if "funnel" in {field.name for field in dataclasses.fields(law)}:
        if funnel is None:
            place = describe(path, text, ("scheme", index, "law"))
            raise ProblemError(f"the law {table.type!r} needs a [funnel] table, and the file has none", place)
        if funnel.signal != "mrp":
            place = describe(path, text, ("funnel", "signal"))
            raise ProblemError(f"the law {table.type!r} tracks the attitude; its funnel must be on mrp", place)
        gains["funnel"] = funnel.bounds
    limit, thrusters = model.torque_limit_N_m, craft.thrusters
    weakness = np.linalg.svd(np.array(thought.thrusters.effectiveness), compute_uv=False)
    if len(weakness) < 3 or weakness[2] < 1e-9 * weakness[0]:
        place = describe(path, text, ("spacecraft", "thrusters"))
        raise ProblemError("the thrusters make no torque about some axis; add or turn one", place)
    count = thought.thrusters.count
    actuation = Actuation(
        effectiveness=thought.thrusters.effectiveness,
        lower=[thrusters.min_force_N] * count,
        upper=[thrusters.max_force_N] * count,
        rate=thrusters.max_force_rate_N_per_s or float("inf"),
        limit_below=[-value for value in limit],
        limit_above=limit,
        allocator=_allocator(model.allocation, thrusters, thought),
    )
    return Scheme(
        model.name, law(body=body, hold=hold, printed=frozenset(named), **gains), actuation, model.feedback, model.title
    )


def _allocator(model: Any, thrusters: schema.Thrusters, thought: _Craft) -> Any:
    if isinstance(model, schema.PinvModel):
        return PseudoInverse(thought.thrusters.effectiveness)
    half = model.centre_of_mass_error_m
    problem = AllocationProblem.of_thrusters(
        thought.thrusters,
        thought.rotation,
        ([-value for value in half], half),
        lower=thrusters.min_force_N,
        upper=thrusters.max_force_N,
        effort_weight=model.effort_weight,
        change_weight=model.change_weight,
        accuracy_weight=model.accuracy_weight,
    )
    return OnlineInFlight(problem) if model.backend == "online" else SolverInFlight(problem, model.backend)
