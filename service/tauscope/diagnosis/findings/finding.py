"""What was found, each finding beside all others: how much it explains, and what the model without it leaves."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.findings.elsewhere import Elsewhere
from tauscope.diagnosis.findings.kind_spread import kinds_elsewhere
from tauscope.diagnosis.findings.order_spread import orders_elsewhere
from tauscope.diagnosis.findings.stand_in import certainty_as_law
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.held_out_change import HeldOutChange, sum_stretches
from tauscope.diagnosis.model.residual import raw_squares
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.model.torque_scale import covariance_on_the_arm, scaled_back
from tauscope.diagnosis.screening.screen import Screen
from tauscope.diagnosis.selection.choice import Option, Selection
from tauscope.diagnosis.selection.confirmation import HeldOut
from tauscope.diagnosis.selection.equivalence import doubt, probability_among
from tauscope.diagnosis.selection.interleaved import interleaved_confirmation
from tauscope.diagnosis.selection.shape_error import groups_of, standings
from tauscope.effects import Effect, TimeLocalEffect
from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class FitSizes:
    """Rms of the torque residual at the recorded rate, no filter.

    train : (n,) float64
        on the recordings that the model was made from [Nm or N]
    held_out : (n,) float64 or None
        on recordings that were not used
    stretches : (n, S) float64 or None
        squared errors there, summed over stretches of motion [Nm² or N²]
    """

    train: Array
    held_out: Array | None
    stretches: Array | None = None


@dataclass(frozen=True, eq=False)
class Finding:
    """Effects of one kind at one place: one term, or several orders of a periodic torque.

    covariances : tuple of (k, k) float64
        of each term's coefficients and shapes, in the arm's own torque (`model.torque_scale`)
    gain : float
        what they take off the residual's energy beside all other findings [noise variances]
    confirmed : bool or None
        by motion that was not used; None where there was none. What is refuted is tentative
    """

    terms: tuple[Term, ...]
    covariances: tuple[Array, ...]
    gain: float
    probability: float
    before: FitSizes
    after: FitSizes
    alternatives: tuple[Option, ...] = ()
    confirmed: bool | None = None
    in_model: bool = True
    behind: Effect | None = None
    as_law: float = 1.0
    elsewhere: tuple[Elsewhere, ...] = ()

    @property
    def place(self) -> tuple[str, int | None]:
        """Effect id and joint index."""
        effect = self.terms[0].effect
        return effect.id, effect.joint

    @property
    def held_out_change(self) -> HeldOutChange | None:
        """What it changes on motion that was not used; None where there was none."""
        return change_between(self.before, self.after)


def change_between(before: FitSizes, after: FitSizes) -> HeldOutChange | None:
    """What a second model predicts better than a first; None without held-out recordings."""
    if before.stretches is None or after.stretches is None:
        return None
    return HeldOutChange.between(before.stretches, after.stretches)


def is_confirmed(term: Term, before: FitSizes, after: FitSizes, *, seen_again: bool | None) -> bool | None:
    """Whether held-out motion confirms an effect; None without held-out recordings.

    What belongs to instants of the training recordings acts on no held-out motion: there it only must do no harm.

    Parameters
    ----------
    seen_again : bool or None
        what a test of its own says
    """
    change = change_between(before, after)
    if change is None or seen_again is False:
        return seen_again
    if not term.effect.recurs(term.shape):
        return not change.harms
    return change.confirms(term.effect.touched(len(change.relative)))


def sizes(model: ExtendedModel, fitter: Fitter, held_out: HeldOut | None) -> FitSizes:
    """Raw residuals of a model on training and held-out recordings."""
    squares, samples = raw_squares(model, fitter.observations)
    train = np.sqrt(squares.sum(axis=1) / np.maximum(samples, 1.0))
    if held_out is None:
        return FitSizes(train, None)
    squares, samples = raw_squares(model, held_out.observations)
    return FitSizes(train, np.sqrt(squares.sum(axis=1) / np.maximum(samples, 1.0)), sum_stretches(squares))


def selected_findings(
    selection: Selection,
    screen: Screen,
    fitter: Fitter,
    held_out: HeldOut | None,
    left: LackOfFit,
    inflation: float,
) -> tuple[Finding, ...]:
    """Terms of one effect at one place together, each compared with the model without it."""
    fit = selection.fit
    covariance = fitter.covariance(fit) * inflation
    groups = groups_of(fit.model)
    after = sizes(fit.model, fitter, held_out)
    all_without = [fitter.without(fit, places) for places in groups.values()]
    own = standings(selection.nominal, fit, all_without, fitter, inflation)
    found = []
    for places, without, standing in zip(groups.values(), all_without, own, strict=True):
        terms = tuple(fit.model.terms[place] for place in places)
        choices = [selection.choices[place] for place in places]
        chosen, *rivals = choices[0].options
        alternatives = _likely(rivals, without, screen, held_out)
        as_law = certainty_as_law(terms[0].effect, selection.nominal, fit, without, left)
        covariances = tuple(_covariance_of(fit.model, place, covariance) for place in places)
        before = sizes(without.model, fitter, held_out)
        seen_again = any(choice.confirmation is not None for choice in choices) or None
        found.append(
            Finding(
                terms=terms,
                covariances=covariances,
                gain=without.energy - fit.energy,
                probability=standing.certainty * as_law * _share(chosen, alternatives, inflation),
                before=before,
                after=after,
                alternatives=alternatives,
                confirmed=is_confirmed(terms[0], before, after, seen_again=seen_again),
                behind=standing.behind,
                as_law=as_law,
                elsewhere=(
                    *_elsewhere(terms, covariances, fit.model, without, screen, inflation),
                    *kinds_elsewhere(choices[0], inflation),
                ),
            )
        )
    return in_order(found)


def _elsewhere(
    terms: Sequence[Term],
    covariances: Sequence[Array],
    model: ExtendedModel,
    without: Fit,
    screen: Screen,
    inflation: float,
) -> tuple[Elsewhere, ...]:
    """Other orders of a finding of one wave, in the arm's own torque."""
    if len(terms) > 1:
        return ()
    error = float(np.sqrt(max(covariances[0][-1, -1], 0.0)))
    found = orders_elsewhere(terms[0], error, without, screen, inflation)
    return tuple(replace(each, term=scaled_back(model, each.term)) for each in found)


