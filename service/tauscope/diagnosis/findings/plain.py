"""Terms of the nominal model that the given model lacks: a constant, plain friction.

The identified model has them all, so that nothing else is taken for them. Whether one is *missing* depends on what the
recordings are compared with. A robot file whose `model` block states friction states no constant with it (CONTRACT.md):
there, a constant that the recordings show is a finding whatever they are compared with. A file without such a block
says nothing, nor does a URDF: its <dynamics> are often placeholders.
"""

from collections.abc import Collection

import numpy as np
from scipy import stats

from tauscope.diagnosis.findings.constant_torque import instead_of_a_constant
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding, is_confirmed, sizes, without_nominal
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.selection.admission import SMALLEST_SHARE
from tauscope.diagnosis.selection.equivalence import probability_among
from tauscope.diagnosis.selection.shape_error import HARDLY
from tauscope.effects.plain_terms import CoulombFriction, PlainTerm, StribeckTerm, TorqueOffset, ViscousFriction
from tauscope.robot import Robot

PLAIN: tuple[type[PlainTerm], ...] = (CoulombFriction, StribeckTerm, ViscousFriction, TorqueOffset)

Lacking = Collection[tuple[int, str]]
"""Joint indices and names of the nominal terms that the given model does not have."""


def undeclared_offsets(diagnosis: Diagnosis) -> Lacking:
    """The constants of all joints where the robot file states friction: it cannot state them."""
    robot = diagnosis.robot
    return [(joint, "offset") for joint in range(robot.joint_count)] if states_friction(robot) else ()


def states_friction(robot: Robot) -> bool:
    """Whether a robot file states friction of its own; that of a URDF is often a placeholder."""
    return robot.model.friction is not None and robot.urdf is None


def with_plain_terms(diagnosis: Diagnosis, lacking: Lacking) -> Diagnosis:
    """The diagnosis with a finding for every nominal term that is there and that the given model lacks.

    Parameters
    ----------
    lacking : collection of (int, str)
        what the given model does not have
    """
    named = {finding.place for finding in diagnosis.findings}
    constants = {each.terms[0].effect.joint for each in diagnosis.findings if each.terms[0].effect.has_constant}
    added = []
    for kind in PLAIN:
        for joint, term in sorted(lacking):
            if term == kind.term and (kind.id, joint) not in named and not (term == "offset" and joint in constants):
                finding = _finding(kind(joint), diagnosis)
                added += [] if finding is None else [finding]
    return diagnosis.with_findings(added)


def _finding(effect: PlainTerm, diagnosis: Diagnosis) -> Finding | None:
    """The finding of one nominal term, None where it may as well be zero."""
    fit, inflation = diagnosis.selection.fit, diagnosis.inflation
    joint = effect.joint or 0
    place = fit.model.structure.coefficient(joint, effect.term)
    if place is None:
        return None
    value, variance = float(fit.model.parameters[place]), float(fit.covariance[place, place]) * inflation
    if variance <= 0.0 or stats.chi2.sf(value**2 / variance, 1) >= diagnosis.level:
        return None
    without = without_nominal(fit, place, diagnosis.fitter)
    gain = without.energy - fit.energy
    # Beside an effect whose columns change with the parameters, the linear standard error may be too small: both count.
    if stats.chi2.sf(max(gain, 0.0) / inflation, 1) >= diagnosis.level:
        return None
    residual = fit.projection.residual[joint]
    if not diagnosis.pure_error and gain < SMALLEST_SHARE * float(residual @ residual):
        return None
    delta = fit.model.structure.terms[joint].delta
    shape = np.array([delta] if isinstance(effect, StribeckTerm) and delta is not None else [])
    others = ()
    if isinstance(effect, TorqueOffset):
        others = instead_of_a_constant(effect, without, gain, diagnosis.screen, diagnosis.fitter)
    probability = probability_among(gain - 1.0, [option.score for option in others], [inflation] * len(others))
    if probability < HARDLY:  # something else explains it better, and has been refused elsewhere
        return None
    term = Term(effect, shape, np.array([value]))
    before = sizes(without.model, diagnosis.fitter, diagnosis.held_out)
    return Finding(
        terms=(term,),
        covariances=(np.diag([variance, *np.zeros(len(shape))]),),
        gain=gain,
        probability=probability,
        before=before,
        after=diagnosis.after,
        alternatives=others,
        confirmed=is_confirmed(term, before, diagnosis.after, seen_again=_seen_again(place, value, diagnosis)),
        in_model=False,
    )


def _seen_again(place: int, value: float, diagnosis: Diagnosis) -> bool | None:
    """Whether held-out recordings, asked alone, give the term the same sign."""
    if diagnosis.held_out is None:
        return None
    again = diagnosis.held_out.fitter.projected(diagnosis.selection.fit.model)
    found = diagnosis.selection.fit.model.parameters[place] + again.projection.step[place]
    return bool(np.sign(found) == np.sign(value))
