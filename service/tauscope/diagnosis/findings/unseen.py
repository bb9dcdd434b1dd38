"""Motion from which no model was made."""

from dataclasses import dataclass
from functools import cached_property

from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations

PREDICTED = 4.0  # power of a held-out residual, in noise variances, up to which a model predicts the motion


@dataclass(frozen=True, eq=False)
class Unseen:
    """Held-out rows, with the noise of the training ones."""

    observations: Observations

    @cached_property
    def fitter(self) -> Fitter:
        """Fits to these rows."""
        return Fitter(self.observations)

    def is_predicted_by(self, model: ExtendedModel) -> bool:
        """Whether a model leaves no joint much more than noise; otherwise the training motion was too poor."""
        return all(float(row @ row) <= PREDICTED * len(row) for row in self.fitter.white_residual(model))
