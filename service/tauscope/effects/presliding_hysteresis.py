"""Friction that rises over a distance after every reversal, as bristles bend before they slide (Dahl).

dz/dq = (sgn q̇ - z) / x_s, so that over a stretch of one direction z approaches ±1 exponentially in the distance
covered. The nominal model has the whole Coulomb step at once; the column is what the bristles lag behind it.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Shape, Sizes, per_joint_columns, size_text
from tauscope.recording.recording import Array
from tauscope.robot import Robot

# Bristle lengths looked at, relative to the joint's range of motion.
DISTANCES = np.array([5e-4, 1e-3, 2e-3, 4e-3, 8e-3, 1.6e-2, 3.2e-2])
# Bristle length, in standard deviations of the position's noise, below which it is a step like any other.
RESOLVED = 4.0


def bristle_deflection(position: Array, lengths: Array, start: Array) -> Array:
    """Deflection z of Dahl bristles along a motion, -1 … 1.

    `position`: (N,), q [rad or m]; `lengths`: (g,), x_s [rad or m]; `start`: (g,), z at the first sample. Returns (g,
    N), z; exact between samples of one direction.
    """
    step = np.diff(position)
    direction = np.sign(step)
    bounds = np.flatnonzero(np.diff(direction)) + 1
    edges = np.concatenate([[0], bounds, [len(step)]])
    deflection = np.empty((len(lengths), len(position)))
    deflection[:, 0] = state = start
    for first, last in pairwise(edges):
        sliding = direction[first]
        distance = np.abs(position[first + 1 : last + 1] - position[first])
        deflection[:, first + 1 : last + 1] = sliding + (state - sliding)[:, None] * np.exp(
            -distance / lengths[:, None]
        )
        state = deflection[:, last]
    return deflection


class PreslidingHysteresis(Effect):
    """τ = F (z - A(q̇)), z the bristles' deflection."""

    has_step = True
    of_motion_and_step = True
    id = "presliding_hysteresis"
    rank = 70
    arguments = frozenset({"position", "velocity"})
    equation = "tau = F (z - sgn(qd)), dz/dt = qd/x_s - |qd| z/x_s"
    meaning = "friction rises over a distance after each reversal instead of stepping"
    remedy = "replace the Coulomb step by a Dahl or LuGre bristle"
    no_code = "it needs the state of the bristles"
    revealing_motion = "slow small reversals, a few hundredths of a radian per second"
    coefficients = (Coefficient("F", "{tau}", positive=True),)
    shapes = (Shape("x_s", "{q}", logarithmic=True),)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        made = []
        for joint in context.joints:
            if context.reverses(joint):
                noise = 0.0 if context.position_std is None else context.position_std[joint]
                lengths = DISTANCES * (context.highest[joint] - context.lowest[joint])
                lengths = lengths[lengths > RESOLVED * noise]
                if len(lengths):
                    shortest = np.maximum(0.3 * lengths[:1], RESOLVED * noise)
                    made.append(cls(joint, lengths[:, None], shortest, 3.0 * lengths[-1:]))
        return made

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Deflection less step, z - A(q̇)."""
        position, lengths = signals.position[self.joint], shapes[:, 0]
        start = np.full(len(lengths), signals.step[self.joint, 0])  # sliding where it moves, relaxed where it rests
        if signals.periodic:  # a period later the bristles stand as they stood
            start = bristle_deflection(position, lengths, start)[:, -1]
        deflection = bristle_deflection(position, lengths, start)
        return per_joint_columns((deflection - signals.step[self.joint])[:, None])

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """Over which distance, and whether friction rises to its level or falls to it."""
        verb = "rises" if found["F"].value >= 0.0 else "falls"
        return f"friction {verb} over {size_text(found['x_s'])} after each reversal instead of at once"

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """Dahl's bristles in place of the robot file's Coulomb friction, whatever F is."""
        return [{"distance": shape[0]}]
