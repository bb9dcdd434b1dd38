"""An extended model beside whitened rows: what it leaves, and the step that would take most off that."""

from dataclasses import dataclass, replace

from tauscope.diagnosis.fitting.projection import JointColumns, Projection, project
from tauscope.diagnosis.fitting.white_columns import WhiteColumns
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class Fit:
    """An extended model, and how far its rows would move it."""

    model: ExtendedModel
    projection: Projection
    spread: Array  # (p, r), square root of the covariance

    @property
    def energy(self) -> float:
        """Σ r² that the moved model leaves, the prior's included [noise variances]."""
        return self.projection.energy

    @property
    def covariance(self) -> Array:
        """Covariance of all parameters for white noise of the modelled size, (p, p)."""
        return self.spread @ self.spread.T

    @property
    def free_parameters(self) -> Array:
        """Θ as the data alone have it, (p,)."""
        return self.model.parameters + self.projection.step[: self.model.structure.size]

    @property
    def free_covariance(self) -> Array:
        """Covariance of all parameters as the data alone have it, (p, p)."""
        return self.projection.spread @ self.projection.spread.T

    def inflation(self) -> float:
        """Residual energy per degree of freedom, at least 1: by this factor more is left than the modelled noise."""
        return max(1.0, self.energy / self.projection.freedom)


class Fitter:
    """Fits extended models to the same observations, linear in all parameters about where they are."""

    def __init__(self, observations: Observations) -> None:
        self.observations = observations
        self._white = WhiteColumns(observations)

    def projected(self, model: ExtendedModel) -> Fit:
        """The linear step at a model as it is, without moving it."""
        residual, noise = self._white.residual(model), self.observations.noise
        rows = sum(own.share * len(row) for own, row in zip(noise, residual, strict=True))
        projection = project(self._white.all(model), residual, model.size, model.prior())
        return Fit(model, replace(projection, independent=rows), projection.spread)

    def white_residual(self, model: ExtendedModel) -> list[Array]:
        """Whitened residual of a model as it is, (R_j,) a joint."""
        return self._white.residual(model)

    def columns(self, model: ExtendedModel) -> list[JointColumns]:
        """Whitened columns of all parameters of a model, one entry a joint."""
        return self._white.all(model)
