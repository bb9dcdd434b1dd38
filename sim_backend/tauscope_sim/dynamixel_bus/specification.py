"""What an emulated servo is: its figures, from ROBOTIS' e-Manual and not from the driver's tables."""

from dataclasses import dataclass, field, replace


@dataclass(frozen=True)
class ModelFigures:
    """What distinguishes one model of servo from another.

    `velocity_unit`: one unit of Present Velocity [rad/s].
    `milliampere`: one unit of Present Current [mA].
    `current_limit`: largest Goal Current [units].
    `velocity_limit`: [units].
    `pwm_limit`: [units].
    `goal_current_caps_position`: whether Goal Current is the cap of mode 3 (P, Y); in mode 5 it always is.
    """

    counts_per_turn: int
    zero_count: int
    velocity_unit: float
    milliampere: float
    current_limit: int
    velocity_limit: int
    pwm_limit: int
    modes: tuple[int, ...]
    goal_current_caps_position: bool
    eeprom: tuple[tuple[int, int], ...]
    gear_ratio: int = 1


_X = ModelFigures(
    counts_per_turn=4096,
    zero_count=2048,
    velocity_unit=0.0239691227,
    milliampere=2.69,
    current_limit=1193,
    velocity_limit=200,
    pwm_limit=885,
    modes=(0, 1, 3, 4, 5, 16),
    goal_current_caps_position=False,
    eeprom=((0, 64),),
)
_P = ModelFigures(
    counts_per_turn=1_003_846,
    zero_count=0,
    velocity_unit=0.0010471976,
    milliampere=1.0,
    current_limit=22_740,
    velocity_limit=2_900,
    pwm_limit=2_009,
    modes=(0, 1, 3, 4, 16),
    goal_current_caps_position=True,
    eeprom=((0, 512),),
)
_Y = ModelFigures(
    counts_per_turn=524_288,
    zero_count=0,
    velocity_unit=0.0010471976,
    milliampere=10.0,
    current_limit=2_080,
    velocity_limit=2_020,
    pwm_limit=1_000,
    modes=(0, 1, 3),
    goal_current_caps_position=True,
    eeprom=((0, 8), (10, 15), (32, 152), (256, 512)),
    gear_ratio=99,
)

MODELS: dict[int, ModelFigures] = {
    1020: _X,
    1120: replace(_X, current_limit=2047, velocity_limit=128),
    1060: replace(_X, current_limit=0),
    1200: replace(_X, milliampere=1.0, current_limit=1750),
    2020: _P,
    4030: _Y,
}
"""XM430-W350, XM540-W270, XL430-W250 (senses no current), XL330-M288, PH54-200-S500 and YM070-210-R099."""


@dataclass(frozen=True)
class ServoSpecification:
    """One emulated servo and the joint that it moves.

    `baud`: [bit/s].
    `torque_per_milliampere`: at the joint [Nm/mA or N/mA].
    `reduction`: turns of the horn per turn of the joint.
    `current_noise_ma`: standard deviation of what Present Current reads while there is torque [mA].
    """

    servo: int
    model_number: int = 1020
    firmware: int = 52
    baud: int = 1_000_000
    torque_per_milliampere: float = 0.01
    direction: int = 1
    reduction: float = 1.0
    current_noise_ma: float = 1.0
    registers: dict[str, int] = field(default_factory=dict)

    @property
    def figures(self) -> ModelFigures:
        """Of its model."""
        return MODELS[self.model_number]

    @property
    def counts_per_radian(self) -> float:
        """Counts for one radian (metre) of the joint, signed."""
        return self.direction * self.reduction * self.figures.counts_per_turn / 6.283185307179586

    @property
    def torque_per_unit(self) -> float:
        """Joint torque of one unit of current, signed [Nm or N]."""
        return self.direction * self.figures.milliampere * self.torque_per_milliampere
