"""Effects in the arm's own torque, at a joint whose recorded torque is scaled.

A fit compares with the recorded torque. Where that is f times the true one, f = 1 + g of another term of the model, the
coefficients c of the effects beside it are those of

    τ_recorded = f τ_nominal + Σ c φ = f (τ_nominal + Σ (c/f) φ)

and what the arm does is c/f.
"""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.effects.torque_gain_error import TorqueGainError
from tauscope.effects.torque_saturation import Saturation
from tauscope.recording.recording import Array


def on_the_arm(model: ExtendedModel, term: Term) -> Term:
    """A term with the coefficients that it has in the arm's own torque; one that is none of the model's as it is."""
    if not _is_scaled(model, term) or not any(term is each for each in model.terms):
        return term
    return replace(term, coefficients=term.coefficients / model.factor(term.effect.joint or 0))


def covariance_on_the_arm(model: ExtendedModel, place: int, covariance: Array) -> Array:
    """Covariance of a term's parameters in the arm's own torque, that of the scale included, (k, k).

    J C Jᵀ with J = ∂(c/f, shapes)/∂(all parameters): 1/f in c, -c/f² in f. `covariance`: (p, p), of all its parameters.
    """
    places, term = model.term_places(), model.terms[place]
    slopes = np.eye(model.size)[places[place]]
    if _is_scaled(model, term):
        joint, count = term.effect.joint or 0, len(term.coefficients)
        scale = model.factor(joint)
        slopes[:count] /= scale
        for other, own in zip(model.terms, places, strict=True):
            if isinstance(other.effect, TorqueGainError) and other.effect.joint == joint:
                slopes[:count, own.start] -= term.coefficients / scale**2
    return np.asarray(slopes @ covariance @ slopes.T)


def _is_scaled(model: ExtendedModel, term: Term) -> bool:
    """Whether all torque of a term is that of one joint, and is recorded as another term there scales it."""
    effect = term.effect
    alone = effect.joint is not None and len(effect.touched(model.structure.robot.joint_count)) == 1
    return alone and not isinstance(effect, TorqueGainError | Saturation)
