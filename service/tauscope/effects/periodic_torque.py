"""Torque that repeats with the angle of the motor or the joint: cogging, and ripple in proportion to the load.

Orders are counted per unit of joint position. Where the robot file states a gear ratio, only whole multiples of the
motor's revolution can occur; otherwise the angle-periodogram is scanned as finely as the range of motion resolves.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, hypot

import numpy as np

from tauscope.effects.computation import THREADS, LastFew
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
    percent_text,
    size_text,
)
from tauscope.recording.recording import Array
from tauscope.robot import JointType, Robot

# Cycles over the range of motion below which a periodic torque is a spring or a bump by another name.
FEWEST_CYCLES = 1.5
CYCLES_A_STEP = 0.35  # step of the scan in cycles over the range of motion: a peak is two wide
BAND_SHARE = 0.8  # share of the band up to which the frequency at typical speed may reach
MOST_ORDERS = 220
# Spread of steps, relative to one, up to which they are even: over a thousand orders no phase is off by as much.
EVEN = 1e-9
# Factor up to which orders are looked at where something is left: they reach the band near reversals only, in a
# twentieth of the time of a sine.
FARTHER = 8.0
MOST_FARTHER_ORDERS = 800
FEW = 2  # orders at once up to which sines are kept: one of a fit, and the two of its difference quotient
KEPT = 24 * THREADS  # sets of them that are kept a piece: those of a model with all orders that it may have


def possible_orders(context: ArmContext, joint: int) -> Array:
    """Orders of a periodic torque that this motion can show, (g,), ascending; empty where there are none."""
    return _orders(context, joint, 1.0)[:MOST_ORDERS]


def farther_orders(context: ArmContext, joint: int) -> Array:
    """Orders beyond those, that show in a part of the motion only, (g,), ascending."""
    near = possible_orders(context, joint)
    return _orders(context, joint, FARTHER)[len(near) :][:MOST_FARTHER_ORDERS]


def _orders(context: ArmContext, joint: int, factor: float) -> Array:
    """Orders whose frequency at rms speed reaches up to some times the band."""
    if not context.moves(joint):
        return np.zeros(0)
    reach = float(context.highest[joint] - context.lowest[joint])
    lowest = FEWEST_CYCLES * 2.0 * np.pi / reach
    highest = factor * BAND_SHARE * 2.0 * np.pi * context.cutoff_hz / float(context.speed[joint])
    if _is_geared(context, joint):
        unit = abs(context.robot.joints[joint].gear_ratio or 1.0) * _pole_pairs(context, joint)
        lowest = min(lowest, unit) if reach >= 2.0 * np.pi / unit * FEWEST_CYCLES else lowest
        multiples = np.arange(max(1, int(np.ceil(lowest / unit - 1e-9))), int(highest / unit) + 1)
        return np.asarray(unit * multiples, dtype=np.float64)
    step = CYCLES_A_STEP * 2.0 * np.pi / reach
    return np.asarray(np.arange(lowest, highest, step), dtype=np.float64)


def _pole_pairs(context: ArmContext, joint: int) -> int:
    drive = context.robot.joints[joint].drive or {}
    pairs = drive.get("pole_pairs", 1)
    return int(pairs) if isinstance(pairs, int | float) and pairs >= 1 else 1


def _is_geared(context: ArmContext, joint: int) -> bool:
    described = context.robot.joints[joint]
    return described.gear_ratio is not None and described.type is JointType.REVOLUTE


def waves(position: Array, orders: Array) -> Array:
    """Waves sin kq and cos kq, (g, 2, N), of `position`, (N,), and `orders` k, (g,): even steps by sin(a + b)."""
    steps = np.diff(orders)
    if len(steps) < 2 or np.ptp(steps) > EVEN * abs(steps[0]):
        angle = orders[:, None] * position
        return np.stack([np.sin(angle), np.cos(angle)], axis=1)
    found = np.empty((len(orders), 2, len(position)))
    found[0] = np.sin(orders[0] * position), np.cos(orders[0] * position)
    sine, cosine = np.sin(steps[0] * position), np.cos(steps[0] * position)
    for before, after in pairwise(found):
        after[0] = before[0] * cosine + before[1] * sine
        after[1] = before[1] * cosine - before[0] * sine
    return found


@dataclass(frozen=True, eq=False)
class _Periodic(Effect):
    """Sine and cosine of an order, with a weight of its own."""

    geared: bool = False

    repeats = True
    shapes = (Shape("order", "1/{q}"),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One a joint whose motion covers enough cycles."""
        return cls._of_orders(context, possible_orders)

    @classmethod
    def farther_forms(cls, context: ArmContext) -> Sequence[Effect]:
        """The same of orders that show near reversals only."""
        return cls._of_orders(context, farther_orders)

    @classmethod
    def _of_orders(cls, context: ArmContext, orders: Callable[[ArmContext, int], Array]) -> Sequence[Effect]:
        found = {joint: orders(context, joint) for joint in cls._places(context)}
        return [
            cls(joint, own[:, None], 0.9 * own[:1], 1.1 * own[-1:], geared=_is_geared(context, joint))
            for joint, own in found.items()
            if len(own)
        ]

    @classmethod
    def _places(cls, context: ArmContext) -> Sequence[int]:
        return context.joints

    def is_free(self, place: int) -> bool:
        return not self.geared

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        """Amplitude, phase and order instead of sine and cosine."""
        sine, cosine = (float(value) for value in coefficients)
        amplitude = float(np.hypot(sine, cosine)) or 1e-300
        of_amplitude = np.array([sine, cosine]) / amplitude
        of_phase = np.array([-cosine, sine]) / amplitude**2
        own, unit = covariance[:2, :2], self.unit(self.coefficients[0].unit, context)
        errors = [float(np.sqrt(slope @ own @ slope)) for slope in (of_amplitude, of_phase)]
        return (
            Quantity("order", float(shape[0]), float(np.sqrt(max(covariance[2, 2], 0.0))), self.unit("1/{q}", context)),
            Quantity("amplitude", amplitude, errors[0], unit),
            Quantity("phase", float(np.arctan2(cosine, sine)), errors[1], "rad", period=2.0 * np.pi),
        )

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """One wave; its order is counted a turn at a revolute joint, a metre at a prismatic one."""
        sine, cosine = coefficients
        turns = robot.joints[self.joint or 0].type is JointType.REVOLUTE
        order = shape[0] if turns else shape[0] / (2.0 * np.pi)
        return [{"amplitude": hypot(sine, cosine), "order": order, "phase": atan2(cosine, sine)}]

    def _waves(self, signals: Signals, shapes: Array) -> Array:
        """Sin kq, cos kq, (g, 2, N); of an order or two they are kept, for a fit asks again under other loads."""
        joint, orders = self.joint or 0, shapes[:, 0]
        if len(orders) > FEW:
            return waves(signals.position[joint], orders)
        kept: LastFew[tuple[int, bytes], Array] = signals.remembered_of_motion("waves", lambda: LastFew(KEPT))
        return kept.get((joint, orders.tobytes()), lambda: waves(signals.position[joint], orders))


