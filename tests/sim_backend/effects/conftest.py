"""Two arms with textbook equations of motion, and an integrator that shares nothing with the plant's.

The equations are written out again here and integrated by SciPy's Radau to seven digits, a thousand times finer than
the tests ask; the plant has to leave the same motion, and a clearly different one from an arm without the effect.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from arms import arm, dh_segment
from tauscope.robot.robot import FrictionCoefficients, FrictionShape, LinkInertia, Model, Robot
from tauscope_sim.plant import Plant

Array = NDArray[np.float64]
Rates = Callable[[float, Array, Array], Array]

GRAVITY = 9.81
K_V, DELTA = 500.0, 10.0
SEGMENT_S = 0.02
AMBIENT = 25.0


def smooth_sign(v: Any, k_v: float = K_V) -> Any:
    """The paper's equation (8), written out again."""
    return np.arctan(k_v * v) * 2.0 / np.pi


@dataclass(frozen=True)
class Pendulum:
    """One joint about a horizontal axis: I q̈ + m g l cos q + τ_f(q̇) = u, with the friction of equation (7)."""

    inertia: float = 0.3
    moment: float = 0.5
    stiction: float = 0.8
    stribeck: float = -0.2
    viscous: float = 0.15

    @property
    def robot(self) -> Robot:
        mass = 2.0
        link = LinkInertia(mass, np.array([self.moment, 0.0, 0.0]), np.diag([self.inertia] * 3))
        bare = arm("pendulum", [dh_segment(0.0, 0.0, 0.0, 0.0)], gravity=(0.0, -GRAVITY, 0.0))
        joint = replace(bare.joints[0], friction_shape=FrictionShape(K_V, DELTA), gear_ratio=50.0)
        friction = FrictionCoefficients(self.stiction, self.stribeck, self.viscous)
        return replace(bare, joints=(joint,), model=Model((link,), (friction,)))

    def friction(self, v: float) -> float:
        return self.stiction * smooth_sign(v) + self.stribeck * smooth_sign(v, DELTA) + self.viscous * v

    def gravity(self, q: float) -> float:
        return self.moment * GRAVITY * np.cos(q)


@dataclass(frozen=True)
class PlanarArm:
    """Two point masses on links in a vertical plane: M(q) q̈ + c(q, q̇) + g(q) + τ_f(q̇) = u."""

    lengths: tuple[float, float] = (0.5, 0.4)
    masses: tuple[float, float] = (2.0, 1.5)
    gravity: tuple[float, float] = (0.0, -GRAVITY)
    coulomb: float = 0.4
    viscous: float = 0.2

    @property
    def robot(self) -> Robot:
        a, b = self.lengths
        bare = arm("planar", [dh_segment(0.0, 0.0, a, 0.0), dh_segment(0.0, 0.0, b, 0.0)], gravity=(*self.gravity, 0.0))
        # the masses sit in the origins of the link frames, at the links' ends
        links = tuple(LinkInertia(m, np.zeros(3), np.zeros((3, 3))) for m in self.masses)
        friction = (FrictionCoefficients(self.coulomb, 0.0, self.viscous),) * 2
        joints = tuple(replace(joint, friction_shape=FrictionShape(K_V, DELTA)) for joint in bare.joints)
        return replace(bare, joints=joints, model=Model(links, friction))

    def tool(self, q: Array) -> tuple[Array, Array]:
        """Jacobians (2, 2) of the two masses' places."""
        (a, b), one, two = self.lengths, q[0], q[0] + q[1]
        elbow = np.array([[-a * np.sin(one), 0.0], [a * np.cos(one), 0.0]])
        wrist = elbow + b * np.array([[-np.sin(two), -np.sin(two)], [np.cos(two), np.cos(two)]])
        return elbow, wrist

    def mass_matrix(self, q: Array) -> Array:
        elbow, wrist = self.tool(q)
        return self.masses[0] * elbow.T @ elbow + self.masses[1] * wrist.T @ wrist

    def bias(self, q: Array, v: Array) -> Array:
        (a, b), (_, m2) = self.lengths, self.masses
        elbow, wrist = self.tool(q)
        h = m2 * a * b * np.sin(q[1])
        coriolis = np.array([-h * (2.0 * v[0] * v[1] + v[1] ** 2), h * v[0] ** 2])
        weight = self.masses[0] * elbow.T @ self.gravity + m2 * wrist.T @ self.gravity
        return coriolis - weight

    def friction(self, v: Array) -> Array:
        return self.coulomb * smooth_sign(v) + self.viscous * v


