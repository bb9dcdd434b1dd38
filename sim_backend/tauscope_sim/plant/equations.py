"""Equations of motion of the plant: rigid bodies, friction, concealed effects, compliant transmissions."""

from collections.abc import Mapping, Sequence
from functools import reduce
from math import atan, pi

import numpy as np

from tauscope.errors import ScenarioError
from tauscope.robot.robot import Array, FrictionCoefficients, FrictionShape, Robot
from tauscope_sim.friction import shape_constants
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.plant.term import (
    Coordinates,
    Forces,
    Moment,
    PhysicalEffect,
    Slopes,
    Term,
    Transmission,
    loaded_accelerations,
)


def compliant_transmissions(effects: Sequence[PhysicalEffect], rotor_inertia: Array) -> dict[int, Transmission]:
    """Compliant transmissions by joint, from 0. Raises ScenarioError. `rotor_inertia`: (n,) [kg m² or kg]."""
    found: dict[int, Transmission] = {}
    for transmission in (effect.transmission() for effect in effects):
        if transmission is None:
            continue
        joint = transmission.joint - 1
        if joint in found:
            raise ScenarioError(
                f"joint {joint + 1}: joint_elasticity or backlash stands twice; a joint has one transmission "
                "(the contact_stiffness of backlash is its elasticity)"
            )
        if rotor_inertia[joint] > 0.0:
            raise ScenarioError(
                f"joint {joint + 1}: its compliant transmission states rotor_inertia itself; "
                "remove the effect rotor_inertia"
            )
        found[joint] = transmission
    return found


class Compliance:
    """All compliant transmissions of an arm. `transmissions`: by joint, counted from 0."""

    def __init__(self, transmissions: Mapping[int, Transmission], coordinates: Coordinates) -> None:
        self._parts = [(joint, coordinates.motor(joint), transmissions[joint]) for joint in coordinates.compliant]
        self.rotor_inertia: Array = np.array([part.rotor_inertia for _, _, part in self._parts])
        """of the motors, in the order of the coordinates [kg m² or kg]"""

    def torque(self, moment: Moment) -> list[float]:
        """Torque that each compliant joint's link receives [Nm or N]."""
        return [part.torque(*_twist(moment, joint, motor)) for joint, motor, part in self._parts]

    def linearise(self, moment: Moment, forces: Forces, slopes: Slopes) -> None:
        """Add stiffness and damping between motors and links."""
        for joint, motor, part in self._parts:
            felt = 1.0 + forces.load_gain[joint] + np.sign(moment.load[joint]) * forces.load_friction[joint]
            matrices = (slopes.by_position, slopes.by_velocity)
            for slope, matrix in zip(part.torque_slopes(*_twist(moment, joint, motor)), matrices, strict=True):
                matrix[joint, joint] += slope
                matrix[joint, motor] -= slope
                matrix[motor, motor] += felt * slope
                matrix[motor, joint] -= felt * slope

    def twist_at_rest(self, load: list[float]) -> list[float]:
        """Twist of each compliant joint at rest [rad or m]. `load`: torque that the links need [Nm or N]."""
        return [part.twist_at_rest(load[joint]) for joint, _, part in self._parts]


def _twist(moment: Moment, joint: int, motor: int) -> tuple[float, float]:
    return (moment.position[motor] - moment.position[joint], moment.velocity[motor] - moment.velocity[joint])


_SCALE = 2.0 / pi


