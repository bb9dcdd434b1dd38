"""Deflections that are certain, as terms of a model."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tauscope.diagnosis.deflection.measured import MeasuredDeflection
from tauscope.diagnosis.model.term import Term
from tauscope.effects import ArmContext
from tauscope.effects.measured_deflection import MeasuredElasticity, MeasuredPlay, MeasuredTeeth


@dataclass(frozen=True, eq=False)
class DirectTerm:
    """A deflection that is certain."""

    term: Term
    value: float  # of its coefficient [rad/Nm, rad, m/N or m]
    std: float

    @property
    def joint(self) -> int:
        """Index, from 0."""
        return self.term.effect.joint or 0


def direct_terms(measured: Sequence[MeasuredDeflection], setting: ArmContext) -> list[DirectTerm]:
    """Terms of all that is certain; compliance beside play where it moves the link by more than that."""
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
