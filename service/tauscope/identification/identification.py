"""From a robot and recordings to parameters: the whole way, in the order of the steps."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import numpy as np
from threadpoolctl import ThreadpoolController

from tauscope.dynamics.base_parameters import base_parameters
from tauscope.errors import IdentificationError, RecordingMismatchError
from tauscope.identification.band import choose_cutoff
from tauscope.identification.consistency import ConsistentParameters
from tauscope.identification.covariance import parameter_covariance
from tauscope.identification.dataset import Dataset
from tauscope.identification.estimate import Estimator, estimate
from tauscope.identification.excitation import Excitation, measure_excitation
from tauscope.identification.friction_shape import EstimatedShape, shape_parameters
from tauscope.identification.gravity_scale import gravity_scale
from tauscope.identification.least_squares import JointFactor, Solution, condition_number
from tauscope.identification.model_terms import choose_model
from tauscope.identification.physical_estimate import consistent_estimate, in_model_columns, is_rejected
from tauscope.identification.posterior import Posterior, infer
from tauscope.identification.preconditions import require_motion
from tauscope.identification.prediction import uncertain_torque
from tauscope.identification.residuals import Fit, ResidualStatistics, evaluate
from tauscope.identification.signs import reversed_joints
from tauscope.identification.structure import ModelStructure
from tauscope.recording.conditioning import Conditioner, ConditioningSummary
from tauscope.recording.recording import Array, Recording
from tauscope.result_warning import ResultWarning
from tauscope.robot import Robot

KNOWN_SHARE = 0.1
"""A coefficient whose standard error moves the joint's torque by more than this share of its rms is not
identifiable."""

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Options:
    """What a user may ask of an identification.

    cutoff_hz : float, None or "auto"
        band that torque and regressor share [Hz]; None for no filter; chosen from the data by default
    prior : bool
        whether the most probable bodies are delivered, or the free least-squares estimate
    """

    estimator: Estimator = Estimator.WLS
    cutoff_hz: float | Literal["auto"] | None = "auto"
    rotor_inertia: bool = True
    prior: bool = True


@dataclass(frozen=True, eq=False)
class Identification:
    """A model of the arm with what is known about its uncertainty.

    parameters : (p,) float64
        the model that is delivered
    free_parameters : (p,) float64
        the LS or WLS estimate, without prior and without bodies
    consistent_parameters : (p,) float64
        the most probable bodies and friction, in the same columns
    constrained : bool
        whether no body can have the free estimate
    price_of_bodies : (n,) float64
        training residual over that of the free estimate
    gravity_scale : float or None
        torque of gravity over that of the stated links; None where it cannot be told
    reversed_joints : tuple of int
        joints whose torque fits much better with the other sign, which is not used
    covariance : (p + s, p + s) float64
        of the parameters, and of the logarithms of the estimated shape constants
    undetermined : (p,) bool
        parameters about which the recordings say nothing
    predicted_train, predicted_held_out : (n,) float64
        residual at the recorded rate that noise and covariance lead to expect [Nm or N]
    extrapolation : (n,) float64 or None
        share of the held-out torque's rms that training leaves uncertain
    """

    robot: Robot
    structure: ModelStructure
    parameters: Array
    free_parameters: Array
    consistent_parameters: Array
    constrained: bool
    reversed_joints: tuple[int, ...]
    gravity_scale: float | None
    posterior: Posterior
    covariance: Array
    undetermined: np.ndarray
    shapes: tuple[EstimatedShape, ...]
    consistent: ConsistentParameters
    condition_number: float
    residuals: ResidualStatistics
    free_fit: Fit
    price_of_bodies: Array
    predicted_train: Array
    held_out: Fit | None
    predicted_held_out: Array | None
    excitation: Excitation
    held_out_excitation: Excitation | None
    extrapolation: Array | None
    cutoff_hz: float | None
    options: Options
    recording_warnings: tuple[ResultWarning, ...]
    conditioning: tuple[ConditioningSummary, ...]
    held_out_conditioning: tuple[ConditioningSummary, ...]
    identifiable: tuple[dict[str, bool], ...]


@ThreadpoolController().wrap(limits=1, user_api="blas")  # factors of 50 columns: threads cost more than they bring
def identify(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording] = (),
    options: Options = Options(),
    progress: Progress = lambda step: None,
) -> Identification:
    """Identify a robot arm from recordings.

    Raises
    ------
    RecordingMismatchError
        where a recording has another number of joints than the robot
    RecordingError
        where a recording is too short or too broken to be used
    IdentificationError
        where the recordings hold too little for the parameters
    """
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
    with _naming(recordings):
        asked = options.cutoff_hz
        cutoff = choose_cutoff(conditioners, robot, base) if asked == "auto" else asked
    motions = Dataset(conditioners, robot, base, cutoff)
    with _naming(recordings):
        progress("choose model terms")
        structure, shapes, factors = choose_model(motions, robot, base, rotor_inertia=options.rotor_inertia)
        progress("estimate parameters")
        weights, solution = estimate(factors, structure.size, options.estimator)
        coloured = infer(structure, factors, estimator=options.estimator)
        free, believed = evaluate(motions, structure, [solution.parameters, coloured.mean])
        ratios = np.array([model.long_run_ratio for model in believed.autoregressions])
        posterior = infer(structure, factors, ratios, options.estimator)
        consistent = consistent_estimate(structure, posterior.factor, posterior.target, posterior.prior)
        progress("compare signs")
        wrong = reversed_joints(motions, structure, factors, ratios, posterior, consistent)
    consistent_parameters = in_model_columns(structure, consistent.parameters)
    parameters = consistent_parameters if options.prior else solution.parameters
    progress("evaluate residuals")
    (residuals,) = evaluate(motions, structure, [parameters]) if options.prior else (free,)
    progress("estimate uncertainty")
    covariance = parameter_covariance(
        motions,
        structure,
        parameters,
        factors,
        posterior.weights if options.prior else weights,
        residuals.autoregressions,
        shape_parameters(shapes),
        posterior if options.prior else None,
    )
    outside = np.maximum(residuals.fit.rms**2 - residuals.fit.band_rms**2, 0.0)
    left = np.sqrt([factor.squared_residual(posterior.mean) / factor.rows for factor in factors])
    noise = residuals.fit.moving_rms * posterior.noise_std / np.maximum(left, np.finfo(float).tiny)

    def predict(others: Dataset) -> tuple[Array, Array]:
        """Expected residual of a motion, and what of it the parameters leave uncertain, (n,) each."""
        uncertain = uncertain_torque(others, structure, parameters, shape_parameters(shapes), covariance, noise)
        return np.sqrt(outside + noise**2 + uncertain**2), uncertain

    progress("evaluate held-out recordings")
    held_conditioners = [Conditioner.survey(recording, robot) for recording in held_out]
    held = predicted = beyond = held_excitation = None
    if held_out:
        unseen = Dataset(held_conditioners, robot, base, cutoff, motions.rest_variance)
        held = evaluate(unseen, structure, [parameters])[0].fit
        predicted, uncertain = predict(unseen)
        held_excitation = measure_excitation(unseen)
        beyond = uncertain / np.maximum(held.torque_rms, np.finfo(float).tiny)
    return Identification(
        robot=robot,
        structure=structure,
        parameters=parameters,
        free_parameters=solution.parameters,
        consistent_parameters=consistent_parameters,
        constrained=is_rejected(consistent),
        reversed_joints=wrong,
        gravity_scale=gravity_scale(motions, structure, parameters),
        posterior=posterior,
        covariance=covariance,
        undetermined=solution.undetermined,
        shapes=shapes,
        consistent=consistent,
        condition_number=condition_number(factors, structure.size),
        residuals=residuals,
        free_fit=free.fit,
        price_of_bodies=residuals.fit.band_rms / np.maximum(free.fit.band_rms, np.finfo(float).tiny),
        predicted_train=predict(motions)[0],
        held_out=held,
        predicted_held_out=predicted,
        excitation=measure_excitation(motions),
        held_out_excitation=held_excitation,
        extrapolation=beyond,
        cutoff_hz=cutoff,
        options=options,
        recording_warnings=tuple(warning for each in (*recordings, *held_out) for warning in each.warnings),
        conditioning=tuple(conditioner.summary(cutoff) for conditioner in conditioners),
        held_out_conditioning=tuple(conditioner.summary(cutoff) for conditioner in held_conditioners),
        identifiable=_identifiable(structure, factors, covariance, solution, shapes),
    )


@contextmanager
def _naming(recordings: Sequence[Recording]) -> Iterator[None]:
    """Put the recordings' names before the message of what they could not answer."""
    try:
        yield
    except IdentificationError as error:
        raise IdentificationError(f"{', '.join(recording.name for recording in recordings)}: {error}") from error


def _identifiable(
    structure: ModelStructure,
    factors: tuple[JointFactor, ...],
    covariance: Array,
    solution: Solution,
    shapes: Sequence[EstimatedShape],
) -> tuple[dict[str, bool], ...]:
    """Per joint, which coefficients and shape constants the data can tell."""
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    described = []
    for joint, (factor, shape) in enumerate(zip(factors, shapes, strict=True)):
        torque = np.linalg.norm(factor.triangle[:, -1])
        known: dict[str, bool] = {"stribeck": False}
        for name in structure.terms[joint].names:
            column = structure.coefficient(joint, name)
            if column is None:
                continue
            place = int(np.searchsorted(factor.columns, column))
            reach = std[column] * np.linalg.norm(factor.triangle[:, place])
            known[name] = bool(reach < KNOWN_SHARE * torque) and not bool(solution.undetermined[column])
        # Where neither slope is known, a fall with speed and a step of another form are one and the same.
        known["stribeck"] &= shape.delta_identifiable or shape.k_v_identifiable
        known["k_v"], known["delta"] = shape.k_v_identifiable, shape.delta_identifiable
        described.append(known)
    return tuple(described)
