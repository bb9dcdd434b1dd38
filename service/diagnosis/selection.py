"""Forward selection of effects, each at its own optimum with everything else fitted anew, and a backward pass."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from service.diagnosis.block_scores import score_inflation
from service.diagnosis.catalogue import TimeLocalEffect
from service.diagnosis.choice import Choice, Option, Place, Selection, distinct, is_physical, place_of
from service.diagnosis.confirmation import Confirmation, HeldOut
from service.diagnosis.fit import Fit, Fitter
from service.diagnosis.interleaved import interleaved_confirmation
from service.diagnosis.model import ExtendedModel, Term, with_terms
from service.diagnosis.proxies import proxies
from service.diagnosis.refinement import refined
from service.diagnosis.screening import Candidate, Screen, model_signals

LEVEL = 0.01
"""Family-wise chance of naming anything where nothing is missing."""

MOST_EFFECTS = 4
"""Different effects in one model."""

UNCONFIRMED = 0.1
"""Share of the level that is left to effects that no other motion can confirm."""

UNCOUNTED = ("rotor_inertia",)
"""Effects beside which others are looked for without limit: every geared joint may have one."""

MOST_REPEATS = 12
"""Terms of one effect that comes in several orders."""

WORTH_REFINING = 0.6
"""Share of the best gain above which a form's shape is refined."""

MOST_FITTED = 8
"""Forms that are fitted with all parameters free before the best is chosen."""

CLOSE = 40.0
"""Score below the best, in noise variances, within which a form is fitted with all parameters free."""

EQUIVALENT = 10.0
"""Score below the best within which data do not tell two effects apart."""

SMALLEST_SHARE = 0.01
"""Share of the residual's energy at the joints it touches that an effect explains at least, where the noise is not
known from repetitions."""


SHARE_OF_LARGEST = 0.01
"""…and the share of what the largest effect explained: columns that are a little off leave as much."""

LIKELY = 0.02
"""Chance, from blocks of a second, below which an effect may still be named where held-out recordings confirm it by
`CLEARLY_PREDICTED` standard errors: few blocks tell little, and the two tests are independent."""

CLEARLY_PREDICTED = 2.5

GUESSED = 0.01
"""Power of the noise, relative to what a saturated fit makes of it, that a better fit may find."""

MOST_TERMS = 24
MOST_REJECTED = 12


