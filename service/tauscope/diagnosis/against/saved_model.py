"""The recordings compared with an extended model that was saved before."""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.against.given_model import CLEAR, Given, beside, compared, is_wrong, ordered
from tauscope.diagnosis.findings.diagnosed import Diagnosis, ParameterDifference
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.recording.recording import Array

TERMS = ("stiction", "stribeck", "viscous", "offset")


def against_saved(diagnosis: Diagnosis, saved: ExtendedModel) -> Diagnosis:
    """The diagnosis compared with a saved model: what that has already is no finding, at most another value."""
    values = dict(zip(saved.structure.names, map(float, saved.parameters), strict=True))
    joints = [joint.name for joint in diagnosis.robot.joints]
    lacking = tuple(
        (joint, term) for joint, name in enumerate(joints) for term in TERMS if f"{term} {name}" not in values
    )
    had = {(term.effect.id, term.effect.joint): term for term in saved.terms}
    missing = tuple(finding for finding in diagnosis.findings if finding.place not in had)
    found = compared(beside(diagnosis, missing), Given(values, lacking, _align_covariance(diagnosis, saved)), "model")
    differences: list[ParameterDifference] = []
    for finding in diagnosis.findings:
        if finding.place not in had:
            continue
        own, given = on_the_arm(diagnosis.selection.fit.model, finding.terms[0]), on_the_arm(saved, had[finding.place])
        std = np.sqrt(np.maximum(np.diag(finding.covariances[0]), 0.0))
        for place, coefficient in enumerate(own.effect.coefficients[: len(given.coefficients)]):
            differences.append(
                ParameterDifference(
                    f"{coefficient.name} of {own.effect.name(joints)}",
                    float(given.coefficients[place]),
                    float(own.coefficients[place]),
                    float(std[place]),
                )
            )
    wrong = [each for each in differences if is_wrong(each, CLEAR)]
    before = diagnosis.sizes(saved)
    return replace(found, differences=ordered([*found.differences, *wrong]), before=before)


def _align_covariance(diagnosis: Diagnosis, saved: ExtendedModel) -> Array | None:
    """Covariance of the saved parameters in the columns of the diagnosed model; None where they are exact."""
    if saved.covariance is None:
        return None
    own, known = diagnosis.selection.fit.model.structure.names, saved.structure.names
    place = np.array([[name == other for other in known] for name in own], dtype=np.float64)
    return place @ saved.covariance @ place.T
