"""An effect with its values, as a model has it."""

from dataclasses import dataclass

from tauscope.effects import Effect
from tauscope.recording.recording import Array

# Step of a shape parameter for its derivative, relative to its bounds or, where logarithmic, to itself.
DIFFERENCE = 1e-3
Place = tuple[str, int | None]  # id of an effect, and index of its joint; None for an effect of the whole arm


@dataclass(frozen=True, eq=False)
class Term:
    """An effect in the model."""

    effect: Effect
    shape: Array  # (k,), values of its shape parameters
    coefficients: Array  # (c,), values of its coefficients

    @property
    def free_shapes(self) -> list[int]:
        """Places of the shape parameters that are estimated, not merely chosen."""
        return [place for place in range(len(self.shape)) if self.effect.is_free(place)]

    @property
    def place(self) -> Place:
        """Which effect where."""
        return self.effect.id, self.effect.joint

    def is_possible(self, k_v: float | None) -> bool:
        """Whether an effect can have these coefficients and this shape, beside its joint's `k_v` if it has one."""
        signs = zip(self.effect.coefficients, self.coefficients, strict=True)
        possible = all(
            each.smallest <= abs(value) <= each.largest and (value >= 0.0 or not each.positive) for each, value in signs
        )
        return possible and self.effect.is_possible(self.shape, k_v)

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
