"""Findings that an encoder on the link shows directly, whether or not the torque shows them too."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import stats

from tauscope.diagnosis.deflection.measured import MeasuredDeflection
from tauscope.diagnosis.findings.detectability import Detectable
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding
from tauscope.diagnosis.model.term import Term
from tauscope.effects import ArmContext
from tauscope.effects.measured_deflection import MeasuredElasticity, MeasuredPlay, MeasuredTeeth

NO_SHAPE = np.zeros((0, 0))
"""Covariance of what no fit estimates."""

AGREED = 3.0
"""Standard errors by which held-out motion may show another size."""


@dataclass(frozen=True, eq=False)
class DirectTerm:
    """A deflection that is certain.

    value, std : float
        of its coefficient [rad/Nm, rad, m/N or m]
    """

    term: Term
    value: float
    std: float

    @property
    def joint(self) -> int:
        """Index, from 0."""
        return self.term.effect.joint or 0


def direct_terms(measured: Sequence[MeasuredDeflection], setting: ArmContext) -> list[DirectTerm]:
    """Terms of all deflections that are certain.

    Teeth give way too: compliance is a finding of its own where it moves the link by more than play does.
    """
    found = []
    for each in measured:
        compliance, play = np.array([each.compliance, each.compliance_std]), np.array([each.play, each.play_std])
        if each.has_play:
            can_swing = each.is_compliant and setting.inertia[each.joint] > 0.0
            teeth = MeasuredTeeth.of(setting, each.joint, play, compliance) if can_swing else None
            effect = teeth or MeasuredPlay.of(setting, each.joint, *play.tolist())
            found.append((effect, play))
        if each.is_compliant and not (each.has_play and each.play > each.largest_wind_up):
            found.append((MeasuredElasticity.of(setting, each.joint, *compliance.tolist()), compliance))
    return [DirectTerm(Term(effect, effect.grid[0], size[:1]), *size.tolist()) for effect, size in found]


def with_direct_findings(
    diagnosis: Diagnosis, measured: Sequence[MeasuredDeflection], again: Sequence[MeasuredDeflection]
) -> Diagnosis:
    """The diagnosis with every deflection that is certain, and what smaller ones would have been seen.

    Parameters
    ----------
    again : sequence of MeasuredDeflection
        the same on held-out recordings
    """
    findings = {finding.place: finding for finding in diagnosis.findings}
    unseen = {each.joint: each for each in again}
    for direct in direct_terms(measured, diagnosis.setting):
        place = direct.term.effect.id, direct.term.effect.joint
        known = findings.get(place)
        if known is None:
            known = Finding((direct.term,), (NO_SHAPE,), 0.0, 1.0, diagnosis.after, diagnosis.after)
        findings[place] = replace(
            known,
            probability=float(stats.norm.cdf(direct.value / direct.std)),
            alternatives=(),
            confirmed=_agree(direct, unseen.get(direct.joint)),
            behind=None,
            as_law=1.0,
            elsewhere=(),
        )
    seen = tuple(limit for each in measured for limit in _limits(each))
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
