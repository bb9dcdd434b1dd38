"""From a robot and recordings to parameters: the whole way, in the order of the steps."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from threadpoolctl import ThreadpoolController

from tauscope.dynamics.base_parameters import base_parameters
from tauscope.errors import IdentificationError, RecordingMismatchError
from tauscope.identification.band import choose_cutoff
from tauscope.identification.consistency import ConsistentParameters
from tauscope.identification.covariance import parameter_covariance, uncertain_torque
from tauscope.identification.dataset import Dataset
from tauscope.identification.excitation import Excitation, measure_excitation
from tauscope.identification.friction_shape import EstimatedShape, shape_parameters
from tauscope.identification.full_parameters import FullParameters
from tauscope.identification.least_squares import Estimator, JointFactor, Solution, condition_number, estimate
from tauscope.identification.model_terms import choose_model
from tauscope.identification.physical_estimate import consistent_estimate, is_rejected
from tauscope.identification.posterior import Posterior, infer
from tauscope.identification.residuals import Fit, ResidualStatistics, evaluate
from tauscope.identification.signs import gravity_scale, reversed_joints
from tauscope.identification.structure import ModelStructure
from tauscope.recording.conditioning import Conditioner, ConditioningEntry
from tauscope.recording.recording import Array, Recording
from tauscope.result_warning import ResultWarning
from tauscope.robot import Robot


def require_motion(conditioners: Sequence[Conditioner]) -> None:
    """Raise IdentificationError where no joint leaves the noise of its own encoder in any recording."""
    if not any(conditioner.moving.any() for conditioner in conditioners):
        names = ", ".join(conditioner.recording.name for conditioner in conditioners)
        raise IdentificationError(
            f"{names}: no joint moves by more than the noise of its position: record a motion that excites every joint"
        )


# A coefficient whose standard error moves the joint's torque by more than this share of its rms is not identifiable.
KNOWN_SHARE = 0.1
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Options:
    """What a user may ask of an identification; `cutoff_hz` is chosen from the data, None for no filter."""

    estimator: Estimator = Estimator.WLS
    cutoff_hz: float | Literal["auto"] | None = "auto"
    rotor_inertia: bool = True
    prior: bool = True  # whether the most probable bodies are delivered, or the free least-squares estimate


@dataclass(frozen=True, eq=False)
class Identification:
    """A model of the arm with what is known about its uncertainty."""

    robot: Robot
    structure: ModelStructure
    parameters: Array  # (p,), the model that is delivered
    free_parameters: Array  # (p,), the LS or WLS estimate, without prior and without bodies
    consistent_parameters: Array  # (p,), the most probable bodies and friction, in the same columns
    constrained: bool  # whether no body can have the free estimate
    reversed_joints: tuple[int, ...]  # joints whose torque fits much better with the other sign, which is not used
    gravity_scale: float | None  # torque of gravity over that of the stated links; None where it cannot be told
    posterior: Posterior
    covariance: Array  # (p + s, p + s), of the parameters, and of the logarithms of the estimated shape constants
    undetermined: np.ndarray  # (p,), parameters about which the recordings say nothing
    shapes: tuple[EstimatedShape, ...]
    consistent: ConsistentParameters
    condition_number: float
    residuals: ResidualStatistics
    free_fit: Fit
    price_of_bodies: Array  # (n,), training residual over that of the free estimate
    predicted_train: Array  # (n,), residual at the recorded rate that noise and covariance lead to expect [Nm or N]
    held_out: Fit | None
    predicted_held_out: Array | None  # (n,), the same of held-out motion [Nm or N]
    excitation: Excitation
    held_out_excitation: Excitation | None
    extrapolation: Array | None  # (n,) or None, share of the held-out torque's rms that training leaves uncertain
    uncertainty_growth: Array | None  # (n,) or None, uncertain torque of held-out motion over that of training
    cutoff_hz: float | None
    options: Options
    recording_warnings: tuple[ResultWarning, ...]
    conditioning: tuple[ConditioningEntry, ...]
    held_out_conditioning: tuple[ConditioningEntry, ...]
    identifiable: tuple[dict[str, bool], ...]


@dataclass(frozen=True, eq=False)
class _Estimates:
    """The free and the most probable model of the training recordings. `weights`: (n,), 1/σ_j of the free estimate."""

    structure: ModelStructure
    shapes: tuple[EstimatedShape, ...]
    factors: tuple[JointFactor, ...]
    weights: Array
    solution: Solution
    free: ResidualStatistics
    posterior: Posterior
    consistent: ConsistentParameters
    reversed_joints: tuple[int, ...]


@ThreadpoolController().wrap(limits=1, user_api="blas")  # factors of 50 columns: threads cost more than they bring
def identify(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    options: Options = Options(),
    progress: Progress = lambda step: None,
) -> Identification:
    """Identify an arm. Raises RecordingError for one too short, broken or of another arm, IdentificationError."""
    for recording in (*recordings, *held_out):
        if recording.joint_count != robot.joint_count:
            raise RecordingMismatchError(
                f"{recording.name}: has {recording.joint_count} joints, robot {robot.name} has {robot.joint_count}:"
                " give the robot file that belongs to it"
            )
    progress("condition recordings")
    base = base_parameters(robot)
    conditioners = [Conditioner.survey(recording, robot) for recording in recordings]
    require_motion(conditioners)
    try:
        asked = options.cutoff_hz
        cutoff = choose_cutoff(conditioners, robot, base) if asked == "auto" else asked
        motions = Dataset(conditioners, robot, base, cutoff)
        found = _estimate(motions, options, progress)
    except IdentificationError as error:
        raise IdentificationError(f"{', '.join(recording.name for recording in recordings)}: {error}") from error
    structure = found.structure
    consistent_parameters = FullParameters.of(structure).map @ found.consistent.parameters
    parameters = consistent_parameters if options.prior else found.solution.parameters
    progress("evaluate residuals")
    (residuals,) = evaluate(motions, structure, [parameters]) if options.prior else (found.free,)
    progress("estimate uncertainty")
    scales = [max(each) for each in zip(*(r.effort_std for r in recordings if r.effort_std), strict=True)]
    covariance = parameter_covariance(
        motions,
        structure,
        parameters,
        found.factors,
        found.posterior.weights if options.prior else found.weights,
        residuals.autoregressions,
        shape_parameters(found.shapes),
        found.posterior if options.prior else None,
        scale_std=scales,
    )
    predict = partial(_predict_residual, found, parameters, residuals.fit, covariance)
    progress("evaluate held-out recordings")
    held_conditioners = [Conditioner.survey(recording, robot) for recording in held_out]
    predicted_train, known = predict(motions)
    held = predicted = beyond = growth = held_excitation = None
    if held_out:
        unseen = Dataset(held_conditioners, robot, base, cutoff, motions.rest_variance)
        held = evaluate(unseen, structure, [parameters])[0].fit
        predicted, uncertain = predict(unseen)
        held_excitation = measure_excitation(unseen)
        beyond = np.divide(uncertain, held.torque_rms, out=np.ones(len(uncertain)), where=held.torque_rms > 0.0)
        growth = uncertain / np.maximum(known, np.finfo(float).tiny)
    return Identification(
        robot=robot,
        structure=structure,
        parameters=parameters,
        free_parameters=found.solution.parameters,
        consistent_parameters=consistent_parameters,
        constrained=is_rejected(found.consistent),
        reversed_joints=found.reversed_joints,
        gravity_scale=gravity_scale(motions, structure, parameters),
        posterior=found.posterior,
        covariance=covariance,
        undetermined=found.solution.undetermined,
        shapes=found.shapes,
        consistent=found.consistent,
        condition_number=condition_number(found.factors, structure.size),
        residuals=residuals,
        free_fit=found.free.fit,
        price_of_bodies=residuals.fit.band_rms / np.maximum(found.free.fit.band_rms, np.finfo(float).tiny),
        predicted_train=predicted_train,
        held_out=held,
        predicted_held_out=predicted,
        excitation=measure_excitation(motions),
        held_out_excitation=held_excitation,
        extrapolation=beyond,
        uncertainty_growth=growth,
        cutoff_hz=cutoff,
        options=options,
        recording_warnings=tuple(warning for each in (*recordings, *held_out) for warning in each.warnings),
        conditioning=tuple(conditioner.summary(cutoff) for conditioner in conditioners),
        held_out_conditioning=tuple(conditioner.summary(cutoff) for conditioner in held_conditioners),
        identifiable=_identifiable(found, covariance),
    )


def _predict_residual(
    found: _Estimates, parameters: Array, fit: Fit, covariance: Array, motions: Dataset
) -> tuple[Array, Array]:
    """Expected residual of motions, and what of it the parameters leave uncertain, (n,) each."""
    left = np.sqrt([factor.squared_residual(found.posterior.mean) / factor.rows for factor in found.factors])
    # In the common band while a joint moves, with the freedom of the parameters.
    noise = fit.moving_rms * found.posterior.noise_std / np.maximum(left, np.finfo(float).tiny)
    outside = np.maximum(fit.rms**2 - fit.band_rms**2, 0.0)
    shapes = shape_parameters(found.shapes)
    uncertain = uncertain_torque(motions, found.structure, parameters, shapes, covariance, noise)
    return np.sqrt(outside + noise**2 + uncertain**2), uncertain


def _estimate(motions: Dataset, options: Options, progress: Progress) -> _Estimates:
    progress("choose model terms")
    structure, shapes, factors = choose_model(motions, motions.robot, motions.base, rotor_inertia=options.rotor_inertia)
    progress("estimate parameters")
    weights, solution = estimate(factors, structure.size, options.estimator)
    coloured = infer(structure, factors, estimator=options.estimator)
    free, believed = evaluate(motions, structure, [solution.parameters, coloured.mean])
    ratios = np.array([model.long_run_ratio for model in believed.autoregressions])
    posterior = infer(structure, factors, ratios, options.estimator)
    consistent = consistent_estimate(structure, posterior.factor, posterior.target, posterior.prior)
    progress("compare signs")
    wrong = reversed_joints(motions, structure, factors, ratios, posterior, consistent)
    return _Estimates(structure, shapes, factors, weights, solution, free, posterior, consistent, wrong)


def _identifiable(found: _Estimates, covariance: Array) -> tuple[dict[str, bool], ...]:
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    described = []
    for joint, (factor, shape) in enumerate(zip(found.factors, found.shapes, strict=True)):
        torque = np.linalg.norm(factor.triangle[:, -1])
        known: dict[str, bool] = {"stribeck": False}
        for name in found.structure.terms[joint].names:
            column = found.structure.coefficient(joint, name)
            if column is None:
                continue
            place = int(np.searchsorted(factor.columns, column))
            reach = std[column] * np.linalg.norm(factor.triangle[:, place])
            known[name] = bool(reach < KNOWN_SHARE * torque) and not bool(found.solution.undetermined[column])
        # Where neither slope is known, a fall with speed and a step of another form are one and the same.
        known["stribeck"] &= shape.delta_identifiable or shape.k_v_identifiable
        known["k_v"], known["delta"] = shape.k_v_identifiable, shape.delta_identifiable
        described.append(known)
    return tuple(described)
