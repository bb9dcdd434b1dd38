"""Slopes K_v of the friction curve that the identification left open, looked for over their whole range.

Near a slope that is too steep for the samples nothing changes with it, and no step leads away. In the wider band of a
diagnosis a gentle one may show all the same; left steep, it passes for friction that rises over a distance.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from service.diagnosis.fit import Fit, Fitter
from service.diagnosis.model import ExtendedModel
from service.identification import Identification
from service.recording.recording import Array

SLOPES = np.geomspace(2.0, 200.0, 9)
"""K_v tried, times the joint's rms speed."""

CLEARLY_BETTER = 12.0
"""Energy that another slope has to take off [noise variances]: chance takes off as much in one of thousands."""


def open_slopes(identification: Identification) -> list[int]:
    """Joints whose slope neither the robot file states nor the identification could tell.

    Parameters
    ----------
    identification : Identification
        the result
    """
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
    model : ExtendedModel
        the nominal model
    fitter : Fitter
        of the training recordings
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


def _best_slope(best: Fit, fitter: Fitter, joint: int, speed: float) -> Fit:
    """The fit with one joint's slope where it fits best."""
    tried = [fitter.fit(_with_slope(best.model, joint, float(value) / speed), steps=0) for value in SLOPES]
    nearest = min(tried, key=lambda each: each.energy)
    if nearest.energy > best.energy:
        return best
    refined = fitter.fit(nearest.model)
    return refined if refined.energy < best.energy - CLEARLY_BETTER * refined.inflation() else best


def _with_slope(model: ExtendedModel, joint: int, slope: float) -> ExtendedModel:
    terms = list(model.structure.terms)
    terms[joint] = replace(terms[joint], k_v=slope)
    return replace(model, structure=model.structure.with_terms(tuple(terms)))
