"""Terms of the nominal model that the given model lacks: a constant, plain friction.

The identified model has them all, so that nothing else is taken for them. Whether one is *missing* depends on what the
recordings are compared with. A robot file whose `model` block states friction states no constant with it (CONTRACT.md):
there, a constant that the recordings show is a finding whatever they are compared with. A file without such a block
says nothing, nor does a URDF: its <dynamics> are often placeholders.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding, equivalent
from tauscope.diagnosis.fitting.fit import Fit
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.search.found import Rival
from tauscope.diagnosis.search.from_recordings import Searched
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory
from tauscope.diagnosis.search.proposals import Proposal, Proposer
from tauscope.effects.plain_terms import CoulombFriction, PlainTerm, StribeckTerm, TorqueOffset, ViscousFriction
from tauscope.robot import Robot

PLAIN: tuple[type[PlainTerm], ...] = (CoulombFriction, StribeckTerm, ViscousFriction, TorqueOffset)
Lacking = Collection[tuple[int, str]]  # joint indices and names of the nominal terms that the given model does not have
CERTAIN = 1e12  # factor by which a constant that is not there is believed more precisely


def undeclared_offsets(diagnosis: Diagnosis) -> Lacking:
    """The constants of all joints where the robot file states friction: it cannot state them."""
    robot = diagnosis.robot
    return [(joint, "offset") for joint in range(robot.joint_count)] if states_friction(robot) else ()


def states_friction(robot: Robot) -> bool:
    """Whether a robot file states friction of its own; that of a URDF is often a placeholder."""
    return robot.model.friction is not None and robot.urdf is None


def with_plain_terms(diagnosis: Diagnosis, lacking: Lacking) -> Diagnosis:
    """The diagnosis with a finding for every nominal term that is there and that the given model lacks."""
    named = {finding.place for finding in diagnosis.findings}
    constants = {each.terms[0].effect.joint for each in diagnosis.findings if each.terms[0].effect.has_constant}
    added = []
    for kind in PLAIN:
        for joint, term in sorted(lacking):
            if term == kind.term and (kind.id, joint) not in named and not (term == "offset" and joint in constants):
                finding = _finding(kind(joint), diagnosis)
                added += [] if finding is None else [finding]
    return diagnosis.with_findings(added)


def with_rivals_of_constants(diagnosis: Diagnosis, searched: Searched) -> Diagnosis:
    """The same, each constant with what may be in its place."""
    findings = [
        replace(each, alternatives=equivalent(*weigh_constant(searched, each.terms[0].effect.joint or 0)))
        if isinstance(each.terms[0].effect, TorqueOffset)
        else each
        for each in diagnosis.findings
    ]
    return replace(diagnosis, findings=tuple(findings))


def _finding(effect: PlainTerm, diagnosis: Diagnosis) -> Finding | None:
    """The finding of one nominal term, None where it may as well be zero."""
    fit = diagnosis.selection.fit
    joint = effect.joint or 0
    place = fit.model.structure.coefficient(joint, effect.term)
    if place is None:
        return None
    value, variance = float(fit.model.parameters[place]), float(fit.covariance[place, place])
    believed = float(np.linalg.inv(diagnosis.identification.posterior.precision)[_column(effect, diagnosis)] ** 0.5)
    gain = value**2 / max(variance, np.finfo(float).tiny)
    log_odds = 0.5 * gain - 0.5 * np.log(1.0 + believed**2 / max(variance, np.finfo(float).tiny))
    if variance <= 0.0 or stats.chi2.sf(gain, 1) >= diagnosis.level or log_odds <= 0.0:
        return None
    delta = fit.model.structure.terms[joint].delta
    shape = np.array([delta] if isinstance(effect, StribeckTerm) and delta is not None else [])
    return Finding(
        terms=(Term(effect, shape, np.array([value])),),
        covariances=(np.diag([variance, *np.zeros(len(shape))]),),
        gain=gain,
        probability=float(1.0 / (1.0 + np.exp(-min(log_odds, 700.0)))),
        before=diagnosis.sizes(_without(fit, place)),
        after=diagnosis.after,
        confirmed=_is_seen_again(place, value, diagnosis),
        in_model=False,
    )


def _column(effect: PlainTerm, diagnosis: Diagnosis) -> tuple[int, int]:
    """Place of a term's variance in the prior of the identification."""
    column = diagnosis.identification.structure.coefficient(effect.joint or 0, effect.term) or 0
    return column, column


def _without(fit: Fit, place: int) -> ExtendedModel:
    """The model with one nominal parameter at zero, the others as they then most likely are."""
    covariance, size = fit.covariance, fit.model.structure.size
    parameters = (
        fit.model.parameters - fit.model.parameters[place] * covariance[:size, place] / covariance[place, place]
    )
    parameters[place] = 0.0
    return replace(fit.model, parameters=parameters)


def _is_seen_again(place: int, value: float, diagnosis: Diagnosis) -> bool | None:
    """Whether held-out recordings, asked alone, give the term the same sign."""
    if diagnosis.held_out is None:
        return None
    again = diagnosis.held_out.fitter.projected(diagnosis.selection.fit.model)
    found = diagnosis.selection.fit.model.parameters[place] + again.projection.step[place]
    return bool(np.sign(found) == np.sign(value))


def weigh_constant(searched: Searched, joint: int) -> tuple[float, tuple[Rival, ...]]:
    """Log odds of a joint's constant, and its rivals, against a model with neither.

    Friction that is larger one way, or a spring far from its rest, may be taken for it.
    """
    final, laboratory = searched.found.hypothesis, searched.laboratory
    place = final.model.structure.coefficient(joint, "offset")
    if place is None:
        return 0.0, ()
    laboratory = _hold(laboratory, place - len(laboratory.prior.bodies.base))
    parameters = final.model.parameters.copy()
    parameters[place] = 0.0
    without = laboratory.at(replace(final.model, parameters=parameters), final.sizes, final.scales, final.dependence)
    without = laboratory.settle(without, [joint])
    beside = laboratory.tune(laboratory.under(without, final.dependence, [joint]), [joint])
    effects = [each for each in searched.effects if each.joint == joint]
    proposals = Proposer(laboratory, effects).propose(without, lambda effect: not effect.is_expected)
    return final.log_evidence - beside.log_evidence, _rivals(laboratory, without, proposals, place)


def _hold(laboratory: Laboratory, place: int) -> Laboratory:
    """The same where a friction coefficient is believed to be zero."""
    friction = laboratory.prior.friction.copy()
    friction[place, place] *= CERTAIN
    return replace(laboratory, prior=replace(laboratory.prior, friction=friction))


def _rivals(
    laboratory: Laboratory, without: Hypothesis, proposals: Sequence[Proposal], absent: int
) -> tuple[Rival, ...]:
    found = []
    for proposal in proposals:
        painted = laboratory.paint(without, proposal.found)
        model = laboratory.approach(laboratory.with_term(painted, proposal.term, proposal.size)).model
        found.append(Rival(model.terms[-1], model, proposal.log_factor, absent))
    return tuple(sorted(found, key=lambda each: -each.log_odds))