class Selector:
    """Selects effects on given observations.

    Parameters
    ----------
    screen : Screen
        of the training recordings
    fitter : Fitter
        of the same
    held_out : HeldOut or None
        what findings are confirmed by
    pure_error : bool
        whether the noise is known from repetitions
    """

    def __init__(self, screen: Screen, fitter: Fitter, held_out: HeldOut | None, *, pure_error: bool) -> None:
        self.screen = screen
        self.fitter = fitter
        self.held_out = held_out
        self.pure_error = pure_error

    def select(self, model: ExtendedModel, beforehand: Sequence[Term], progress: Callable[[str], None]) -> Selection:
        """Add effects as long as one is significant and confirmed.

        Parameters
        ----------
        model : ExtendedModel
            the nominal model
        beforehand : sequence of Term
            effects that others have found; those that count here too are there before any other is looked for
        progress : callable
            told what was found
        """
        nominal = fit = self.fitter.fit(model)
        choices: list[Choice] = []
        for term in beforehand:
            option = self._option(fit, term)
            p_value = self._robust_p_value(option, fit, blocks=False)
            confirmation = self._confirmation(fit, option)
            if p_value < self._level and (confirmation is None or confirmation.confirmed(cautious=not self.pure_error)):
                choices.append(Choice((option,), confirmation, 0.0))
                fit = option.fit
        rejected: list[Choice] = []
        while len(choices) < MOST_TERMS:
            choice = self._next(fit, choices, rejected)
            if choice is None:
                break
            choices.append(choice)
            fit = choice.options[0].fit
            names = [joint.name for joint in model.structure.robot.joints]
            progress(f"found {choice.options[0].candidate.effect.name(names)}")
        fit, choices = self._without_superfluous(fit, choices)
        fit, choices = self._without_proxies(nominal, fit, choices)
        choices = [self._compared(fit, choices, place) for place in range(len(choices))]
        return Selection(nominal, fit, tuple(choices), tuple(rejected))

    def _next(self, fit: Fit, choices: Sequence[Choice], rejected: list[Choice]) -> Choice | None:
        """The best significant and confirmed option; what held-out recordings refuse is added to `rejected`."""
        refused = {place_of(choice.options[0].candidate) for choice in rejected}
        table = _Table(self, fit, [place_of(choice.options[0].candidate) for choice in choices], refused)
        while len(rejected) < MOST_REJECTED:
            choice = self._best(table, choices)
            if choice is None or choice.confirmation is None:
                return choice
            if choice.confirmation.confirmed(cautious=not self.pure_error):
                return choice
            rejected.append(choice)
            table.refuse(place_of(choice.options[0].candidate))
        return None

    def _best(self, table: "_Table", choices: Sequence[Choice]) -> Choice | None:
        """The best significant option, with those that explain nearly as much."""
        fit = table.fit
        level = self._level
        inflation = self._inflation(fit) if not self.pure_error else 1.0
        significant = [each for each in table.candidates if each.p_value(inflation) < level]
        if not significant:
            return None
        top = max(each.gain for each in significant)
        closest = [table.refined(each) for each in significant if each.gain > WORTH_REFINING * top]
        closest.sort(key=lambda each: -each.score)
        near = CLOSE * self._inflation(fit) + 0.1 * closest[0].gain
        fitted = [table.fitted(each) for each in closest[:MOST_FITTED] if each.score > closest[0].score - near]
        fitted = [each for each in fitted if is_physical(each, fit) and not self._outsized(each)]
        fitted.sort(key=lambda each: -each.score)
        for option in fitted:
            known = place_of(option.candidate) in [place_of(choice.options[0].candidate) for choice in choices]
            p_value = self._robust_p_value(option, fit, blocks=not known)
            if isinstance(option.candidate.effect, TimeLocalEffect):
                p_value = min(1.0, p_value / UNCONFIRMED)
            if p_value < (level if self.pure_error else LIKELY) and self._large_enough(
                option, fit, choices, known=known
            ):
                confirmation = self._confirmation(fit, option)
                if p_value >= level and (confirmation is None or confirmation.gain_z < CLEARLY_PREDICTED):
                    continue
                margin = EQUIVALENT * self._inflation(option.fit)
                alike = [each for each in fitted if option.score - margin < each.score <= option.score]
                options = distinct([option, *(each for each in alike if each is not option)])
                return Choice(options, confirmation, p_value / level)
        for each in closest:  # none of the largest is significant by the stricter measure: look below
            table.refuse(place_of(each))
        return self._best(table, choices)

    @property
    def _level(self) -> float:
        """Chance of a false name that each form is given."""
        return LEVEL / max(len(self.screen.effects), 1)

    def _inflation(self, fit: Fit) -> float:
        """By how much the residual exceeds the modelled noise; where nothing repeats, the residual itself is right."""
        return fit.inflation(at_least=1.0 if self.pure_error else GUESSED)

    def allowed(self, candidate: Candidate, chosen: Sequence[Place], refused: set[Place]) -> bool:
        """Whether a form may be added to a model.

        Parameters
        ----------
        candidate : Candidate
            the form
        chosen : sequence of (str, int or None)
            effects and places that the model has
        refused : set of (str, int or None)
            effects and places that were refused
        """
        place = place_of(candidate)
        if place in refused or candidate.gain <= 0.0:
            return False
        if place in chosen:
            return candidate.effect.repeats and chosen.count(place) < MOST_REPEATS
        others = {each for each in chosen if each[0] not in UNCOUNTED}
        return place[0] in UNCOUNTED or len(others) < MOST_EFFECTS

    def _option(self, fit: Fit, term: Term) -> Option:
        """A term that was not screened for, fitted."""
        signals = model_signals(fit.model, self.screen.observations)
        found = self.screen.at_shapes(term.effect, term.shape[None], fit, signals)
        candidate = Candidate(
            term.effect, term.shape, term.coefficients, 0.0, found.gram[0], True, 1.0, found.gram[0, 0, 0]
        )
        return self.fitted(candidate, fit)

    def _compared(self, fit: Fit, choices: Sequence[Choice], place: int) -> Choice:
        """A choice with its alternatives fitted anew beside all the others, those kept that explain nearly as much."""
        choice, terms = choices[place], list(fit.model.terms)
        effect = terms[place].effect
        if (
            effect.repeats
            and sum(place_of(other.options[0].candidate) == place_of(choice.options[0].candidate) for other in choices)
            > 1
        ):
            return replace(choice, options=choice.options[:1])
        without = self.fitter.fit(with_terms(fit.model, [*terms[:place], *terms[place + 1 :]]))
        own = replace(choice.options[0], fit=fit, gain=without.energy - fit.energy)
        others = [self.fitted(each.candidate, without) for each in choice.options[1:]]
        if len(choice.options) == 1 and choice.p_value == 0.0 and len(choices) <= MOST_EFFECTS:
            rest = [other for at, other in enumerate(choices) if at != place]
            table = _Table(self, without, [place_of(other.options[0].candidate) for other in rest], set())
            again = self._best(table, rest)
            found = [] if again is None else list(again.options)
            others = [each for each in found if place_of(each.candidate) != place_of(own.candidate)]
        margin = EQUIVALENT * self._inflation(fit)
        alike = [each for each in others if is_physical(each, without) and each.score > own.score - margin]
        return replace(choice, options=distinct([own, *sorted(alike, key=lambda each: -each.score)]))

    def fitted(self, candidate: Candidate, fit: Fit) -> Option:
        """A form added to a model, with everything fitted anew.

        Parameters
        ----------
        candidate : Candidate
            the form with its shape
        fit : Fit
            the model without it
        """
        term = Term(candidate.effect, candidate.shape, candidate.coefficients)
        start = with_terms(fit.model, [*fit.model.terms, term])
        stepped = replace(start, parameters=fit.model.parameters + fit.projection.step[: fit.model.structure.size])
        found = self.fitter.fit(stepped)
        return Option(candidate, found, fit.energy - found.energy)

    def _robust_p_value(self, option: Option, fit: Fit, *, blocks: bool) -> float:
        """Chance of the gain; without pure error its variance is taken from blocks of a second where that is larger.

        A further order of what was found before needs no such care: the orders still missing are what the blocks see.
        """
        candidate = replace(option.candidate, gain=max(option.gain, 0.0))
        inflation = self._inflation(option.fit)
        plain = candidate.p_value(inflation, refined=True)
        if self.pure_error or not blocks:
            return plain
        ratio, pieces = score_inflation(option.fit.model.terms[-1], fit, option.fit, self.screen)
        if ratio <= inflation or pieces <= candidate.count + 2:
            return plain
        tail = float(stats.f.sf(candidate.gain / ratio / candidate.count, candidate.count, pieces - candidate.count))
        return max(plain, min(1.0, candidate.shapes_tried * tail))

    def _large_enough(self, option: Option, fit: Fit, choices: Sequence[Choice], *, known: bool) -> bool:
        """Whether it explains a worthwhile share of what is left at its joints, and of what the largest effect did."""
        if self.pure_error:
            return True
        largest = max((choice.options[0].gain for choice in choices), default=0.0)
        if not known and option.gain < SHARE_OF_LARGEST * largest:
            return False
        touched = option.candidate.effect.touched(len(fit.projection.residual))
        energy = sum(float(fit.projection.residual[j] @ fit.projection.residual[j]) for j in touched)
        return option.gain > SMALLEST_SHARE * energy

    def _outsized(self, option: Option) -> bool:
        """Whether the term's torque exceeds all that was measured at a joint: it then only cancels other columns."""
        observations, term = self.screen.observations, option.fit.model.terms[-1]
        touched = list(term.effect.touched(observations.robot.joint_count))
        own, measured = np.zeros(len(touched)), np.zeros(len(touched))
        for piece in observations:
            rows = option.fit.model.term_torque(term, option.fit.model.signals(piece))
            own += np.mean(rows**2, axis=tuple(range(1, rows.ndim))) * rows.shape[-1]
            measured += np.mean(piece.prepared.motion.torque[..., touched] ** 2, axis=(0, 1)) * rows.shape[-1]
        return bool((own > measured).any())

    def _confirmation(self, fit: Fit, option: Option) -> Confirmation | None:
        term = option.fit.model.terms[-1]
        if isinstance(term.effect, TimeLocalEffect):
            return interleaved_confirmation(term, fit, option.fit, self.screen, self.held_out)
        if self.held_out is None:
            return None
        return self.held_out.confirm(fit.model, option.fit.model, term)

    def _without_proxies(self, nominal: Fit, fit: Fit, choices: list[Choice]) -> tuple[Fit, list[Choice]]:
        """Drop what only stands in for an effect that the catalogue does not have."""
        rows = self.screen.observations
        dropped = proxies(nominal, fit, choices, rows, pure_error=self.pure_error)
        if not dropped:
            return fit, choices
        kept = [place for place in range(len(choices)) if place not in dropped]
        terms = [fit.model.terms[place] for place in kept]
        return self.fitter.fit(with_terms(fit.model, terms)), [choices[place] for place in kept]

    def _without_superfluous(self, fit: Fit, choices: list[Choice]) -> tuple[Fit, list[Choice]]:
        """Drop terms that the others have made superfluous, the weakest first."""
        while choices:
            gains = []
            for place in range(len(choices)):
                terms = [term for other, term in enumerate(fit.model.terms) if other != place]
                without = self.fitter.fit(with_terms(fit.model, terms))
                gains.append((without.energy - fit.energy, without))
            weakest = int(np.argmin([gain for gain, _ in gains]))
            candidate = choices[weakest].options[0].candidate
            level = self._level
            inflation = self._inflation(fit)
            if replace(candidate, gain=max(gains[weakest][0], 0.0)).p_value(inflation) < level:
                break
            fit = gains[weakest][1]
            choices = [choice for place, choice in enumerate(choices) if place != weakest]
        return fit, choices


class _Table:
    """All candidates beside one fitted model, refined and fitted where somebody asks."""

    def __init__(self, selector: Selector, fit: Fit, chosen: list[Place], refused: set[Place]) -> None:
        self.fit = fit
        self._selector = selector
        self._signals = model_signals(fit.model, selector.screen.observations)
        screened = selector.screen.candidates(fit)
        self.candidates = [each for each in screened if selector.allowed(each, chosen, refused)]
        self._refined: dict[int, Candidate] = {}
        self._fitted: dict[int, Option] = {}

    def refuse(self, place: Place) -> None:
        """Leave an effect at a place out from now on."""
        self.candidates = [each for each in self.candidates if place_of(each) != place]

    def refined(self, candidate: Candidate) -> Candidate:
        """The candidate at its best shape."""
        if id(candidate) not in self._refined:
            self._refined[id(candidate)] = refined(candidate, self.fit, self._selector.screen, self._signals)
        return self._refined[id(candidate)]

    def fitted(self, candidate: Candidate) -> Option:
        """The refined candidate fitted with everything else."""
        if id(candidate) not in self._fitted:
            self._fitted[id(candidate)] = self._selector.fitted(candidate, self.fit)
        return self._fitted[id(candidate)]
