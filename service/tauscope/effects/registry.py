"""All effects that are looked for: those of this package, and those that plugins add.

A plugin names an `Effect` class under the entry point group ``tauscope.effects``.
"""

from collections.abc import Sequence
from functools import cache
from importlib.metadata import entry_points

from tauscope.effects.asymmetric_friction import AsymmetricCoulomb, AsymmetricViscous
from tauscope.effects.backlash import Backlash
from tauscope.effects.base_tilt import BaseTilt
from tauscope.effects.context import ArmContext
from tauscope.effects.effect import Effect
from tauscope.effects.elastic_forces import CableForce, JointSpring
from tauscope.effects.external_contact import ExternalContact
from tauscope.effects.friction_coupling import FrictionCoupling
from tauscope.effects.friction_drift import FrictionDrift
from tauscope.effects.joint_elasticity import JointElasticity
from tauscope.effects.kinematic_error import KinematicError
from tauscope.effects.load_dependent_friction import LoadDependentFriction
from tauscope.effects.nonlinear_viscous import NonlinearViscous
from tauscope.effects.payload import Payload
from tauscope.effects.payload_change import PayloadChange
from tauscope.effects.periodic_torque import Cogging, TorqueRipple
from tauscope.effects.plain_terms import CoulombFriction, TorqueOffset, ViscousFriction
from tauscope.effects.position_dependent_friction import PositionDependentFriction
from tauscope.effects.presliding_hysteresis import PreslidingHysteresis
from tauscope.effects.rotor_inertia import RotorInertia
from tauscope.effects.stribeck_friction import StribeckFriction
from tauscope.effects.time_delay import TimeDelay
from tauscope.effects.torque_sensing import TorqueGainError, TorqueSaturation
from tauscope.errors import IdentificationError

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


def possible_effects(context: ArmContext) -> Sequence[Effect]:
    """Every form of every effect worth looking at beside the nominal model."""
    return [form for effect in catalogue() if effect.screened for form in effect.forms(context)]


def farther_effects(context: ArmContext) -> Sequence[Effect]:
    """Every form that is worth a look only where something is left."""
    return [form for effect in catalogue() if effect.screened for form in effect.farther_forms(context)]
