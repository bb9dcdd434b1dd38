"""A second look in a wider band, taken where the first has found nothing.

What is fast, as a compliant gear, a delay or play, shows most where the first band ends. Wider, noise of the positions
would explain itself; so there the accelerations are those that the motion most likely had, given the torque. What
happens once, or changes over time, is slow, and is not looked for again; nor is what lies within friction's step, which
noise of the velocities blurs there, nor what the first band does not speak for at all. What is found counts where that
band's rows, which know less, say nothing else of its size.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from tauscope.diagnosis.findings.detectability import Detectable
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.verdict import Verdict
from tauscope.diagnosis.in_band import Progress, concluded, confirming_rows, selected, selector_on
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.model.likely_accelerations import with_likely_accelerations
from tauscope.diagnosis.model.nominal import setting_of
from tauscope.diagnosis.observations.band import wider_cutoff
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import model_signals
from tauscope.diagnosis.selection.choice import Place, Selection, place_of
from tauscope.effects import Effect, possible_effects
from tauscope.recording.conditioning import Conditioner

SPOKEN_FOR = 0.5
"""Chance of what an effect explains in the first band, below which it is looked for again. What s = 8 hid there and the
second band showed had 0.2 and less; every second effect that is not there has more than this."""

OTHER_SIZE = 1e-3
"""Chance below which the first band's rows speak of another size."""


def looked_again(
    first: Diagnosis, recordings: Sequence[Conditioner], held_out: Sequence[Conditioner], progress: Progress
) -> Diagnosis:
    """What a wider band shows where nothing was found and nothing seemed to be left; else the first diagnosis."""
    identification, model = first.identification, first.selection.nominal.model
    cutoff = wider_cutoff(recordings, identification, model.steepness, first.cutoff_hz)
    if cutoff is None or first.verdict is not Verdict.CONSISTENT:
        return first
    progress("look again in a wider band")
    base = identification.structure.base
    rows = Observations.prepare(recordings, first.robot, base, cutoff, model.steepness)
    unseen = confirming_rows(held_out, identification, cutoff, model.steepness)
    rows = _likely(rows, model, cutoff, first.fitter.observations)
    if unseen is not None and first.held_out is not None:
        unseen = _likely(unseen, model, cutoff, first.held_out.observations)
    setting = replace(setting_of(model, rows, recordings, cutoff), link_encoders=first.setting.link_encoders)
    spoken_for = _spoken_for(first)
    effects = [each for each in possible_effects(setting) if (each.id, each.joint) in spoken_for]
    selector = selector_on(rows, unseen, model, effects, looked_at_before=len(first.screen.effects))
    selection, selector = selected(selector, model, identification, setting, progress)
    if not selection.choices or not agrees(first, selection):
        return first
    second = concluded(identification, setting, selector, selection, cutoff)
    if not second.findings:
        known = {each.place for each in first.tentative}
        new = [each for each in second.tentative if each.place not in known]
        return replace(first, tentative=(*first.tentative, *new))
    return replace(second, detectable=_detectable(first, second))


def _likely(rows: Observations, model: ExtendedModel, cutoff_hz: float, measured: Observations) -> Observations:
    """Rows of most likely accelerations, whose residuals are stated by the motion as it was measured."""
    return replace(with_likely_accelerations(rows, model, cutoff_hz), as_measured=measured)


def _spoken_for(first: Diagnosis) -> set[Place]:
    """Effects and places of which the first band shows a trace at least, of those that a wider one shows better."""
    return {
        place_of(each)
        for each in first.screen.candidates(first.selection.nominal)
        if _shows_wider(each.effect) and each.p_value(first.inflation) < SPOKEN_FOR
    }


def _shows_wider(effect: Effect) -> bool:
    """Whether a wider band shows an effect better: it is as fast as the motion, and not within friction's step.

    The blurred step A(q̇ + n) stands in a bristle's column and, times friction, in what is left to explain: of 208 arms
    that lack nothing, with an encoder of 4096 or 6283 steps a turn or as much white noise, 5 were given bristles.
    """
    return effect.repeats_with_motion and not effect.within_step


def _detectable(first: Diagnosis, second: Diagnosis) -> tuple[Detectable, ...]:
    """What would have been seen: in the wider band where it was looked for there, else in the first."""
    wider = {(each.effect, each.joint): each for each in second.detectable}
    return tuple(wider.get((each.effect, each.joint), each) for each in first.detectable)


def agrees(first: Diagnosis, selection: Selection) -> bool:
    """Whether the first band's rows allow every term the size that was found, each beside all others.

    (ĉ - c)ᵀ G (ĉ - c) with G ĉ = g, the information and the scores of its columns there at the same shape.
    """
    terms = selection.fit.model.terms
    for place, term in enumerate(terms):
        beside = with_terms(first.selection.fit.model, [*terms[:place], *terms[place + 1 :]])
        fit = first.fitter.projected(beside)
        signals = model_signals(beside, first.fitter.observations)
        found = first.screen.at_shapes(term.effect, term.shape[None], fit, signals)
        information, scores = found.gram[0], found.target[0]
        off = np.linalg.pinv(information, hermitian=True) @ scores - term.coefficients
        distance = float(off @ information @ off) / first.inflation
        if stats.chi2.sf(distance, len(off)) < OTHER_SIZE:
            return False
    return True
