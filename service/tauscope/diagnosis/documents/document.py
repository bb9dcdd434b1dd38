"""A diagnosis turned into its document."""

from collections.abc import Mapping, Sequence

import numpy as np

from tauscope.diagnosis.documents.result import (
    CauseEntry,
    ConstancyEntry,
    DetectableEntry,
    DiagnosisDocument,
    DifferenceEntry,
    FindingEntry,
    FitChangeEntry,
    FitChangesEntry,
    HeadroomEntry,
    HeldOutChangeEntry,
    MismatchEntry,
    MovedEntry,
    NextExperimentEntry,
    QuantityEntry,
    ShiftEntry,
    WhereEntry,
)
from tauscope.diagnosis.documents.statement import HEADLINES, state_finding, state_unknown
from tauscope.diagnosis.findings.diagnosed import Diagnosis
from tauscope.diagnosis.findings.finding import Finding
from tauscope.diagnosis.findings.location import JointMismatch, Place
from tauscope.diagnosis.findings.verdict import OPEN, Verdict
from tauscope.diagnosis.findings.wrong_value import WrongValue
from tauscope.diagnosis.fitting.projection import INVISIBLE
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.model.torque_scale import on_the_arm
from tauscope.diagnosis.next_experiment import PlannedExperiment
from tauscope.effects import Effect, Quantity, effect_class
from tauscope.identification.structure import ModelStructure
from tauscope.identification.warnings import excitation_warnings, extrapolation_warnings, extrapolations, robot_warnings
from tauscope.number_text import significant
from tauscope.recording.recording import Array
from tauscope.result_warning import ResultWarning

SHIFTS_FROM = 3.0  # standard errors from which a parameter's shift is told
UNKNOWN = "unknown"
_WIDE = "record one motion through the whole range of positions and speeds, slow reversals included"
# Standard parameters that are positive; a sum of such ones with positive weights is positive, too.
POSITIVE = ("m", "Ixx", "Iyy", "Izz")
POSITIVE_TERMS = ("stiction", "viscous", "rotor_inertia")
CLEARLY = 2.0  # standard errors below zero from which a value is worth a warning: nearer, it is zero


def document(
    diagnosis: Diagnosis,
    planned: PlannedExperiment | None = None,
    trajectory: str | None = None,
    headroom: list[HeadroomEntry] | None = None,
) -> DiagnosisDocument:
    """The document of a diagnosis."""
    names = [joint.name for joint in diagnosis.robot.joints]
    findings = [*(_finding(each, diagnosis, names) for each in diagnosis.findings), *_unknown(diagnosis, names)]
    noise_method = diagnosis.identification.residuals.noise_method
    return DiagnosisDocument(
        warnings=[*_warnings(diagnosis), *impossible_warnings(diagnosis)],
        robot=diagnosis.robot.name,
        joints=names,
        against=diagnosis.against,
        verdict=diagnosis.verdict.value,
        noise_std=diagnosis.noise_std.tolist(),
        noise_method="periods" if noise_method == "periods" else "residual",
        cutoff_hz=diagnosis.cutoff_hz,
        mismatch=[
            _mismatch(each, names, significant=significant)
            for each, significant in zip(diagnosis.mismatch, diagnosis.mismatched, strict=True)
        ],
        headline=_headline(diagnosis),
        findings=findings,
        tentative=[_finding(each, diagnosis, names, tentative=True) for each in diagnosis.tentative],
        fit=_fit_changes(diagnosis),
        constancy=_constancy(diagnosis),
        detectable=_detectable(diagnosis, names),
        parameter_differences=_differences(diagnosis, names),
        wrong_values=_wrong_values(diagnosis, names),
        parameter_shifts=_shifts(diagnosis),
        next_experiment=_next_experiment(diagnosis, names, planned, trajectory),
        headroom=headroom,
    )


def parameter_names(diagnosis: Diagnosis) -> list[str]:
    """Readable names of all parameters of the final model, in their order."""
    model = diagnosis.selection.fit.model
    joints = [joint.name for joint in diagnosis.robot.joints]
    names = [*model.structure.names, *(f"log {name} {joints[joint]}" for joint, name in model.constants)]
    for term in model.terms:
        own = [each.name for each in term.effect.coefficients]
        own += [term.effect.shapes[place].name for place in term.free_shapes]
        names += [f"{name} of {term.effect.name(joints)}" for name in own]
    return names


