"""From a robot and recordings to what its model leaves out: the whole way, in the order of the steps."""

from collections.abc import Sequence
from dataclasses import replace

from threadpoolctl import ThreadpoolController

from tauscope.diagnosis.deflection.measured import measure_deflection
from tauscope.diagnosis.deflection.terms import direct_terms
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.direct import with_direct_findings
from tauscope.diagnosis.findings.finding import Finding, FitSizes
from tauscope.diagnosis.findings.plain import undeclared_offsets, with_plain_terms
from tauscope.diagnosis.fitting.friction_slopes import (
    open_slopes,
    open_stribeck,
    with_fitting_slopes,
    with_fitting_stribeck,
)
from tauscope.diagnosis.in_band import Progress, concluded, confirming_rows, selected, selector_on
from tauscope.diagnosis.model.nominal import nominal_model, setting_of
from tauscope.diagnosis.observations.band import diagnosis_cutoff
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.second_look import looked_again
from tauscope.effects import possible_effects
from tauscope.identification import Options, identify
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Recording
from tauscope.robot import Robot

__all__ = ["Diagnosis", "Finding", "FitSizes", "diagnose"]

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

    Raises
    ------
    TauscopeError
        where the recordings cannot even answer what the parameters are
    """
    identification = identify(robot, recordings, held_out, options, progress)
    progress("prepare observations")
    surveyed = [Conditioner.survey(recording, robot) for recording in recordings]
    unseen = [Conditioner.survey(recording, robot) for recording in held_out]
    model = nominal_model(identification)
    cutoff = diagnosis_cutoff(surveyed, identification, model.steepness)
    rows = Observations.prepare(surveyed, robot, identification.structure.base, cutoff, model.steepness)
    confirming = confirming_rows(unseen, identification, cutoff, model.steepness)
    measured = measure_deflection(recordings, identification, model, cutoff)
    seen = frozenset(each.joint for each in measured if not each.is_open)
    setting = replace(setting_of(model, rows, surveyed, cutoff), link_encoders=seen)
    progress("estimate noise")
    selector = selector_on(rows, confirming, model, possible_effects(setting))
    progress("compare effects")
    model = with_fitting_slopes(model, selector.fitter, open_slopes(identification), setting.speed)
    model = with_fitting_stribeck(model, selector.fitter, open_stribeck(identification), setting.speed)
    direct = [each.term for each in direct_terms(measured, setting)]
    selection, selector = selected(selector, model, identification, setting, progress, direct)
    progress("weigh the evidence")
    found = concluded(identification, setting, selector, selection, cutoff)
    found = looked_again(found, surveyed, unseen, progress)
    found = with_direct_findings(found, measured, measure_deflection(held_out, identification, model, cutoff))
    return with_plain_terms(found, undeclared_offsets(found))
