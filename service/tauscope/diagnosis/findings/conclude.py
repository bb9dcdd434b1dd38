"""From the most probable hypothesis to a diagnosis: findings, place of the mismatch, tests of what is left."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.findings.constancy import constancy
from tauscope.diagnosis.findings.detectability import Detectable, detectable, detectable_parameters, visibilities
from tauscope.diagnosis.findings.diagnosed import Diagnosis, Selection, Unseen
from tauscope.diagnosis.findings.finding import Finding, FitSizes, equivalent, in_order
from tauscope.diagnosis.findings.formula_error import doubt_formulas
from tauscope.diagnosis.findings.location import locate
from tauscope.diagnosis.findings.plain import states_friction
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import without_spilled
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import delivered_model
from tauscope.diagnosis.model.term import Place
from tauscope.diagnosis.model.torque_scale import covariance_on_the_arm
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.search.found import Step
from tauscope.diagnosis.search.from_recordings import Searched, measure_lack, rows_under, weigh
from tauscope.diagnosis.search.gates import NAMED
from tauscope.diagnosis.search.hypothesis import Hypothesis
from tauscope.effects.payload import Payload
from tauscope.effects.plain_terms import TorqueOffset
from tauscope.identification import Identification
from tauscope.recording.recording import Array

LEVEL = 0.01  # chance that anything is named where nothing is missing, for limits of detection


def conclude(identification: Identification, searched: Searched) -> Diagnosis:
    """All that a search comes to."""
    nominal, final = searched.found.nominal, searched.found.hypothesis
    rows = rows_under(final, searched.rows, pure_error=searched.pure_error)
    fitter, held_out = Fitter(rows), searched.unseen
    unseen = None if held_out is None else Unseen(weigh(held_out.with_noise(rows.noise), final))
    before, after = _fit(nominal, fitter), _fit(final, fitter)
    if not final.model.terms:  # the best of possible bodies is the one that the identification delivers
        before = after = replace(fitter.projected(delivered_model(identification)), spread=after.spread)
    selection = Selection(before, after)
    misfit_before, misfit_after = (
        measure_lack(fit, at, rows, pure_error=searched.pure_error) for fit, at in ((before, nominal), (after, final))
    )
    inflation = 1.0 if searched.pure_error else after.inflation()
    level = LEVEL / max(len(searched.effects), 1)
    sizes = FitSizes.of(after.model, rows, _rows(unseen))
    findings = _findings(searched, selection, fitter, unseen, sizes)
    return Diagnosis(
        identification=identification,
        setting=searched.setting,
        selection=selection,
        findings=findings,
        tentative=_tentative(searched.found.steps, {each.place for each in findings}, fitter, unseen),
        mismatch=locate(before, after, rows, misfit_after.significant),
        misfit_before=without_spilled(misfit_before, before, fitter, pure_error=searched.pure_error),
        misfit_after=misfit_after,
        constancy=constancy(fitter, after, None if unseen is None else unseen.fitter, inflation),
        detectable=(
            *detectable(visibilities(before, rows, searched.effects), level, inflation),
            *_detectable_constants(identification, after, level, inflation),
            Detectable(Payload.id, None, None, Payload.coefficients[0].unit, False),  # it is one with the last link
        ),
        before=FitSizes.of(before.model, rows, _rows(unseen)),
        after=sizes,
        noise_std=identification.residuals.noise_std,
        pure_error=searched.pure_error,
        level=level,
        cutoff_hz=searched.cutoff_hz,
        fitter=fitter,
        held_out=unseen,
    )


def _rows(unseen: Unseen | None) -> Observations | None:
    return None if unseen is None else unseen.observations


def _fit(at: Hypothesis, fitter: Fitter) -> Fit:
    """A hypothesis beside its rows; its parameters are as uncertain as its posterior says."""
    return replace(fitter.projected(at.model), spread=at.posterior.spread)


def _findings(
    searched: Searched, selection: Selection, fitter: Fitter, unseen: Unseen | None, after: FitSizes
) -> tuple[Finding, ...]:
    """Every effect of the final hypothesis beside all others."""
    model, covariance = selection.fit.model, selection.fit.covariance
    found = []
    for weighed in searched.found.weighed:
        terms = tuple(model.terms[place] for place in weighed.places)
        without = fitter.projected(weighed.without.model)
        found.append(
            Finding(
                terms=terms,
                covariances=tuple(_covariance(model, place, covariance) for place in weighed.places),
                gain=without.energy - selection.fit.energy,
                probability=weighed.probability,
                before=FitSizes.of(weighed.without.model, fitter.observations, _rows(unseen)),
                after=after,
                alternatives=equivalent(weighed.log_odds, weighed.rivals),
                confirmed=None if unseen is None else True,
            )
        )
    sites = len({(each.id, each.joint) for each in searched.effects})
    return in_order(doubt_formulas(found, sites))


def _tentative(steps: Sequence[Step], found: set[Place], fitter: Fitter, unseen: Unseen | None) -> tuple[Finding, ...]:
    """Effects that training shows and held-out motion does not confirm, each as it was tried last.

    What both together refute as surely as something is named is not worth a word.
    """
    refuted = {step.place: step for step in steps if not step.is_confirmed and step.trained_log_odds > 0.0}
    told = {place: step for place, step in refuted.items() if step.log_odds > -NAMED and place not in found}
    tentative = []
    for step in told.values():
        before, after = (fitter.projected(model) for model in (step.before, step.after))
        sizes = (FitSizes.of(model, fitter.observations, _rows(unseen)) for model in (step.before, step.after))
        place = len(step.after.terms) - 1
        tentative.append(
            Finding(
                terms=(step.after.terms[place],),
                covariances=(_covariance(step.after, place, step.covariance),),
                gain=before.energy - after.energy,
                probability=step.probability,
                before=next(sizes),
                after=next(sizes),
                confirmed=False,
            )
        )
    return in_order(tentative)


def _covariance(model: ExtendedModel, place: int, covariance: Array) -> Array:
    """Covariance of a term's coefficients and all its shapes; shapes that were only chosen have none."""
    term = model.terms[place]
    count = len(term.coefficients)
    places = [*range(count), *(count + place for place in term.free_shapes)]
    whole = np.zeros((count + len(term.shape), count + len(term.shape)))
    whole[np.ix_(places, places)] = covariance_on_the_arm(model, place, covariance)
    return whole


def _detectable_constants(
    identification: Identification, fit: Fit, level: float, inflation: float
) -> tuple[Detectable, ...]:
    """Constants as far as one would be named: without stated friction the identified model has them."""
    found = detectable_parameters(fit, (TorqueOffset,), level, inflation)
    if states_friction(identification.robot):
        return found
    return tuple(replace(each, minimum=None, visible=False) for each in found)
