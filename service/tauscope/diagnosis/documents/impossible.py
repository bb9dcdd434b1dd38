"""Parameters to which findings gave values that no body, no rotor and no friction can have."""

from collections.abc import Mapping

import numpy as np

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.identification.structure import ModelStructure
from tauscope.number_text import significant
from tauscope.recording.recording import Array
from tauscope.result_warning import ResultWarning

# Standard parameters that are positive; a sum of such ones with positive weights is positive, too.
POSITIVE = ("m", "Ixx", "Iyy", "Izz")
POSITIVE_TERMS = ("stiction", "viscous", "rotor_inertia")
CLEARLY = 2.0  # standard errors below zero from which a value is worth a warning: nearer, it is zero


def impossible_places(structure: ModelStructure, parameters: Array) -> list[int]:
    """Places of parameters below zero that must not be. `parameters`: (p,), Θ."""
    places = [place for place, terms in enumerate(structure.base.terms) if _is_positive(terms)]
    joints = range(structure.robot.joint_count)
    terms = [structure.coefficient(joint, name) for joint in joints for name in POSITIVE_TERMS]
    places += [place for place in terms if place is not None]
    return [place for place in places if parameters[place] < 0.0]


def impossible_warnings(diagnosis: Diagnosis) -> list[ResultWarning]:
    """A warning where findings made parameters clearly impossible."""
    fit = diagnosis.selection.fit
    structure, parameters = fit.model.structure, fit.model.parameters
    std = np.sqrt(np.maximum(np.diag(fit.covariance) * diagnosis.inflation, 0.0))
    if not diagnosis.findings:
        return []
    places = [each for each in impossible_places(structure, parameters) if parameters[each] < -CLEARLY * std[each]]
    if not places:
        return []
    values = ", ".join(f"{structure.names[place]} = {significant(parameters[place], 2)}" for place in places)
    return [
        ResultWarning(
            code="impossible-value",
            text=f"the findings make values impossible, and the tables omit them: {values}",
            remedy="record motion that excites these joints more, and diagnose again",
        )
    ]


def _is_positive(terms: Mapping[str, float]) -> bool:
    """Whether no body makes a base parameter negative."""
    return all(weight > 0.0 and name.rstrip("0123456789") in POSITIVE for name, weight in terms.items())
