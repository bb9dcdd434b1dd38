"""Simulated recordings whose truth is known, and that truth in an identification's own columns."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from tauscope.identification import Identification
from tauscope.recording import Recording
from tauscope.robot import FrictionCoefficients, FrictionShape, JointLimits, LinkInertia, Model, Robot, read_robot
from tauscope.robot.robot import STANDARD_PARAMETERS
from tauscope_sim.examples import example_robot
from tauscope_sim.motion import FourierMotion, random_fourier_motion
from tauscope_sim.recording import SimulatedRecording, simulate_recording

Array = NDArray[np.float64]

PAPER_NOISE = np.array([0.5, 0.3, 0.7])
"""σ_τ of the paper's section 6 [Nm]."""


@dataclass(frozen=True, eq=False)
class SimulatedArm:
    """An arm, its exact motion and torque; noise is drawn anew for every recording.

    robot : Robot
        the true arm, its model block included
    exact : SimulatedRecording
        motion and torque without noise
    """

    robot: Robot
    exact: SimulatedRecording

    def recording(
        self,
        torque_noise: Array | float = 0.0,
        position_noise: Array | float = 0.0,
        *,
        extra_torque: Array | float = 0.0,
        periods: bool = True,
        name: str = "simulated",
    ) -> Recording:
        """What a logger leaves: exact signals plus (N, n) noise; without `periods` nobody says that it repeats."""
        exact = self.exact
        return Recording.from_arrays(
            name,
            exact.time,
            exact.exact.position + position_noise,
            exact.torque_exact + extra_torque + torque_noise,
            period=exact.period.astype(np.float64) if periods else None,
        )

    def white(self, std: Array | float, rng: np.random.Generator) -> Array:
        """White Gaussian noise of the recording's shape."""
        return np.asarray(std) * rng.standard_normal(self.exact.torque_exact.shape)


@cache
def paper_robot() -> Robot:
    """The paper's arm as its robot file says, K_v and δ included."""
    return read_robot(example_robot("paper_arm"))


def with_shapes(robot: Robot, k_v: float | None, delta: float | None) -> Robot:
    """The arm with these constants of the friction's shape at every joint."""
    joints = tuple(replace(joint, friction_shape=FrictionShape(k_v, delta)) for joint in robot.joints)
    return replace(robot, joints=joints)


def with_limits(robot: Robot, position: float, velocity: float, acceleration: float) -> Robot:
    """The arm with these limits at every joint."""
    limits = JointLimits((-position, position), velocity, acceleration)
    return replace(robot, joints=tuple(replace(joint, limits=limits) for joint in robot.joints))


def with_model(robot: Robot, parameters: Array, friction: Sequence[FrictionCoefficients] | None = None) -> Robot:
    """The arm with these standard parameters (10 n,) as its truth."""
    links = tuple(LinkInertia.from_vector(row) for row in parameters.reshape(-1, len(STANDARD_PARAMETERS)))
    return replace(robot, model=Model(links, None if friction is None else tuple(friction)))


def simulate(
    robot: Robot,
    *,
    seed: int = 0,
    rate_hz: float = 100.0,
    periods: int = 3,
    period_s: float = 10.0,
    motion: FourierMotion | None = None,
    friction: Sequence[FrictionCoefficients] | None = None,
) -> SimulatedArm:
    """One exact simulation by MuJoCo on a random Fourier motion within the joints' limits."""
    rng = np.random.default_rng(seed)
    if motion is None:
        motion = random_fourier_motion(robot.joints, rng, period_s=period_s)
    if friction is not None:
        robot = replace(robot, model=replace(robot.model, friction=tuple(friction)))
    exact = simulate_recording(robot, motion, rate_hz=rate_hz, periods=periods, noise_std=0.0, rng=rng)
    return SimulatedArm(robot, exact)


def true_parameters(result: Identification, robot: Robot, rotors: Sequence[float] | None = None) -> Array:
    """The truth in the columns of an identification, (p,): base expressions, friction, rotors."""
    links = robot.model.links
    assert links is not None
    standard = {
        f"{name}{number}": float(value)
        for number, link in enumerate(links, 1)
        for name, value in zip(STANDARD_PARAMETERS, link.to_vector(), strict=True)
    }
    values = [sum(factor * standard[name] for name, factor in terms.items()) for terms in result.structure.base.terms]
    friction = robot.model.friction or (FrictionCoefficients(),) * robot.joint_count
    for joint, (terms, coefficients) in enumerate(zip(result.structure.terms, friction, strict=True)):
        known = {
            "stiction": coefficients.stiction,
            "stribeck": coefficients.stribeck,
            "viscous": coefficients.viscous,
            "offset": 0.0,
            "rotor_inertia": 0.0 if rotors is None else rotors[joint],
        }
        values += [known[name] for name in terms.names]
    return np.array(values)


def standard_errors(result: Identification) -> Array:
    """Standard errors of the free estimate, (p,)."""
    return np.sqrt(np.diag(result.covariance)[: result.structure.size])


def z_scores(result: Identification, robot: Robot, rotors: Sequence[float] | None = None) -> Array:
    """(estimate - truth) / standard error of the free estimate, (p,); NaN for what the recordings say nothing about."""
    errors = np.where(result.undetermined, np.nan, standard_errors(result))
    return (result.free_parameters - true_parameters(result, robot, rotors)) / errors


def runs(few: int, many: int) -> pytest.MarkDecorator:
    """The number of runs that differ by their noise: few in a quick test, many in a whole proof."""
    return pytest.mark.parametrize("runs", [few, pytest.param(many, marks=pytest.mark.proof)])


def rms(values: Array) -> float:
    """Root mean square of all values."""
    return float(np.sqrt(np.mean(np.square(values))))
