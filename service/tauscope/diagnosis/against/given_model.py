"""What a given model has wrong: the robot file's, a saved one, or that of recordings from the user's own simulator.

Values that are wrong (`Diagnosis.differences`) are told from structure that is missing (`Diagnosis.findings`). A term
that the given model does not have at all is missing; one that it has is right or wrong. Wrong values are attributed to
links and joints; a body at the tool is a payload. An effect that the simulator shows too is not missing from it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy import stats
from threadpoolctl import ThreadpoolController

from tauscope.diagnosis.against.attribution import Attribution, Explanation
from tauscope.diagnosis.against.link_changes import stated_links
from tauscope.diagnosis.against.simulated import fit_to_simulation
from tauscope.diagnosis.against.wrong_values import attribute
from tauscope.diagnosis.findings.diagnosed import Diagnosis, ParameterDifference
from tauscope.diagnosis.findings.finding import Finding, FitSizes
from tauscope.diagnosis.findings.plain import with_plain_terms
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Place, Term
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.effects.carried_body import FARTHEST_M
from tauscope.effects.payload import Payload
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.errors import IdentificationError
from tauscope.identification import Options
from tauscope.recording.recording import Array, Recording

CHANCE = 0.01  # chance of calling any parameter wrong where all are right
NEGLIGIBLE = 1e-3  # part of the larger value below which two values are the same for all purposes
LACKED = 0.02  # part of the real value below which a simulator's own estimate of a term says that it has none
CLEAR = 3.0  # standard errors from which an effect has another size in the simulator than on the arm
TERMS = ("stiction", "stribeck", "viscous", "offset")


@dataclass(frozen=True, eq=False)
class Given:
    """A model that recordings are compared with."""

    values: Mapping[str, float]
    lacking: tuple[tuple[int, str], ...] = ()  # joint indices and nominal terms that it does not have
    # (p, p), of the values, in the columns of the diagnosed model; None where they are exact
    covariance: Array | None = None
    # (10 n,), standard parameters of its links; None where only their base parameters are known
    links: Array | None = None


def against_model(diagnosis: Diagnosis) -> Diagnosis:
    """The diagnosis compared with the robot file's model. Raises IdentificationError where it has none."""
    robot = diagnosis.robot
    if robot.model.links is None and robot.model.friction is None:
        raise IdentificationError(
            f"{robot.source or robot.name}: has no model block to compare with: add one, or leave --against out"
        )
    rotors = _stated_rotors(diagnosis)
    missing = tuple(finding for finding in diagnosis.findings if finding.place not in rotors)
    found = compare_with(keep_missing(diagnosis, missing) if rotors else diagnosis, _stated(diagnosis), "model")
    wrong = [each for each in rotors.values() if is_wrong(each, CLEAR)]
    return replace(found, differences=sort_differences([*found.differences, *wrong]))


def _stated_rotors(diagnosis: Diagnosis) -> dict[Place, ParameterDifference]:
    """Rotors that were found, and that the robot file states: they are not missing, though they may be wrong."""
    stated = diagnosis.robot.model.rotor_inertia or ()
    rotors = {}
    for finding in diagnosis.findings:
        effect, joint = finding.place
        if effect == RotorInertia.id and joint is not None and joint < len(stated) and stated[joint] > 0.0:
            name = f"{RotorInertia.id} {diagnosis.robot.joints[joint].name}"
            real, std = float(finding.terms[0].coefficients[0]), float(np.sqrt(finding.covariances[0][0, 0]))
            rotors[finding.place] = ParameterDifference(name, stated[joint], real, std)
    return rotors


def against_simulation(diagnosis: Diagnosis, simulated: Sequence[Recording], options: Options) -> Diagnosis:
    """The diagnosis compared with recordings from a simulator, on motions of its own."""
    fit = fit_to_simulation(diagnosis, simulated, options)
    names = diagnosis.selection.fit.model.structure.names
    values = dict(zip(names, (float(value) for value in fit.values), strict=True))
    std = dict(zip(names, np.sqrt(np.diag(fit.covariance)), strict=True))
    real = dict(zip(names, diagnosis.selection.fit.model.parameters, strict=True))
    small = {name for name in values if abs(values[name]) < max(LACKED * abs(real[name]), 5.0 * std[name])}
    joints = enumerate(diagnosis.robot.joints)
    lacking = [(joint, term) for joint, own in joints for term in TERMS if f"{term} {own.name}" in small]
    missing = tuple(finding for finding in diagnosis.findings if finding.place not in fit.shared)
    given = Given(values, tuple(lacking), fit.covariance)
    given = replace(given, links=_simulated_links(diagnosis, given))
    found = compare_with(keep_missing(diagnosis, missing), given, "simulation")
    of_effects = [each for differences in fit.shared.values() for each in differences if is_wrong(each, CLEAR)]
    return replace(found, differences=sort_differences([*found.differences, *of_effects]))


