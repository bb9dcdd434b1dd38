"""Effects to conceal, drawn at random: their entries in a scenario file, and how their strength is set.

An effect's size has one knob. Where the torque that it makes is proportional to it, so is s; elsewhere s goes with a
power of it, which is only needed to find the size of a wanted s in few passages.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from concealed.generator.forward import Entry
from tauscope.robot import Robot

Draw = Callable[["Ground", np.random.Generator], "Drawn"]


@dataclass(frozen=True, eq=False)
class Ground:
    """Where an effect is drawn.

    robot : Robot
        the true arm
    joint : int
        counted from 0
    noise : float
        standard deviation of the joint's torque [Nm]
    load : float
        rms of its torque [Nm]
    low, high : float
        range of its motion [rad]
    duration, shortest : float
        of the longest and the shortest recording [s]
    """

    robot: Robot
    joint: int
    noise: float
    load: float
    low: float
    high: float
    duration: float
    shortest: float

    @property
    def coulomb(self) -> float:
        """The joint's Coulomb friction [Nm]."""
        return (self.robot.model.friction or ())[self.joint].stiction


@dataclass(frozen=True, eq=False)
class Drawn:
    """A concealed effect.

    entry : callable
        from the size of the knob to the entry
    size : float
        a first guess of the knob
    power : float
        s goes with size**power
    places : tuple of int or None
        joints, counted from 0, at which it may be named
    names : tuple of str
        ids under which it may be named
    also : tuple of str
        ids that come with it: a second mass that an elastic transmission brings, teeth that give way
    also_places : tuple of int or None
        joints at which what comes with it may be named; `places` where empty
    smallest : float
        size below which the effect is another: bristles shorter than the encoder's noise are a step
    largest : float
        size beyond which no arm has it
    """

    entry: Callable[[float], Entry]
    size: float
    power: float
    places: tuple[int | None, ...]
    names: tuple[str, ...]
    also: tuple[str, ...] = ()
    also_places: tuple[int | None, ...] = ()
    smallest: float = 0.0
    largest: float = np.inf


LARGEST_VARIATION = 0.9
"""Part of its Coulomb friction by which a joint's differs with direction or place: more than all of it would drive."""

LARGEST_GAIN_ERROR = 0.5
"""Of a torque channel: one that is wrong by more, somebody has seen long ago; at one it shows nothing."""

LARGEST_OF_LOAD = 0.95
"""Part of the load that a gear's ripple, or its friction, may take: at all of it the transmission locks itself."""


def _law(effect: str, ground: Ground, key: str, size: float, **more: object) -> Drawn:
    """An effect of one joint with an amplitude."""
    return Drawn(
        lambda value: {"effect": effect, "joint": ground.joint + 1, key: value, **more},
        size,
        1.0,
        (ground.joint,),
        (effect,),
    )


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def asymmetric_coulomb(g: Ground, rng: np.random.Generator) -> Drawn:
    drawn = _law("asymmetric_coulomb", g, "amplitude", 0.8 * g.noise * _sign(rng))
    return replace(drawn, largest=LARGEST_VARIATION * g.coulomb)


def asymmetric_viscous(g: Ground, rng: np.random.Generator) -> Drawn:
    return _law("asymmetric_viscous", g, "amplitude", 1.0 * g.noise * _sign(rng))


def nonlinear_viscous(g: Ground, rng: np.random.Generator) -> Drawn:
    return _law("nonlinear_viscous", g, "amplitude", 3.0 * g.noise, exponent=float(rng.choice([0.5, 1.7, 2.2])))


def stribeck_friction(g: Ground, rng: np.random.Generator) -> Drawn:
    more = {"velocity": float(rng.uniform(0.08, 0.5)), "exponent": float(rng.choice([1.0, 2.0]))}
    return _law("stribeck_friction", g, "amplitude", 2.0 * g.noise, **more)


def load_dependent_friction(g: Ground, rng: np.random.Generator) -> Drawn:
    drawn = _law("load_dependent_friction", g, "mu", min(0.8 * g.noise / g.load, 0.3))
    return replace(drawn, largest=LARGEST_OF_LOAD)


def position_dependent_friction(g: Ground, rng: np.random.Generator) -> Drawn:
    phase = float(rng.uniform(-3.0, 3.0))
    drawn = _law("position_dependent_friction", g, "amplitude", 0.8 * g.noise, order=1.0, phase=phase)
    return replace(drawn, largest=LARGEST_VARIATION * g.coulomb)


