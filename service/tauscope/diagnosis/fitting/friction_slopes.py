"""What the identification left open of the friction curve: slopes K_v, and Stribeck terms too small for it to propose.

Near a slope that is too steep for the samples nothing changes with it, and no step leads away. In the wider band of a
diagnosis a gentle one may show all the same; left steep, it passes for friction that rises over a distance. A Stribeck
term that explains little of the torque is worth no parameter to an identification; to a diagnosis, which sees less
than a percent, it is the plain model's own, and no physics that was left out.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.effects.computation import side_by_side
from tauscope.identification import Identification
from tauscope.identification.friction_shape import SEPARATION
from tauscope.recording.recording import Array

SLOPES = np.geomspace(2.0, 200.0, 9)
"""K_v tried, times the joint's rms speed."""

STRIBECK_SLOPES = np.geomspace(0.5, 40.0, 9)
"""δ tried, times the joint's rms speed."""

CLEARLY_BETTER = 12.0
"""Energy that another slope has to take off [noise variances]: chance takes off as much in one of thousands."""


def open_slopes(identification: Identification) -> list[int]:
    """Joints whose slope neither the robot file states nor the identification could tell."""
    return [
        joint
        for joint, (shape, identifiable) in enumerate(
            zip(identification.shapes, identification.identifiable, strict=True)
        )
        if not shape.k_v_given and not identifiable["k_v"]
    ]


def with_fitting_slopes(model: ExtendedModel, fitter: Fitter, joints: Sequence[int], speed: Array) -> ExtendedModel:
    """The model with the slopes that fit clearly better, joint after joint.

    Parameters
    ----------
    joints : sequence of int
        whose slopes are open, from 0
    speed : (n,) float64
        rms speed of every joint [rad/s or m/s]
    """
    if not joints:
        return model
    best = fitter.fit(model)
    for joint in joints:
        if speed[joint] > 0.0:
            best = _best_slope(best, fitter, joint, float(speed[joint]))
    return best.model


def open_stribeck(identification: Identification) -> list[int]:
    """Joints without a Stribeck term, of which the robot file does not say that they have none."""
    return [
        joint
        for joint, (shape, terms) in enumerate(zip(identification.shapes, identification.structure.terms, strict=True))
        if terms.delta is None and not shape.k_v_given
    ]


def with_fitting_stribeck(model: ExtendedModel, fitter: Fitter, joints: Sequence[int], speed: Array) -> ExtendedModel:
    """The model with τ_sc (2/π) atan(δ q̇) at the joints where friction falls with speed by that, clearly.

    Parameters
    ----------
    joints : sequence of int
        that have no such term yet, from 0
    speed : (n,) float64
        rms speed of every joint [rad/s or m/s]
    """
    if not joints:
        return model
    best = fitter.fit(model)
    for joint in joints:
        if speed[joint] > 0.0:
            best = _best_stribeck(best, fitter, joint, float(speed[joint]))
    return best.model


def _best_stribeck(best: Fit, fitter: Fitter, joint: int, speed: float) -> Fit:
    """The fit with a Stribeck term at one joint, or as it was."""
    slopes = [value / speed for value in STRIBECK_SLOPES]
    apart = [slope for slope in slopes if slope * SEPARATION <= best.model.structure.terms[joint].k_v]
    tried = side_by_side(lambda slope: fitter.linear_optimum(_with_stribeck(best.model, joint, float(slope))), apart)
    falling = [each for each in tried if _falls(each.model, joint)]
    if not falling:
        return best
    refined = fitter.fit(min(falling, key=lambda each: each.energy).model)
    is_better = refined.energy < best.energy - CLEARLY_BETTER * refined.inflation()
    return refined if is_better and _falls(refined.model, joint) else best


def _falls(model: ExtendedModel, joint: int) -> bool:
    """Whether friction falls from τ_s to τ_s + τ_sc ≥ 0."""
    stiction, stribeck = (model.structure.coefficient(joint, name) for name in ("stiction", "stribeck"))
    assert stiction is not None and stribeck is not None  # noqa: S101, PT018 (the term was just added)
    start, change = float(model.parameters[stiction]), float(model.parameters[stribeck])
    return change < 0.0 <= start + change


def _with_stribeck(model: ExtendedModel, joint: int, delta: float) -> ExtendedModel:
    """The model with such a term, its coefficient still zero."""
    terms = list(model.structure.terms)
    terms[joint] = replace(terms[joint], delta=delta)
    structure = model.structure.with_terms(tuple(terms))
    place = structure.coefficient(joint, "stribeck")
    assert place is not None  # noqa: S101 (the term was just added)
    return replace(
        model,
        structure=structure,
        parameters=np.insert(model.parameters, place, 0.0),
        constants=(*model.constants, (joint, "delta")),
        stated=(*model.stated, None),
    )


def _best_slope(best: Fit, fitter: Fitter, joint: int, speed: float) -> Fit:
    """The fit with one joint's slope where it fits best."""
    slopes = SLOPES / speed
    tried = side_by_side(lambda slope: fitter.linear_optimum(_with_slope(best.model, joint, float(slope))), slopes)
    nearest = min(tried, key=lambda each: each.energy)
    if nearest.energy > best.energy:
        return best
    refined = fitter.fit(nearest.model)
    return refined if refined.energy < best.energy - CLEARLY_BETTER * refined.inflation() else best


def _with_slope(model: ExtendedModel, joint: int, slope: float) -> ExtendedModel:
    terms = list(model.structure.terms)
    terms[joint] = replace(terms[joint], k_v=slope)
    return replace(model, structure=model.structure.with_terms(tuple(terms)))
