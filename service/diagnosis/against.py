"""Parameters that a simulation has wrong: the robot file's model, or recordings made in the user's own simulator."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from service.diagnosis.diagnosis import Diagnosis
from service.errors import IdentificationError
from service.identification import Identification, Options, identify
from service.recording.recording import Array, Recording
from service.robot import Robot

DIFFERENT = 3.0
"""Standard errors from which a parameter counts as wrong."""

NEGLIGIBLE = 1e-3
"""…and the part of the larger value that it differs by at least."""


@dataclass(frozen=True)
class ParameterDifference:
    """One parameter.

    parameter : str
        its name
    simulation, real : float
        its values [SI]
    std : float
        standard error of the difference
    """

    parameter: str
    simulation: float
    real: float
    std: float

    @property
    def in_std(self) -> float:
        """Real less simulation in standard errors."""
        return (self.real - self.simulation) / max(self.std, np.finfo(float).tiny)

    @property
    def is_wrong(self) -> bool:
        """Whether the simulation's value is not the arm's."""
        size = max(abs(self.real), abs(self.simulation))
        return abs(self.in_std) > DIFFERENT and abs(self.real - self.simulation) > NEGLIGIBLE * size


def differences_from_model(diagnosis: Diagnosis) -> tuple[ParameterDifference, ...]:
    """What the robot file's model has wrong, measured on the model with all findings.

    Parameters
    ----------
    diagnosis : Diagnosis
        of real recordings

    Returns
    -------
    tuple of ParameterDifference
        base parameters and friction coefficients, most standard errors first

    Raises
    ------
    IdentificationError
        where the robot file has no model
    """
    robot = diagnosis.robot
    if robot.model.links is None and robot.model.friction is None:
        raise IdentificationError(
            f"{robot.source or robot.name}: has no model block to compare with: add one, or leave --against out"
        )
    names, real, std = _measured(diagnosis)
    stated = _stated(robot, diagnosis)
    return _differences(names, [stated.get(name) for name in names], real, std, np.zeros(len(real)))


def differences_from_simulation(
    diagnosis: Diagnosis, robot: Robot, simulated: Sequence[Recording], options: Options
) -> tuple[ParameterDifference, ...]:
    """What a simulator has wrong, from recordings made in it.

    Parameters
    ----------
    diagnosis : Diagnosis
        of real recordings
    robot : Robot
        the arm
    simulated : sequence of Recording
        what the simulator records on motions of its own
    options : Options
        of the identification

    Returns
    -------
    tuple of ParameterDifference
        base parameters and friction coefficients, most standard errors first
    """
    names, real, std = _measured(diagnosis)
    found = identify(robot, simulated, (), options)
    values = dict(zip(found.structure.names, found.free_parameters, strict=True))
    errors = dict(zip(found.structure.names, _errors(found), strict=True))
    simulation = [values.get(name) for name in names]
    return _differences(names, simulation, real, std, np.array([errors.get(name, 0.0) for name in names]))


def _measured(diagnosis: Diagnosis) -> tuple[tuple[str, ...], Array, Array]:
    """Names, values and standard errors of the nominal parameters in the final model."""
    fit = diagnosis.selection.fit
    size = fit.model.structure.size
    inflation = 1.0 if diagnosis.pure_error else fit.inflation()
    return fit.model.structure.names, fit.model.parameters, np.sqrt(np.diag(fit.covariance)[:size] * inflation)


def _errors(found: Identification) -> Array:
    return np.sqrt(np.maximum(np.diag(found.covariance)[: found.structure.size], 0.0))


def _stated(robot: Robot, diagnosis: Diagnosis) -> dict[str, float]:
    """What the robot file's model says, by parameter name; friction that it leaves out is zero."""
    structure = diagnosis.selection.fit.model.structure
    values: dict[str, float] = {}
    if robot.model.links is not None:
        standard = np.concatenate([link.to_vector() for link in robot.model.links])
        values |= dict(zip(structure.base.expressions, structure.base.project(standard), strict=True))
    for joint, described in enumerate(robot.joints):
        friction = None if robot.model.friction is None else robot.model.friction[joint]
        for name in ("stiction", "stribeck", "viscous"):
            values[f"{name} {described.name}"] = 0.0 if friction is None else float(getattr(friction, name))
        values[f"offset {described.name}"] = 0.0
    return values


def _differences(
    names: Sequence[str], simulation: Sequence[float | None], real: Array, std: Array, simulation_std: Array
) -> tuple[ParameterDifference, ...]:
    found = [
        ParameterDifference(name, float(stated), float(value), float(np.hypot(error, own)))
        for name, stated, value, error, own in zip(names, simulation, real, std, simulation_std, strict=True)
        if stated is not None
    ]
    return tuple(sorted((each for each in found if each.is_wrong), key=lambda each: -abs(each.in_std)))