def presliding_hysteresis(g: Ground, rng: np.random.Generator) -> Drawn:
    entry = _law("presliding_hysteresis", g, "distance", 0.01)
    return Drawn(entry.entry, 0.01, 0.7, entry.places, entry.names, smallest=1e-3)


def friction_drift(g: Ground, rng: np.random.Generator) -> Drawn:
    more = {"thermal_resistance": 5.0, "time_constant": float(rng.uniform(0.3, 0.8)) * g.duration}
    joint = g.joint + 1
    return Drawn(
        lambda value: {
            "effect": "friction_drift",
            "joint": joint,
            "coulomb_per_kelvin": value,
            "viscous_per_kelvin": value,
            **more,
        },
        -0.03,
        1.0,
        (g.joint,),
        ("friction_drift",),
    )


def friction_coupling(g: Ground, rng: np.random.Generator) -> Drawn:
    other = g.joint - 1 if g.joint else 1
    joint, k = g.joint + 1, other + 1
    of = str(rng.choice(["sum", "difference"]))
    return Drawn(
        lambda value: {
            "effect": "friction_coupling",
            "joint": joint,
            "other_joint": k,
            "of": of,
            "coulomb": value,
            "viscous": 0.0,
        },
        0.5 * g.noise,
        1.0,
        (g.joint, other),
        ("friction_coupling",),
    )


def cogging(g: Ground, rng: np.random.Generator) -> Drawn:
    order = round(float(rng.uniform(6.0, 40.0)) / max(g.high - g.low, 0.5) * 2.0, 1)
    return _law("cogging", g, "amplitude", 0.4 * g.noise, order=order, phase=float(rng.uniform(-3.0, 3.0)))


def torque_ripple(g: Ground, rng: np.random.Generator) -> Drawn:
    order = round(float(rng.uniform(6.0, 40.0)) / max(g.high - g.low, 0.5) * 2.0, 1)
    more = {"order": order, "phase": float(rng.uniform(-3.0, 3.0))}
    drawn = _law("torque_ripple", g, "amplitude", min(0.4 * g.noise / g.load, 0.3), **more)
    return replace(drawn, largest=LARGEST_OF_LOAD)


def _rotor(g: Ground) -> float:
    """Reflected inertia of the motor: so small beside the noise that it hides no compliance [kg m² or kg]."""
    return min(0.004, 0.02 * g.noise)


def joint_elasticity(g: Ground, rng: np.random.Generator) -> Drawn:
    joint, rotor = g.joint + 1, _rotor(g)
    return Drawn(
        lambda value: {
            "effect": "joint_elasticity",
            "joint": joint,
            "stiffness": 1.0 / value,
            "damping": 0.002 / value,
            "rotor_inertia": rotor,
        },
        2e-3,
        1.0,
        (g.joint,),
        ("joint_elasticity",),
        ("rotor_inertia",),
        largest=0.02,
        smallest=1e-7,  # where none reaches s another effect is drawn; no file may state a stiffness of 1e9
    )


def backlash(g: Ground, rng: np.random.Generator) -> Drawn:
    joint, rotor = g.joint + 1, _rotor(g)
    return Drawn(
        lambda value: {
            "effect": "backlash",
            "joint": joint,
            "gap": value,
            "contact_stiffness": 1e4,
            "rotor_inertia": rotor,
        },
        0.01,
        1.0,
        (g.joint,),
        ("backlash",),
        ("rotor_inertia", "joint_elasticity"),  # the teeth give way, too: contact_stiffness
        largest=0.05,
    )


def rotor_inertia(g: Ground, rng: np.random.Generator) -> Drawn:
    return _law("rotor_inertia", g, "inertia", 0.2 * g.noise)


def torque_gain_error(g: Ground, rng: np.random.Generator) -> Drawn:
    drawn = _law("torque_gain_error", g, "gain", 0.0)
    return Drawn(
        lambda value: {**drawn.entry(0.0), "gain": 1.0 + value},
        0.05 * _sign(rng),
        1.0,
        drawn.places,
        drawn.names,
        largest=LARGEST_GAIN_ERROR,
    )


def torque_saturation(g: Ground, rng: np.random.Generator) -> Drawn:
    shape = str(rng.choice(["compression", "clip"]))
    joint = g.joint + 1
    return Drawn(
        lambda value: {"effect": "torque_saturation", "joint": joint, "level": 3.0 * g.load / value, "shape": shape},
        1.5,
        2.0,
        (g.joint,),
        ("torque_saturation",),
    )


