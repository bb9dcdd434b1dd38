"""Transmissions that give way, along a motion of the motors that is known.

The motors of an elastic arm can follow the same motion as those of a rigid one: their encoders and drives sit on the
motor's side. Only the link of the joint moves otherwise, by x = q - θ. With the rigid-body torque of its joint
linearised about the motors' motion,

    m ẍ + d ẋ + g x + τ(θ, θ̇, θ̈) = T(-x, -ẋ),

one equation of one unknown, where T is the torque of the transmission. ROS2 (see `tauscope_sim.plant.rosenbrock`)
integrates it. Afterwards the acceleration of the link is the one at which the rigid-body torque is exactly T; the drive
of the joint needs T and the inertia of its rotor, the others need what the rigid bodies take along that motion.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from concealed.generator.rates import FINE, RATE_HZ
from tauscope.robot import Robot
from tauscope_sim.model import build_model
from tauscope_sim.plant.term import Transmission
from tauscope_sim.recording import rigid_body_torque

Array = NDArray[np.float64]

STEP_S = 1.0 / (FINE * RATE_HZ)
GAMMA = 1.0 - 0.5 * 2.0**0.5

RESOLVED = 0.3
"""Largest step of the integration over the shortest time constant of link and transmission."""

MOST_PARTS = 10
"""Steps between two readings; of a stiffer transmission ROS2 damps the oscillation that it cannot resolve."""

LINEARISATIONS = 2
"""The second about the motion that the first has found."""

SLIGHT = 1e-4
"""Change of position [rad or m] and speed [per s] at which the rigid-body torque is linearised."""


@dataclass(frozen=True, eq=False)
class LinkEquation:
    """Coefficients of the link's equation at 1 kHz.

    inertia, damping, stiffness, torque : (N,) float64
        m, d, g and τ
    resting_torque : float
        that carries the link at first [Nm or N]
    """

    inertia: Array
    damping: Array
    stiffness: Array
    torque: Array
    resting_torque: float


def transmission_torque(robot: Robot, transmission: Transmission, position: Array, velocity: Array) -> Array:
    """Torque that the drives need beside those of a rigid arm with the same motion of the motors, (N, n).

    Parameters
    ----------
    position, velocity : (N, n) float64
        of the motors at 1 kHz, on the joint's side [rad, rad/s]
    """
    joint = transmission.joint - 1
    acceleration = np.asarray(np.gradient(velocity, STEP_S, axis=0))
    model = build_model(robot)
    still = np.zeros((1, position.shape[1]))
    unit = np.zeros(position.shape[1])
    unit[joint] = 1.0

    def rigid(x: Array | float, w: Array | float, a: Array | float) -> Array:
        """Rigid-body torque where the link leads its motor by so much, (N, n)."""
        lead = [np.multiply.outer(np.broadcast_to(each, len(position)), unit) for each in (x, w, a)]
        return rigid_body_torque(model, position + lead[0], velocity + lead[1], acceleration + lead[2])

    before = rigid(0.0, 0.0, 0.0)
    lead, rate, excess = (np.zeros(len(position)) for _ in range(3))
    link = before
    for _ in range(LINEARISATIONS):
        own = link[:, joint]
        inertia = rigid(lead, rate, excess + 1.0)[:, joint] - own
        damping = (rigid(lead, rate + SLIGHT, excess)[:, joint] - own) / SLIGHT
        stiffness = (rigid(lead + SLIGHT, rate, excess)[:, joint] - own) / SLIGHT
        own = own - inertia * excess - damping * rate - stiffness * lead
        resting = rigid_body_torque(model, position[:1] + lead[0] * unit, still, still)
        lead, rate = follow(LinkEquation(inertia, damping, stiffness, own, float(resting[0, joint])), transmission)
        handed = np.array([transmission.torque(-x, -w) for x, w in zip(lead.tolist(), rate.tolist(), strict=True)])
        excess = (handed - rigid(lead, rate, 0.0)[:, joint]) / inertia
        link = rigid(lead, rate, excess)
    link[:, joint] += transmission.rotor_inertia * acceleration[:, joint]
    return link - before


def follow(equation: LinkEquation, transmission: Transmission) -> tuple[Array, Array]:
    """Lead x of the link over its motor and its rate, each (N,), from rest in balance."""
    largest = float(np.abs(equation.torque).max())
    stiffest, _ = transmission.torque_slopes(transmission.twist_at_rest(largest), 0.0)
    fastest = (max(stiffest, 0.0) / float(equation.inertia.min())) ** 0.5
    parts = min(max(ceil(fastest * STEP_S / RESOLVED), 1), MOST_PARTS)
    h = STEP_S / parts
    scale = GAMMA * h
    count = len(equation.torque)
    fine = np.arange((count - 1) * parts + 1) / parts
    inertia, damping, stiffness, load = (
        np.interp(fine, np.arange(count), each).tolist()
        for each in (equation.inertia, equation.damping, equation.stiffness, equation.torque)
    )
    torque, slopes = transmission.torque, transmission.torque_slopes
    x, w = -transmission.twist_at_rest(equation.resting_torque), 0.0
    lead, rate = np.empty(count), np.empty(count)
    lead[0], rate[0] = x, w
    for k in range(1, len(fine)):
        m, d, g = inertia[k - 1], damping[k - 1], stiffness[k - 1]
        by_twist, by_rate = slopes(-x, -w)
        solving = 1.0 + scale * (d + by_rate) / m + scale * scale * (g + by_twist) / m
        p = -(g + by_twist) / m
        # stage 1: W k = f, solved for the rate's part first
        fx, fw = w, (torque(-x, -w) - load[k - 1] - d * w - g * x) / m
        kw = (fw + scale * p * fx) / solving
        kx = fx + scale * kw
        x1, w1 = x + h * kx, w + h * kw
        m, d, g = inertia[k], damping[k], stiffness[k]
        fx, fw = w1 - 2.0 * kx, (torque(-x1, -w1) - load[k] - d * w1 - g * x1) / m - 2.0 * kw
        lw = (fw + scale * p * fx) / solving
        lx = fx + scale * lw
        x += h * (1.5 * kx + 0.5 * lx)
        w += h * (1.5 * kw + 0.5 * lw)
        if k % parts == 0:
            lead[k // parts], rate[k // parts] = x, w
    return lead, rate
