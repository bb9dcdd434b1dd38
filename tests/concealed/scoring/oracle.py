"""What a diagnosis would reach that knows the form of what is concealed, and only has to fit it."""

from collections.abc import Collection
from unittest import mock

import numpy as np

from concealed.generator.trial import Trial
from tauscope.diagnosis import diagnosis as steps
from tauscope.diagnosis import document
from tauscope.diagnosis.documents.document import DiagnosisDocument
from tauscope.effects import ArmContext, Effect, possible_effects


def oracle(trial: Trial) -> DiagnosisDocument:
    """The diagnosis whose catalogue holds nothing but the truth."""
    places = {(name, place) for drawn in trial.truth for name in drawn.names for place in drawn.places}
    places |= {(name, place) for drawn in trial.truth for name in drawn.also for place in drawn.places}
    with mock.patch.object(steps, "possible_effects", lambda setting: _only(places, setting)):
        return document(steps.diagnose(trial.robot, trial.train, trial.held_out))


def _only(places: Collection[tuple[str, int | None]], setting: ArmContext) -> list[Effect]:
    return [each for each in possible_effects(setting) if (each.id, each.joint) in places]


def against_oracle(found: DiagnosisDocument, best: DiagnosisDocument) -> float:
    """Largest ratio of held-out rms after the findings, over all joints."""
    after, least = (each.fit.held_out.rms_after if each.fit.held_out else [] for each in (found, best))
    return float(np.max(np.array(after) / np.array(least)))