@dataclass(frozen=True)
class Trial:
    """Torque held over segments of `SEGMENT_S`, and a start at rest."""

    start: Array
    torque: Array

    def simulate(self, robot: Robot, effects: Sequence[Any] = (), step_s: float = 5e-4) -> dict[str, Array]:
        """Motor and link positions and velocities, temperature: each (K, n)."""
        plant = Plant(robot, effects, step_s=step_s)
        plant.place(self.start)
        states = []
        for torque in self.torque:
            plant.advance(torque, SEGMENT_S)
            states.append(plant.state)
        names = ("motor_position", "motor_velocity", "link_position", "link_velocity", "temperature")
        return {name: np.array([getattr(state, name) for state in states]) for name in names}

    def integrate(self, rates: Rates, start: Array, tolerance: float = 1e-7) -> Array:
        """Reference: y' = rates(t, y, u), (K, len(y))."""
        rows, y = [], np.asarray(start, dtype=np.float64)
        for number, torque in enumerate(self.torque):
            begin = number * SEGMENT_S
            solution = solve_ivp(
                rates, (begin, begin + SEGMENT_S), y, method="Radau", args=(torque,), rtol=tolerance, atol=1e-10
            )
            assert solution.success, solution.message
            y = solution.y[:, -1]
            rows.append(y)
        return np.array(rows)


def swing(start: Sequence[float], level: Sequence[float], bias: Sequence[float], segments: int = 40) -> Trial:
    """A torque that drives each joint to and fro about what holds it, with several reversals."""
    time = np.arange(segments) * SEGMENT_S
    phases = np.multiply.outer(time, 2.0 * np.pi * np.array([2.5, 3.4])[: len(level)])
    return Trial(np.array(start), np.array(bias) + np.array(level) * np.sin(phases))


@pytest.fixture
def pendulum() -> Pendulum:
    return Pendulum()


@pytest.fixture
def planar() -> PlanarArm:
    return PlanarArm()


@pytest.fixture
def pendulum_trial() -> Trial:
    return swing([0.3], [14.0], [4.0])


@pytest.fixture
def planar_trial() -> Trial:
    return swing([0.3, 0.5], [9.0, 5.0], [24.0, 4.0])


PendulumCheck = Callable[..., dict[str, Array]]


@pytest.fixture
def follows(pendulum: Pendulum, pendulum_trial: Trial) -> PendulumCheck:
    """Checks that a pendulum with an effect follows I q̈ = u - m g l cos q - τ(t, q, v), and not the plain one."""

    def check(
        effect: Any, resistance: Callable[[float, float, float], float], inertia: float = 0.0, tolerance: float = 1e-4
    ) -> dict[str, Array]:
        def rates(t: float, y: Array, u: Array) -> Array:
            q, v = y
            total = u[0] - pendulum.gravity(q) - pendulum.friction(v) - resistance(t, q, v)
            return np.array([v, total / (pendulum.inertia + inertia)])

        return agree(pendulum.robot, [effect], pendulum_trial, rates, tolerance)

    return check


def agree(robot: Robot, effects: Sequence[Any], trial: Trial, rates: Rates, tolerance: float) -> dict[str, Array]:
    """Checks positions and velocities of an arm against the reference; y is [q, q̇]."""
    count = robot.joint_count
    simulated = trial.simulate(robot, effects)
    expected = trial.integrate(rates, np.concatenate([trial.start, np.zeros(count)]))
    plain = trial.simulate(robot)
    np.testing.assert_allclose(simulated["motor_position"], expected[:, :count], rtol=0, atol=tolerance)
    np.testing.assert_allclose(simulated["motor_velocity"], expected[:, count:], rtol=0, atol=30.0 * tolerance)
    changed = np.max(np.abs(simulated["motor_position"] - plain["motor_position"]))
    assert changed > 50.0 * tolerance, f"the effect moves the arm by {changed:g} rad only: the trial shows nothing"
    return simulated


@pytest.fixture
def agrees() -> Callable[..., dict[str, Array]]:
    return agree
