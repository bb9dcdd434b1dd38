"""From a robot and recordings to what its model leaves out: the whole way, in the order of the steps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import ThreadpoolController

from service.diagnosis.band import diagnosis_cutoff
from service.diagnosis.catalogue import Setting, possible_effects
from service.diagnosis.catalogue.rotor_inertia import RotorInertia
from service.diagnosis.confirmation import HeldOut
from service.diagnosis.constancy import Constancy, constancy
from service.diagnosis.detectability import Detectable, detectable
from service.diagnosis.fit import Fit, Fitter
from service.diagnosis.lack_of_fit import LackOfFit, lack_of_fit
from service.diagnosis.location import JointMismatch, locate
from service.diagnosis.model import ExtendedModel, Term, raw_squares, with_terms
from service.diagnosis.noise_floor import with_noise
from service.diagnosis.nominal import identified_rotors, nominal_model, setting_of
from service.diagnosis.observations import Observations
from service.diagnosis.screening import Screen
from service.diagnosis.selection import LEVEL, Choice, Selection, Selector
from service.diagnosis.verdict import Evidence, Verdict, verdict
from service.identification import Identification, Options, identify
from service.recording.conditioning import Conditioner
from service.recording.recording import Array, Recording
from service.robot import Robot

Progress = Callable[[str], None]

DEFAULT = Options()
"""An identification as nobody asked otherwise."""


@dataclass(frozen=True, eq=False)
class FitSizes:
    """Rms of the torque residual at the recorded rate, no filter.

    train : (n,) float64
        on the recordings that the model was made from [Nm or N]
    held_out : (n,) float64 or None
        on recordings that were not used
    """

    train: Array
    held_out: Array | None


@dataclass(frozen=True, eq=False)
class Finding:
    """Effects of one kind at one place: one term, or several orders of a periodic torque.

    choices : tuple of Choice
        the steps that selected them
    terms : tuple of Term
        as in the final model
    covariances : tuple of (k, k) float64
        of each term's coefficients and shapes
    gain : float
        what they take off the residual's energy beside all other findings [noise variances]
    probability : float
        that it is this effect and not one of its equivalents
    before, after : FitSizes
        residuals of the model without it, and with all findings
    """

    choices: tuple[Choice, ...]
    terms: tuple[Term, ...]
    covariances: tuple[Array, ...]
    gain: float
    probability: float
    before: FitSizes
    after: FitSizes


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found.

    identification : Identification
        the nominal model
    setting : Setting
        the arm and the ranges of its motion
    verdict : Verdict
        as a whole
    selection : Selection
        nominal and final model, and what was tried
    findings : tuple of Finding
        most explained energy first
    mismatch : tuple of JointMismatch
        one a joint
    misfit_before, misfit_after : LackOfFit
        what nominal and final model leave
    constancy : Constancy
        of the final model's parameters
    detectable : tuple of Detectable
        one an effect and place
    before, after : FitSizes
        residuals of nominal and final model
    noise_std : (n,) float64
        torque noise a sample at the recorded rate [Nm or N]
    pure_error : bool
        whether the noise is known from repetitions
    cutoff_hz : float
        band of the comparison [Hz]
    """

    identification: Identification
    setting: Setting
    verdict: Verdict
    selection: Selection
    findings: tuple[Finding, ...]
    mismatch: tuple[JointMismatch, ...]
    misfit_before: LackOfFit
    misfit_after: LackOfFit
    constancy: Constancy
    detectable: tuple[Detectable, ...]
    before: FitSizes
    after: FitSizes
    noise_std: Array
    pure_error: bool
    cutoff_hz: float

    @property
    def robot(self) -> Robot:
        """The arm."""
        return self.identification.robot


@ThreadpoolController().wrap(limits=1, user_api="blas")  # many small factors: threads cost more than they bring
def diagnose(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    options: Options = DEFAULT,
    progress: Progress = lambda step: None,
) -> Diagnosis:
    """Say what the best rigid-body and friction model of an arm leaves out.

    Parameters
    ----------
    robot : Robot
        the arm
    recordings : sequence of Recording
        what is explained; each one continuous motion
    held_out : sequence of Recording
        what findings are confirmed by
    options : Options
        of the identification of the nominal model
    progress : callable
        told the name of each step as it begins

    Returns
    -------
    Diagnosis
        findings with their evidence, and what could not have been seen

    Raises
    ------
    TauscopeError
        where the recordings cannot even answer what the parameters are
    """
    identification = identify(robot, recordings, held_out, options, progress)
    progress("prepare observations")
    conditioners = [Conditioner.survey(recording, robot) for recording in recordings]
    cutoff = diagnosis_cutoff(conditioners, identification)
    base = identification.structure.base
    model = nominal_model(identification)
    observations = Observations.prepare(conditioners, robot, base, cutoff)
    setting = setting_of(model, observations, conditioners, cutoff)
    effects = possible_effects(setting)
    progress("estimate noise")
    observations, pure_error = with_noise(observations, model, effects)
    confirming = _held_out(held_out, robot, observations, identification, cutoff)
    progress("compare effects")
    screen, fitter = Screen(observations, effects), Fitter(observations)
    rotors = [
        Term(RotorInertia(j), np.zeros(0), np.array([value])) for j, value in identified_rotors(identification).items()
    ]
    selection = Selector(screen, fitter, confirming, pure_error=pure_error).select(model, rotors, progress)
    progress("weigh the evidence")
    return _concluded(identification, setting, screen, fitter, confirming, selection, pure_error, cutoff)