class Cogging(_Periodic):
    """τ = Σ a sin(k q + φ)."""

    of_motion_alone = True
    id = "cogging"
    rank = 100
    arguments = frozenset({"position"})
    equation = "tau = sum a sin(k q + phi)"
    meaning = "torque repeats with the angle, whatever the load"
    remedy = "compensate the torque over the motor's angle"
    code = "{c[0]} * sin({s[0]} * q) + {c[1]} * cos({s[0]} * q)"
    revealing_motion = "slow constant speed over the whole range, the load changed by other joints' poses"
    coefficients = (Coefficient("sine", "{tau}"), Coefficient("cosine", "{tau}"))

    def claim(self, found: Sizes, context: ArmContext) -> str:
        size, order = size_text(found["amplitude"]), found["order"].value
        return f"a cogging torque of {size} and order {order:.4g} is missing"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(self._waves(signals, shapes))


class TorqueRipple(_Periodic):
    """τ = τ_rb Σ a sin(k q + φ)."""

    id = "torque_ripple"
    rank = 110
    arguments = frozenset({"position", "load"})
    equation = "tau = tau_rb sum a sin(k q + phi)"
    meaning = "torque repeats with the angle, in proportion to the load"
    remedy = "correct the torque constant over the motor's angle"
    code = "load * ({c[0]} * sin({s[0]} * q) + {c[1]} * cos({s[0]} * q))"
    revealing_motion = "the same angles under other loads: other poses of the other joints"
    coefficients = (Coefficient("sine", "1", largest=1.0), Coefficient("cosine", "1", largest=1.0))

    @classmethod
    def _places(cls, context: ArmContext) -> Sequence[int]:
        return [joint for joint in super()._places(context) if context.is_loaded(joint)]

    def claim(self, found: Sizes, context: ArmContext) -> str:
        size, order = percent_text(found["amplitude"].value), found["order"].value
        return f"torque ripples by {size} of the load with order {order:.4g}"

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return per_joint_columns(signals.load[self.joint] * self._waves(signals, shapes))