class StaticFriction(Term):
    """τ_f = τ_s (2/π) arctan(K_v v) + τ_sc (2/π) arctan(δ v) + τ_v v; RobotFileError without a shape constant."""

    def __init__(
        self,
        friction: Sequence[FrictionCoefficients],
        friction_shape: Sequence[FrictionShape],
        coordinates: Coordinates,
    ) -> None:
        constants = shape_constants(friction, friction_shape)
        # number from 0, place of the motor, levels times 2/π, steepnesses, τ_v
        self._laws = [
            (joint, coordinates.motor(joint), one.stiction * _SCALE, k_v, one.stribeck * _SCALE, delta, one.viscous)
            for joint, (one, (k_v, delta)) in enumerate(zip(friction, constants, strict=True))
        ]

    def act(self, moment: Moment, forces: Forces) -> None:
        """Add τ_f."""
        velocity, friction = moment.velocity, forces.friction
        for joint, place, stiction, k_v, stribeck, delta, viscous in self._laws:
            v = velocity[place]
            friction[joint] += stiction * atan(k_v * v) + stribeck * atan(delta * v) + viscous * v

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        """Add dτ_f/dv."""
        for _, place, stiction, k_v, stribeck, delta, viscous in self._laws:
            x, y = k_v * moment.velocity[place], delta * moment.velocity[place]
            slope = stiction * k_v / (1.0 + x * x) + stribeck * delta / (1.0 + y * y) + viscous
            slopes.by_velocity[place, place] += slope