def _held_out(
    recordings: Sequence[Recording],
    robot: Robot,
    observations: Observations,
    identification: Identification,
    cutoff_hz: float,
) -> HeldOut | None:
    """Held-out recordings in the same band, with the same noise."""
    if not recordings:
        return None
    conditioners = [Conditioner.survey(recording, robot) for recording in recordings]
    rows = Observations.prepare(conditioners, robot, identification.structure.base, cutoff_hz)
    return HeldOut(rows.with_noise(observations.noise))


def _concluded(
    identification: Identification,
    setting: Setting,
    screen: Screen,
    fitter: Fitter,
    held_out: HeldOut | None,
    selection: Selection,
    pure_error: bool,
    cutoff_hz: float,
) -> Diagnosis:
    """All tests on the selected model, and the verdict."""
    observations = fitter.observations
    inflation = 1.0 if pure_error else selection.fit.inflation()
    before = lack_of_fit(selection.nominal, observations, pure_error=pure_error)
    after = lack_of_fit(selection.fit, observations, pure_error=pure_error)
    held = constancy(fitter, selection.fit, None if held_out is None else held_out.fitter, inflation)
    candidates = screen.candidates(selection.nominal)
    findings = _findings(selection, fitter, held_out, inflation)
    evidence = Evidence(len(findings), any(before.significant), any(after.significant), held.holds)
    return Diagnosis(
        identification=identification,
        setting=setting,
        verdict=verdict(evidence),
        selection=selection,
        findings=findings,
        mismatch=locate(selection.nominal, observations),
        misfit_before=before,
        misfit_after=after,
        constancy=held,
        detectable=detectable(candidates, LEVEL / max(len(screen.effects), 1), inflation),
        before=_sizes(selection.nominal, fitter, held_out),
        after=_sizes(selection.fit, fitter, held_out),
        noise_std=identification.residuals.noise_std,
        pure_error=pure_error,
        cutoff_hz=cutoff_hz,
    )


def _sizes(fit: Fit, fitter: Fitter, held_out: HeldOut | None) -> FitSizes:
    """Raw residuals of a model on training and held-out recordings."""
    train = _rms(fit.model, fitter.observations)
    return FitSizes(train, None if held_out is None else _rms(fit.model, held_out.observations))


def _rms(model: ExtendedModel, observations: Observations) -> Array:
    squares, samples = raw_squares(model, observations)
    return np.sqrt(squares / np.maximum(samples, 1.0))


def _findings(selection: Selection, fitter: Fitter, held_out: HeldOut | None, inflation: float) -> tuple[Finding, ...]:
    """Terms of one effect at one place together, each compared with the model without it."""
    fit = selection.fit
    covariance = fit.covariance * inflation
    groups: dict[tuple[str, int | None], list[int]] = {}
    for place, term in enumerate(fit.model.terms):
        groups.setdefault((term.effect.id, term.effect.joint), []).append(place)
    after = _sizes(fit, fitter, held_out)
    found = []
    for places in groups.values():
        others = [term for place, term in enumerate(fit.model.terms) if place not in places]
        without = fitter.fit(with_terms(fit.model, others))
        slices = fit.model.term_places()
        terms = tuple(fit.model.terms[place] for place in places)
        found.append(
            Finding(
                choices=tuple(selection.choices[place] for place in places),
                terms=terms,
                covariances=tuple(
                    _spread_out(t, covariance[slices[p], slices[p]]) for t, p in zip(terms, places, strict=True)
                ),
                gain=without.energy - fit.energy,
                probability=_probability(selection.choices[places[0]], inflation),
                before=_sizes(without, fitter, held_out),
                after=after,
            )
        )
    return tuple(sorted(found, key=lambda each: -each.gain))


def _spread_out(term: Term, covariance: Array) -> Array:
    """Covariance of coefficients and all shapes; shapes that were only chosen have none."""
    count = len(term.coefficients)
    places = [*range(count), *(count + place for place in term.free_shapes)]
    whole = np.zeros((count + len(term.shape), count + len(term.shape)))
    whole[np.ix_(places, places)] = covariance
    return whole


def _probability(choice: Choice, inflation: float) -> float:
    """Share of the chosen option among its equivalents by their likelihoods."""
    scores = np.array([option.score for option in choice.options]) / inflation
    weights = np.exp(-0.5 * (scores.max() - scores))
    return float(min(weights[0] / weights.sum(), 0.999))
