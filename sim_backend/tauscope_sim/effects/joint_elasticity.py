"""Transmission compliance: motor and link are two masses with T = K (θ - q) + D (θ̇ - q̇) between them.

K in Nm/rad (N/m), D in Nm s/rad (N s/m), the motor's reflected inertia J in kg m² (kg). All friction and the drive act
on the motor; the encoder sits there too.
"""

from typing import ClassVar

from tauscope.robot.document_fields import Positive
from tauscope_sim.effects.effect import JointEffect
from tauscope_sim.effects.fields import NotNegative
from tauscope_sim.plant.term import Transmission


class JointElasticity(JointEffect):
    """T = K (θ - q) + D (θ̇ - q̇).

    joint : int
        its number, counted from 1
    stiffness : float
        K [Nm/rad or N/m]
    damping : float
        D [Nm s/rad or N s/m]
    rotor_inertia : float
        J [kg m² or kg]
    """

    effect_id: ClassVar[str] = "joint_elasticity"
    stiffness: Positive
    damping: NotNegative = 0.0
    rotor_inertia: Positive

    def transmission(self) -> Transmission:
        """Itself."""
        return self

    def torque(self, twist: float, twist_rate: float) -> float:
        """T [Nm or N].

        Parameters
        ----------
        twist : float
            θ - q [rad or m]
        twist_rate : float
            θ̇ - q̇ [rad/s or m/s]
        """
        return self.stiffness * twist + self.damping * twist_rate

    def torque_slopes(self, twist: float, twist_rate: float) -> tuple[float, float]:
        """K and D.

        Parameters
        ----------
        twist : float
            θ - q [rad or m]
        twist_rate : float
            θ̇ - q̇ [rad/s or m/s]
        """
        return self.stiffness, self.damping

    def twist_at_rest(self, torque: float) -> float:
        """Twist T / K [rad or m].

        Parameters
        ----------
        torque : float
            T [Nm or N]
        """
        return torque / self.stiffness