class EquationsOfMotion:
    """Accelerations and rates of the plant, and their linearisation.

    A rigid joint obeys the equation of `tauscope_sim.plant.term`; a compliant one has two coordinates, link and motor,
    with T between them: H(q) q̈ + h + c + link = T, J θ̈ + friction + motor + T (1 + g) + |T| f = u. Raises
    RobotFileError, ScenarioError where robot or effects do not fit.
    """

    def __init__(self, robot: Robot, effects: Sequence[PhysicalEffect]) -> None:
        real = reduce(lambda arm, effect: effect.alter(arm), effects, robot)
        count = real.joint_count
        stated = np.array(real.model.rotor_inertia or (0.0,) * count)
        self._rotors = sum((effect.added_rotor_inertia(real) for effect in effects), stated)
        transmissions = compliant_transmissions(effects, self._rotors)
        self.coordinates = Coordinates(count, tuple(sorted(transmissions)))
        self._count, self._size = count, self.coordinates.size
        self.compliance = Compliance(transmissions, self.coordinates)
        self.bodies = RigidBodies(real, self._rotors)
        self._terms = _terms(real, effects, self.coordinates)
        self.state_count = 0
        for term in self._terms:
            term.first_state = self.state_count
            self.state_count += term.state_count
        self._acting = _overriding(self._terms, "act")
        self._linearising = _overriding(self._terms, "linearise")
        self._evolving = _overriding(self._terms, "rates")
        self._heating = _overriding(self._terms, "report_temperature")
        self._loaded = any(term.depends_on_load for term in self._terms)
        self._plain = not (self._loaded or self._evolving or self.coordinates.compliant)
        self.event_times = sorted({time for term in self._terms for time in term.event_times})
        self._moment = Moment(self.coordinates, self.bodies)
        self._forces = Forces(count)
        self._slopes = Slopes(self.coordinates.size, self.state_count)
        self._matrix = np.diag(np.concatenate([np.ones(count), self.compliance.rotor_inertia]))
        self._last_load = np.ones(count)

    def initial_states(self) -> list[float]:
        """Internal states of an arm that rests, m numbers."""
        return [state for term in self._terms for state in term.initial_states()]

    def begin(self, time: float) -> None:
        """Let the terms take note that an interval without events begins. `time`: its first instant [s]."""
        for term in self._terms:
            term.begin(time, self.bodies)

    def temperature(self, states: list[float], ambient: float) -> Array:
        """Temperature of the joints, (n,) [°C]. `ambient`: temperature of joints that no term heats [°C]."""
        temperature = np.full(self.coordinates.joint_count, ambient)
        for term in self._heating:
            term.report_temperature(states, temperature)
        return temperature

    def evaluate(self, time: float, vector: list[float], drive: list[float]) -> list[float]:
        """Rate of change of y = [p, v, z], 2N + m. `time`: t [s]; `drive`: u, the drives' joint torque [Nm or N]."""
        size = self._size
        link_side = self.load_at(time, vector)
        forces, moment = self._forces, self._moment
        motor_side = [u - f - m for u, f, m in zip(drive, forces.friction, forces.motor, strict=True)]
        velocity = vector[size : 2 * size]
        if self._plain:
            torque = [u - b for u, b in zip(motor_side, link_side, strict=True)]
            return velocity + self.bodies.accelerations(torque).tolist()
        acceleration, load = self._accelerations(np.array(motor_side), np.array(link_side))
        moment.load = load.tolist()
        moment.friction = [
            friction + abs(carried) * share
            for friction, carried, share in zip(forces.friction, moment.load, forces.load_friction, strict=True)
        ]
        rates = [0.0] * self.state_count
        for term in self._evolving:
            term.rates(moment, rates)
        return velocity + acceleration.tolist() + rates

    def linearise(self) -> tuple[Array, Slopes]:
        """Mass matrix (N, N) and slopes at the state that was evaluated last; overwritten by the next call."""
        slopes, moment = self._slopes, self._moment
        slopes.all[:] = 0.0
        for term in self._linearising:
            term.linearise(moment, slopes)
        if self.coordinates.compliant:
            self.compliance.linearise(moment, self._forces, slopes)
        if not self._loaded:
            count = self._count
            self._matrix[:count, :count] = self.bodies.mass_matrix()
        return self._matrix, slopes

    def load_at(self, time: float, vector: list[float]) -> list[float]:
        """Move the links at t [s], sum the terms into `Forces`; h + c + link, one a joint [Nm or N]."""
        count, size = self._count, self._size
        moment, forces = self._moment, self._forces
        self.bodies.update(vector[:count], vector[size : size + count])
        moment.time = time
        moment.position, moment.velocity, moment.states = vector[:size], vector[size : 2 * size], vector[2 * size :]
        forces.clear()
        for term in self._acting:
            term.act(moment, forces)
        return [bias + link for bias, link in zip(self.bodies.bias.tolist(), forces.link, strict=True)]

    def _accelerations(self, motor_side: Array, link_side: Array) -> tuple[Array, Array]:
        """Solve for v̇ (N,) and the load (n,), given u - friction - motor and h + c + link."""
        drive = motor_side.copy()
        own_gain, own_friction = np.array(self._forces.load_gain), np.array(self._forces.load_friction)
        gain, friction = own_gain.copy(), own_friction.copy()
        compliant = list(self.coordinates.compliant)
        if compliant:
            torque = self.compliance.torque(self._moment)
            # links of compliant joints are driven by their transmission, which hands on all that it holds
            drive[compliant], gain[compliant], friction[compliant] = torque, 0.0, 0.0
        if self._loaded:
            matrix = self.bodies.mass_matrix()
            pair = np.array([matrix, matrix - np.diag(self._rotors)])
            links, load, loaded = loaded_accelerations(pair, drive, link_side, gain, friction, self._last_load)
            self._matrix[: len(links), : len(links)] = loaded
            self._last_load = load
        else:
            links = self.bodies.accelerations(drive - link_side)
            load = drive - self._rotors * links
        if not compliant:
            return links, load
        lost = load * (1.0 + own_gain) + np.abs(load) * own_friction
        motors = (motor_side - lost)[compliant] / self.compliance.rotor_inertia
        return np.concatenate([links, motors]), load


def _terms(robot: Robot, effects: Sequence[PhysicalEffect], coordinates: Coordinates) -> tuple[Term, ...]:
    own: tuple[Term, ...] = ()
    if robot.model.friction is not None:
        shape = [joint.friction_shape for joint in robot.joints]
        own = (StaticFriction(robot.model.friction, shape, coordinates),)
    return own + tuple(term for effect in effects for term in effect.terms(robot, coordinates))


def _overriding(terms: Sequence[Term], hook: str) -> tuple[Term, ...]:
    """Terms that fill in a hook: the others need not be called."""
    return tuple(term for term in terms if getattr(type(term), hook) is not getattr(Term, hook))
