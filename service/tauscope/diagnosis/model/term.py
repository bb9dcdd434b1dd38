"""An effect with its values, as a model has it."""

from dataclasses import dataclass

from tauscope.effects import Effect
from tauscope.recording.recording import Array

DIFFERENCE = 1e-3
"""Step of a shape parameter for its derivative, relative to its bounds or, where logarithmic, to itself."""


@dataclass(frozen=True, eq=False)
class Term:
    """An effect in the model.

    shape : (k,) float64
        values of its shape parameters
    coefficients : (c,) float64
        values of its coefficients
    """

    effect: Effect
    shape: Array
    coefficients: Array
    displaced: tuple[int, ...] = ()

    @property
    def free_shapes(self) -> list[int]:
        """Places of the shape parameters that are estimated, not merely chosen."""
        return [place for place in range(len(self.shape)) if self.effect.is_free(place)]

    @property
    def size(self) -> int:
        """Number of its parameters: coefficients, then free shapes."""
        return len(self.coefficients) + len(self.free_shapes)


def shape_step(term: Term, place: int) -> float:
    """Step of a shape parameter for its derivative."""
    effect = term.effect
    if effect.shapes[place].logarithmic:
        return DIFFERENCE * abs(float(term.shape[place]))
    return DIFFERENCE * 0.1 * float(effect.upper[place] - effect.lower[place]) + 1e-12
