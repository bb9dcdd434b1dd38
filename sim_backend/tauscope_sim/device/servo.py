"""The drives' own loop, run at every tick: from target and state to torque, within the torque limit.

The gains are those of a unit inertia, scaled by H(q). With e = q_g - q and ω = `BANDWIDTH`,

    position  τ = P + 3 ω H ė + ∫ ω/9 P + g(q) + τ_ff,     P = (3 ω² H + k) e
    damping   τ = -d H q̇                                   d = `DAMPING`: a falling arm sinks at H⁻¹ g / d

where g(q) is the torque that carries the resting arm, as the brakes did before they handed it over.

k is stiffness for joints that have little inertia to scale by but friction to overcome, like a wrist, or the first
joint of an arm that stands upright: the torque limit over `YIELD`, as far as the tick allows it without vibration.
The loop sees the motors' true position and velocity: what the encoders add belongs to what the host is told.
"""

from collections.abc import Sequence
from functools import reduce

import numpy as np

from tauscope.robot.robot import Array, Robot
from tauscope_sim.plant.rigid_bodies import RigidBodies
from tauscope_sim.plant.term import PhysicalEffect

# the damping of a drive with a compliant transmission is tuned to at most this many times its rotor's inertia
LARGEST_EXCESS = 4.0
STIFFNESS_EXCESS = 5.0  # its stiffness may be tuned to so many times more


class InertiaSchedule:
    """H(q) and gravity of the arm as it really is, concealed payloads and rotors included.

    For a joint with a compliant transmission H is scaled down to a multiple of its rotor's inertia, which is all that
    the drive feels between two ticks.
    """

    def __init__(self, robot: Robot, effects: Sequence[PhysicalEffect]) -> None:
        real = reduce(lambda arm, effect: effect.alter(arm), effects, robot)
        rotors = sum((effect.added_rotor_inertia(real) for effect in effects), np.zeros(real.joint_count))
        self._bodies = RigidBodies(real, rotors)
        self._rest = np.zeros(real.joint_count)
        self._largest = np.full(real.joint_count, np.inf)
        for effect in effects:
            if (transmission := effect.transmission()) is not None:
                self._largest[transmission.joint - 1] = LARGEST_EXCESS * transmission.rotor_inertia
        self.compliant = np.isfinite(self._largest)  # joints with a compliant transmission, (n,)
        self._rigid = not self.compliant.any()

    def at(self, position: Array) -> tuple[Array, Array, Array]:
        """What scales damping and stiffness, and what carries the resting arm; overwritten by the next call.

        `position`: (n,), q [rad or m]. Returns H(q), scaled down where transmissions are compliant, (n, n) [kg m² or
        kg]; likewise, less so, (n, n); gravity's torque, (n,) [Nm or N].
        """
        self._bodies.update(position, self._rest)
        matrix, load = self._bodies.mass_matrix(), self._bodies.bias
        if self._rigid:
            return matrix, matrix, load
        return self._scale(matrix, 1.0), self._scale(matrix, STIFFNESS_EXCESS), load

    def _scale(self, matrix: Array, excess: float) -> Array:
        """H with the rows and columns of compliant joints scaled down; it stays positive definite."""
        scale = np.sqrt(np.minimum(1.0, excess * self._largest / matrix.diagonal()))
        return matrix * np.multiply.outer(scale, scale)


BANDWIDTH = 80.0  # ω of the position loop [rad/s]
DAMPING = 200.0  # deceleration a unit of speed when damping [1/s]
YIELD = 0.4  # error at which the stiffness k alone gives the full torque [rad or m]

_PROPORTIONAL = 3.0 * BANDWIDTH**2
_DERIVATIVE = 3.0 * BANDWIDTH
_INTEGRAL = BANDWIDTH / 9.0
_INTEGRAL_COMPLIANT = BANDWIDTH / 30.0
_TICKS_PER_STIFFNESS = 16


