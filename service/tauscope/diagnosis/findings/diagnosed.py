"""What a diagnosis comes to, with the fits that it rests on."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from tauscope.diagnosis.findings.constancy import Constancy
from tauscope.diagnosis.findings.detectability import Detectable
from tauscope.diagnosis.findings.finding import Finding, FitSizes, in_order
from tauscope.diagnosis.findings.location import JointMismatch
from tauscope.diagnosis.findings.verdict import Evidence, Verdict, verdict
from tauscope.diagnosis.findings.wrong_value import WrongValue
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.lack_of_fit import LackOfFit
from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.effects import ArmContext
from tauscope.identification import Identification
from tauscope.identification.warnings import extrapolations, undetermined
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Energy that findings take off a joint's residual, in noise variances, from which there was something to explain.
EXPLAINED = 20.0
PREDICTED = 4.0  # power of a held-out residual, in noise variances, up to which a model predicts the motion


@dataclass(frozen=True)
class ParameterDifference:
    """One parameter that a simulation has wrong."""

    parameter: str
    simulation: float  # value [SI]
    real: float
    std: float
    explained_by: tuple[WrongValue, ...] = ()  # quantities of links or joints that explain the difference

    @property
    def in_std(self) -> float:
        """Real less simulation in standard errors."""
        return (self.real - self.simulation) / max(self.std, 1e-300)


@dataclass(frozen=True, eq=False)
class Selection:
    """The nominal model, and the one with all findings."""

    nominal: Fit
    fit: Fit


@dataclass(frozen=True, eq=False)
class Unseen:
    """Held-out rows, with the noise of the training ones."""

    observations: Observations

    @cached_property
    def fitter(self) -> Fitter:
        """Fits to these rows."""
        return Fitter(self.observations)

    def is_predicted_by(self, model: ExtendedModel) -> bool:
        """Whether a model leaves no joint much more than noise; otherwise the training motion was too poor."""
        return all(float(row @ row) <= PREDICTED * len(row) for row in self.fitter.white_residual(model))


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found."""

    identification: Identification
    setting: ArmContext
    selection: Selection
    findings: tuple[Finding, ...]
    mismatch: tuple[JointMismatch, ...]
    misfit_before: LackOfFit
    misfit_after: LackOfFit
    constancy: Constancy
    detectable: tuple[Detectable, ...]
    before: FitSizes
    after: FitSizes
    noise_std: Array  # (n,), torque noise a sample at the recorded rate [Nm or N]
    pure_error: bool
    level: float
    cutoff_hz: float  # band of the comparison [Hz]
    fitter: Fitter
    held_out: Unseen | None
    against: Literal["identified", "model", "simulation"] = "identified"
    differences: tuple[ParameterDifference, ...] = ()
    tentative: tuple[Finding, ...] = ()  # what held-out motion refutes; no part of the model, and it turns no verdict

    @property
    def robot(self) -> Robot:
        """The arm."""
        return self.identification.robot

    @property
    def verdict(self) -> Verdict:
        """As a whole."""
        return verdict(
            Evidence(
                len(self.findings),
                any(self.mismatched),
                any(self.misfit_after.significant),
                self.constancy.holds,
                self.predicts,
                bool(extrapolations(self.identification)),
                bool(undetermined(self.identification)),
                bool(self.differences),
            )
        )

    @property
    def mismatched(self) -> list[bool]:
        """Per joint, whether there is something to explain: what cannot be measured counts where predictions fail.

        What findings explain was there, also where the residual's power alone would not have told.
        """
        agreed = self.constancy.holds and self.predicts
        tested = self.misfit_before.mismatch if agreed else self.misfit_before.significant
        terms = [term for finding in self.findings for term in finding.terms]
        touched = {joint for term in terms for joint in term.effect.touched(len(tested))}
        explained = [each.explained > EXPLAINED * self.inflation for each in self.mismatch]
        return [told or (explained[joint] and joint in touched) for joint, told in enumerate(tested)]

    @cached_property
    def predicts(self) -> bool:
        """Whether the final model predicts the held-out recordings, where there are any."""
        return self.held_out is None or self.held_out.is_predicted_by(self.selection.fit.model)

    @property
    def inflation(self) -> float:
        """Factor by which the residual exceeds the modelled noise; 1 where that is known from repetitions."""
        return 1.0 if self.pure_error else self.selection.fit.inflation()

    def sizes(self, model: ExtendedModel) -> FitSizes:
        """Residuals of a model on the recordings."""
        return FitSizes.of(
            model, self.fitter.observations, None if self.held_out is None else self.held_out.observations
        )

    def with_findings(self, added: Sequence[Finding]) -> "Diagnosis":
        """The same with more findings, those apart that held-out motion refutes."""
        standing = [each for each in added if each.confirmed is not False]
        refuted = [each for each in added if each.confirmed is False]
        return replace(
            self, findings=in_order([*self.findings, *standing]), tentative=in_order([*self.tentative, *refuted])
        )
