"""One look at the recordings: what is missing from a model in one band, and all tests on what was selected."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.findings.constancy import constancy
from tauscope.diagnosis.findings.constant_torque import with_better_than_constants
from tauscope.diagnosis.findings.detectability import Detectable, detectable, detectable_parameters
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding, selected_findings, sizes
from tauscope.diagnosis.findings.location import locate
from tauscope.diagnosis.findings.plain import states_friction
from tauscope.diagnosis.findings.tentative import set_refuted_apart
from tauscope.diagnosis.fitting.fit import Fitter
from tauscope.diagnosis.fitting.lack_of_fit import lack_of_fit
from tauscope.diagnosis.fitting.regressor_noise import row_weightings
from tauscope.diagnosis.fitting.spilled_misfit import without_spilled
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.model.nominal import delivered_model, identified_rotors
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.noise.events import beside_events
from tauscope.diagnosis.noise.floor import with_noise
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.screening.screen import Screen, model_signals
from tauscope.diagnosis.selection.choice import Selection
from tauscope.diagnosis.selection.confirmation import CLEARLY_WORSE, HeldOut
from tauscope.diagnosis.selection.farther import looked_farther
from tauscope.diagnosis.selection.guided import guided_by
from tauscope.diagnosis.selection.kinds import with_best_kinds
from tauscope.diagnosis.selection.pruning import without_errors_of_larger_ones
from tauscope.diagnosis.selection.selector import Selector
from tauscope.effects import ArmContext, Effect
from tauscope.effects.payload import Payload
from tauscope.effects.plain_terms import TorqueOffset
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.identification import Identification
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array
from tauscope.robot import Robot

Progress = Callable[[str], None]

PREDICTED_BETTER = 2.0
"""Standard errors by which one of two models predicts a joint better; worse, it is by `CLEARLY_WORSE` and by more than
the other joints gain: of many joints one is so by chance, at a size that nobody would see."""


def selector_on(
    rows: Observations,
    held_out: Observations | None,
    model: ExtendedModel,
    effects: Sequence[Effect],
    *,
    looked_at_before: int = 0,
) -> Selector:
    """A selector on training rows whose noise and weights a model tells, and held-out rows of the same noise."""
    known, pure_error = _observed(rows, model, effects)
    confirming = None if held_out is None else _weighted(held_out.with_noise(known.noise), model)
    return Selector(
        Screen(known, effects),
        Fitter(known),
        None if confirming is None else HeldOut(confirming),
        pure_error=pure_error,
        looked_at_before=looked_at_before,
    )


def confirming_rows(
    held_out: Sequence[Conditioner], identification: Identification, cutoff_hz: float, steepness: Array
) -> Observations | None:
    """Held-out recordings in a band; None where there are none.

    Parameters
    ----------
    cutoff_hz : float
        of the band [Hz]
    steepness : (n,) float64
        K_v of every joint's friction [s/rad or s/m]
    """
    if not held_out:
        return None
    base = identification.structure.base
    return Observations.prepare(held_out, identification.robot, base, cutoff_hz, steepness).apart()


def selected(
    selector: Selector,
    model: ExtendedModel,
    identification: Identification,
    setting: ArmContext,
    progress: Progress,
    known: Sequence[Term] = (),
) -> tuple[Selection, Selector]:
    """All that is missing, and the selector whose rows count as much as they should beside it."""
    rotors = [
        Term(RotorInertia(j), np.zeros(0), np.array([value])) for j, value in identified_rotors(identification).items()
    ]
    shaped = _choose_shapes(known, model, selector) if known else []
    selection = selector.select(model, [*rotors, *shaped], progress)
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


def _choose_shapes(known: Sequence[Term], model: ExtendedModel, selector: Selector) -> list[Term]:
    """Terms of known size in the shapes of their grids that the torque fits best: 2 c u - c² B is largest."""
    fit = selector.fitter.fit(model)
    signals = model_signals(fit.model, selector.screen.observations)
    found = []
    for term in known:
        seen = selector.screen.at_shapes(term.effect, term.effect.grid, fit, signals)
        size = float(term.coefficients[0])
        gains = 2.0 * size * seen.target[:, 0] - size**2 * seen.gram[:, 0, 0]
        found.append(replace(term, shape=term.effect.grid[int(np.argmax(gains))]))
    return found


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

    Each joint by itself: the one with the least noise would else speak for all. A loss that the best of them outweighs
    is no clear one: what was free to explain one joint may cost another a little. Without held-out motion it stands.
    """
    if held_out is None:
        return True
    gains = held_out.joint_gains_z(plain, model)
    whole = held_out.block_gains(plain, model).sum()
    clearly_worse = min(CLEARLY_WORSE, -float(gains.max()))
    return bool(gains.min() > clearly_worse and (gains.max() > PREDICTED_BETTER or whole > 0.0))


def _observed(observations: Observations, model: ExtendedModel, effects: Sequence[Effect]) -> tuple[Observations, bool]:
    """The rows with their noise and its weights, and whether it is known from repetitions."""
    known, pure_error = with_noise(observations, model, effects)
    if pure_error:
        known, pure_error = beside_events(observations, known, model, effects)
    return _weighted(known, model), pure_error


def _weighted(observations: Observations, model: ExtendedModel) -> Observations:
    """The rows with the weights that a model's friction gives them."""
    return observations.with_weightings(row_weightings(observations, model))


def concluded(
    identification: Identification, setting: ArmContext, selector: Selector, selection: Selection, cutoff_hz: float
) -> Diagnosis:
    """All tests on the selected model.

    Parameters
    ----------
    cutoff_hz : float
        of the band [Hz]
    """
    screen, fitter, held_out, pure_error = selector.screen, selector.fitter, selector.held_out, selector.pure_error
    observations = fitter.observations
    level = selector.admission.level

    def find(at: Selection) -> tuple[Finding, ...]:
        left = lack_of_fit(at.fit, observations, pure_error=pure_error)
        return selected_findings(at, screen, fitter, held_out, left, 1.0 if pure_error else at.fit.inflation())

    selection, findings, tentative = set_refuted_apart(selection, find, fitter)
    inflation = 1.0 if pure_error else selection.fit.inflation()
    misfit_before = lack_of_fit(selection.nominal, observations, pure_error=pure_error)
    misfit_after = lack_of_fit(selection.fit, observations, pure_error=pure_error)
    return Diagnosis(
        identification=identification,
        setting=setting,
        selection=selection,
        findings=findings,
        tentative=tentative,
        mismatch=locate(selection, observations, misfit_after.significant),
        misfit_before=without_spilled(misfit_before, selection.nominal, fitter, pure_error=pure_error),
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
        level=level,
        cutoff_hz=cutoff_hz,
        screen=screen,
        fitter=fitter,
        held_out=held_out,
    )


def _detectable_constants(robot: Robot, selection: Selection, level: float, inflation: float) -> tuple[Detectable, ...]:
    """Constants as far as one would be named: without stated friction the identified model has them."""
    found = detectable_parameters(selection.fit, (TorqueOffset,), level, inflation)
    return found if states_friction(robot) else tuple(replace(each, minimum=None, visible=False) for each in found)
