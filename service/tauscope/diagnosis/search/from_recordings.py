"""From an identification and its recordings to the effects that make them most probable."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.deflection.measured import MeasuredDeflection, direct_terms, measure_deflection
from tauscope.diagnosis.evidence.rows import EvidenceRows, weigh_rows
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit, lack_of_fit
from tauscope.diagnosis.fitting.regressor_noise import shared_errors
from tauscope.diagnosis.model.nominal import delivered_model, identified_rotors, setting_of
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.noise.floor import band_share, white_noise, with_pure_error
from tauscope.diagnosis.observations.band import diagnosis_cutoff
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.whitening import RowWeighting
from tauscope.diagnosis.search.found import Found
from tauscope.diagnosis.search.gates import Gates
from tauscope.diagnosis.search.held_out import HeldOut
from tauscope.diagnosis.search.hypothesis import Hypothesis, Laboratory, Prior
from tauscope.diagnosis.search.proposals import Proposer
from tauscope.diagnosis.search.search import Search
from tauscope.effects import ArmContext, Effect, farther_effects, possible_effects
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.identification import Identification
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Recording

KNOWN_SPREAD = 2.0  # standard deviation believed of a coefficient that is known beforehand, relative to its value


@dataclass(frozen=True, eq=False)
class Searched:
    """A search and what it rests on."""

    found: Found
    laboratory: Laboratory
    effects: tuple[Effect, ...]
    setting: ArmContext
    rows: Observations
    unseen: Observations | None  # held-out rows in the same band
    deflections: tuple[MeasuredDeflection, ...]  # of joints with an encoder on the link
    cutoff_hz: float  # of the band [Hz]
    pure_error: bool  # whether repetitions tell the noise


def search(
    identification: Identification,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    progress: Callable[[str], None] = lambda step: None,
) -> Searched:
    """The most probable effects beside what an identification delivers."""
    progress("prepare observations")
    robot, base = identification.robot, identification.structure.base
    surveyed = [Conditioner.survey(recording, robot) for recording in recordings]
    model = delivered_model(identification)
    cutoff = diagnosis_cutoff(surveyed, identification, model.steepness)
    bare = Observations.prepare(surveyed, robot, base, cutoff, model.steepness)
    deflections = tuple(measure_deflection(recordings, identification, model, cutoff))
    seen = frozenset(each.joint for each in deflections if not each.is_open)
    setting = replace(setting_of(model, bare, surveyed, cutoff), link_encoders=seen)
    effects = tuple(possible_effects(setting))
    repeated = with_pure_error(bare, model)
    white = repeated or bare.with_noise(white_noise(bare, model, band_share(bare)))
    rows = EvidenceRows.prepare(white, model)
    progress("compare effects")
    laboratory = Laboratory(rows, Prior.of(identification, model), repeated is not None)
    start = laboratory.start(model)
    laboratory = replace(laboratory, rows=rows.under(start.model, start.scales))
    known = [*_rotors(identification, effects), *(each.term for each in direct_terms(deflections, setting))]
    nominal = _add_known(laboratory.start(model), laboratory, known)
    unseen = None
    if held_out:
        others = [Conditioner.survey(recording, robot) for recording in held_out]
        unseen = Observations.prepare(others, robot, base, cutoff, model.steepness).apart()
    confirming = None if unseen is None else HeldOut(unseen.with_noise(white_noise(unseen, model)))
    farther = tuple(farther_effects(setting))
    near, far = Proposer(laboratory, effects), Proposer(laboratory, [*effects, *farther])
    search_near = Search(Gates(nominal, laboratory, near, confirming), farther)
    found = search_near.run()
    named = any(not term.effect.is_expected for term in found.hypothesis.model.terms)
    if not named and is_left(found.hypothesis, white, pure_error=repeated is not None):
        progress("look farther")
        found = Search(Gates(nominal, laboratory, far, confirming)).run(found)
    return Searched(found, laboratory, effects, setting, white, unseen, deflections, cutoff, repeated is not None)


def _rotors(identification: Identification, effects: Sequence[Effect]) -> list[Term]:
    """Rotors that the identification found: every geared joint has one."""
    of_joint = {effect.joint: effect for effect in effects if isinstance(effect, RotorInertia)}
    rotors = identified_rotors(identification)
    return [Term(of_joint[joint], np.zeros(0), np.array([rotors[joint]])) for joint in rotors if joint in of_joint]


def _add_known(nominal: Hypothesis, laboratory: Laboratory, known: Sequence[Term]) -> Hypothesis:
    """The nominal model with effects that are known beforehand, each in the shape of its grid that fits best."""
    for term in known:
        size = KNOWN_SPREAD * np.abs(term.coefficients)
        shapes = term.effect.grid if len(term.shape) else term.shape[None]
        tried = [laboratory.with_term(nominal, replace(term, shape=shape), size) for shape in shapes]
        nominal = max(tried, key=lambda each: each.log_evidence)
    return laboratory.settle(nominal, range(len(nominal.scales)))


def is_left(at: Hypothesis, rows: Observations, *, pure_error: bool) -> bool:
    """Whether a hypothesis leaves more than noise at any joint."""
    rows = rows_under(at, rows, pure_error=pure_error)
    return any(measure_lack(Fitter(rows).projected(at.model), at, rows, pure_error=pure_error).significant)


def measure_lack(fit: Fit, at: Hypothesis, rows: Observations, *, pure_error: bool) -> LackOfFit:
    """Lack of fit at every joint; without repetitions, rows are as dependent as the hypothesis says."""
    return lack_of_fit(fit, rows, None if pure_error else at.dependence, pure_error=pure_error)


def rows_under(at: Hypothesis, rows: Observations, *, pure_error: bool) -> Observations:
    """Rows with the noise that a hypothesis finds, unless repetitions tell it, and as much as they tell."""
    if pure_error:
        return weigh(rows, at)
    pairs = zip(rows.noise, at.scales, strict=True)
    return weigh(rows.with_noise([own.times(scales.noise) for own, scales in pairs]), at)


def weigh(rows: Observations, at: Hypothesis) -> Observations:
    """Rows as much as they tell by a hypothesis' friction."""
    weightings = []
    for joint in range(len(rows.noise)):
        weights = weigh_rows(rows, at.model, joint)
        weightings.append(RowWeighting.of(weights, shared_errors(rows, at.model, joint, weights)))
    return rows.with_weightings(weightings)
