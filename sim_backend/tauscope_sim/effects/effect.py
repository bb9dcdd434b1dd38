"""What every concealed effect of the plant has in common; the hooks of which each overrides those that it needs."""

import math
from collections.abc import Callable
from enum import StrEnum
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, BeforeValidator

from tauscope.errors import ScenarioError
from tauscope.robot.document_fields import Document, Number, Positive, refusal
from tauscope.robot.messages import shown
from tauscope.robot.robot import Joint, Robot
from tauscope_sim.friction import shape_constants, smooth_sign, smooth_sign_slope
from tauscope_sim.plant.term import Coordinates, Forces, Moment, PhysicalEffect, Slopes, Term

LARGEST_EXPONENT = 10.0  # of a power law in speed or angle


def _must_be(words: str, is_right: Callable[[Any], bool]) -> Callable[[Any], Any]:
    """Refuse a value that is none of these."""

    def check(value: Any) -> Any:
        if not is_right(value):
            raise refusal(f"must be {words}, but is {shown(value)}")
        return value

    return check


def _is_whole(least: int, below: float) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, int) and not isinstance(value, bool) and least <= value < below


def _list(value: Any) -> Any:
    if isinstance(value, list | tuple):
        if not value:
            raise refusal("must not be an empty list; write a number or a list of numbers")
        return list(value)
    return [value]


NotNegative = Annotated[Number, AfterValidator(_must_be("zero or more", lambda value: value >= 0.0))]
Exponent = Annotated[
    Number,
    AfterValidator(
        _must_be(f"above 0 and at most {LARGEST_EXPONENT:g}", lambda value: 0.0 < value <= LARGEST_EXPONENT)
    ),
]
_WHOLE = _must_be("a number counted from 1 or a joint's name", _is_whole(1, math.inf))
JointNumber = Annotated[int, BeforeValidator(_WHOLE)]
Numbers = Annotated[list[Number], BeforeValidator(_list)]
NotNegativeNumbers = Annotated[list[NotNegative], BeforeValidator(_list)]
Seed = Annotated[int, BeforeValidator(_must_be("a whole number of zero or more", _is_whole(0, 2**63)))]


def one_of(*words: str) -> Any:
    """Validator of a key that is one of a few words."""
    return BeforeValidator(_must_be(" or ".join(words), lambda value: isinstance(value, str) and value in words))


class ScenarioEntry(Document):
    """One entry of a scenario's list of effects: its fields are the entry's keys."""

    effect_id: ClassVar[str] = ""  # id of CONTRACT.md, the entry's key ``effect``

    def check(self, robot: Robot) -> None:
        """Refuse an entry that this robot cannot have. Raises ScenarioError naming effect and key."""
        for key, kind in (("joint", "joints"), ("other_joint", "joints"), ("link", "links")):
            number = getattr(self, key, None)
            if number is not None and number > robot.joint_count:
                raise self.refused(key, f"is {number}, but the arm has {robot.joint_count} {kind}")

    def refused(self, key: str, text: str) -> ScenarioError:
        return ScenarioError(f"{self.effect_id}.{key}: {text}")


class Effect(ScenarioEntry, PhysicalEffect):
    """A concealed effect of arm, transmission or surroundings."""


class JointEffect(Effect):
    """An effect of one joint."""

    joint: JointNumber  # its number, counted from 1

    @property
    def index(self) -> int:
        return self.joint - 1

    def joint_of(self, robot: Robot) -> Joint:
        return robot.joints[self.index]


class SmoothSignEffect(JointEffect):
    """An effect of one `joint`, from 1, in which A(v) = (2/π) arctan(K_v v) stands for the sign of velocity."""

    k_v: Positive | None = None  # K_v; that of the joint's friction_shape where None [s/rad or s/m]

    def check(self, robot: Robot) -> None:
        super().check(robot)
        self.steepness(robot)

    def steepness(self, robot: Robot) -> float:
        """K_v [s/rad or s/m]."""
        k_v = self.k_v if self.k_v is not None else self.joint_of(robot).friction_shape.k_v
        if k_v is None:
            raise self.refused("k_v", "is missing, and the robot file states none for this joint; state k_v [s/rad]")
        return k_v


