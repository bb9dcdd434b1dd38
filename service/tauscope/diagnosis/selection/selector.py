"""Forward selection of effects, each at its own optimum with everything else fitted anew, and a backward pass."""

from collections.abc import Callable, Sequence
from dataclasses import replace

from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit
from tauscope.diagnosis.fitting.spilled_misfit import without_spilled
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.screening.screen import Candidate, Screen, model_signals
from tauscope.diagnosis.selection.admission import Admission
from tauscope.diagnosis.selection.choice import (
    Choice,
    Option,
    Place,
    Selection,
    distinct,
    is_physical,
    outsized,
    place_of,
)
from tauscope.diagnosis.selection.confirmation import Confirmation, HeldOut
from tauscope.diagnosis.selection.equivalence import EQUIVALENT, FORMULA_ERROR, equivalents, with_rivals
from tauscope.diagnosis.selection.interleaved import interleaved_confirmation
from tauscope.diagnosis.selection.outside import where_held_out_shows
from tauscope.diagnosis.selection.position_bias import is_position_noise
from tauscope.diagnosis.selection.proxies import TELLING, endless, full, hopeless
from tauscope.diagnosis.selection.pruning import without_proxies, without_superfluous, without_weak_likenesses
from tauscope.diagnosis.selection.table import Table, fitted_option
from tauscope.effects import Effect, TimeLocalEffect, effect_class
from tauscope.effects.computation import side_by_side

MOST_EFFECTS = 4
"""Different effects in one model; what one joint does, the others may do as well."""

UNCONFIRMED = 0.1
"""Share of the level that is left to effects that no other motion can confirm."""

MOST_REPEATS = 12
"""Terms of one effect that comes in several orders."""

WORTH_REFINING = 0.6
"""Share of the best gain above which a form's shape is refined."""

MOST_FITTED = 8
"""Forms that are fitted with all parameters free before the best is chosen."""

FEW = 2
"""…the same where one more order of many is about to be chosen: its rivals are asked again beside it."""

CLOSE = 40.0
"""Score below the best, in noise variances, within which a form is fitted with all parameters free."""

LIKELY = 0.02
"""Chance, from blocks of a second, below which an effect may still be named where held-out recordings confirm it by
`CLEARLY_PREDICTED` standard errors: few blocks tell little, and the two tests are independent."""

CLEARLY_PREDICTED = 2.5

MOST_TERMS = 24
MOST_REJECTED = 12