def time_delay(g: Ground, rng: np.random.Generator) -> Drawn:
    whole = bool(rng.random() < 0.5)
    place = {} if whole else {"joint": g.joint + 1}
    return Drawn(
        lambda value: {"effect": "time_delay", "delay": value, **place},
        0.003,  # a late torque: what late positions do is no torque that could be added to a passage
        1.0,
        (None if whole else g.joint,),
        ("time_delay",),
        largest=0.03,
    )


def joint_spring(g: Ground, rng: np.random.Generator) -> Drawn:
    return _law("joint_spring", g, "stiffness", 1.0 * g.noise, rest=float(rng.uniform(-0.5, 0.5)))


def cable_force(g: Ground, rng: np.random.Generator) -> Drawn:
    side = str(rng.choice(["above", "below"]))
    share = float(rng.uniform(0.45, 0.7))
    angle = g.low + (share if side == "above" else 1.0 - share) * (g.high - g.low)
    return _law("cable_force", g, "stiffness", 2.0 * g.noise, angle=angle, side_of_angle=side, exponent=1.5)


def base_tilt(g: Ground, rng: np.random.Generator) -> Drawn:
    share = float(rng.uniform(-1.0, 1.0))
    return Drawn(
        lambda value: {"effect": "base_tilt", "about_x": value, "about_y": share * value},
        0.02,
        1.0,
        (None,),
        ("base_tilt",),
    )


def kinematic_error(g: Ground, rng: np.random.Generator) -> Drawn:
    link = int(rng.integers(1, g.robot.joint_count))
    axis = int(rng.integers(3))
    return Drawn(
        lambda value: {
            "effect": "kinematic_error",
            "link": link,
            "translation": [value if place == axis else 0.0 for place in range(3)],
        },
        0.03 * _sign(rng),
        1.0,
        (None,),
        ("kinematic_error",),
        largest=0.15,
    )


def payload_change(g: Ground, rng: np.random.Generator) -> Drawn:
    """From one instant to another of every recording: a cycle that picks something up."""
    offset = [float(value) for value in rng.uniform(-0.1, 0.1, 3).round(3)]
    begin, length = float(rng.uniform(0.2, 0.5)) * g.shortest, float(rng.uniform(0.2, 0.4)) * g.shortest
    when = {"start": round(begin, 2), "end": round(begin + length, 2)}
    return Drawn(
        lambda value: {"effect": "payload_change", "mass": value, "offset": offset, **when},
        0.2,
        1.0,
        (None,),
        ("payload_change",),
        largest=20.0,
    )


def external_contact(g: Ground, rng: np.random.Generator) -> Drawn:
    """A push at one joint, once in every recording."""
    profile = str(rng.choice(["half_sine", "rectangular"]))
    when = {
        "start": round(float(rng.uniform(0.2, 0.7)) * g.shortest, 2),
        "duration": round(float(rng.uniform(0.5, 3.0)), 2),
    }
    return _law("external_contact", g, "torque", 2.0 * g.noise * _sign(rng), profile=profile, **when)


def flip_one(joint: int) -> Drawn:
    """A torque channel wired the other way round."""
    return Drawn(lambda value: {}, 1.0, 1.0, (joint,), ("torque_gain_error",))


def flip_all(joint_count: int) -> Drawn:
    """The reaction on the drives in place of their torque, at every joint."""
    gain = ("torque_gain_error",)
    return Drawn(lambda value: {}, 1.0, 1.0, (None,), gain, gain, tuple(range(joint_count)))


EVENTS: dict[str, Draw] = {draw.__name__: draw for draw in (payload_change, external_contact)}
"""Effects that happen once a recording."""

CATALOGUE: dict[str, Draw] = {
    draw.__name__: draw
    for draw in (
        asymmetric_coulomb,
        asymmetric_viscous,
        nonlinear_viscous,
        stribeck_friction,
        load_dependent_friction,
        position_dependent_friction,
        presliding_hysteresis,
        friction_drift,
        friction_coupling,
        cogging,
        torque_ripple,
        joint_elasticity,
        backlash,
        rotor_inertia,
        torque_gain_error,
        torque_saturation,
        time_delay,
        joint_spring,
        cable_force,
        base_tilt,
        kinematic_error,
    )
}
