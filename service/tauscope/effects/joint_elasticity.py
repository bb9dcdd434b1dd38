"""A transmission that gives way under load, quasi-statically or with the resonance of link and spring."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import solve_banded

from tauscope.effects.context import ArmContext
from tauscope.effects.deflection import BAND, Deflection
from tauscope.effects.effect import Coefficient, Effect, Quantities, Quantity, Shape, Sizes, size_text
from tauscope.recording.recording import Array

# Bands to which the load is smoothed, relative to the common one; the widest passes all that is compared there.
BANDS = np.array([1.41, 1.0, 0.35, 0.12])
# The same where the link swings: near a resonance, what a narrower one takes from the load passes for compliance.
SWINGING_BANDS = BANDS[:2]
# Resonances of the link at its mean inertia, the motor held, relative to the common band; beyond, nothing is seen.
RESONANCES = np.array([0.6, 0.75, 0.9, 1.1, 1.35, 1.7, 2.2, 3.0])
SAME = 1.6  # factor between the compliance that swings and the one that is found, up to which they are the same
DAMPING = 0.1  # damping ratio of the resonance: gears and bearings make it heavier than steel alone


def transmitted(load: Array, inertia: Array, compliance: float, rate_hz: float) -> Array:
    """What a spring transmits to a link whose load is given for a rigid transmission: I δ̈ + D δ̇ + K δ = τ_rb.

    D = 2 ζ √(K Ī) with the mean inertia Ī. By the trapezoidal rule, from rest under the first load. `load`: (N,), τ_rb
    [Nm or N]; `inertia`: (N,), I, above zero [kg m² or kg]; `compliance`: 1/K [rad/Nm or m/N]; `rate_hz`: sampling rate
    [Hz]. Returns (N,), K δ [Nm or N].
    """
    by_acceleration = rate_hz**2 * compliance * inertia
    by_rate = DAMPING * rate_hz * np.sqrt(compliance * inertia.mean())
    ahead = by_acceleration + by_rate + 0.25
    here = 0.5 - 2.0 * by_acceleration
    behind = by_acceleration - by_rate + 0.25
    # row k + 1 holds the equation at k; the first two say that it rests
    count = len(load)
    matrix = np.zeros((3, count))
    matrix[0, :2], matrix[0, 2:] = 1.0, ahead[1:-1]
    matrix[1, 1:-1], matrix[2, :-2] = here[1:-1], behind[1:-1]
    right = np.concatenate([load[:1], load[:1], 0.25 * (load[2:] + 2.0 * load[1:-1] + load[:-2])])
    return np.asarray(solve_banded((2, 0), matrix, right))


class JointElasticity(Deflection):
    """q_link = q - c τ, τ the load as the spring passes it on."""

    id = "joint_elasticity"
    rank = 130
    equation = "q_link = q - c tau_rb, c = 1/stiffness"
    meaning = "the transmission gives way under load"
    remedy = "model the joint as two masses with a stiffness between them"
    revealing_motion = "sharp reversals from constant speed, and an encoder on the link"
    coefficients = (Coefficient("c", "{q}/{tau}", positive=True),)
    shapes = (BAND, Shape("swinging", "{q}/{tau}", fixed=True, reported=False))

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        bands = BANDS * context.cutoff_hz
        stiff = np.stack([bands, np.zeros(len(bands))], axis=1)
        made = []
        for joint in cls.deflected_joints(context):
            grid = stiff
            if context.inertia[joint] > 0.0:
                swinging = 1.0 / ((2.0 * np.pi * RESONANCES * context.cutoff_hz) ** 2 * context.inertia[joint])
                swings = [[band, each] for band in SWINGING_BANDS * context.cutoff_hz for each in swinging]
                grid = np.concatenate([stiff, np.array(swings)])
            made.append(cls(joint, grid, grid.min(axis=0), grid.max(axis=0)))
        return made

    def limits(self, coefficients: Array, shape: Array) -> tuple[Array, Array]:
        """What gives way is what the link swings on."""
        lower, upper = super().limits(coefficients, shape)
        if shape[1]:
            lower[1], upper[1] = coefficients[0] / SAME, coefficients[0] * SAME
        return lower, upper

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        """c; where the link swings, the mean of what gives way and what it swings on: both estimate one compliance.

        The load of a resonance is known only within a band, which errs the one way in the amplitude and the other way
        in the frequency: half the difference is an error of their mean that the covariance does not know.
        """
        (found,) = super().quantities(context, coefficients, shape, covariance)
        swinging = float(shape[1])
        if swinging == 0.0:
            return (found,)
        apart = 0.5 * (found.value - swinging)
        return (replace(found, value=found.value - apart, std=float(np.hypot(found.std, apart))),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        compliance = found["c"].value
        if compliance <= 0.0:
            return self.meaning
        stiffness = Quantity("K", 1.0 / compliance, 0.0, self.unit("{tau}/{q}", context))
        return f"a transmission stiffness of {size_text(stiffness)} is missing"

    def deflection(self, load: Array, inertia: Array, shape: Array, rate_hz: float) -> Array:
        swinging = float(shape[1])
        return load if swinging == 0.0 or not inertia.all() else transmitted(load, inertia, swinging, rate_hz)
