"""All effects that are looked for: those of this package, and those that plugins add.

A plugin names an `Effect` class under the entry point group ``tauscope.effects``.
"""

from collections.abc import Sequence
from functools import cache
from importlib.metadata import entry_points

from service.diagnosis.catalogue.asymmetric_friction import AsymmetricCoulomb, AsymmetricViscous
from service.diagnosis.catalogue.backlash import Backlash
from service.diagnosis.catalogue.base_tilt import BaseTilt
from service.diagnosis.catalogue.effect import Effect
from service.diagnosis.catalogue.elastic_forces import CableForce, JointSpring
from service.diagnosis.catalogue.external_contact import ExternalContact
from service.diagnosis.catalogue.friction_coupling import FrictionCoupling
from service.diagnosis.catalogue.friction_drift import FrictionDrift
from service.diagnosis.catalogue.joint_elasticity import JointElasticity
from service.diagnosis.catalogue.kinematic_error import KinematicError
from service.diagnosis.catalogue.load_dependent_friction import LoadDependentFriction
from service.diagnosis.catalogue.nonlinear_viscous import NonlinearViscous
from service.diagnosis.catalogue.payload import Payload
from service.diagnosis.catalogue.payload_change import PayloadChange
from service.diagnosis.catalogue.periodic_torque import Cogging, TorqueRipple
from service.diagnosis.catalogue.plain_terms import CoulombFriction, TorqueOffset, ViscousFriction
from service.diagnosis.catalogue.position_dependent_friction import PositionDependentFriction
from service.diagnosis.catalogue.presliding_hysteresis import PreslidingHysteresis
from service.diagnosis.catalogue.rotor_inertia import RotorInertia
from service.diagnosis.catalogue.setting import Setting
from service.diagnosis.catalogue.stribeck_friction import StribeckFriction
from service.diagnosis.catalogue.time_delay import TimeDelay
from service.diagnosis.catalogue.torque_sensing import TorqueGainError, TorqueSaturation
from service.errors import IdentificationError

ENTRY_POINT_GROUP = "tauscope.effects"

BUILT_IN: tuple[type[Effect], ...] = (
    AsymmetricCoulomb,
    AsymmetricViscous,
    NonlinearViscous,
    LoadDependentFriction,
    PositionDependentFriction,
    StribeckFriction,
    PreslidingHysteresis,
    FrictionDrift,
    FrictionCoupling,
    Cogging,
    TorqueRipple,
    Backlash,
    JointElasticity,
    RotorInertia,
    TorqueGainError,
    TorqueSaturation,
    TimeDelay,
    JointSpring,
    CableForce,
    BaseTilt,
    PayloadChange,
    ExternalContact,
    KinematicError,
    Payload,
    TorqueOffset,
    CoulombFriction,
    ViscousFriction,
)


@cache
def catalogue() -> tuple[type[Effect], ...]:
    """The classes of all effects, built-in ones first.

    Raises
    ------
    IdentificationError
        where a plugin cannot be loaded or is no effect
    """
    added = []
    for entry in entry_points(group=ENTRY_POINT_GROUP):
        try:
            effect = entry.load()
        except Exception as error:
            raise IdentificationError(f"effect {entry.name} ({entry.value}) cannot be loaded: {error}") from error
        if not (isinstance(effect, type) and issubclass(effect, Effect)):
            raise IdentificationError(
                f"effect {entry.name} ({entry.value}) is no subclass of Effect: correct the plugin"
            )
        added.append(effect)
    return (*BUILT_IN, *added)


def possible_effects(setting: Setting) -> Sequence[Effect]:
    """Every form of every effect worth looking at beside the nominal model.

    Parameters
    ----------
    setting : Setting
        the arm and the ranges of its motion
    """
    return [form for effect in catalogue() if effect.screened for form in effect.forms(setting)]


def farther_effects(setting: Setting) -> Sequence[Effect]:
    """Every form that is worth a look only where something is left.

    Parameters
    ----------
    setting : Setting
        the arm and the ranges of its motion
    """
    return [form for effect in catalogue() if effect.screened for form in effect.farther_forms(setting)]
