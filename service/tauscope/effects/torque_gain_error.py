"""A recorded torque that is scaled: a wrong torque constant."""

from collections.abc import Sequence

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, per_joint_columns
from tauscope.recording.recording import Array
from tauscope.robot import Robot


class TorqueGainError(Effect):
    """τ_recorded = (1 + g) τ."""

    id = "torque_gain_error"
    rank = 150
    german = "falscher Drehmomentfaktor"
    equation = "tau_recorded = (1 + g) tau"
    meaning = "the recorded torque is scaled: the torque constant is wrong"
    remedy = "correct the joint's torque_constant by 1 + g"
    no_code = "it changes the recorded torque, not the arm's"
    revealing_motion = "fast motion of neighbouring joints that share inertia, or a known added mass"
    coefficients = (Coefficient("g", "1"),)
    may_exceed_measured = True

    @classmethod
    def can_act(cls, context: ArmContext, joint: int) -> bool:
        """Whether the joint is there: a joint at rest has torque too."""
        return True

    def columns(self, signals: Signals, shapes: Array) -> Array:
        """The model's torque."""
        return per_joint_columns(signals.torque[self.joint][None, None])

    def factor(self, coefficients: Array) -> float:
        """1 + g: with a wrong sign every parameter works the other way round."""
        return 1.0 + float(coefficients[0])

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """The gain 1 + g."""
        return [{"gain": 1.0 + coefficients[0]}]
