"""A point mass at the tool, found in the links' surplus over a given model, as a finding."""

from dataclasses import replace

import numpy as np

from tauscope.diagnosis.against.attribution import Explanation
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding
from tauscope.diagnosis.model.term import Term
from tauscope.effects.carried_body import FARTHEST_M
from tauscope.effects.payload import Payload


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