def _fit_changes(diagnosis: Diagnosis) -> FitChangesEntry:
    before, after = diagnosis.before, diagnosis.after
    held_out = None
    if before.held_out is not None and after.held_out is not None:
        held_out = FitChangeEntry(rms_before=before.held_out.tolist(), rms_after=after.held_out.tolist())
    train = FitChangeEntry(rms_before=before.train.tolist(), rms_after=after.train.tolist())
    return FitChangesEntry(train=train, held_out=held_out)


def _constancy(diagnosis: Diagnosis) -> ConstancyEntry:
    names = parameter_names(diagnosis)
    moved = [
        MovedEntry(parameter=names[move.parameter], between=list(move.between), shift_in_std=move.shift_in_std)
        for move in diagnosis.constancy.moves
    ]
    return ConstancyEntry(p_value=diagnosis.constancy.p_value, moved=moved)


def _detectable(diagnosis: Diagnosis, names: Sequence[str]) -> list[DetectableEntry]:
    return [
        DetectableEntry(
            effect=each.effect,
            joint=None if each.joint is None else names[each.joint],
            minimum=each.minimum,
            unit=effect_class(each.effect).unit_at(each.unit, diagnosis.setting, each.joint),
            visible=each.visible,
        )
        for each in diagnosis.detectable
    ]


def _warnings(diagnosis: Diagnosis) -> list[ResultWarning]:
    """Warnings of the files and of the motion; what training hardly tells where that leaves the verdict open."""
    found = diagnosis.identification
    weak = excitation_warnings(found) if diagnosis.verdict is Verdict.INCONCLUSIVE else ()
    return [*robot_warnings(diagnosis.robot), *found.recording_warnings, *extrapolation_warnings(found), *weak]


def _differences(diagnosis: Diagnosis, names: Sequence[str]) -> list[DifferenceEntry]:
    return [
        DifferenceEntry(
            parameter=each.parameter,
            simulation=each.simulation,
            real=each.real,
            std=each.std,
            difference_in_std=each.in_std,
            explained_by=[cause for value in each.explained_by for cause in _causes(value, names)],
        )
        for each in diagnosis.differences
    ]


def _causes(wrong: WrongValue, names: Sequence[str]) -> list[CauseEntry]:
    return [
        CauseEntry(
            link=None if wrong.link is None else wrong.link + 1,
            joint=None if wrong.joint is None else names[wrong.joint],
            quantity=each.name,
            simulation=each.simulation,
            value=each.value,
            std=each.std,
            unit=each.unit,
        )
        for each in wrong.quantities
    ]


def _wrong_values(diagnosis: Diagnosis, names: Sequence[str]) -> list[str]:
    """One sentence a link or joint, the one that explains most first."""
    found = dict.fromkeys(value for each in diagnosis.differences for value in each.explained_by)
    return [value.statement(names) for value in sorted(found, key=lambda each: -each.explains)]


def _where(place: Place | None) -> WhereEntry | None:
    if place is None:
        return None
    return WhereEntry(
        variable=place.variable, range=[place.low, place.high], share=place.share, recording=place.recording
    )


def _mismatch(found: JointMismatch, names: Sequence[str], *, significant: bool) -> MismatchEntry:
    return MismatchEntry(
        joint=names[found.joint],
        excess_rms=found.excess_rms,
        significant=significant,
        where=_where(found.place) if significant else None,
        time=_where(found.time) if significant else None,
    )


def _finding(finding: Finding, diagnosis: Diagnosis, names: Sequence[str], *, tentative: bool = False) -> FindingEntry:
    effect = finding.terms[0].effect
    quantities = _quantities(finding, diagnosis)
    known = [each for each in quantities if each.is_known]
    others = list({rival.term.effect.name(names): None for rival in finding.alternatives})
    before, after = finding.before, finding.after
    return FindingEntry(
        effect=effect.id,
        joint=None if effect.joint is None else names[effect.joint],
        probability=finding.probability,
        equivalent=others,
        equation=effect.equation,
        parameters=[QuantityEntry(name=q.name, value=q.value, std=q.std, unit=q.unit) for q in known],
        statement=state_finding(finding, quantities, diagnosis, tentative=tentative).text,
        gain=finding.gain,
        share=_share(finding, diagnosis, tentative=tentative),
        confirmed=False if tentative else finding.confirmed,
        held_out_change=_held_out_change(finding),
        rms_before=before.train.tolist(),
        rms_after=after.train.tolist(),
        held_out_rms_before=None if before.held_out is None else before.held_out.tolist(),
        held_out_rms_after=None if after.held_out is None else after.held_out.tolist(),
    )


