"""A recorded torque that is scaled: a wrong torque constant."""

from collections.abc import Sequence

from tauscope.effects.context import ArmContext, Signals
from tauscope.effects.effect import Coefficient, Effect, Entry, Sizes, percent_text
from tauscope.number_text import significant
from tauscope.recording.recording import Array
from tauscope.robot import Robot

ALIKE = 0.05  # part of a torque constant by which motors of one kind differ: so much is no scale


class TorqueGainError(Effect):
    """τ_recorded = (1 + g) τ."""

    id = "torque_gain_error"
    rank = 150
    equation = "tau_recorded = (1 + g) tau"
    meaning = "the recorded torque is scaled: the torque constant is wrong"
    remedy = "correct the joint's torque_constant by 1 + g"
    no_code = "it changes the recorded torque, not the arm's"
    revealing_motion = "fast motion of neighbouring joints that share inertia, or a known added mass"
    coefficients = (Coefficient("g", "1"),)

    @classmethod
    def can_act(cls, context: ArmContext, joint: int) -> bool:
        """Whether the joint is there: a joint at rest has torque too."""
        return True

    def columns(self, signals: Signals, shapes: Array) -> Array:
        return signals.torque[list(self.touched(len(signals.torque)))][None, None]

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """A wrong sign first; else which way it is wrong."""
        gain = 1.0 + found["g"].value
        off = f"{percent_text(abs(gain) - 1.0)} too {'large' if abs(gain) > 1.0 else 'small'}"
        if gain >= 0.0:
            return f"the recorded torque is {off}"
        sign = "the recorded torque has the wrong sign"
        return sign if abs(abs(gain) - 1.0) < ALIKE else f"{sign} and is {off}"

    def advice(self, found: Sizes) -> str:
        gain = 1.0 + found["g"].value
        constant = f"divide the joint's torque_constant by {significant(abs(gain), 3)}"
        if gain >= 0.0:
            return constant
        return "invert the joint's sign" if abs(abs(gain) - 1.0) < ALIKE else f"invert the joint's sign and {constant}"

    def place(self, joint_names: Sequence[str]) -> str:
        return super().place(joint_names) or "at every joint"

    def factor(self, coefficients: Array) -> float:
        """1 + g: with a wrong sign every parameter works the other way round."""
        return 1.0 + float(coefficients[0])

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        return [{"gain": 1.0 + coefficients[0]}]
