"""Play of a transmission: teeth part where the load turns its sign, and meet when the link has crossed the gap."""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from scipy.integrate import cumulative_trapezoid

from service.diagnosis.catalogue.deflection import BAND, Deflection
from service.diagnosis.catalogue.effect import Effect, mesh
from service.diagnosis.catalogue.parameters import Coefficient, Shape
from service.diagnosis.catalogue.setting import Setting
from service.recording.recording import Array

GAPS = np.array([1e-4, 3e-4, 1e-3, 3e-3, 1e-2])
"""Gaps looked at, relative to the joint's range of motion."""

BANDS = np.array([2.0, 1.0, 0.35])
"""Bands to which the load is smoothed, relative to the common one."""

FARTHEST_FLOWN = 1.3
"""Gap that is flown over, relative to b, beyond which no teeth are as far apart: on simulated arms it is 0.75 to
0.9 of b, and 2 or more where something else is taken for play."""


def place_between_teeth(load: Array, inertia: Array, gap: float, rate_hz: float) -> Array:
    """Where a link is in the play of its transmission, in gaps from the middle, -1/2 … 1/2.

    The teeth carry the load on one side until it turns its sign. Then the link moves on under its load alone,
    I δ̈ = τ_rb, until it meets teeth again, where it stays: gears and their grease swallow the shock.

    Parameters
    ----------
    load : (N,) float64
        τ_rb [Nm or N]
    inertia : (N,) float64
        I; where it is zero all along, the link crosses at once [kg m² or kg]
    gap : float
        b, above zero [rad or m]
    rate_hz : float
        sampling rate [Hz]

    Returns
    -------
    (N,) float64
        δ/b
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


def _first(is_so: np.ndarray) -> int:
    """Index of the first True; the length where there is none."""
    return int(is_so.argmax()) if is_so.any() else len(is_so)


class Backlash(Deflection):
    """q_link = q - b u, u the place of the link between the teeth."""

    id: ClassVar[str] = "backlash"
    equation: ClassVar[str] = "q_link = q - delta, delta = +-b/2 under load, I d2(delta)/dt2 = tau_rb in between"
    meaning: ClassVar[str] = "the transmission has play when the load changes sign"
    remedy: ClassVar[str] = "take up the play, or model a dead zone"
    revealing_motion: ClassVar[str] = "poses in which the joint's load passes slowly through zero"
    coefficients: ClassVar[tuple[Coefficient, ...]] = (Coefficient("b", "{q}", positive=True),)
    # What is flown over is b, and less where the load is smoothed: without it the motor, too, moves on during a flight.
    shapes: ClassVar[tuple[Shape, ...]] = (Shape("flown", "{q}", logarithmic=True, reported=False), BAND)

    @classmethod
    def forms(cls, setting: Setting) -> Sequence[Effect]:
        """One a joint that moves under load.

        Parameters
        ----------
        setting : Setting
            the arm
        """
        made = []
        for joint in cls.deflected_joints(setting):
            gaps, bands = GAPS * (setting.highest[joint] - setting.lowest[joint]), BANDS * setting.cutoff_hz
            bounds = np.array([0.5 * gaps[0], bands[-1]]), np.array([2.0 * gaps[-1], bands[0]])
            made.append(cls(joint, mesh(gaps, bands), *bounds))
        return made

    def is_consistent(self, coefficients: Array, shape: Array) -> bool:
        """Whether the gap that the link flies over is the one by which it moves.

        Parameters
        ----------
        coefficients : (1,) float64
            b [rad or m]
        shape : (2,) float64
            gap that is flown over [rad or m], band of the load [Hz]
        """
        return bool(shape[0] <= FARTHEST_FLOWN * coefficients[0])

    def deflection(self, load: Array, inertia: Array, shape: Array, rate_hz: float) -> Array:
        """Place between the teeth.

        Parameters
        ----------
        load, inertia : (N,) float64
            of the link [Nm or N, kg m² or kg]
        shape : (2,) float64
            gap that is flown over [rad or m], band of the load [Hz]
        rate_hz : float
            sampling rate [Hz]
        """
        return place_between_teeth(load, inertia, float(shape[0]), rate_hz)