def _headline(diagnosis: Diagnosis) -> str:
    """The finding that explains most; without findings what the verdict is."""
    if not diagnosis.findings:
        return HEADLINES[diagnosis.verdict.value]
    first = diagnosis.findings[0]
    return f"{state_finding(first, _quantities(first, diagnosis), diagnosis, tentative=False).headline}."


def _quantities(finding: Finding, diagnosis: Diagnosis) -> list[Quantity]:
    """Parameters of all terms; those after the first are numbered, and what no joint feels is not known at all."""
    found: list[Quantity] = []
    for number, (term, covariance) in enumerate(zip(finding.terms, finding.covariances, strict=True), start=1):
        sized, unfelt = on_the_arm(diagnosis.selection.fit.model, term), _find_unfelt(term, diagnosis)
        own = sized.effect.quantities(diagnosis.setting, sized.coefficients, sized.shape, covariance)
        suffix = "" if number == 1 else f"_{number}"
        for each in own:
            std = np.inf if each.name in unfelt else each.std
            found.append(Quantity(f"{each.name}{suffix}", each.value, std, each.unit))
    return found


def _find_unfelt(term: Term, diagnosis: Diagnosis) -> set[str]:
    """Coefficients of an effect that change no joint's torque on the recorded motion; a single one does."""
    if len(term.coefficients) == 1:
        return set()
    model = diagnosis.selection.fit.model
    columns = (
        term.effect.columns(model.signals(piece), term.shape[None])[0] for piece in diagnosis.fitter.observations
    )
    largest = np.max([np.abs(own).reshape(len(own), -1).max(axis=1) for own in columns], axis=0)
    names = [each.name for each in term.effect.coefficients]
    return {name for name, size in zip(names, largest, strict=True) if size**2 <= INVISIBLE * largest.max() ** 2}


def _share(finding: Finding, diagnosis: Diagnosis, *, tentative: bool) -> float | None:
    """Part of the energy that is explained at its joints that it explains; None where nothing is."""
    touched = finding.terms[0].effect.touched(len(diagnosis.mismatch))
    explained = sum(max(diagnosis.mismatch[joint].explained, 0.0) for joint in touched)
    if tentative or not finding.in_model:  # what the model's findings explain is without it
        explained += finding.gain
    return min(max(finding.gain / explained, 0.0), 1.0) if explained > 0.0 else None


def _held_out_change(finding: Finding) -> HeldOutChangeEntry | None:
    change = finding.held_out_change
    if change is None:
        return None
    std = [error if np.isfinite(error) else None for error in change.error.tolist()]
    return HeldOutChangeEntry(relative=change.relative.tolist(), std=std)


def _unknown(diagnosis: Diagnosis, names: Sequence[str]) -> list[FindingEntry]:
    """What is significant and not explained, joint by joint, most of all first, where nothing could be named at all."""
    if diagnosis.verdict is not Verdict.UNEXPLAINED:
        return []
    before = diagnosis.before
    held_out = None if before.held_out is None else before.held_out.tolist()
    entries = [
        FindingEntry(
            effect=UNKNOWN,
            joint=names[found.joint],
            probability=1.0,
            equivalent=[],
            equation="",
            parameters=[],
            statement=state_unknown(
                names[found.joint], found.excess_rms, Effect.unit_at("{tau}", diagnosis.setting, found.joint)
            ).text,
            gain=float(diagnosis.misfit_before.excess[found.joint]),
            confirmed=None,
            rms_before=before.train.tolist(),
            rms_after=diagnosis.after.train.tolist(),
            held_out_rms_before=held_out,
            held_out_rms_after=held_out,
        )
        for found, significant in zip(diagnosis.mismatch, diagnosis.mismatched, strict=True)
        if significant
    ]
    return sorted(entries, key=lambda each: -each.gain)