# τ(q, v) [Nm or N], and its derivatives with respect to q and v
Law = tuple[Callable[[float, float], float], Callable[[float, float], tuple[float, float]]]


class Side(StrEnum):
    """Where in the joint a torque acts."""

    FRICTION = "friction"  # on the motor's side, as friction that heats the joint
    MOTOR = "motor"  # on the motor's side
    LINK = "link"  # on the link's side: part of the load that the transmission carries
    LOAD_GAIN = "load_gain"  # a unit of that load
    LOAD_FRICTION = "load_friction"  # a unit of that load's magnitude, as friction


class JointLaw(JointEffect):
    """An effect τ(q, v) of one joint; q and v are the motor's, or the link's where it acts on that side."""

    side: ClassVar[Side] = Side.MOTOR

    def law(self, robot: Robot) -> Law:
        raise NotImplementedError

    def terms(self, robot: Robot, coordinates: Coordinates) -> tuple[Term, ...]:
        place = self.index if self.side is Side.LINK else coordinates.motor(self.index)
        return (_LawTerm(self.index, place, self.side, self.law(robot)),)


class FrictionLaw(SmoothSignEffect, JointLaw):
    """A friction law τ = f(q, v) A(v) of one joint."""

    side: ClassVar[Side] = Side.FRICTION

    def factor(self, q: float, v: float) -> tuple[float, float, float]:
        """Factor f and its derivatives by q and v."""
        raise NotImplementedError

    def law(self, robot: Robot) -> Law:
        k_v = self.steepness(robot)

        def slopes(q: float, v: float) -> tuple[float, float]:
            (f, by_position, by_velocity), sign = self.factor(q, v), smooth_sign(v, k_v)
            return sign * by_position, f * smooth_sign_slope(v, k_v) + sign * by_velocity

        return (lambda q, v: self.factor(q, v)[0] * smooth_sign(v, k_v)), slopes


class _LawTerm(Term):
    def __init__(self, joint: int, place: int, side: Side, law: Law) -> None:
        self._joint, self._place, self._side = joint, place, side
        self._torque, self._slopes = law
        self.depends_on_load = side in (Side.LOAD_GAIN, Side.LOAD_FRICTION)

    def act(self, moment: Moment, forces: Forces) -> None:
        torque = self._torque(moment.position[self._place], moment.velocity[self._place])
        getattr(forces, self._side.value)[self._joint] += torque

    def linearise(self, moment: Moment, slopes: Slopes) -> None:
        place, load = self._place, moment.load[self._joint]
        factor = {Side.LOAD_GAIN: load, Side.LOAD_FRICTION: abs(load)}.get(self._side, 1.0)
        by_position, by_velocity = self._slopes(moment.position[place], moment.velocity[place])
        slopes.by_position[place, place] += factor * by_position
        slopes.by_velocity[place, place] += factor * by_velocity


class CoulombTerm(Term):
    """What changes the robot file's static friction of one joint, by an internal state of its own."""

    state_count = 1

    def __init__(self, effect: JointEffect, robot: Robot, coordinates: Coordinates) -> None:
        self._joint, self._place = effect.index, coordinates.motor(effect.index)
        self._friction = (robot.model.friction or ())[effect.index]
        ((self._k_v, self._delta),) = shape_constants([self._friction], [effect.joint_of(robot).friction_shape])
        self._stiction, self._stribeck = self._friction.stiction, self._friction.stribeck

    def _level(self, v: float) -> float:
        """τ_s A(v) + τ_sc A_δ(v)."""
        return self._stiction * smooth_sign(v, self._k_v) + self._stribeck * smooth_sign(v, self._delta)

    def _slope(self, v: float) -> float:
        return self._stiction * smooth_sign_slope(v, self._k_v) + self._stribeck * smooth_sign_slope(v, self._delta)
