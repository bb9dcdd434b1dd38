"""The nominal model: what an identification found, in the form that a diagnosis extends."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from tauscope.diagnosis.model.extended import ExtendedModel
from tauscope.diagnosis.observations.observations import Observations
from tauscope.dynamics import mass_matrix
from tauscope.effects import ArmContext, Signals
from tauscope.identification import Identification
from tauscope.identification.shape_sensitivity import ShapeParameter
from tauscope.recording.conditioning import Conditioner
from tauscope.recording.recording import Array
from tauscope.robot import Robot

POSES = 200  # of a motion, by which the mean of an inertia is told


def nominal_model(identification: Identification) -> ExtendedModel:
    """The identified model, its friction curves' constants free, stated ones too, without rotors: they are effects."""
    constants: list[ShapeParameter] = []
    stated: list[float | None] = []
    for joint, terms in enumerate(identification.structure.terms):
        shape = identification.robot.joints[joint].friction_shape
        constants.append((joint, "k_v"))
        stated.append(shape.k_v)
        if terms.delta is not None:
            constants.append((joint, "delta"))
            stated.append(shape.delta)
    structure = identification.structure
    return ExtendedModel(
        structure=structure.with_terms(tuple(replace(terms, rotor=False) for terms in structure.terms)),
        parameters=_without_rotors(identification, identification.free_parameters),
        links=identification.consistent.parameters[: 10 * identification.robot.link_count],
        constants=tuple(constants),
        stated=tuple(stated),
    )


def delivered_model(identification: Identification) -> ExtendedModel:
    """The model that the identification delivers, which is a body's where the free estimate is none's."""
    parameters = _without_rotors(identification, identification.parameters)
    return replace(nominal_model(identification), parameters=parameters)


def _without_rotors(identification: Identification, parameters: Array) -> Array:
    structure = identification.structure
    rotors = [structure.coefficient(joint, "rotor_inertia") for joint in range(structure.robot.joint_count)]
    return np.delete(parameters, [column for column in rotors if column is not None])


def identified_rotors(identification: Identification) -> dict[int, float]:
    """Joints whose rotor the identification found, with its inertia [kg m² or kg]."""
    structure = identification.structure
    columns = {joint: structure.coefficient(joint, "rotor_inertia") for joint in range(structure.robot.joint_count)}
    return {
        joint: float(identification.free_parameters[column]) for joint, column in columns.items() if column is not None
    }


def setting_of(
    model: ExtendedModel, observations: Observations, conditioners: Sequence[Conditioner], cutoff_hz: float | None
) -> ArmContext:
    """The arm and the ranges of its recorded motion."""
    robot = observations.robot
    motions = [piece.prepared.motion for piece in observations]
    position = np.concatenate([motion.position for motion in motions])
    velocity = np.concatenate([motion.velocity for motion in motions])
    speed = np.abs(velocity)
    slowest, fastest = np.quantile(velocity, [0.01, 0.99], axis=0)
    signals = [model.signals(piece) for piece in observations]
    load = np.concatenate([each.load for each in signals], axis=1)
    torque = np.concatenate([each.torque for each in signals], axis=1)
    coldest, hottest = _temperatures(signals, robot.joint_count)
    nyquist = min(conditioner.timing.rate_hz for conditioner in conditioners) / 2.0
    return ArmContext(
        robot=robot,
        slowest=slowest,
        fastest=fastest,
        lowest=position.min(axis=0),
        highest=position.max(axis=0),
        speed=np.sqrt((speed**2).mean(axis=0)),
        top_speed=speed.max(axis=0),
        load=np.sqrt((load**2).mean(axis=1)),
        top_torque=np.abs(torque).max(axis=1),
        inertia=mean_inertia(robot, signals[0].bodies, position),
        durations=_durations(observations),
        cutoff_hz=nyquist if cutoff_hz is None else cutoff_hz,
        position_std=np.max([conditioner.position_noise_std for conditioner in conditioners], axis=0),
        coldest=coldest,
        hottest=hottest,
    )


def mean_inertia(robot: Robot, bodies: Array, position: Array) -> Array:
    """Mean of the mass matrix's diagonal of `bodies`, (10 n,), along `position`, (N, n), (n,) [kg m² or kg]."""
    poses = position[:: max(len(position) // POSES, 1)]
    diagonal = np.diagonal(mass_matrix(robot, bodies, poses), axis1=1, axis2=2)
    return np.asarray(np.maximum(diagonal.mean(axis=0), 0.0))


def _temperatures(signals: Sequence[Signals], joint_count: int) -> tuple[Array, Array]:
    """Lowest and highest temperature of every joint, (n,) each [°C]; NaN where none was recorded."""
    lowest, highest = np.full(joint_count, np.nan), np.full(joint_count, np.nan)
    for each in signals:
        if each.temperature is not None:
            lowest = np.fmin(lowest, np.fmin.reduce(each.temperature, axis=(1, 2)))
            highest = np.fmax(highest, np.fmax.reduce(each.temperature, axis=(1, 2)))
    return lowest, highest


def _durations(observations: Observations) -> tuple[float, ...]:
    """Length of every recording, however many pieces it has [s]."""
    ends: dict[int, float] = {}
    for piece in observations:
        recording = piece.prepared.recording
        ends[recording] = max(ends.get(recording, 0.0), float(piece.time.max()))
    return tuple(ends[recording] for recording in sorted(ends))
