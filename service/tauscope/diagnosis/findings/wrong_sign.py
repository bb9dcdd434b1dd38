"""Findings of a torque that is recorded with the wrong sign: all else is diagnosed with the right one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding, in_order
from tauscope.diagnosis.findings.location import locate
from tauscope.diagnosis.model.extended import with_terms
from tauscope.diagnosis.model.term import Term
from tauscope.effects.torque_gain_error import TorqueGainError
from tauscope.identification.signs import CLEARLY

OPPOSITE = np.array([-2.0])  # gain g of 1 + g = -1


def with_wrong_signs(diagnosis: Diagnosis, joints: Sequence[int]) -> Diagnosis:
    """The diagnosis with a finding for each joint of wrong sign, or one for all; it has them right already."""
    if not joints:
        return diagnosis
    whole = len(joints) == diagnosis.robot.joint_count > 1
    terms = [Term(TorqueGainError(joint), np.zeros(0), OPPOSITE) for joint in ([None] if whole else joints)]
    found = []
    for term in terms:
        final = diagnosis.selection.fit.model
        before = diagnosis.sizes(with_terms(final, [*final.terms, term]))
        found.append(
            Finding(
                terms=(term,),
                covariances=(np.zeros((1, 1)),),
                gain=_energy(diagnosis, term),
                probability=float(1.0 / (1.0 + np.exp(-CLEARLY))),
                before=before,
                after=diagnosis.after,
                confirmed=None if diagnosis.held_out is None else True,
                in_model=False,
            )
        )
    nominal = diagnosis.selection.nominal
    stated = with_terms(nominal.model, [*nominal.model.terms, *terms])
    left = diagnosis.misfit_after.significant
    places = locate(replace(nominal, model=stated), diagnosis.selection.fit, diagnosis.fitter.observations, left)
    gains = {joint: found[0 if whole else number].gain for number, joint in enumerate(joints)}
    mismatch = tuple(
        replace(place, explained=own.explained + gains[place.joint]) if place.joint in gains else own
        for own, place in zip(diagnosis.mismatch, places, strict=True)
    )
    findings, before = in_order([*diagnosis.findings, *found]), diagnosis.sizes(stated)
    return replace(diagnosis, findings=findings, before=before, mismatch=mismatch)


def _energy(diagnosis: Diagnosis, term: Term) -> float:
    """Energy that the right sign takes off the residual [noise variances]."""
    model = diagnosis.selection.fit.model
    left = [diagnosis.fitter.white_residual(each) for each in (with_terms(model, [*model.terms, term]), model)]
    wrong, right = (float(sum(rows @ rows for rows in each)) for each in left)
    return wrong - right
