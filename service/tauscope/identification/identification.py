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
from tauscope.identification.friction_shape import EstimatedShape, shape_parameters
from tauscope.identification.least_squares import JointFactor, Solution, condition_number
from tauscope.identification.model_terms import choose_model
from tauscope.identification.physical_estimate import consistent_estimate, in_model_columns, is_rejected
from tauscope.identification.preconditions import require_motion
from tauscope.identification.residuals import Fit, ResidualStatistics, evaluate
from tauscope.identification.structure import ModelStructure
from tauscope.recording.conditioning import Conditioner, ConditioningSummary
from tauscope.recording.recording import Array, Recording
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
    """

    estimator: Estimator = Estimator.WLS
    cutoff_hz: float | Literal["auto"] | None = "auto"
    rotor_inertia: bool = True


@dataclass(frozen=True, eq=False)
class Identification:
    """A model of the arm with what is known about its uncertainty.

    parameters : (p,) float64
        the model that is delivered: the free estimate, or the consistent one where physics rejects the free one
    free_parameters : (p,) float64
        the LS or WLS estimate
    consistent_parameters : (p,) float64
        the nearest physically consistent parameters in the same columns
    covariance : (p + s, p + s) float64
        of the free estimate, and of the logarithms of the estimated shape constants
    undetermined : (p,) bool
        parameters about which the recordings say nothing
    """

    robot: Robot
    structure: ModelStructure
    parameters: Array
    free_parameters: Array
    consistent_parameters: Array
    constrained: bool
    covariance: Array
    undetermined: np.ndarray
    shapes: tuple[EstimatedShape, ...]
    consistent: ConsistentParameters
    condition_number: float
    residuals: ResidualStatistics
    consistent_fit: Fit
    held_out: Fit | None
    held_out_consistent: Fit | None
    cutoff_hz: float | None
    estimator: Estimator
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
        consistent = consistent_estimate(structure, solution)
    estimates = (solution.parameters, in_model_columns(structure, consistent.parameters))
    progress("evaluate residuals")
    free, bound = evaluate(motions, structure, estimates)
    progress("estimate uncertainty")
    covariance = parameter_covariance(
        motions, structure, solution.parameters, factors, weights, free.autoregressions, shape_parameters(shapes)
    )
    constrained = is_rejected(consistent, free)
    progress("evaluate held-out recordings")
    held_conditioners = [Conditioner.survey(recording, robot) for recording in held_out]
    held_free, held_bound = _held_out_fits(held_conditioners, structure, cutoff, estimates)
    return Identification(
        robot=robot,
        structure=structure,
        parameters=estimates[constrained],
        free_parameters=estimates[0],
        consistent_parameters=estimates[1],
        constrained=constrained,
        covariance=covariance,
        undetermined=solution.undetermined,
        shapes=shapes,
        consistent=consistent,
        condition_number=condition_number(factors, structure.size),
        residuals=bound if constrained else free,
        consistent_fit=bound.fit,
        held_out=held_bound if constrained else held_free,
        held_out_consistent=held_bound,
        cutoff_hz=cutoff,
        estimator=options.estimator,
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


def _held_out_fits(
    conditioners: Sequence[Conditioner],
    structure: ModelStructure,
    cutoff_hz: float | None,
    estimates: tuple[Array, Array],
) -> tuple[Fit | None, Fit | None]:
    """Fits of both estimates on recordings that were not used."""
    if not conditioners:
        return None, None
    motions = Dataset(conditioners, structure.robot, structure.base, cutoff_hz)
    free, bound = evaluate(motions, structure, estimates)
    return free.fit, bound.fit


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
        known["k_v"], known["delta"] = shape.k_v_identifiable, shape.delta_identifiable
        described.append(known)
    return tuple(described)
