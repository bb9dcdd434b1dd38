"""A recorded torque that is compressed or clipped at high load."""

from abc import abstractmethod
from collections.abc import Sequence
from math import sqrt

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import (
    Coefficient,
    Effect,
    Entry,
    Quantities,
    Quantity,
    Shape,
    Sizes,
    per_joint_columns,
    size_text,
)
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Levels of a soft curve looked at, relative to the largest torque.
COMPRESSIONS = np.array([0.3, 0.5, 0.8, 1.3, 2.2, 4.0])
CLIPS = np.array([0.3, 0.45, 0.6, 0.7, 0.8, 0.9])  # levels of a hard one
# Part of what lies beyond the level that a hard curve takes off: one that takes off little is a soft curve.
CLIPPED_AT_LEAST = 0.5


class Saturation(Effect):
    """τ_recorded = τ - a (τ - r(τ)): what all curves r have in common; a is 1 where nothing else bends them."""

    id = "torque_saturation"
    rank = 160
    equation = "tau_recorded = tau - a (tau - c tanh(tau/c)); clipped: tau - a (tau - clip(tau, +-c))"
    meaning = "the recorded torque is compressed or clipped at high load"
    remedy = "record within the sensor's or the drive's linear range"
    no_code = "it changes the recorded torque, not the arm's"
    bends = True
    revealing_motion = "the same motion slower and without payload, well below the level"
    shapes = (Shape("c", "{tau}", logarithmic=True),)

    @classmethod
    def of_levels(cls, context: ArmContext, parts: Array) -> list[Effect]:
        """One a joint. `parts`: (g,), levels looked at, relative to the joint's largest torque."""
        made: list[Effect] = []
        for joint in context.joints:
            levels = parts * float(context.top_torque[joint])
            made.append(cls(joint, levels[:, None], 0.7 * levels[:1], 1.5 * levels[-1:]))
        return made

    @abstractmethod
    def recorded(self, torque: Array, levels: Array) -> Array:
        """`torque`, (N,), as it is recorded, r(τ), with a = 1 and `levels` c, (g, 1) [Nm or N], (g, N)."""

    @abstractmethod
    def _derivative(self, torque: Array, level: float) -> Array:
        """r'(τ), (N,)."""

    def slope(self, torque: Array, coefficients: Array, shape: Array) -> Array:
        """1 - a (1 - r'(τ))."""
        return 1.0 - coefficients[0] * (1.0 - self._derivative(torque, float(shape[0])))

    def claim(self, found: Sizes, context: ArmContext) -> str:
        return f"the recorded torque saturates near {size_text(found['c'])}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """What the recorded torque falls short by."""
        torque = signals.torque[self.joint]
        return per_joint_columns((self.recorded(torque, shapes) - torque)[:, None])


class TorqueSaturation(Saturation):
    """r(τ) = c tanh(τ/c), a soft curve; where it is only bent a little no data tell a and c apart, but c/√a."""

    coefficients = (Coefficient("a", "1", positive=True),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        return [*cls.of_levels(context, COMPRESSIONS), *Clipping.forms(context)]

    def recorded(self, torque: Array, levels: Array) -> Array:
        """A soft curve, c tanh(τ/c), (g, N)."""
        return levels * np.tanh(torque / levels)

    def _derivative(self, torque: Array, level: float) -> Array:
        return 1.0 - np.tanh(torque / level) ** 2

    def limits(self, coefficients: Array, shape: Array) -> tuple[Array, Array]:
        """A curve with a = 1 that is bent as much has a level that a sensor may have."""
        lower, upper = super().limits(coefficients, shape)
        lower[0] = self.lower[0] * np.sqrt(coefficients[0])
        return lower, upper

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        share, level = max(float(coefficients[0]), 1e-12), float(shape[0])
        slope = np.array([-0.5 * level / share**1.5, 1.0 / np.sqrt(share)])
        std = float(np.sqrt(max(slope @ covariance @ slope, 0.0)))
        return (Quantity("c", level / np.sqrt(share), std, self.unit("{tau}", context)),)

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """The soft curve: τ - a (τ - c tanh(τ/c)) is l tanh(τ/l) to third order, l = c/√a."""
        if coefficients[0] <= 0.0:
            return []
        return [{"level": shape[0] / sqrt(coefficients[0]), "shape": "compression"}]


class Clipping(Saturation):
    """r(τ) = clip(τ, ±c): what lies beyond the level is cut off."""

    is_variant = True
    coefficients = (Coefficient("a", "1", positive=True, largest=2.0, smallest=CLIPPED_AT_LEAST),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        return cls.of_levels(context, CLIPS)

    def recorded(self, torque: Array, levels: Array) -> Array:
        """A hard curve, clip(τ, ±c), (g, N)."""
        return np.clip(torque, -levels, levels)

    def _derivative(self, torque: Array, level: float) -> Array:
        return (np.abs(torque) < level).astype(np.float64)

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"level": shape[0], "shape": "clip"}] if coefficients[0] > 0.0 else []
