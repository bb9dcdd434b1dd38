"""Play of a transmission: teeth part where the load turns its sign, and meet when the link has crossed the gap.

Stiff teeth stop the link; on springy ones it swings, at frequencies that a diagnosis may well see.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.ndimage import map_coordinates

from tauscope.effects.context import ArmContext
from tauscope.effects.deflection import BAND, Deflection
from tauscope.effects.effect import Coefficient, Effect, Quantities, Shape, Sizes, mesh, size_text
from tauscope.recording.recording import Array

GAPS = np.array([1e-4, 3e-4, 1e-3, 3e-3, 1e-2])  # gaps looked at, relative to the joint's range of motion
BANDS = np.array([2.0, 1.0, 0.35])  # bands to which the load is smoothed, relative to the common one
# Factor between the gap that a link crosses and the one by which it is found to move, up to which they are the same: a
# link that bounces at other instants than the model's seems to move by less, and on simulated arms by up to 1.7 times.
SAME = 2.0
# Gaps on springy teeth that are looked at, relative to the joint's range of motion: closer to each other, as a link
# that swings comes back at other instants, and smaller, as it swings on after them.
SPRINGY_GAPS = np.geomspace(2e-5, 1e-2, 9)
# Band of the load on springy teeth, relative to the common one: when a link meets them hangs on all of it.
SPRINGY_BAND = 3.0
# Resonances of the link on springy teeth at its mean inertia, relative to the common band.
RESONANCES = np.array([0.7, 1.0, 1.5, 2.2])
STEPS = 15.0  # steps of the integration in a period of the resonance at its least inertia
# Least, usual and largest share of their force that teeth lose a speed [s/rad or s/m]: what strikes them by v bounces
# back by some v - 2/3 c v².
LOSSES = np.array([0.8, 8.0, 80.0])
# Damping ratio of teeth that touch, beside what they lose under load: where less is lost a link bounces on, but when it
# comes back hangs on everything that a recording does not show.
DAMPING = 0.2


def place_between_teeth(load: Array, inertia: Array, gap: float, rate_hz: float) -> Array:
    """Where a link is in the play of its transmission, in gaps from the middle, -1/2 … 1/2.

    The teeth carry the load on one side until it turns its sign. Then the link moves on under its load alone, I δ̈ =
    τ_rb, until it meets teeth again, where it stays: gears and their grease swallow the shock. `load`: (N,), τ_rb [Nm
    or N]; `inertia`: (N,), I; where it is zero all along, the link crosses at once [kg m² or kg]; `gap`: b, above zero
    [rad or m]; `rate_hz`: sampling rate [Hz]. Returns (N,), δ/b.
    """
    sides = np.where(load >= 0.0, 0.5, -0.5)
    if not inertia.all():
        return sides
    time = np.arange(len(load)) / rate_hz
    speed = cumulative_trapezoid(load / inertia, time, initial=0) / gap
    way = cumulative_trapezoid(speed, time, initial=0)
    place, side, begin = np.empty(len(load)), sides[0], 0
    while begin < len(load):
        parted = begin + _first(sides[begin:] != side)
        place[begin:parted] = side
        if parted == len(load):
            break
        flight = side + way[parted:] - way[parted] - speed[parted] * (time[parted:] - time[parted])
        flown = 1 + _first(np.abs(flight[1:]) >= 0.5)
        place[parted : parted + flown] = flight[:flown]
        side, begin = np.copysign(0.5, flight[min(flown, len(flight) - 1)]), parted + flown
    return place


def place_between_springs(
    load: Array, inertia: Array, gap: float, compliance: float, loss: float, rate_hz: float
) -> Array:
    """Where a link is against its motor, in gaps, where the teeth give way under load.

    I δ̈ = τ_rb - T with T = max(0, K x (1 + c ẋ) + D ẋ) of the overlap x = |δ| - b/2 where that is above zero, against
    δ: teeth push and never pull. c is the loss of Hunt and Crossley (J. Appl. Mech. 42, 1975), which grows with the
    overlap, D = 2 ζ √(K Ī). By leapfrog steps, from rest on the teeth under the first load. `load`: (N,), τ_rb [Nm or
    N]; `inertia`: (N,), I, above zero [kg m² or kg]; `gap`: b, above zero [rad or m]; `compliance`: 1/K [rad/Nm or
    m/N]; `loss`: c [s/rad or s/m]; `rate_hz`: sampling rate [Hz]. Returns (N,), δ/b.
    """
    highest_hz = 1.0 / (2.0 * np.pi * math.sqrt(compliance * float(inertia.min())))
    time = np.arange(len(load)) / rate_hz
    steps = max(int(time[-1] * STEPS * highest_hz), 2)
    instants, step = np.linspace(0.0, time[-1], steps, retstep=True)
    pushes = np.interp(instants, time, load / inertia / gap).tolist()
    stiffness = np.interp(instants, time, 1.0 / (compliance * inertia)).tolist()
    damping = 2.0 * DAMPING * math.sqrt(float(inertia.mean()) / compliance)
    dampings = np.interp(instants, time, damping / inertia).tolist()
    place = math.copysign(0.5 + abs(float(load[0])) * compliance / gap, float(load[0]))
    speed, lost, places = 0.0, loss * gap, []
    for push, spring, damper in zip(pushes, stiffness, dampings, strict=True):
        places.append(place)
        overlap, coasting = abs(place) - 0.5, speed + step * push
        speed = coasting
        if overlap > 0.0:  # what depends on the speed counts at the step's end: stable however much is lost
            side, force = math.copysign(1.0, place), spring * overlap
            stopped = (side * coasting - step * force) / (1.0 + step * (lost * force + damper))
            speed = side * min(stopped, side * coasting)
        place += step * speed
    return np.asarray(map_coordinates(np.array(places), [time / step], mode="nearest"))


def _first(is_so: np.ndarray) -> int:
    return int(is_so.argmax()) if is_so.any() else len(is_so)


class Backlash(Deflection):
    """q_link = q - b u, u the place of the link between the teeth."""

    id = "backlash"
    rank = 120
    equation = "q_link = q - delta, delta = +-b/2 under load, I d2(delta)/dt2 = tau_rb in between"
    meaning = "the transmission has play when the load changes sign"
    remedy = "take up the play, or model a dead zone"
    revealing_motion = "poses in which the joint's load passes slowly through zero"
    coefficients = (Coefficient("b", "{q}", positive=True),)
    # What is flown over is b, and less where the load is smoothed: without it the motor, too, moves on during a flight.
    shapes = (Shape("flown", "{q}", logarithmic=True, reported=False), BAND)

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        made = []
        for joint in cls.deflected_joints(context):
            gaps, bands = GAPS * (context.highest[joint] - context.lowest[joint]), BANDS * context.cutoff_hz
            bounds = np.array([0.5 * gaps[0], bands[-1]]), np.array([2.0 * gaps[-1], bands[0]])
            made.append(cls(joint, mesh(gaps, bands), *bounds))
        return made

    @classmethod
    def farther_forms(cls, context: ArmContext) -> Sequence[Effect]:
        """The same with teeth that give way, one a joint whose link has an inertia."""
        return SpringyTeeth.forms(context)

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        """b; where the link crosses more than it is found to move by, what it crosses.

        A bounce at another instant than the model's adds nothing to how far the link moves; of how long it flies they
        still tell. Half the difference counts as an error that the covariance does not know.
        """
        (found,) = super().quantities(context, coefficients, shape, covariance)
        apart = max(float(shape[0]) - found.value, 0.0)
        return (replace(found, value=found.value + apart, std=float(np.hypot(found.std, 0.5 * apart))),)

    def claim(self, found: Sizes, context: ArmContext) -> str:
        return f"the transmission has {size_text(found['b'])} of backlash"

    def limits(self, coefficients: Array, shape: Array) -> tuple[Array, Array]:
        """The gap that the link flies over is no more than the one by which it moves."""
        lower, upper = super().limits(coefficients, shape)
        upper[0] = SAME * coefficients[0]
        return lower, upper

    def deflection(self, load: Array, inertia: Array, shape: Array, rate_hz: float) -> Array:
        return place_between_teeth(load, inertia, float(shape[0]), rate_hz)


class SpringyTeeth(Backlash):
    """The same where the teeth give way, so that a link that has crossed the gap swings on them."""

    is_variant = True
    refines = frozenset({"backlash", "joint_elasticity"})
    shapes = (
        *Backlash.shapes,
        Shape("swinging", "{q}/{tau}", logarithmic=True, reported=False),
        Shape("loss", "s/{q}", logarithmic=True, reported=False),
    )

    @classmethod
    def forms(cls, context: ArmContext) -> Sequence[Effect]:
        """One a joint that moves under load, and whose link has an inertia."""
        made = []
        for joint in cls.deflected_joints(context):
            if context.inertia[joint] <= 0.0:
                continue
            gaps = SPRINGY_GAPS * (context.highest[joint] - context.lowest[joint])
            swinging = 1.0 / ((2.0 * np.pi * RESONANCES * context.cutoff_hz) ** 2 * context.inertia[joint])
            grid = mesh(gaps, np.array([SPRINGY_BAND * context.cutoff_hz]), swinging, LOSSES[1:2])
            lower, upper = grid.min(axis=0) * [0.5, 1.0, 0.7, 1.0], grid.max(axis=0) * [2.0, 1.0, 1.4, 1.0]
            lower[-1], upper[-1] = LOSSES[0], LOSSES[-1]
            made.append(cls(joint, grid, lower, upper))
        return made

    @classmethod
    def farther_forms(cls, context: ArmContext) -> Sequence[Effect]:
        return ()

    def limits(self, coefficients: Array, shape: Array) -> tuple[Array, Array]:
        """The gap that the link crosses is the one by which it moves."""
        lower, upper = super().limits(coefficients, shape)
        lower[0] = coefficients[0] / SAME
        return lower, upper

    def deflection(self, load: Array, inertia: Array, shape: Array, rate_hz: float) -> Array:
        """Place between and on the teeth; where no inertia is known that could swing, as on stiff ones."""
        if not inertia.all():
            return place_between_teeth(load, inertia, float(shape[0]), rate_hz)
        return place_between_springs(load, inertia, float(shape[0]), float(shape[2]), float(shape[3]), rate_hz)
