"""Compliance and play whose size an encoder on the link has shown.

A fit of the torque may give the first-order laws another size; reported is the size that the encoder shows.
"""

from dataclasses import dataclass

import numpy as np

from tauscope.effects.backlash import BANDS, LOSSES, SPRINGY_BAND, Backlash, SpringyTeeth
from tauscope.effects.context import ArmContext
from tauscope.effects.effect import Quantities, Quantity, mesh
from tauscope.effects.joint_elasticity import BANDS as LOAD_BANDS
from tauscope.effects.joint_elasticity import JointElasticity
from tauscope.recording.recording import Array


@dataclass(frozen=True, eq=False)
class MeasuredElasticity(JointElasticity):
    """Compliance from q - q_link over the load."""

    is_variant = True
    equation = "q - q_link = c tau_rb, c = 1/stiffness"
    meaning = "the transmission gives way under load: the encoder on the link shows it"

    compliance: float = 0.0  # c [rad/Nm or m/N]
    compliance_std: float = 0.0  # its standard error

    @classmethod
    def of(cls, context: ArmContext, joint: int, compliance: float, std: float) -> "MeasuredElasticity":
        """The form of a joint of compliance c and its standard error [rad/Nm or m/N]."""
        swings = (0.0, compliance) if context.inertia[joint] > 0.0 else (0.0,)
        grid = mesh(LOAD_BANDS * context.cutoff_hz, np.array(swings))
        return cls(joint, grid, grid.min(axis=0), grid.max(axis=0), compliance, std)

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        return (Quantity("c", self.compliance, self.compliance_std, self.unit("{q}/{tau}", context)),)


@dataclass(frozen=True, eq=False)
class MeasuredPlay(Backlash):
    """Play from the jump of q - q_link where the load changes its sign."""

    is_variant = True
    equation = "q - q_link = b/2 sgn(tau_rb)"
    meaning = "the transmission has play when the load changes sign: the encoder on the link shows it"

    play: float = 0.0  # b [rad or m]
    play_std: float = 0.0  # its standard error

    @classmethod
    def of(cls, context: ArmContext, joint: int, play: float, std: float) -> "MeasuredPlay":
        """The form of a joint. `joint`: index, from 0; `play`, `std`: b and its standard error [rad or m]."""
        grid = mesh(np.array([play]), BANDS * context.cutoff_hz)
        return cls(joint, grid, grid.min(axis=0), grid.max(axis=0), play, std)

    def is_free(self, place: int) -> bool:
        """No shape: the encoder shows the gap."""
        return False

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        return (Quantity("b", self.play, self.play_std, self.unit("{q}", context)),)


@dataclass(frozen=True, eq=False)
class MeasuredTeeth(SpringyTeeth):
    """The same where the encoder also shows that the teeth give way."""

    is_variant = True
    equation = "q - q_link = b/2 sgn(tau_rb) + c tau_rb"
    meaning = MeasuredPlay.meaning

    play: float = 0.0  # b [rad or m]
    play_std: float = 0.0  # its standard error
    compliance: float = 0.0  # c [rad/Nm or m/N]
    compliance_std: float = 0.0  # its standard error

    @classmethod
    def of(cls, context: ArmContext, joint: int, play: Array, compliance: Array) -> "MeasuredTeeth":
        """The form of a joint of play b [rad or m] and compliance c [rad/Nm or m/N], with standard errors, (2,)."""
        band = np.array([SPRINGY_BAND * context.cutoff_hz])
        grid = mesh(play[:1], band, compliance[:1], LOSSES)
        return cls(joint, grid, grid.min(axis=0), grid.max(axis=0), *play.tolist(), *compliance.tolist())

    def is_free(self, place: int) -> bool:
        """No shape: the encoder shows gap and compliance."""
        return False

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        return (
            Quantity("b", self.play, self.play_std, self.unit("{q}", context)),
            Quantity("c", self.compliance, self.compliance_std, self.unit("{q}/{tau}", context)),
        )