class Servo:
    """Torque of the drives, with an integral, slower where transmissions are compliant. `tick_s`: [s]."""

    def __init__(self, robot: Robot, inertia: InertiaSchedule, tick_s: float) -> None:
        self._inertia = inertia
        self._tick_s = tick_s
        limits = [joint.limits.torque for joint in robot.joints]
        self._motor_limit = np.array([np.inf if limit is None else limit for limit in limits])
        self._limit = self._motor_limit
        friction = robot.model.friction
        viscous = np.zeros(robot.joint_count) if friction is None else np.array([one.viscous for one in friction])
        # What sampling makes of stiffness k is negative damping k h/2. An inertia M bears as much as half its own
        # damping 3 ω M makes up for; where there is none, friction c alone bears k h < c.
        self._bearable_by_inertia = 0.5 * _DERIVATIVE / (0.5 * tick_s)
        self._bearable_by_friction = 0.5 * viscous / tick_s
        self._wanted_stiffness = np.where(np.isfinite(self._motor_limit), self._motor_limit / YIELD, 0.0)
        self._integral = np.zeros(robot.joint_count)
        self._integral_step = tick_s * np.where(inertia.compliant, _INTEGRAL_COMPLIANT, _INTEGRAL)
        self._age = _TICKS_PER_STIFFNESS

    def set_torque_limit(self, limit: Array) -> None:
        """Cap the torque below what the motors can give. `limit`: (n,), cap; infinite where there is none [Nm or N]."""
        self._limit = np.minimum(limit, self._motor_limit)

    def begin(self) -> None:
        """Begin a position loop, with nothing to remember."""
        self._integral = np.zeros_like(self._limit)
        self._age = _TICKS_PER_STIFFNESS

    def absorb(self, feed_forward: Array) -> None:
        """Keep a feed-forward torque that is about to end, so that nothing jerks. `feed_forward`: (n,) [Nm or N]."""
        self._integral = self.capped(self._integral + feed_forward)

    def track(self, error: Array, error_rate: Array, feed_forward: Array | None, position: Array) -> Array:
        """Torque of the position loop, (n,). `error`, `error_rate`: target less arm; `feed_forward`; `position`: q."""
        damping, stiffness, load = self._renew(position)
        proportional = stiffness.dot(_PROPORTIONAL * error) + self._stiffness * error
        integral = self._integral + self._integral_step * proportional
        wanted = proportional + damping.dot(_DERIVATIVE * error_rate) + integral + load
        if feed_forward is not None:
            wanted += feed_forward
        torque = self.capped(wanted)
        saturated = torque != wanted
        if saturated.any():
            # a joint at its limit keeps its integral, or it would overshoot once the limit lets go
            integral = np.where(saturated, self._integral, integral)
        self._integral = integral
        return torque

    def damp(self, position: Array, velocity: Array) -> Array:
        """Torque against motion, (n,) [Nm or N]. `position`: q, for H(q) [rad or m]; `velocity`: q̇ [rad/s or m/s]."""
        damping, _, _ = self._renew(position)
        return self.capped(-DAMPING * damping.dot(velocity))

    def capped(self, torque: Array) -> Array:
        """Torque within the limit, (n,) [Nm or N]. `torque`: (n,), wanted [Nm or N]."""
        return np.minimum(np.maximum(torque, -self._limit), self._limit)

    def _renew(self, position: Array) -> tuple[Array, Array, Array]:
        """Scale the gains by the inertia at a place: at every tick, or torque would ripple in step with the host."""
        gains = self._inertia.at(position)
        self._age += 1
        if self._age >= _TICKS_PER_STIFFNESS:
            self._age = 0
            lone_inertia = 1.0 / np.linalg.inv(gains[0]).diagonal()
            bearable = np.maximum(self._bearable_by_inertia * lone_inertia, self._bearable_by_friction)
            self._stiffness = np.minimum(self._wanted_stiffness, bearable)
        return gains
