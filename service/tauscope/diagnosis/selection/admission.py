"""Whether an effect that was fitted may enter a model: significant, large enough, no larger than what was measured."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.screening.screen import Candidate, Screen
from tauscope.diagnosis.selection.block_scores import score_inflation
from tauscope.diagnosis.selection.choice import Choice, Option

LEVEL = 0.01
"""Family-wise chance of naming anything where nothing is missing."""

SMALLEST_SHARE = 0.01
"""Share of the residual's energy at the joints it touches that an effect explains at least, where the noise is not
known from repetitions."""

MORE_THAN_SCREENED = 3.0
"""Factor by which a fit of everything may make of an effect more than the best shape of its grid explains."""

SHARE_OF_LARGEST = 0.01
"""…and the share of what the largest effect explained: columns that are a little off leave as much."""

DETERMINED = 3.5
"""Standard errors, of the joint covariance with shapes and all parameters, that coefficients differ from zero."""

GUESSED = 0.01
"""Power of the noise, relative to what a saturated fit makes of it, that a better fit may find."""


class Admission:
    """What is asked of an effect on given observations."""

    def __init__(self, screen: Screen, *, pure_error: bool, looked_at_before: int = 0) -> None:
        self.screen = screen
        self.pure_error = pure_error
        self._looked_at_before = looked_at_before

    @property
    def level(self) -> float:
        """Chance of a false name that each form is given."""
        return LEVEL / max(self._looked_at_before + len(self.screen.effects), 1)

    def inflation(self, fit: Fit) -> float:
        """By how much the residual exceeds the modelled noise; where nothing repeats, the residual itself is right."""
        return fit.inflation(at_least=1.0 if self.pure_error else GUESSED)

    def p_value(self, option: Option, fit: Fit, *, blocks: bool) -> float:
        """Chance of the gain; without pure error its variance is taken from blocks of a second where that is larger.

        A further order of what was found before needs no such care: the orders still missing are what the blocks see.
        """
        candidate = replace(option.candidate, gain=max(option.gain, 0.0))
        inflation = self._inflation_there(option)
        plain = candidate.p_value(inflation, refined=True, freedom=self._freedom(option))
        if self.pure_error or not blocks:
            return plain
        ratio, pieces = score_inflation(option.fit.model.terms[-1], fit, option.fit, self.screen)
        if ratio <= inflation or pieces <= candidate.count + 2:
            return plain
        tail = float(stats.f.sf(candidate.gain / ratio / candidate.count, candidate.count, pieces - candidate.count))
        return max(plain, min(1.0, candidate.shapes_tried * tail))

    def _freedom(self, option: Option) -> float:
        """Rows of the joints that an effect touches, less their part of the parameters: they say how large noise is."""
        if self.pure_error:
            return np.inf
        residual, noise = option.fit.projection.residual, self.screen.observations.noise
        rows = [own.share * len(row) for own, row in zip(noise, residual, strict=True)]
        touched = option.candidate.effect.touched(len(rows))
        return max(1.0, sum(rows[j] for j in touched) * option.fit.projection.freedom / sum(rows))

    def _inflation_there(self, option: Option) -> float:
        """The inflation; where nothing repeats, that of the joints that an effect touches if theirs is larger.

        Noise was told with all rows alike, those near reversals included that weigh less in the fit: by how much it is
        less for that differs from joint to joint.
        """
        everywhere = self.inflation(option.fit)
        if self.pure_error:
            return everywhere
        residual = option.fit.projection.residual
        there = sum(float(residual[j] @ residual[j]) for j in option.candidate.effect.touched(len(residual)))
        return max(everywhere, there / self._freedom(option))

    def determined(self, fit: Fit, fitter: Fitter) -> bool:
        """Whether the last term's coefficients differ from zero with everything else open, its own shapes included.

        cᵀ C⁻¹ c, C of the joint covariance: a shape that the data leave open makes a gain out of other columns' errors.
        """
        place, count = fit.model.term_places()[-1], len(fit.model.terms[-1].coefficients)
        own = slice(place.start, place.start + count)
        coefficients = fit.model.terms[-1].coefficients
        covariance = fitter.covariance(fit)[own, own] * self.inflation(fit)
        return float(coefficients @ np.linalg.pinv(covariance, hermitian=True) @ coefficients) > DETERMINED**2

    def large_enough(self, option: Option, fit: Fit, choices: Sequence[Choice], *, known: bool) -> bool:
        """Whether it explains a worthwhile share of what is left at its joints, and of what the largest effect did."""
        if self.pure_error:
            return True
        largest = max((choice.options[0].gain for choice in choices), default=0.0)
        if not known and option.gain < SHARE_OF_LARGEST * largest:
            return False
        return option.gain > self._smallest_gain(option.candidate, fit)

    def may_be_large_enough(self, candidate: Candidate, fit: Fit) -> bool:
        """Whether it may explain a worthwhile share of what is left at its joints, once everything is fitted anew."""
        return self.pure_error or MORE_THAN_SCREENED * candidate.gain > self._smallest_gain(candidate, fit)

    def _smallest_gain(self, candidate: Candidate, fit: Fit) -> float:
        """A worthwhile share of what is left at the joints that an effect touches [noise variances]."""
        touched = candidate.effect.touched(len(fit.projection.residual))
        return SMALLEST_SHARE * sum(float(fit.projection.residual[j] @ fit.projection.residual[j]) for j in touched)
