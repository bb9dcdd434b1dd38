"""From a robot and recordings to what its model leaves out: the whole way, in the order of the steps."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from threadpoolctl import ThreadpoolController

from service.diagnosis.catalogue import Effect, Setting, possible_effects
from service.diagnosis.catalogue.payload import Payload
from service.diagnosis.catalogue.plain_terms import TorqueOffset
from service.diagnosis.catalogue.rotor_inertia import RotorInertia
from service.diagnosis.findings.constancy import constancy
from service.diagnosis.findings.constant_torque import with_better_than_constants
from service.diagnosis.findings.detectability import Detectable, detectable, detectable_parameters
from service.diagnosis.findings.diagnosed import Diagnosis
from service.diagnosis.findings.finding import Finding, FitSizes, selected_findings, sizes
from service.diagnosis.findings.location import locate
from service.diagnosis.findings.plain import states_friction, undeclared_offsets, with_plain_terms
from service.diagnosis.fitting.fit import Fitter
from service.diagnosis.fitting.friction_slopes import (
    open_slopes,
    open_stribeck,
    with_fitting_slopes,
    with_fitting_stribeck,
)
from service.diagnosis.fitting.lack_of_fit import lack_of_fit
from service.diagnosis.fitting.regressor_noise import row_weightings
from service.diagnosis.model.extended import ExtendedModel
from service.diagnosis.model.nominal import delivered_model, identified_rotors, nominal_model, setting_of
from service.diagnosis.model.term import Term
from service.diagnosis.noise.events import beside_events
from service.diagnosis.noise.floor import with_noise
from service.diagnosis.observations.band import diagnosis_cutoff
from service.diagnosis.observations.observations import Observations
from service.diagnosis.screening.screen import Screen
from service.diagnosis.selection.admission import LEVEL
from service.diagnosis.selection.choice import Selection
from service.diagnosis.selection.confirmation import CLEARLY_WORSE, HeldOut
from service.diagnosis.selection.farther import looked_farther
from service.diagnosis.selection.guided import guided_by
from service.diagnosis.selection.kinds import with_best_kinds
from service.diagnosis.selection.pruning import without_errors_of_larger_ones
from service.diagnosis.selection.selector import Selector
from service.identification import Identification, Options, identify
from service.recording.conditioning import Conditioner
from service.recording.recording import Recording
from service.robot import Robot

__all__ = ["Diagnosis", "Finding", "FitSizes", "diagnose"]

Progress = Callable[[str], None]

PREDICTED_BETTER = 2.0
"""Standard errors by which one of two models predicts a joint better; worse, it is by `CLEARLY_WORSE`: of many joints
one is so by chance, at a size that nobody would see."""

DEFAULT = Options()
"""An identification as nobody asked otherwise."""


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
    model = nominal_model(identification)
    cutoff = diagnosis_cutoff(conditioners, identification, model.steepness)
    observations = Observations.prepare(conditioners, robot, identification.structure.base, cutoff, model.steepness)
    setting = setting_of(model, observations, conditioners, cutoff)
    effects = possible_effects(setting)
    progress("estimate noise")
    rows, pure_error = _observed(observations, model, effects)
    confirming = _held_out(held_out, robot, rows, identification, cutoff)
    progress("compare effects")
    fitter = Fitter(rows)
    model = with_fitting_slopes(model, fitter, open_slopes(identification), setting.speed)
    model = with_fitting_stribeck(model, fitter, open_stribeck(identification), setting.speed)
    selector = Selector(Screen(rows, effects), fitter, confirming, pure_error=pure_error)
    selection, selector = _selected(selector, model, identification, setting, progress)
    progress("weigh the evidence")
    found = _concluded(identification, setting, selector, selection, cutoff)
    return with_plain_terms(found, undeclared_offsets(found))


def _selected(
    selector: Selector, model: ExtendedModel, identification: Identification, setting: Setting, progress: Progress
) -> tuple[Selection, Selector]:
    """All that is missing, and the selector whose rows count as much as they should beside it."""
    rotors = [
        Term(RotorInertia(j), np.zeros(0), np.array([value])) for j, value in identified_rotors(identification).items()
    ]
    selection = selector.select(model, rotors, progress)
    guided = guided_by(selection.fit.model, selector)
    if guided is not None:
        selector = guided
        selection = selector.select(model, selection.fit.model.terms, progress)
    selection = looked_farther(selection, selector, setting, progress)
    selection = with_best_kinds(selection, selector)
    if states_friction(identification.robot):
        selection = with_better_than_constants(selection, selector)
    selection = without_errors_of_larger_ones(selection, selector.fitter, selector.admission)
    if identification.constrained:
        selection = _unless_plainer_is_better(selection, delivered_model(identification), selector)
    return selection, selector


def _unless_plainer_is_better(selection: Selection, delivered: ExtendedModel, selector: Selector) -> Selection:
    """The plain model of a possible body and nothing selected, where it predicts held-out motion better than all of it.

    Motion that excites an arm too poorly leaves free parameters that no body has; findings then explain their errors.
    Without findings the possible body is the model, as an identification delivers it: what the free parameters say of
    other motion is worth nothing.
    """
    if selection.choices and _predicts_better(selection.fit.model, delivered, selector.held_out):
        return selection
    plain = selector.fitter.projected(delivered)
    return Selection(plain, plain, (), (*selection.rejected, *selection.choices))


def _predicts_better(model: ExtendedModel, plain: ExtendedModel, held_out: HeldOut | None) -> bool:
    """Whether a model predicts some joint clearly better than a plainer one and none clearly worse.

    Each joint by itself: the one with the least noise would else speak for all. Without held-out motion it stands.
    """
    if held_out is None:
        return True
    gains = held_out.joint_gains_z(plain, model)
    whole = held_out.block_gains(plain, model).sum()
    return bool(gains.min() > CLEARLY_WORSE and (gains.max() > PREDICTED_BETTER or whole > 0.0))


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
    model = nominal_model(identification)
    rows = Observations.prepare(conditioners, robot, identification.structure.base, cutoff_hz, model.steepness)
    rows = rows.with_noise(observations.noise)
    return HeldOut(_apart(rows.with_weightings(row_weightings(rows, model))))


def _apart(observations: Observations) -> Observations:
    """The same pieces with negative indices of recordings: none of them is one of training."""
    pieces = [
        replace(piece, prepared=replace(piece.prepared, recording=-1 - piece.prepared.recording))
        for piece in observations
    ]
    return replace(observations, pieces=tuple(pieces))


def _observed(observations: Observations, model: ExtendedModel, effects: Sequence[Effect]) -> tuple[Observations, bool]:
    """The rows with their noise and its weights, and whether it is known from repetitions."""
    known, pure_error = with_noise(observations, model, effects)
    if pure_error:
        known, pure_error = beside_events(observations, known, model, effects)
    return known.with_weightings(row_weightings(known, model)), pure_error


def _concluded(
    identification: Identification, setting: Setting, selector: Selector, selection: Selection, cutoff_hz: float
) -> Diagnosis:
    """All tests on the selected model."""
    screen, fitter, held_out, pure_error = selector.screen, selector.fitter, selector.held_out, selector.pure_error
    observations = fitter.observations
    inflation = 1.0 if pure_error else selection.fit.inflation()
    level = LEVEL / max(len(screen.effects), 1)
    misfit_after = lack_of_fit(selection.fit, observations, pure_error=pure_error)
    return Diagnosis(
        identification=identification,
        setting=setting,
        selection=selection,
        findings=selected_findings(selection, screen, fitter, held_out, misfit_after, inflation),
        mismatch=locate(selection, observations, misfit_after.significant),
        misfit_before=lack_of_fit(selection.nominal, observations, pure_error=pure_error),
        misfit_after=misfit_after,
        constancy=constancy(fitter, selection.fit, None if held_out is None else held_out.fitter, inflation),
        detectable=(
            *detectable(screen.candidates(selection.nominal), level, inflation),
            *_detectable_constants(identification.robot, selection, level, inflation),
            Detectable(Payload.id, None, None, Payload.coefficients[0].unit, False),  # it is one with the last link
        ),
        before=sizes(selection.nominal.model, fitter, held_out),
        after=sizes(selection.fit.model, fitter, held_out),
        noise_std=identification.residuals.noise_std,
        pure_error=pure_error,
        cutoff_hz=cutoff_hz,
        screen=screen,
        fitter=fitter,
        held_out=held_out,
    )


def _detectable_constants(robot: Robot, selection: Selection, level: float, inflation: float) -> tuple[Detectable, ...]:
    """Constants as far as one would be named: without stated friction the identified model has them."""
    found = detectable_parameters(selection.fit, (TorqueOffset,), level, inflation)
    return found if states_friction(robot) else tuple(replace(each, minimum=None, visible=False) for each in found)