def _share(chosen: Option, alternatives: Sequence[Option], inflation: float) -> float:
    """Chance that it is the chosen one among those that explain nearly as much."""
    doubts = [doubt(chosen, each, inflation) for each in alternatives]
    return probability_among(chosen.score, [each.score for each in alternatives], doubts)


def _likely(options: Sequence[Option], without: Fit, screen: Screen, held_out: HeldOut | None) -> tuple[Option, ...]:
    """The options less those windows that do not hold within themselves: one can be found on anything."""
    return tuple(
        option
        for option in options
        if not isinstance(option.candidate.effect, TimeLocalEffect)
        or interleaved_confirmation(option.fit.model.terms[-1], without, option.fit, screen, held_out).confirmed(
            cautious=True
        )
    )


def in_order(found: Sequence[Finding]) -> tuple[Finding, ...]:
    """Findings, most explained energy first."""
    return tuple(sorted(found, key=lambda each: -each.gain))


def without_nominal(fit: Fit, place: int, fitter: Fitter) -> Fit:
    """The model fitted anew with one of its nominal parameters held at zero."""
    parameters = fit.model.parameters.copy()
    parameters[place] = 0.0
    return fitter.fit(replace(fit.model, parameters=parameters, held=(*fit.model.held, place)))


def _covariance_of(model: ExtendedModel, place: int, covariance: Array) -> Array:
    """Covariance of a term's coefficients and all its shapes; shapes that were only chosen have none."""
    term = model.terms[place]
    count = len(term.coefficients)
    places = [*range(count), *(count + place for place in term.free_shapes)]
    whole = np.zeros((count + len(term.shape), count + len(term.shape)))
    whole[np.ix_(places, places)] = covariance_on_the_arm(model, place, covariance)
    return whole