def keep_missing(diagnosis: Diagnosis, missing: Sequence[Finding]) -> Diagnosis:
    """Keep only the findings that the given model does not have; where it has all, their misfit is no news."""
    has_all = bool(diagnosis.findings) and not any(finding.in_model for finding in missing)
    before = diagnosis.misfit_after if has_all else diagnosis.misfit_before
    return replace(diagnosis, findings=tuple(missing), misfit_before=before)


def _simulated_links(diagnosis: Diagnosis, given: Given) -> Array | None:
    """The robot file's links where the simulator has their base parameters: they are its own."""
    links = diagnosis.robot.model.links
    if links is None or given.covariance is None:
        return None
    base = diagnosis.selection.fit.model.structure.base
    values, standard = base.project(stated_links(links)), stated_links(links)
    pairs = zip(base.expressions, values, np.sqrt(np.diag(given.covariance)), strict=False)
    differences = [
        ParameterDifference(name, given.values[name], float(value), float(std)) for name, value, std in pairs
    ]
    return None if any(is_wrong(each, _several(len(values))) for each in differences) else standard


def _stated(diagnosis: Diagnosis) -> Given:
    """What the robot file's model says, by parameter name."""
    robot, structure = diagnosis.robot, diagnosis.selection.fit.model.structure
    values: dict[str, float] = {}
    standard = None
    lacking: list[tuple[int, str]] = []
    if robot.model.links is not None:
        standard = stated_links(robot.model.links)
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
    return Given(values, tuple(lacking), links=standard)


@ThreadpoolController().wrap(limits=1, user_api="blas")  # many small factors: threads cost more than they bring
def compare_with(diagnosis: Diagnosis, given: Given, kind: Literal["model", "simulation"]) -> Diagnosis:
    """Findings that the given model makes, then what it has wrong beside them."""
    plain = replace(diagnosis, findings=tuple(finding for finding in diagnosis.findings if finding.in_model))
    found = with_plain_terms(plain, given.lacking)
    fit = found.selection.fit
    size, structure = fit.model.structure.size, fit.model.structure
    covariance = fit.free_covariance[:size, :size] * found.inflation
    covariance = covariance if given.covariance is None else covariance + given.covariance
    names, real = list(structure.names), fit.free_parameters.copy()
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    count, several = structure.base_count, _several(len(given.values))
    explanations: list[Explanation] = []
    if all(name in given.values for name in names[:count]):
        attribution = _attribution(found, given, real[:count], covariance[:count, :count])
        carried = attribution.payload()
        explanations = list(attribution.explain(carried))
        if carried is not None:
            payload = explanations.pop(0)
            found, real[:count] = found.with_findings([payload_finding(found, payload)]), real[:count] - payload.effect
    missing = {f"{term} {diagnosis.robot.joints[joint].name}" for joint, term in given.lacking}
    differences = [
        ParameterDifference(name, given.values[name], float(value), float(error))
        for name, value, error in zip(names, real, std, strict=True)
        if name in given.values and name not in missing
    ]
    wrong = sort_differences([each for each in differences if is_wrong(each, several)])
    wrong = attribute(wrong, names[:count], explanations, given.links, diagnosis.robot.joints, several)
    return replace(found, against=kind, differences=wrong, before=_given_sizes(found, given))


def _attribution(diagnosis: Diagnosis, given: Given, real: Array, covariance: Array) -> Attribution:
    """The surplus of the base parameters, to be explained by links."""
    base, links = diagnosis.selection.fit.model.structure.base, diagnosis.robot.link_count
    stated = np.array([given.values[name] for name in base.expressions])
    same = np.diag((NEGLIGIBLE * np.maximum(np.abs(real), np.abs(stated))) ** 2)
    prior = diagnosis.identification.posterior.prior.root[: 10 * links, : 10 * links]
    believed = np.asarray(np.linalg.inv(prior.T @ prior), dtype=np.float64)
    return Attribution(base, real - stated, covariance + same, given.links, believed)


