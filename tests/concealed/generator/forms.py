"""Effects that the catalogue knows under another formula: another curve, another hysteresis, another wave.

Every law gives the torque (N,) that its joint needs in addition along a passage, or its sensor reports in addition.
`size` is about one where the effect is as large as the joint's noise.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from concealed.generator.effects import LARGEST_VARIATION, Ground
from concealed.generator.forward import Passage
from concealed.generator.rates import FINE, RATE_HZ

Array = NDArray[np.float64]
STEP_S = 1.0 / (FINE * RATE_HZ)
SLIDES = np.array([0.002, 0.006, 0.014])
"""Distances over which the elements of a Maxwell-slip model stick [rad]."""


@dataclass(frozen=True, eq=False)
class Along:
    """One joint's passage, and what a law's constants are drawn from: the same on all passages of a trial.

    position, velocity, torque : (N,) float64
        of the joint
    ground : Ground
        what its training motions span
    rng : Generator
        of the constants
    size : float
        how strong it is, in units of the joint's noise
    """

    position: Array
    velocity: Array
    torque: Array
    ground: Ground
    rng: np.random.Generator
    size: float

    @property
    def amplitude(self) -> float:
        return self.size * self.ground.noise

    @property
    def sign(self) -> Array:
        """Direction of motion, with another smoothing than the catalogue's."""
        return np.asarray(np.tanh(self.velocity / 0.004))

    @property
    def reach(self) -> float:
        return self.ground.high - self.ground.low

    @property
    def from_middle(self) -> Array:
        return self.position - 0.5 * (self.ground.low + self.ground.high)


def easier_one_way(a: Along) -> Array:
    """Coulomb friction that differs with direction, fading in with speed."""
    amplitude = min(a.amplitude, LARGEST_VARIATION * a.ground.coulomb)
    return np.asarray(amplitude * (1.0 - np.exp(-np.abs(a.velocity) / 0.02)))


def saturating_drag(a: Along) -> Array:
    """Drag that grows with the square of speed and then less."""
    speed = np.abs(a.velocity)
    return np.asarray(4.0 * a.amplitude * a.velocity * speed / (1.0 + 0.5 * speed))


def rational_stribeck(a: Along) -> Array:
    """Friction that falls with the inverse square of speed."""
    return np.asarray(3.0 * a.amplitude * a.sign / (1.0 + (a.velocity / a.rng.uniform(0.06, 0.2)) ** 2))


def quadratic_load_friction(a: Along) -> Array:
    """Friction that grows with the square of the torque."""
    return np.asarray(3.0 * a.amplitude * (a.torque / (3.0 * a.ground.load)) ** 2 * a.sign)


def worn_range(a: Along) -> Array:
    """Friction that is higher over a part of the range, with soft edges."""
    offset = a.from_middle - 0.1 * a.rng.standard_normal() * a.reach
    return np.asarray(2.0 * a.amplitude * a.sign * np.exp(-((offset / (0.2 * a.reach)) ** 4)))


def maxwell_slip(a: Along) -> Array:
    """Elastic elements that slide one after another, in the place of a part of Coulomb friction."""
    bristles = np.zeros(len(SLIDES))
    force = np.empty(len(a.position))
    moves = np.diff(a.position, prepend=a.position[0])
    for k, move in enumerate(moves):
        bristles = np.clip(bristles + move, -SLIDES, SLIDES)
        force[k] = (bristles / SLIDES).mean()
    return np.asarray(6.0 * a.amplitude * (force - a.sign))


def warm_up_in_two_stages(a: Along) -> Array:
    """Friction that falls fast at first and then slowly."""
    time = STEP_S * np.arange(len(a.position))
    course = 0.6 * (1.0 - np.exp(-time / 3.0)) + 0.4 * time / a.ground.duration
    return np.asarray(-3.0 * a.amplitude * course * (0.7 * a.sign + 0.3 * a.velocity))


def triangle_cogging(a: Along) -> Array:
    """Cogging whose wave has corners."""
    order = a.rng.uniform(8.0, 24.0)
    return np.asarray(a.amplitude * signal.sawtooth(order * a.position + a.rng.uniform(-3.0, 3.0), 0.5))


def soft_stop(a: Along) -> Array:
    """A torque that grows exponentially towards one end of the range."""
    return np.asarray(6.0 * a.amplitude * np.exp(6.0 * (a.position - a.ground.high) / a.reach))


def hardening_spring(a: Along) -> Array:
    """An elastic torque that grows faster than the angle."""
    x = a.from_middle
    return np.asarray(2.0 * a.amplitude * (x + 0.5 * x**3))


def soft_saturation(a: Along) -> Array:
    """A sensor whose gain falls with the torque."""
    level = 12.0 * a.ground.load / max(a.size, 1e-9)
    return np.asarray(a.torque / (1.0 + np.abs(a.torque) / level) - a.torque)


def sluggish_sensor(a: Along) -> Array:
    """A torque channel behind a Butterworth filter of third order."""
    cutoff = 1.0 / (2.0 * np.pi * 0.001 * max(a.size, 0.1))
    sections = signal.butter(3, min(cutoff, 0.4 / STEP_S), fs=1.0 / STEP_S, output="sos")
    late, _ = signal.sosfilt(sections, a.torque, zi=signal.sosfilt_zi(sections) * a.torque[0])
    return np.asarray(late - a.torque)


@dataclass(frozen=True)
class Form:
    """A law and the ids of the catalogue's effects that are of its family."""

    law: Callable[[Along], Array]
    names: tuple[str, ...]


FORMS: dict[str, Form] = {
    law.__name__: Form(law, names)
    for law, names in (
        (easier_one_way, ("asymmetric_coulomb", "asymmetric_viscous")),
        (saturating_drag, ("nonlinear_viscous",)),
        (rational_stribeck, ("stribeck_friction",)),
        (quadratic_load_friction, ("load_dependent_friction",)),
        (worn_range, ("position_dependent_friction",)),
        (maxwell_slip, ("presliding_hysteresis",)),
        (warm_up_in_two_stages, ("friction_drift",)),
        (triangle_cogging, ("cogging",)),
        (soft_stop, ("cable_force",)),
        (hardening_spring, ("joint_spring", "cable_force")),
        (soft_saturation, ("torque_saturation",)),
        (sluggish_sensor, ("time_delay",)),
    )
}


def form_torque(name: str, passage: Passage, ground: Ground, size: float, seed: int) -> Array:
    """What the named form adds to its joint's torque along a passage, (N,)."""
    position, velocity, torque = (
        each[:, ground.joint] for each in (passage.position, passage.velocity, passage.torque)
    )
    return FORMS[name].law(Along(position, velocity, torque, ground, np.random.default_rng([seed, 3]), size))
