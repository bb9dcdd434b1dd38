"""Concealed physics: every effect id of CONTRACT.md that forward physics or sensors can have, one file an effect.

`EFFECTS` finds an effect's class by its id. To add one, write its file and name its class here.
"""

from collections.abc import Mapping
from types import MappingProxyType

from tauscope_sim.effects.asymmetric_coulomb import AsymmetricCoulomb
from tauscope_sim.effects.asymmetric_viscous import AsymmetricViscous
from tauscope_sim.effects.backlash import Backlash
from tauscope_sim.effects.base_tilt import BaseTilt
from tauscope_sim.effects.cable_force import CableForce
from tauscope_sim.effects.cogging import Cogging
from tauscope_sim.effects.coulomb_friction import CoulombFriction
from tauscope_sim.effects.effect import Effect, ScenarioEntry
from tauscope_sim.effects.external_contact import ExternalContact
from tauscope_sim.effects.friction_coupling import FrictionCoupling
from tauscope_sim.effects.friction_drift import FrictionDrift
from tauscope_sim.effects.joint_elasticity import JointElasticity
from tauscope_sim.effects.joint_spring import JointSpring
from tauscope_sim.effects.kinematic_error import KinematicError
from tauscope_sim.effects.load_dependent_friction import LoadDependentFriction
from tauscope_sim.effects.nonlinear_viscous import NonlinearViscous
from tauscope_sim.effects.payload import Payload
from tauscope_sim.effects.payload_change import PayloadChange
from tauscope_sim.effects.position_dependent_friction import PositionDependentFriction
from tauscope_sim.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope_sim.effects.rotor_inertia import RotorInertia
from tauscope_sim.effects.sensor_effect import Channel, SensorEffect
from tauscope_sim.effects.stribeck_friction import StribeckFriction
from tauscope_sim.effects.time_delay import TimeDelay
from tauscope_sim.effects.torque_gain_error import TorqueGainError
from tauscope_sim.effects.torque_offset import TorqueOffset
from tauscope_sim.effects.torque_ripple import TorqueRipple
from tauscope_sim.effects.torque_saturation import TorqueSaturation
from tauscope_sim.effects.viscous_friction import ViscousFriction

_CLASSES: tuple[type[ScenarioEntry], ...] = (
    AsymmetricCoulomb,
    AsymmetricViscous,
    Backlash,
    BaseTilt,
    CableForce,
    Cogging,
    CoulombFriction,
    ExternalContact,
    FrictionCoupling,
    FrictionDrift,
    JointElasticity,
    JointSpring,
    KinematicError,
    LoadDependentFriction,
    NonlinearViscous,
    Payload,
    PayloadChange,
    PositionDependentFriction,
    PreslidingHysteresis,
    RotorInertia,
    StribeckFriction,
    TimeDelay,
    TorqueGainError,
    TorqueOffset,
    TorqueRipple,
    TorqueSaturation,
    ViscousFriction,
)

EFFECTS: Mapping[str, type[ScenarioEntry]] = MappingProxyType({entry.effect_id: entry for entry in _CLASSES})
"""Class of each effect, by its id."""

__all__ = [
    "EFFECTS",
    "AsymmetricCoulomb",
    "AsymmetricViscous",
    "Backlash",
    "BaseTilt",
    "CableForce",
    "Channel",
    "Cogging",
    "CoulombFriction",
    "Effect",
    "ExternalContact",
    "FrictionCoupling",
    "FrictionDrift",
    "JointElasticity",
    "JointSpring",
    "KinematicError",
    "LoadDependentFriction",
    "NonlinearViscous",
    "Payload",
    "PayloadChange",
    "PositionDependentFriction",
    "PreslidingHysteresis",
    "RotorInertia",
    "ScenarioEntry",
    "SensorEffect",
    "StribeckFriction",
    "TimeDelay",
    "TorqueGainError",
    "TorqueOffset",
    "TorqueRipple",
    "TorqueSaturation",
    "ViscousFriction",
]
