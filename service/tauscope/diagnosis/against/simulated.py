"""The final model fitted to what a simulator records: which of its parts the simulator has, and of which size."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tauscope.diagnosis.findings.diagnosed import Diagnosis, ParameterDifference
from tauscope.diagnosis.fitting.fit import Fit, Fitter
from tauscope.diagnosis.fitting.regressor_noise import weightings_of_motion
from tauscope.diagnosis.model.extended import ExtendedModel, with_terms
from tauscope.diagnosis.model.nominal import nominal_model
from tauscope.diagnosis.model.term import Term
from tauscope.diagnosis.noise.floor import band_share, white_noise, with_pure_error
from tauscope.diagnosis.observations.observations import Observations
from tauscope.diagnosis.observations.whitening import JointNoise
from tauscope.effects import TimeLocalEffect
from tauscope.identification import Options, identify
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array, Recording

PRESENT = 5.0  # standard errors from which an effect is in the simulator's recordings…
OF_REAL = 0.1  # …and the part of its size on the arm that it has at least
Place = tuple[str, int | None]


@dataclass(frozen=True, eq=False)
class SimulatedFit:
    """What the simulator has."""

    values: Array  # (p,), nominal parameters in the columns of the final model
    covariance: Array  # (p, p), of these
    # effects and places that the simulator shows too, with their coefficients in the simulator and on the arm
    shared: dict[Place, tuple[ParameterDifference, ...]]


def fit_to_simulation(diagnosis: Diagnosis, simulated: Sequence[Recording], options: Options) -> SimulatedFit:
    """Fit the final model of a diagnosis to a simulator's recordings."""
    found = identify(diagnosis.robot, simulated, (), options)
    final = diagnosis.selection.fit
    lasting = [term for term in final.model.terms if not isinstance(term.effect, TimeLocalEffect)]
    start = _in_columns_of(final.model, nominal_model(found), lasting)
    conditioners = [Conditioner.survey(recording, diagnosis.robot) for recording in simulated]
    base, cutoff = start.structure.base, diagnosis.cutoff_hz
    rows = Observations.prepare(conditioners, diagnosis.robot, base, cutoff, start.steepness)
    repeated = with_pure_error(rows, start)
    rows = repeated or rows.with_noise(_quieter_noise(rows, start))
    fit = Fitter(rows.with_weightings(weightings_of_motion(rows, start))).projected(start)
    inflation = 1.0 if repeated else fit.inflation()
    size = start.structure.size
    covariance = fit.covariance[:size, :size] * inflation
    return SimulatedFit(fit.free_parameters, covariance, _shared(diagnosis, fit, inflation))


def _quieter_noise(rows: Observations, start: ExtendedModel) -> list[JointNoise]:
    """Noise of every joint beside the model that leaves less there: with the arm's effects, or without them."""
    share = band_share(rows)
    pairs = zip(*(white_noise(rows, model, share) for model in (start, with_terms(start, ()))), strict=True)
    return [min(pair, key=lambda each: float(each.model.variance)) for pair in pairs]


def _in_columns_of(final: ExtendedModel, simulated: ExtendedModel, terms: Sequence[Term]) -> ExtendedModel:
    """The simulator's model in the columns of the final one: terms that it has not begin at zero."""
    known = dict(zip(simulated.structure.names, simulated.parameters, strict=True))
    parameters = np.array([known.get(name, 0.0) for name in final.structure.names])
    pairs = zip(final.structure.terms, simulated.structure.terms, strict=True)
    own = [replace(real, k_v=found.k_v, delta=real.delta and (found.delta or real.delta)) for real, found in pairs]
    structure = final.structure.with_terms(tuple(own))
    kept = replace(final, structure=structure, parameters=parameters, stated=(None,) * len(final.constants))
    return with_terms(kept, terms)


def _shared(diagnosis: Diagnosis, fit: Fit, inflation: float) -> dict[Place, tuple[ParameterDifference, ...]]:
    """Effects of the final model that the simulator's recordings show too."""
    real = diagnosis.selection.fit
    pairs = zip(real.model.terms, real.model.term_places(), strict=True)
    lasting = [(term, place) for term, place in pairs if not isinstance(term.effect, TimeLocalEffect)]
    names = [joint.name for joint in diagnosis.robot.joints]
    found: dict[Place, tuple[ParameterDifference, ...]] = {}
    simulated = zip(fit.model.terms, fit.model.term_places(), strict=True)
    for (term, place), (own, at) in zip(lasting, simulated, strict=True):
        count = len(own.coefficients)
        coefficients = own.coefficients + fit.projection.step[at][:count]
        spread = fit.covariance[at, at][:count, :count] * inflation
        strength = float(coefficients @ np.linalg.pinv(spread, hermitian=True) @ coefficients)
        of_real = float(np.linalg.norm(coefficients) / max(np.linalg.norm(term.coefficients), 1e-300))
        if strength > PRESENT**2 and of_real > OF_REAL:
            errors = np.diag(spread) + np.diag(real.covariance[place, place])[:count] * diagnosis.inflation
            differences = tuple(
                ParameterDifference(
                    f"{coefficient.name} of {term.effect.name(names)}",
                    float(coefficients[number]),
                    float(term.coefficients[number]),
                    float(np.sqrt(errors[number])),
                )
                for number, coefficient in enumerate(term.effect.coefficients)
            )
            key = (term.effect.id, term.effect.joint)
            found[key] = (*found.get(key, ()), *differences)
    return found
