"""Concealed physics: every effect id of CONTRACT.md that forward physics or sensors can have, one file an effect.

`EFFECTS` finds an effect's class by its id. To add one, write its file and name its class here.
"""

from collections.abc import Mapping
from types import MappingProxyType

from sim_backend.effects.asymmetric_coulomb import AsymmetricCoulomb
from sim_backend.effects.asymmetric_viscous import AsymmetricViscous
from sim_backend.effects.backlash import Backlash
from sim_backend.effects.base_tilt import BaseTilt
from sim_backend.effects.cable_force import CableForce
from sim_backend.effects.cogging import Cogging
from sim_backend.effects.coulomb_friction import CoulombFriction
from sim_backend.effects.effect import Effect, ScenarioEntry
from sim_backend.effects.external_contact import ExternalContact
from sim_backend.effects.friction_coupling import FrictionCoupling
from sim_backend.effects.friction_drift import FrictionDrift
from sim_backend.effects.joint_elasticity import JointElasticity
from sim_backend.effects.joint_spring import JointSpring
from sim_backend.effects.kinematic_error import KinematicError
from sim_backend.effects.load_dependent_friction import LoadDependentFriction
from sim_backend.effects.nonlinear_viscous import NonlinearViscous
from sim_backend.effects.payload import Payload
from sim_backend.effects.payload_change import PayloadChange
from sim_backend.effects.position_dependent_friction import PositionDependentFriction
from sim_backend.effects.presliding_hysteresis import PreslidingHysteresis
from sim_backend.effects.rotor_inertia import RotorInertia
from sim_backend.effects.sensor_effect import Channel, SensorEffect
from sim_backend.effects.stribeck_friction import StribeckFriction
from sim_backend.effects.time_delay import TimeDelay
from sim_backend.effects.torque_gain_error import TorqueGainError
from sim_backend.effects.torque_offset import TorqueOffset
from sim_backend.effects.torque_ripple import TorqueRipple
from sim_backend.effects.torque_saturation import TorqueSaturation
from sim_backend.effects.viscous_friction import ViscousFriction

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
