"""Findings that an encoder on the link shows directly, whether or not the torque shows them too."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from tauscope.diagnosis.deflection.measured import CERTAIN, DirectTerm, MeasuredDeflection, direct_terms
from tauscope.diagnosis.findings.detectability import Detectable
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding
from tauscope.effects.measured_deflection import MeasuredElasticity, MeasuredPlay

NO_SHAPE = np.zeros((0, 0))  # covariance of what no fit estimates
AGREED = 3.0  # standard errors by which held-out motion may show another size


def with_direct_findings(
    diagnosis: Diagnosis, measured: Sequence[MeasuredDeflection], again: Sequence[MeasuredDeflection]
) -> Diagnosis:
    """The diagnosis with every deflection that is certain, also by held-out motion `again`, and what would be seen."""
    findings = {finding.place: finding for finding in diagnosis.findings}
    unseen = {each.joint: each for each in again}
    for direct in direct_terms(measured, diagnosis.setting):
        place = direct.term.effect.id, direct.term.effect.joint
        known = findings.get(place)
        if known is None:
            known = Finding((direct.term,), (NO_SHAPE,), 0.0, 1.0, diagnosis.after, diagnosis.after)
        agrees = _agree(direct, unseen.get(direct.joint))
        findings[place] = replace(
            known,
            probability=float(stats.norm.cdf(CERTAIN)),
            alternatives=(),
            confirmed=known.confirmed if agrees is None else agrees,
        )
    seen = tuple(limit for each in measured if not each.is_open for limit in _limits(each))
    found = replace(diagnosis, findings=(), detectable=(*diagnosis.detectable, *seen))
    return found.with_findings(list(findings.values()))


def _agree(direct: DirectTerm, again: MeasuredDeflection | None) -> bool | None:
    """Whether held-out motion shows the same size; None where it could not show it."""
    if again is None:
        return None
    is_elastic = isinstance(direct.term.effect, MeasuredElasticity)
    value, std = (again.compliance, again.compliance_std) if is_elastic else (again.play, again.play_std)
    if (again.least_compliance if is_elastic else again.least_play) > direct.value:
        return None
    return abs(direct.value - value) < AGREED * float(np.hypot(direct.std, std))


def _limits(measured: MeasuredDeflection) -> tuple[Detectable, Detectable]:
    """Smallest compliance and play that would have been certain."""
    kinds = (MeasuredElasticity, measured.least_compliance), (MeasuredPlay, measured.least_play)
    elastic, play = (
        Detectable(
            kind.id,
            measured.joint,
            least if np.isfinite(least) else None,
            kind.coefficients[0].unit,
            visible=bool(np.isfinite(least)),
        )
        for kind, least in kinds
    )
    return elastic, play
