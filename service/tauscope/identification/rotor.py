"""Reflected rotor inertia: a parameter of its own where the data ask for it.

A geared motor's rotor adds I_a q̈_j to its own joint's torque and nothing to the others'. At the first joints that is
one with the links' inertia; further out it can be told apart, and some arms (quasi-direct drives, small wrists) are
not understood without it. Torque sensors behind the gear do not see it, so it is never assumed.
"""

import numpy as np

from tauscope.dynamics.base_parameters import BaseParameters
from tauscope.dynamics.regressor import torque_regressor
from tauscope.identification.least_squares import RANK_TOLERANCE, JointFactor, restrict, solve
from tauscope.identification.structure import ModelStructure
from tauscope.recording.recording import Array
from tauscope.robot import Robot

SEPARATION = 1e-6  # share of a rotor's column that must lie outside the base parameters' columns
STANDARD_ERRORS = 5.0  # a rotor must be this many standard errors away from zero, and positive
# …or this many where the robot file states a gear ratio: a geared motor has a rotor, the question is only whether it
# shows.
GEARED_STANDARD_ERRORS = 2.0
# …and explain this share of its joint's residual energy: less is more likely a stand-in for something else.
SMALLEST_SHARE = 0.02
PROBE_STATES = 30


def separable_rotors(robot: Robot, base: BaseParameters) -> tuple[bool, ...]:
    """Whether no combination of link parameters, offsets and viscous friction can imitate a rotor, (n,)."""
    rng = np.random.default_rng(0)
    count = robot.joint_count
    states = [scale * rng.standard_normal((PROBE_STATES, count)) for scale in (2.0, 2.0, 4.0)]
    regressor = torque_regressor(robot, *states, columns=np.asarray(base.independent_columns))
    own = np.zeros((PROBE_STATES, count, count, 2))
    for joint in range(count):
        own[:, joint, joint] = np.stack([np.ones(PROBE_STATES), states[1][:, joint]], axis=1)
    columns = np.concatenate([regressor, own.reshape(PROBE_STATES, count, -1)], axis=2)
    stacked = columns.reshape(PROBE_STATES * count, -1)
    left, singular, _ = np.linalg.svd(stacked / np.linalg.norm(stacked, axis=0), full_matrices=False)
    basis = left[:, singular > RANK_TOLERANCE * singular[0]]
    separable = []
    for joint in range(count):
        column = np.zeros((PROBE_STATES, count))
        column[:, joint] = states[2][:, joint]
        flat = column.ravel()
        outside = flat - basis @ (basis.T @ flat)
        separable.append(bool(np.linalg.norm(outside) > SEPARATION * np.linalg.norm(flat)))
    return tuple(separable)


def needed_rotors(
    factors: tuple[JointFactor, ...], structure: ModelStructure, noise_std: Array, inflation: Array
) -> tuple[bool, ...]:
    """Whether data ask for a rotor, (n,): the least needed drop out; `noise_std`, `inflation` of variances: (n,)."""
    joints = {joint for joint, terms in enumerate(structure.terms) if terms.rotor}
    if _gain_of_all(factors, structure, noise_std) < min(
        (_needed_gain(structure, joint, inflation[joint], factors[joint].rows) for joint in joints), default=np.inf
    ):
        return (False,) * structure.robot.joint_count
    while joints:
        keep = kept_columns(structure, joints)
        smaller = restrict(factors, keep)
        solution = solve(smaller, len(keep), noise_std)
        columns = structure.coefficients("rotor_inertia")
        places = {joint: int(np.searchsorted(keep, columns[joint])) for joint in joints}
        excess = {
            joint: max(solution.parameters[place], 0.0) ** 2
            / np.sum(solution.spread[place] ** 2)
            / _needed_gain(structure, joint, inflation[joint], factors[joint].rows)
            for joint, place in places.items()
        }
        weakest = min(joints, key=lambda joint: excess[joint])
        if excess[weakest] >= 1.0:
            break
        joints.remove(weakest)
    return tuple(joint in joints for joint in range(structure.robot.joint_count))


def _gain_of_all(factors: tuple[JointFactor, ...], structure: ModelStructure, noise_std: Array) -> float:
    """What all rotors together take off the criterion: no single one can take more."""
    keep = kept_columns(structure, set())
    smaller = restrict(factors, keep)
    fits = ((factors, structure.size), (smaller, len(keep)))
    criteria = []
    for joint_factors, size in fits:
        parameters = solve(joint_factors, size, noise_std).parameters
        squares = [factor.squared_residual(parameters) for factor in joint_factors]
        criteria.append(float(np.sum(np.array(squares) / noise_std**2)))
    return criteria[1] - criteria[0]


def _needed_gain(structure: ModelStructure, joint: int, inflation: float, rows: int) -> float:
    """What a rotor must take off the criterion to stay [noise variances]."""
    if structure.robot.joints[joint].gear_ratio is not None:
        return GEARED_STANDARD_ERRORS**2
    return max(STANDARD_ERRORS**2 * inflation, SMALLEST_SHARE * rows)


def kept_columns(structure: ModelStructure, rotors: set[int]) -> np.ndarray:
    """Global columns of a model when only some of its rotors stay. Returns (k,) int, ascending."""
    dropped = [column for joint, column in structure.coefficients("rotor_inertia").items() if joint not in rotors]
    return np.setdiff1d(np.arange(structure.size), np.array(dropped, dtype=int))