class Selector:
    """Selects effects on given observations."""

    def __init__(
        self,
        screen: Screen,
        fitter: Fitter,
        held_out: HeldOut | None,
        *,
        pure_error: bool,
        looked_at_before: int = 0,
        wanted: Callable[[Effect], bool] = lambda effect: True,
        instead: bool = False,
    ) -> None:
        self.screen = screen
        self.fitter = fitter
        self.held_out = held_out
        self.pure_error = pure_error
        self.looked_at_before = looked_at_before
        self.wanted = wanted
        self.instead = instead
        self.admission = Admission(screen, pure_error=pure_error, looked_at_before=looked_at_before)

    def select(self, model: ExtendedModel, beforehand: Sequence[Term], progress: Callable[[str], None]) -> Selection:
        """Add effects as long as one is significant and confirmed."""
        nominal = fit = self.fitter.fit(model)
        choices: list[Choice] = []
        for term in beforehand:
            option = self._option(fit, term)
            p_value = self.admission.p_value(option, fit, blocks=False)
            confirmation = self.confirmation(fit, option)
            confirmed = confirmation is None or confirmation.confirmed(cautious=not self.pure_error)
            if p_value < self.admission.level and confirmed:
                choices.append(Choice((option,), confirmation, p_value, was_given=True))
                fit = option.fit
        fit, grown, rejected = self._grown(nominal, fit, choices, progress)
        choices = list(grown)
        if self.pure_error:
            fit, choices = without_weak_likenesses(nominal, fit, choices, self.fitter)
        fit, choices = without_superfluous(fit, choices, self.fitter, self.admission)
        dropped = [each for each in grown if each not in choices]
        choices = [with_rivals(each, dropped) for each in choices]
        fit, choices = without_proxies(nominal, fit, choices, self.fitter, self.admission)
        if not self._is_of_no_catalogue(fit, choices):  # there, what may stand in for what says nothing
            fit, choices = self._settled_without_superfluous(fit, choices)
        return Selection(nominal, fit, tuple(choices), tuple(rejected))

    def continued(self, selection: Selection, progress: Callable[[str], None]) -> Selection:
        """Add effects of this screen to what was selected with another."""
        fit, choices, rejected = self._grown(selection.nominal, selection.fit, list(selection.choices), progress)
        if len(choices) == len(selection.choices):
            return selection
        fit, choices = without_superfluous(fit, choices, self.fitter, self.admission)
        fit, choices = without_proxies(selection.nominal, fit, choices, self.fitter, self.admission)
        return Selection(selection.nominal, fit, tuple(choices), (*selection.rejected, *rejected))

    def _grown(
        self, nominal: Fit, fit: Fit, choices: list[Choice], progress: Callable[[str], None]
    ) -> tuple[Fit, list[Choice], list[Choice]]:
        """A model with one effect after the other, as long as one is significant and confirmed; what was refused."""
        names = [joint.name for joint in fit.model.structure.robot.joints]
        refused: list[Choice] = []
        rejected: list[Choice] = []
        while len(choices) < MOST_TERMS and not self._is_of_no_catalogue(fit, choices):
            choice = self._next(fit, choices, refused, self._spent(nominal, fit, choices))
            rejected += [each for each in refused if each not in rejected]
            if choice is None:
                break
            is_open = any(len(each.options) > 1 for each in choices)
            choices = [*choices, choice]
            fit = choice.options[0].fit
            if is_open:  # what has come may decide between them; else others come to explain what the wrong one leaves
                fit, choices = self._settled(fit, choices)
            refused = [each for each in refused if not _at_one_joint(each, choice)]
            progress(f"found {choice.options[0].candidate.effect.name(names)}")
        return fit, choices, rejected

    def _is_of_no_catalogue(self, fit: Fit, choices: Sequence[Choice]) -> bool:
        """Whether all that is left is at joints where as much was found as can be, or has spilled over from there."""
        crowded = full(choices) if self.pure_error else set()
        if not crowded:
            return False
        misfit = lack_of_fit(fit, self.screen.observations, pure_error=True)
        left = without_spilled(misfit, fit, self.fitter, pure_error=True).significant
        wrong = {joint for joint, told in enumerate(left) if told}
        return bool(wrong) and wrong <= crowded

    def _spent(self, nominal: Fit, fit: Fit, choices: Sequence[Choice]) -> set[Place]:
        """Effects of which no more orders are worth a look."""
        if not self.pure_error:
            return set()
        return hopeless(nominal, fit, choices, self.screen.observations, MOST_REPEATS) | endless(choices)

    def _next(self, fit: Fit, choices: Sequence[Choice], rejected: list[Choice], spent: set[Place]) -> Choice | None:
        """The best significant and confirmed option; what held-out recordings refuse is added to `rejected`."""
        refused = {_chosen(choice) for choice in rejected} | spent
        table, before = self._table(fit, choices, refused), len(rejected)
        while len(rejected) < MOST_REJECTED:
            choice = self._best(table, choices)
            if choice is None or choice.confirmation is None:
                return choice
            if choice.confirmation.confirmed(cautious=not self.pure_error, chance=choice.p_value):
                return with_rivals(choice, rejected[before:])
            rejected.append(choice)
            table.refuse(_chosen(choice), but=self._other_forms(table, choice.options[0]))
        return None

    def _other_forms(self, table: Table, refused: Option) -> list[Candidate]:
        """Forms of a refused effect that training hardly tells from it: the other side of a cable, another exponent."""
        others, doubt = _siblings(table, refused.candidate), EQUIVALENT * self.admission.inflation(refused.fit)
        near = [each for each in table.refined(others) if each.score > refused.score - CLOSE]
        fitted = zip(near, table.fitted(near), strict=True)
        alike = [each.effect for each, option in fitted if option.score > refused.score - doubt]
        return [each for each in others if each.effect in alike]

    def _best(self, table: Table, choices: Sequence[Choice]) -> Choice | None:
        """The best significant option, with those that explain nearly as much."""
        fit = table.fit
        level = self.admission.level
        inflation = self.admission.inflation(fit) if not self.pure_error else 1.0
        significant = [each for each in table.candidates if each.p_value(inflation) < level]
        significant = [each for each in significant if self.admission.may_be_large_enough(each, fit)]
        if not significant:
            return None
        top = max(each.gain for each in significant)
        closest = table.refined([each for each in significant if each.gain > WORTH_REFINING * top])
        closest.sort(key=lambda each: -each.score)
        near = CLOSE * self.admission.inflation(fit) + EQUIVALENT * FORMULA_ERROR * closest[0].gain
        is_routine = [_chosen(choice) for choice in choices].count(place_of(closest[0])) >= TELLING
        most = FEW if is_routine else MOST_FITTED
        tried = [each for each in closest[:most] if each.score > closest[0].score - near]
        fitted = table.fitted(tried)
        impossible = [each.candidate for each in fitted if not is_physical(each, fit, instead=self.instead)]
        fitted = [each for each in fitted if each.candidate not in impossible]
        fitted = [each for each in fitted if not outsized(each, self.screen.observations)]
        fitted = [each for each in fitted if not is_position_noise(each, fit, self.screen)]
        fitted.sort(key=lambda each: -each.score)
        for option in fitted:
            known = place_of(option.candidate) in [_chosen(choice) for choice in choices]
            p_value = self.admission.p_value(option, fit, blocks=not known)
            if isinstance(option.candidate.effect, TimeLocalEffect):
                p_value = min(1.0, p_value / UNCONFIRMED)
            if p_value < (level if self.pure_error else LIKELY) and self.admission.large_enough(
                option, fit, choices, known=known
            ):
                if not known and not self.pure_error and not self.admission.determined(option.fit, self.fitter):
                    continue
                below = [each for each in fitted if each.score <= option.score]
                chosen = where_held_out_shows(option, fit, self.fitter, self.held_out)
                confirmation = self.confirmation(fit, chosen)
                if p_value >= level and (confirmation is None or confirmation.gain_z < CLEARLY_PREDICTED):
                    continue
                alike = equivalents(chosen, below, fit, self.screen, self.admission.inflation(chosen.fit))
                return Choice(distinct([chosen, *alike]), confirmation, p_value / level)
        for each in tried:  # none of the largest is significant by the stricter measure: look below
            table.refuse(place_of(each), but=_without_shape(table, each) if each in impossible else ())
        return self._best(table, choices)

    def _table(self, fit: Fit, choices: Sequence[Choice], refused: set[Place]) -> Table:
        """What may be added to a model with some choices."""
        chosen = [_chosen(choice) for choice in choices]
        return Table(fit, self.screen, self.fitter, lambda each: self.allowed(each, chosen, refused))

    def allowed(self, effect: Effect, chosen: Sequence[Place], refused: set[Place]) -> bool:
        """Whether an effect may be added to a model.

        Parameters
        ----------
        chosen : sequence of (str, int or None)
            effects and places that the model has
        refused : set of (str, int or None)
            effects and places that were refused
        """
        place = effect.id, effect.joint
        if place in refused or not self.wanted(effect):
            return False
        if place in chosen:
            return effect.repeats and chosen.count(place) < MOST_REPEATS
        kinds = {name for name, _ in chosen if not effect_class(name).is_expected}
        return effect.is_expected or effect.id in kinds or len(kinds) < MOST_EFFECTS

    def _option(self, fit: Fit, term: Term) -> Option:
        """A term that was not screened for, fitted."""
        signals = model_signals(fit.model, self.screen.observations)
        found = self.screen.at_shapes(term.effect, term.shape[None], fit, signals)
        candidate = Candidate(
            term.effect, term.shape, term.coefficients, 0.0, found.gram[0], True, 1.0, found.gram[0, 0, 0]
        )
        return fitted_option(candidate, fit, self.fitter)

    def _settled_without_superfluous(self, fit: Fit, choices: list[Choice]) -> tuple[Fit, list[Choice]]:
        """The same with each choice settled, until none that took another's place has made a third superfluous."""
        for _ in range(MOST_EFFECTS):
            before, (fit, choices) = {_chosen(each) for each in choices}, self._settled(fit, list(choices))
            if {_chosen(each) for each in choices} == before:
                break
            count, (fit, choices) = len(choices), without_superfluous(fit, choices, self.fitter, self.admission)
            if len(choices) == count:
                break
        return fit, choices

    def _settled(self, fit: Fit, choices: list[Choice]) -> tuple[Fit, list[Choice]]:
        """Every choice with its alternatives beside all the others, in the place of one that has turned out better."""
        place = 0
        for _ in range(2 * len(choices)):
            if place == len(choices):
                break
            compared = self._compared(fit, choices, place)
            fit, choice = self._exchanged(fit, compared, place)
            if choice.options[0] is compared.options[0]:
                choices[place], place = choice, place + 1
            else:
                choices = [*choices[:place], *choices[place + 1 :], choice]
        return fit, choices

    def _exchanged(self, fit: Fit, compared: Choice, place: int) -> tuple[Fit, Choice]:
        """A choice with the best of its alternatives in front; one that held-out recordings refute is none."""
        own, kept = compared.options[0], compared.options
        better = sorted((each for each in kept if each.score > own.score), key=lambda each: -each.score)
        if not better:
            return fit, compared
        without = self.fitter.without(fit, [place])
        for option in better:
            confirmation = self.confirmation(without, option)
            if confirmation is None or confirmation.confirmed(cautious=not self.pure_error):
                return option.fit, Choice(distinct([option, *kept]), confirmation, compared.p_value)
            kept = tuple(each for each in kept if each is not option)
        return fit, replace(compared, options=kept)

    def _compared(self, fit: Fit, choices: Sequence[Choice], place: int) -> Choice:
        """A choice with its alternatives fitted anew beside all the others, those kept that explain nearly as much."""
        choice, terms = choices[place], list(fit.model.terms)
        effect = terms[place].effect
        if effect.repeats and sum(_chosen(other) == _chosen(choice) for other in choices) > 1:
            return replace(choice, options=choice.options[:1])
        without = self.fitter.without(fit, [place])
        own = replace(choice.options[0], fit=fit, gain=without.energy - fit.energy)
        rivals = [each.candidate for each in choice.options[1:]]
        others = side_by_side(lambda each: fitted_option(each, without, self.fitter), rivals)
        if self._may_have_changed(choices, place) and len(choices) <= MOST_EFFECTS:
            rest = [other for at, other in enumerate(choices) if at != place]
            again = self._best(self._table(without, rest, set()), rest)
            found = [] if again is None else list(again.options)
            others = [each for each in found if place_of(each.candidate) != place_of(own.candidate)]
        physical = [each for each in others if is_physical(each, without)]
        alike = equivalents(own, physical, without, self.screen, self.admission.inflation(fit))
        return replace(choice, options=distinct([own, *sorted(alike, key=lambda each: -each.score)]))

    def _may_have_changed(self, choices: Sequence[Choice], place: int) -> bool:
        """Whether a choice was made before something else at its joints, or without looking for others at all."""
        count = self.screen.observations.robot.joint_count
        own, *later = [set(choice.options[0].candidate.effect.touched(count)) for choice in choices[place:]]
        return choices[place].was_given or any(own & each for each in later)

    def confirmation(self, fit: Fit, option: Option) -> Confirmation | None:
        """What motion that was not used says of an option; None where there is none."""
        term = option.fit.model.terms[-1]
        if isinstance(term.effect, TimeLocalEffect):
            return interleaved_confirmation(term, fit, option.fit, self.screen, self.held_out)
        if self.held_out is None:
            return None
        return self.held_out.confirm(fit, option.fit, self.fitter)


def _chosen(choice: Choice) -> Place:
    """The effect that is in the model, and where."""
    return place_of(choice.options[0].candidate)


def _siblings(table: Table, candidate: Candidate) -> list[Candidate]:
    """Other forms of the same effect at the same place."""
    place = place_of(candidate)
    return [each for each in table.candidates if place_of(each) == place and each.effect != candidate.effect]


def _without_shape(table: Table, candidate: Candidate) -> list[Candidate]:
    """The plain form of an effect, beside one whose shape and size cannot belong together: it has no shape."""
    return [each for each in _siblings(table, candidate) if not each.effect.shapes]


def _at_one_joint(refused: Choice, found: Choice) -> bool:
    """Whether one effect was refused beside a model that another one, found since, has changed at its own joint.

    What belongs to the whole arm changes all joints a little, and is no reason to ask anew what motion has refuted.
    """
    (_, one), (_, other) = _chosen(refused), _chosen(found)
    return one is not None and one == other
