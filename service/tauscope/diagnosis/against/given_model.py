"""What a given model has wrong: the robot file's model, or what recordings made in the user's own simulator show.

Values that are wrong (`Diagnosis.differences`) are told from structure that is missing (`Diagnosis.findings`). A term
that the given model does not have at all is missing; one that it has is right or wrong. A surplus of the links that one
body at the tool accounts for is a payload. An effect that the simulator shows too is not missing from it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy import stats

from tauscope.diagnosis.against.payload_search import payload_finding
from tauscope.diagnosis.against.simulated import fit_to_simulation
from tauscope.diagnosis.findings.diagnosed import Diagnosis, ParameterDifference
from tauscope.diagnosis.findings.finding import Finding, FitSizes, sizes
from tauscope.diagnosis.findings.plain import with_plain_terms
from tauscope.errors import IdentificationError
from tauscope.identification import Options
from tauscope.recording.recording import Array, Recording

CHANCE = 0.01
"""Chance of calling any parameter wrong where all are right."""

NEGLIGIBLE = 1e-3
"""Part of the larger value below which two values are the same for all purposes."""

LACKED = 0.02
"""Part of the real value below which a simulator's own estimate of a term says that it has none."""

CLEAR = 3.0
"""Standard errors from which an effect has another size in the simulator than on the arm."""

TERMS = ("stiction", "stribeck", "viscous", "offset")


@dataclass(frozen=True, eq=False)
class Given:
    """A model that recordings are compared with.

    lacking : tuple of (int, str)
        joint indices and nominal terms that it does not have
    """

    values: Mapping[str, float]
    std: Mapping[str, float] = field(default_factory=dict)
    lacking: tuple[tuple[int, str], ...] = ()


def against_model(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis compared with the robot file's model.

    Raises
    ------
    IdentificationError
        where the robot file has no model
    """
    robot = diagnosis.robot
    if robot.model.links is None and robot.model.friction is None:
        raise IdentificationError(
            f"{robot.source or robot.name}: has no model block to compare with: add one, or leave --against out"
        )
    return compared(diagnosis, _stated(diagnosis), "model")


def against_simulation(diagnosis: Diagnosis, simulated: Sequence[Recording], options: Options) -> Diagnosis:
    """The diagnosis compared with recordings from a simulator, on motions of its own."""
    fit = fit_to_simulation(diagnosis, simulated, options)
    names = diagnosis.selection.fit.model.structure.names
    values = dict(zip(names, (float(value) for value in fit.values), strict=True))
    std = dict(zip(names, (float(value) for value in fit.std), strict=True))
    real = dict(zip(names, diagnosis.selection.fit.model.parameters, strict=True))
    terms = [(joint, term) for joint in range(diagnosis.robot.joint_count) for term in TERMS]
    lacking = []
    for joint, term in terms:
        name = f"{term} {diagnosis.robot.joints[joint].name}"
        if name in values and abs(values[name]) < max(LACKED * abs(real[name]), 5.0 * std[name]):
            lacking.append((joint, term))
    missing = tuple(finding for finding in diagnosis.findings if finding.place not in fit.shared)
    found = compared(beside(diagnosis, missing), Given(values, std, tuple(lacking)), "simulation")
    of_effects = [each for differences in fit.shared.values() for each in differences if is_wrong(each, CLEAR)]
    return replace(found, differences=ordered([*found.differences, *of_effects]))


def beside(diagnosis: Diagnosis, missing: Sequence[Finding]) -> Diagnosis:
    """The diagnosis beside a model that has all of its findings but some: where it has all, their misfit is no news."""
    has_all = bool(diagnosis.findings) and not any(finding.in_model for finding in missing)
    before = diagnosis.misfit_after if has_all else diagnosis.misfit_before
    return replace(diagnosis, findings=tuple(missing), misfit_before=before)


def _stated(diagnosis: Diagnosis) -> Given:
    """What the robot file's model says, by parameter name."""
    robot, structure = diagnosis.robot, diagnosis.selection.fit.model.structure
    values: dict[str, float] = {}
    lacking: list[tuple[int, str]] = []
    if robot.model.links is not None:
        standard = np.concatenate([link.to_vector() for link in robot.model.links])
        values |= dict(zip(structure.base.expressions, map(float, structure.base.project(standard)), strict=True))
    for joint, described in enumerate(robot.joints):
        friction = None if robot.model.friction is None else robot.model.friction[joint]
        stated = {name: 0.0 if friction is None else float(getattr(friction, name)) for name in TERMS[:3]}
        if structure.coefficient(joint, "stribeck") is None:
            # The recordings are as well off without a Stribeck term: what they show is its level at speed.
            stated["stiction"] += stated.pop("stribeck")
        values |= {f"{name} {described.name}": value for name, value in stated.items()}
        lacking += [(joint, name) for name, value in stated.items() if value == 0.0]
        lacking.append((joint, "offset"))
    return Given(values, {}, tuple(lacking))


def compared(diagnosis: Diagnosis, given: Given, kind: Literal["model", "simulation"]) -> Diagnosis:
    """Findings that the given model makes, then what it has wrong beside them."""
    plain = replace(diagnosis, findings=tuple(finding for finding in diagnosis.findings if finding.in_model))
    found = with_plain_terms(plain, given.lacking)
    fit = found.selection.fit
    size, structure = fit.model.structure.size, fit.model.structure
    covariance = fit.covariance[:size, :size] * found.inflation
    names, real = list(structure.names), fit.model.parameters.copy()
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    count = structure.base_count
    if all(name in given.values for name in names[:count]):
        surplus = real[:count] - np.array([given.values[name] for name in names[:count]])
        spread = covariance[:count, :count] + np.diag([given.std.get(name, 0.0) ** 2 for name in names[:count]])
        payload, share = payload_finding(found, surplus, spread)
        if payload is not None:
            found, real[:count] = found.with_findings([payload]), real[:count] - share
    missing = {f"{term} {diagnosis.robot.joints[joint].name}" for joint, term in given.lacking}
    several = float(stats.norm.isf(0.5 * CHANCE / max(len(given.values), 1)))
    differences = [
        ParameterDifference(name, given.values[name], float(value), float(np.hypot(error, given.std.get(name, 0.0))))
        for name, value, error in zip(names, real, std, strict=True)
        if name in given.values and name not in missing
    ]
    wrong = ordered([each for each in differences if is_wrong(each, several)])
    return replace(found, against=kind, differences=wrong, before=_given_sizes(found, given))


def _given_sizes(diagnosis: Diagnosis, given: Given) -> FitSizes:
    """What the given model leaves, where it says enough to predict torque at all."""
    model = diagnosis.selection.nominal.model
    names = model.structure.names
    if any(name not in given.values for name in names[: model.structure.base_count]):
        return diagnosis.before
    stated: Array = np.array([given.values.get(name, 0.0) for name in names])
    return sizes(replace(model, parameters=stated), diagnosis.fitter, diagnosis.held_out)


def is_wrong(difference: ParameterDifference, several: float) -> bool:
    """Whether the given value is not the arm's."""
    size = max(abs(difference.real), abs(difference.simulation))
    return abs(difference.in_std) > several and abs(difference.real - difference.simulation) > NEGLIGIBLE * size


def ordered(differences: Sequence[ParameterDifference]) -> tuple[ParameterDifference, ...]:
    """Most standard errors first."""
    return tuple(sorted(differences, key=lambda each: -abs(each.in_std)))