def payload_finding(diagnosis: Diagnosis, carried: Explanation) -> Finding:
    """The payload as a finding; the model without it keeps everything else."""
    model = diagnosis.selection.fit.model
    parameters = model.parameters.copy()
    parameters[: len(carried.effect)] -= carried.effect
    effect = Payload(None, np.zeros((1, 3)), np.full(3, -FARTHEST_M), np.full(3, FARTHEST_M))
    return Finding(
        terms=(Term(effect, carried.values[1:], carried.values[:1]),),
        covariances=(carried.covariance,),
        gain=carried.gain * diagnosis.inflation,
        probability=float(1.0 / (1.0 + np.exp(-carried.log_odds))),
        before=diagnosis.sizes(replace(model, parameters=parameters)),
        after=diagnosis.after,
        in_model=False,
    )


def _several(count: int) -> float:
    """Standard errors by which one of so many parameters differs by chance alone in `CHANCE` of all cases."""
    return float(stats.norm.isf(0.5 * CHANCE / max(count, 1)))


def _given_sizes(diagnosis: Diagnosis, given: Given) -> FitSizes:
    """What the given model leaves, where it says enough to predict torque at all."""
    model = diagnosis.selection.nominal.model
    names = model.structure.names
    if any(name not in given.values for name in names[: model.structure.base_count]):
        return diagnosis.before
    stated: Array = np.array([given.values.get(name, 0.0) for name in names])
    return diagnosis.sizes(replace(model, parameters=stated))


def is_wrong(difference: ParameterDifference, several: float) -> bool:
    """Whether the given value is not the arm's."""
    size = max(abs(difference.real), abs(difference.simulation))
    return abs(difference.in_std) > several and abs(difference.real - difference.simulation) > NEGLIGIBLE * size


def sort_differences(differences: Sequence[ParameterDifference]) -> tuple[ParameterDifference, ...]:
    """Most standard errors first."""
    return tuple(sorted(differences, key=lambda each: -abs(each.in_std)))


def compare_with_saved(diagnosis: Diagnosis, saved: ExtendedModel) -> Diagnosis:
    """The diagnosis compared with a saved model: what that has already is no finding, at most another value."""
    values = dict(zip(saved.structure.names, map(float, saved.parameters), strict=True))
    joints = [joint.name for joint in diagnosis.robot.joints]
    lacking = tuple(
        (joint, term) for joint, name in enumerate(joints) for term in TERMS if f"{term} {name}" not in values
    )
    had = {(term.effect.id, term.effect.joint): term for term in saved.terms}
    missing = tuple(finding for finding in diagnosis.findings if finding.place not in had)
    found = compare_with(
        keep_missing(diagnosis, missing), Given(values, lacking, _align_covariance(diagnosis, saved)), "model"
    )
    differences = [
        ParameterDifference(f"{each.name} of {own.effect.name(joints)}", float(given), float(value), float(std))
        for finding in diagnosis.findings
        if finding.place in had
        for own in [on_the_arm(diagnosis.selection.fit.model, finding.terms[0])]
        for each, given, value, std in zip(
            own.effect.coefficients,
            on_the_arm(saved, had[finding.place]).coefficients,
            own.coefficients,
            np.sqrt(np.maximum(np.diag(finding.covariances[0]), 0.0)),
            strict=False,
        )
    ]
    wrong = [each for each in differences if is_wrong(each, CLEAR)]
    before = diagnosis.sizes(saved)
    return replace(found, differences=sort_differences([*found.differences, *wrong]), before=before)


def _align_covariance(diagnosis: Diagnosis, saved: ExtendedModel) -> Array | None:
    """Covariance of the saved parameters in the columns of the diagnosed model; None where they are exact."""
    if saved.covariance is None:
        return None
    own, known = diagnosis.selection.fit.model.structure.names, saved.structure.names
    place = np.array([[name == other for other in known] for name in own], dtype=np.float64)
    return place @ saved.covariance @ place.T
