"""Whether a finding holds on motion that was not used: what it predicts there, and what it would be there."""

import math
import sys
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.prediction import log_likelihood
from tauscope.diagnosis.fitting.projection import moments
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.diagnosis.selection.blocks import add_block_sums
from tauscope.recording.recording import Array

CLEARLY_WORSE = -3.0
"""Standard errors of the gain below which a finding has spoilt the prediction."""

CLEARLY_BETTER = 1.0
"""…and above which it must lie where the noise is not known from repetitions, so that significance is less certain."""

BEYOND_DOUBT = 2.5
"""…and above which the prediction alone confirms it: these recordings may be too few to estimate it anew."""

SEEN_AGAIN = 1.64
"""Standard errors that a finding estimated on the held-out recordings alone must differ from zero, its sign kept."""

PLAINLY_SEEN = 6.0
"""Standard errors at which it is there beyond doubt, so that a prediction that is no better speaks of its size only."""

SAME_SIZE = 0.4
"""…as long as it is at least this part of what training says."""

SHOULD_BE_SEEN = 3.0
"""Standard errors at which the finding, if true, is expected there: below, estimated anew it says little; what it
predicts still has to be better than what is predicted without it."""

RIGHT = 1.1
"""Residual energy per row of a fit to the held-out recordings, up to which the model may be right: beyond, what
predictions err by is no uncertainty of parameters."""

TELLS_NOTHING = 1.0
"""…and below which the held-out motion does not even do that."""

UNLIKE = -1.0
"""Likeness below which what held-out recordings show is something else, however well it is predicted."""

LESS_LIKELY = -3.0
"""Logarithm of a likelihood ratio below which held-out recordings speak against a finding, whatever training says: with
it they, or what they show of it, are twenty times less likely. What is there and should show with E standard errors
falls below in Φ(-E/2 - 3/E) of all cases, one in 140 at most; below zero it would in one of four where E is 1.4."""

PREDICTED = 4.0
"""Energy of a joint's residual on held-out motion, noise variances a row, up to which that motion is predicted."""


@dataclass(frozen=True)
class Confirmation:
    """What held-out recordings say of a finding.

    gain : float
        what the finding takes off the predicted residual's energy there [noise variances]
    """

    gain: float
    gain_z: float
    expected_z: float
    seen_z: float
    favour: float

    def confirmed(self, *, cautious: bool, chance: float = 1.0) -> bool:
        """Whether the finding is there on motion that it was not made from, and does not spoil the prediction."""
        if self.gain_z <= CLEARLY_WORSE:
            return False
        if self.gain > 0.0 and self.gain_z > BEYOND_DOUBT:
            return True
        if self.expected_z < TELLS_NOTHING:
            return self.gain_z > CLEARLY_BETTER if cautious else self.favour > LESS_LIKELY
        if self.seen_z > max(PLAINLY_SEEN, SAME_SIZE * self.expected_z):
            return True
        if not cautious:
            least = max(LESS_LIKELY, math.log(max(chance, sys.float_info.min)))
            return self.favour > min(least, 0.0) and likeness(self.expected_z, self.seen_z) > min(least, UNLIKE)
        seen = self.expected_z < SHOULD_BE_SEEN or self.seen_z > SEEN_AGAIN
        return seen and self.gain > 0.0 and self.gain_z > CLEARLY_BETTER


def likeness(expected_z: float, seen_z: float) -> float:
    """Logarithm of how much likelier a size found anew is if it is what was expected than if it is zero: z E - E²/2."""
    return expected_z * seen_z - 0.5 * expected_z**2


class HeldOut:
    """Held-out recordings, with the noise of the training ones."""

    def __init__(self, observations: Observations) -> None:
        self.observations = observations
        self.fitter = Fitter(observations)
        self.screen = Screen(observations, ())

    def confirm(self, before: Fit, after: Fit, training: Fitter) -> Confirmation:
        """Compare predictions without and with a term."""
        gains = self.block_gains(before.model, after.model)
        spread = float(gains.std(ddof=1) * np.sqrt(len(gains))) if len(gains) > 1 else np.inf
        total = float(gains.sum())
        expected, seen, inflation = self._seen_again(before.model, after.model, after.model.terms[-1])
        if inflation > RIGHT:
            favour = 0.5 * total + likeness(expected, seen)
        else:
            favour = self._log_likelihood(after, training) - self._log_likelihood(before, training)
        return Confirmation(total, total / max(spread, np.finfo(float).tiny), expected, seen, favour)

    def _log_likelihood(self, fit: Fit, training: Fitter) -> float:
        return log_likelihood(fit.model, training.covariance(fit), self.fitter)

    def predicted_by(self, model: ExtendedModel) -> bool:
        """Whether a model leaves no joint much more than noise; otherwise the training motion was too poor."""
        return all(float(row @ row) <= PREDICTED * len(row) for row in self.fitter.white_residual(model))

    def block_gains(self, before: ExtendedModel, after: ExtendedModel) -> Array:
        """Decrease of the whitened residual's energy in blocks of `BLOCK_S`, (b,)."""
        gains: dict[tuple[int, int], float] = {}
        for joint, rows in enumerate(self._row_gains(before, after)):
            add_block_sums(gains, *self.observations.row_labels(joint), rows)
        return np.array(list(gains.values()))

    def joint_gains_z(self, before: ExtendedModel, after: ExtendedModel) -> Array:
        """The same decrease joint by joint, each in its own standard errors, (n,)."""
        found = []
        for joint, rows in enumerate(self._row_gains(before, after)):
            gains: dict[tuple[int, int], float] = {}
            add_block_sums(gains, *self.observations.row_labels(joint), rows)
            blocks = np.array(list(gains.values()))
            spread = float(blocks.std(ddof=1) * np.sqrt(len(blocks))) if len(blocks) > 1 else np.inf
            found.append(float(blocks.sum()) / max(spread, np.finfo(float).tiny))
        return np.array(found)

    def _row_gains(self, before: ExtendedModel, after: ExtendedModel) -> list[Array]:
        """Decrease of every whitened row's square, (R_j,) a joint."""
        rows = zip(self.fitter.white_residual(before), self.fitter.white_residual(after), strict=True)
        return [old**2 - new**2 for old, new in rows]

    def _seen_again(self, before: ExtendedModel, after: ExtendedModel, term: Term) -> tuple[float, float, float]:
        """The term along its training coefficients: expected and found, in standard errors of these recordings.

        And by how much the residual of a fit of their own exceeds the noise.
        """
        nominal = replace(before, structure=after.structure, parameters=after.parameters)
        fit = self.fitter.projected(nominal)
        white = self.screen.white_columns(term.effect, term.shape[None], model_signals(nominal, self.observations))
        found = moments(fit.projection, white)
        strength = float(np.sqrt(term.coefficients @ found.gram[0] @ term.coefficients))
        noise = float(np.sqrt(fit.inflation()))
        along = float(term.coefficients @ found.target[0]) / max(strength, np.finfo(float).tiny)
        return strength / noise, along / noise, noise**2