def _shifts(diagnosis: Diagnosis) -> list[ShiftEntry]:
    """Nominal parameters that moved when the findings were added, to values that they can have."""
    before, after = diagnosis.selection.nominal, diagnosis.selection.fit
    if not diagnosis.findings:
        return []
    inflation = 1.0 if diagnosis.pure_error else after.inflation()
    size = before.model.structure.size
    std = np.sqrt(np.maximum(np.diag(before.covariance)[:size] * inflation, 1e-300))
    shifts = (after.model.parameters - before.model.parameters) / std
    hidden = impossible_places(before.model.structure, after.model.parameters)
    order = np.argsort(-np.abs(shifts))
    return [
        ShiftEntry(
            parameter=before.model.structure.names[place],
            before=float(before.model.parameters[place]),
            after=float(after.model.parameters[place]),
            shift_in_std=float(shifts[place]),
        )
        for place in order
        if abs(shifts[place]) > SHIFTS_FROM and place not in hidden
    ]


def _next_experiment(
    diagnosis: Diagnosis, names: Sequence[str], planned: PlannedExperiment | None, trajectory: str | None
) -> NextExperimentEntry | None:
    """The motion that would tell equivalents apart, or show what an inconclusive motion hides."""
    separates, why = _open_question(diagnosis, names)
    if planned is not None:
        why = f"{why}; planned: {planned.words}" if why else planned.words
    return NextExperimentEntry(separates=separates, trajectory=trajectory, why=why) if why else None


def _open_question(diagnosis: Diagnosis, names: Sequence[str]) -> tuple[list[str], str]:
    """What is to be told apart, and the motion for it in words; empty where nothing is open."""
    if diagnosis.verdict is Verdict.INCONCLUSIVE:
        return [], f"{_reason(diagnosis)}: {_WIDE}"
    for finding in diagnosis.findings:
        if finding.alternatives:
            return _tell_apart(
                [term.effect for term in (finding.terms[0], *(rival.term for rival in finding.alternatives))], names
            )
    if diagnosis.verdict in OPEN:
        why = "repeat the same motion several times and slower: what repeats with time, angle or speed shows its kind"
        return [UNKNOWN], why
    return _tell_apart([finding.terms[0].effect for finding in diagnosis.tentative], names)


def _tell_apart(effects: Sequence[Effect], names: Sequence[str]) -> tuple[list[str], str]:
    """Names of effects, and the motions that reveal them; empty without any."""
    motions = dict.fromkeys(effect.revealing_motion for effect in effects)
    return [effect.name(names) for effect in effects], "record " + "; and ".join(motions) if motions else ""


def _reason(diagnosis: Diagnosis) -> str:
    """Why the recordings decide nothing."""
    beyond = extrapolations(diagnosis.identification)
    if beyond and not diagnosis.predicts:
        joints = (f"{diagnosis.robot.joints[joint].name}: {reason}" for joint, reason in beyond.items())
        return f"training lacks motion that held-out recordings have ({'. '.join(joints)})"
    if diagnosis.constancy.holds:
        return "the training motion does not say what held-out motion asks for"
    moved = sorted({parameter_names(diagnosis)[move.parameter] for move in diagnosis.constancy.moves})
    return f"the parameters do not hold from one recording to the next ({', '.join(moved[:4])})"


def impossible_places(structure: ModelStructure, parameters: Array) -> list[int]:
    """Places of parameters below zero that must not be. `parameters`: (p,), Θ."""
    places = [place for place, terms in enumerate(structure.base.terms) if _is_positive(terms)]
    joints = range(structure.robot.joint_count)
    terms = [structure.coefficient(joint, name) for joint in joints for name in POSITIVE_TERMS]
    places += [place for place in terms if place is not None]
    return [place for place in places if parameters[place] < 0.0]


def impossible_warnings(diagnosis: Diagnosis) -> list[ResultWarning]:
    """A warning where findings made parameters clearly impossible."""
    fit = diagnosis.selection.fit
    structure, parameters = fit.model.structure, fit.model.parameters
    std = np.sqrt(np.maximum(np.diag(fit.covariance) * diagnosis.inflation, 0.0))
    if not diagnosis.findings:
        return []
    places = [each for each in impossible_places(structure, parameters) if parameters[each] < -CLEARLY * std[each]]
    if not places:
        return []
    values = ", ".join(f"{structure.names[place]} = {significant(parameters[place], 2)}" for place in places)
    return [
        ResultWarning(
            code="impossible-value",
            text=f"the findings make values impossible, and the tables omit them: {values}",
            remedy="record motion that excites these joints more, and diagnose again",
        )
    ]


def _is_positive(terms: Mapping[str, float]) -> bool:
    """Whether no body makes a base parameter negative."""
    return all(weight > 0.0 and name.rstrip("0123456789") in POSITIVE for name, weight in terms.items())
