"""The torque of an effect along a motion that is already known.

τ = H q̈ + h + c + τ_f + x holds along any motion: where x is a law of the motion, the drives of an arm that conceals it
need just x more for the same motion. So one passage under the drives' own loop, with all its sticking at reversals,
serves for many effects without another simulation. A transmission that gives way lets its link move otherwise, which
`concealed.generator.transmissions` works out; where it stands beside other effects, they act on that link too, and the
arm is simulated.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from concealed.generator.forward import Passage
from concealed.generator.rates import FINE, RATE_HZ
from concealed.generator.transmissions import transmission_torque
from tauscope.robot import Robot
from tauscope_sim.effects import Effect
from tauscope_sim.effects.carried_bodies import Payload, PayloadChange, RotorInertia
from tauscope_sim.effects.effect import JointLaw
from tauscope_sim.effects.elastic_transmissions import Backlash, JointElasticity
from tauscope_sim.effects.external_contact import ExternalContact
from tauscope_sim.effects.friction_coupling import FrictionCoupling
from tauscope_sim.effects.friction_drift import FrictionDrift
from tauscope_sim.effects.friction_laws import LoadDependentFriction
from tauscope_sim.effects.geometry_errors import BaseTilt, KinematicError
from tauscope_sim.effects.periodic_torques import TorqueRipple
from tauscope_sim.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope_sim.model import build_model
from tauscope_sim.recording import rigid_body_torque

Array = NDArray[np.float64]

STEP_S = 1.0 / (FINE * RATE_HZ)


def with_law(robot: Robot, effects: tuple[Effect, ...], passage: Passage) -> Passage | None:
    """The passage as it is under some effects; None where that takes a simulation."""
    if len(effects) > 1 and any(isinstance(effect, Backlash | JointElasticity) for effect in effects):
        return None
    torques = [law_torque(robot, effect, passage) for effect in effects]
    if any(each is None for each in torques):
        return None
    return replace(passage, torque=passage.torque + sum(each for each in torques if each is not None))


def law_torque(robot: Robot, effect: Effect, passage: Passage) -> Array | None:
    """Torque (N, n) of an effect that is a law of the motion; None for any other."""
    q, v = passage.position, passage.velocity
    torque = np.zeros_like(q)
    match effect:
        case LoadDependentFriction():
            j = effect.index
            torque[:, j] = effect.mu * np.abs(_load(robot, passage)[:, j]) * _sign(v[:, j], effect.steepness(robot))
        case TorqueRipple():
            ripple, _ = effect.law(robot)
            gain = [ripple(x, 0.0) for x in q[:, effect.index]]
            torque[:, effect.index] = _load(robot, passage)[:, effect.index] * gain
        case JointLaw():
            law, _ = effect.law(robot)
            j = effect.index
            torque[:, j] = [law(*state) for state in zip(q[:, j], v[:, j], strict=True)]
        case FrictionCoupling():
            sign = 1.0 if effect.of == "sum" else -1.0
            common = v[:, effect.index] + sign * v[:, effect.other_joint - 1]
            friction = effect.coulomb * _sign(common, effect.steepness(robot)) + effect.viscous * common
            torque[:, effect.index], torque[:, effect.other_joint - 1] = friction, sign * friction
        case RotorInertia():
            torque[:, effect.index] = effect.inertia * _acceleration(v)[:, effect.index]
        case PreslidingHysteresis():
            torque[:, effect.index] = _bristles(robot, effect, q[:, effect.index], v[:, effect.index])
        case FrictionDrift():
            torque[:, effect.index] = _warming(robot, effect, v[:, effect.index])
        case ExternalContact() if effect.joint is not None:
            torque[:, effect.joint - 1] = (effect.torque or 0.0) * _pressing(effect, len(q))
        case PayloadChange():
            carries = Payload(mass=effect.mass, offset=effect.offset, moments=effect.moments)
            torque = _carrying(effect, len(q)) * (_load(carries.alter(robot), passage) - _load(robot, passage))
        case Backlash() | JointElasticity():
            torque = transmission_torque(robot, effect, q, v)
        case BaseTilt() | Payload() | KinematicError():
            torque = _load(effect.alter(robot), passage) - _load(robot, passage)
        case _:
            return None
    return torque


def _load(robot: Robot, passage: Passage) -> Array:
    """Rigid-body torque by MuJoCo, (N, n) [Nm]."""
    return rigid_body_torque(build_model(robot), passage.position, passage.velocity, _acceleration(passage.velocity))


def _carrying(effect: PayloadChange, count: int) -> Array:
    """One while the body is carried, (N, 1)."""
    time = STEP_S * np.arange(count)[:, None]
    return np.where((time >= effect.start) & (time < (effect.end or np.inf)), 1.0, 0.0)


def _pressing(effect: ExternalContact, count: int) -> Array:
    """w(t), (N,)."""
    phase = (STEP_S * np.arange(count) - effect.start) / effect.duration
    shape = np.sin(np.pi * phase) if effect.profile == "half_sine" else np.ones(count)
    return np.where((phase >= 0.0) & (phase < 1.0), shape, 0.0)


def _acceleration(velocity: Array) -> Array:
    return np.asarray(np.gradient(velocity, STEP_S, axis=0))


def _sign(velocity: Array, k_v: float) -> Array:
    return np.asarray(np.arctan(k_v * velocity) / (0.5 * np.pi))


def _static(robot: Robot, joint: int, velocity: Array) -> tuple[Array, float]:
    """Coulomb and Stribeck part of the robot file's friction (N,), and the viscous coefficient."""
    friction, shape = (robot.model.friction or ())[joint], robot.joints[joint].friction_shape
    curve = friction.stiction * _sign(velocity, shape.k_v or 0.0)
    return curve + friction.stribeck * _sign(velocity, shape.delta or 0.0), friction.viscous


def _bristles(robot: Robot, effect: PreslidingHysteresis, position: Array, velocity: Array) -> Array:
    """Dahl's bristles, exact where the direction does not change within a step."""
    if effect.bristles != "dahl":
        raise ValueError("LuGre's bristles have to be simulated")
    friction = (robot.model.friction or ())[effect.index]
    k_v = robot.joints[effect.index].friction_shape.k_v or 0.0
    z, deflection = 0.0, np.empty(len(position))
    for k, step in enumerate(np.diff(position, prepend=position[0])):
        side = np.sign(step)
        z = side + (z - side) * np.exp(-abs(step) / effect.distance) if step else z
        deflection[k] = z
    return friction.stiction * (deflection - _sign(velocity, k_v))


def _warming(robot: Robot, effect: FrictionDrift, velocity: Array) -> Array:
    """Friction that its own heat changes, step by step."""
    level, viscous = _static(robot, effect.index, velocity)
    warmth, torque = 0.0, np.empty(len(velocity))
    for k, v in enumerate(velocity):
        coulomb, thick = (np.expm1(c * warmth) for c in (effect.coulomb_per_kelvin, effect.viscous_per_kelvin))
        torque[k] = coulomb * level[k] + thick * viscous * v
        heat = (level[k] + viscous * v + torque[k]) * v
        warmth += STEP_S * (effect.thermal_resistance * heat - warmth) / effect.time_constant
    return torque
