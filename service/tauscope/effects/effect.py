"""What an effect of the catalogue is: torque that the nominal model lacks, linear in coefficients for a given shape.

One object is one *form* of an effect at one place: a joint, or the whole arm. Its columns are made at the recorded
rate, before any filter, so that torque and columns pass the same one. Adding an effect is one file: a class with its
equation, its columns and the forms that it can take on a given arm.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from tauscope.effects.context import ArmContext, Signals
from tauscope.number_text import significant
from tauscope.recording.recording import Array
from tauscope.robot import JointType, Robot

# An entry of a scenario file without its joint; without its effect too where that is the effect's own id.
Entry = dict[str, Any]
_STEP = "atan({k_v} * v) * 0.6366197723675814"  # A(K_v v), the smooth sign, in C and Python
_POSITION = {JointType.REVOLUTE: "rad", JointType.PRISMATIC: "m"}
_TORQUE = {JointType.REVOLUTE: "Nm", JointType.PRISMATIC: "N"}
SHORT_S = 0.5  # times below this are told in milliseconds [s]
NO_SHAPE = np.zeros((1, 0))  # the grid of an effect without shape parameters


@dataclass(frozen=True)
class Coefficient:
    """A linear coefficient of an effect. `largest`, `smallest`: magnitudes beyond which there is no such effect."""

    name: str
    unit: str
    positive: bool = False
    largest: float = np.inf
    smallest: float = 0.0
    whole: float = np.inf  # value of what is complete, where an estimate stops


@dataclass(frozen=True)
class Shape:
    """A quantity that shapes an effect's columns and is searched over a grid, then refined between bounds."""

    name: str
    unit: str
    logarithmic: bool = False
    fixed: bool = False
    reported: bool = True


@dataclass(frozen=True)
class Quantity:
    """A parameter as a finding reports it."""

    name: str
    value: float
    std: float
    unit: str
    period: float = np.inf

    @property
    def is_known(self) -> bool:
        """Whether the data say anything of it."""
        return bool(np.isfinite(self.std))

    @property
    def in_usual_unit(self) -> "Quantity":
        """The same in milliseconds where it is a short time."""
        if self.unit != "s" or abs(self.value) >= SHORT_S:
            return self
        return replace(self, value=1e3 * self.value, std=1e3 * self.std, unit="ms", period=1e3 * self.period)


Quantities = tuple[Quantity, ...]  # parameters of a finding in their order
Sizes = Mapping[str, Quantity]  # parameters of a finding by name


def size_text(quantity: Quantity) -> str:
    """The magnitude of a quantity with its unit, two digits."""
    shown = quantity.in_usual_unit
    return significant(abs(shown.value), 2) + ("" if shown.unit == "1" else f" {shown.unit}")


def percent_text(value: float) -> str:
    """The magnitude of a share as per cent, two digits."""
    return f"{significant(100.0 * abs(value), 2)} %"


@dataclass(frozen=True, eq=False)
class Effect(ABC):
    """One form of an effect at one place."""

    id: ClassVar[str]
    equation: ClassVar[str]
    meaning: ClassVar[str]
    remedy: ClassVar[str]
    revealing_motion: ClassVar[str]
    # The torque as an expression that C and Python share: q, v and load are position, velocity and rigid-body torque of
    # the joint, {c[0]} and {s[0]} the first coefficient and shape, {step} the smooth sign of v, {effect} the object.
    code: ClassVar[str] = ""
    no_code: ClassVar[str] = ""  # why there is none
    no_scenario: ClassVar[str] = ""  # why a scenario cannot hold the effect
    rank: ClassVar[int] = 0  # its place in the catalogue and in documents
    is_variant: ClassVar[bool] = False  # a form of the effect of the same id, which stands in no catalogue itself
    refines: ClassVar[frozenset[str]] = frozenset()
    is_expected: ClassVar[bool] = False  # of every geared joint: counts towards no limit, nothing is doubted beside it
    has_constant: ClassVar[bool] = False  # of its own, which the nominal model shows as its offset
    coefficients: ClassVar[tuple[Coefficient, ...]]
    shapes: ClassVar[tuple[Shape, ...]] = ()
    repeats: ClassVar[bool] = False
    of_motion_alone: ClassVar[bool] = False  # its columns are the same beside every model, and are made once
    has_step: ClassVar[bool] = False  # they change with K_v of its joint…
    of_motion_and_step: ClassVar[bool] = False  # …and with nothing else of the model
    screened: ClassVar[bool] = True  # looked for beside the nominal model; others are found against a given model
    # What its law depends on: `position`, `velocity`, `acceleration` of its joint, the `load` on its transmission,
    # `time`, the `others`' motion; None where it acts on whatever torque there is.
    arguments: ClassVar[frozenset[str] | None] = None
    bends: ClassVar[bool] = False  # the torque has a `slope` that changes with it

    joint: int | None  # None for the whole arm
    grid: Array = field(default_factory=lambda: NO_SHAPE)  # (g, k), shapes at which the effect is looked for
    lower: Array = field(default_factory=lambda: np.zeros(0))  # (k,), bounds of the shapes
    upper: Array = field(default_factory=lambda: np.zeros(0))  # (k,)

    @classmethod
    def forms(cls, context: ArmContext) -> "Sequence[Effect]":
        """All forms and places worth looking at on this arm and motion: one a joint where it can act."""
        return [cls(joint) for joint in context.joints if cls.can_act(context, joint)]

    @classmethod
    def can_act(cls, context: ArmContext, joint: int) -> bool:
        """Whether the motion of a joint, from 0, may show the effect: whether it moves."""
        return context.moves(joint)

    @classmethod
    def farther_forms(cls, context: ArmContext) -> "Sequence[Effect]":
        """Forms that show in a small part of the motion: looked at where all others leave more than noise."""
        return ()

    @abstractmethod
    def columns(self, signals: Signals, shapes: Array) -> Array:
        """Torque per unit of each coefficient, for several shapes at once.

        `shapes`: (g, k), values of the shape parameters. Returns (g, c, m, N) or (g, c, m, P, N), for the m joints of
        `touched`; with P where repetitions of the same motion differ.
        """

    def torque_of(self, signals: Signals, coefficients: Array, shape: Array) -> Array:
        """Torque at full size, (m, N) or (m, P, N), of `coefficients`, (c,), and `shape`, (k,)."""
        (columns,) = self.columns(signals, shape[None])
        return np.asarray(np.tensordot(coefficients, columns, axes=1), dtype=np.float64)

    def torque_code(self, coefficients: Sequence[float], shape: Sequence[float], k_v: float) -> str:
        """`code` with its numbers. `k_v`: K_v of the joint [s/rad or s/m]."""
        step = _STEP.format(k_v=repr(k_v))
        return self.code.format(c=[*map(repr, coefficients)], s=[*map(repr, shape)], step=step, effect=self)

    def scenario_entries(self, coefficients: Sequence[float], shape: Sequence[float], robot: Robot) -> Sequence[Entry]:
        """Entries of a scenario file that stand for the effect; none where `no_scenario` tells why."""
        return ()

    def factor(self, coefficients: Array) -> float:
        """By how much `coefficients`, (c,), multiply what the plain model makes at its joint: 1 where it adds."""
        return 1.0

    def slope(self, torque: Array, coefficients: Array, shape: Array) -> Array:
        """∂τ_recorded/∂τ at its joint, (N,), of the plain `torque` τ, (N,), `coefficients`, (c,), and `shape`, (k,)."""
        return np.full(len(torque), self.factor(coefficients))

    def is_possible(self, shape: Array, k_v: float | None) -> bool:
        """Whether `shape`, (k,), is still what the effect means, beside K_v of its joint's friction, if any."""
        return True

    def limits(self, coefficients: Array, shape: Array) -> tuple[Array, Array]:
        """Shapes, (k,) each, between which `coefficients`, (c,), and `shape`, (k,), belong to one thing."""
        return np.full(len(shape), -np.inf), np.full(len(shape), np.inf)

    def is_consistent(self, coefficients: Array, shape: Array) -> bool:
        """Whether coefficients, (c,), and shape, (k,), belong to one thing, not merely held at its limits."""
        lower, upper = self.limits(coefficients, shape)
        return bool(np.all((lower < shape) & (shape < upper)))

    def touched(self, joint_count: int) -> tuple[int, ...]:
        """Joints whose torque the effect changes: its own one, or all."""
        return tuple(range(joint_count)) if self.joint is None else (self.joint,)

    def find_own_joints(self, joint_count: int) -> tuple[int, ...]:
        """Joints at which its formula holds: what reaches others through the links follows from mechanics."""
        return self.touched(joint_count)

    def is_free(self, place: int) -> bool:
        """Whether a shape parameter is estimated between the grid's points."""
        return not self.shapes[place].fixed

    def name(self, joint_names: Sequence[str]) -> str:
        """``effect@joint``, or the effect alone where it belongs to the whole arm."""
        return self.id if self.joint is None else f"{self.id}@{joint_names[self.joint]}"

    def place(self, joint_names: Sequence[str]) -> str:
        """Where it acts, as the end of a sentence; empty where it belongs to the whole arm."""
        return "" if self.joint is None else f"at {joint_names[self.joint]}"

    def claim(self, found: Sizes, context: ArmContext) -> str:
        """What the arm does and the model does not, with its size, as its sign says: a clause without its place."""
        return self.meaning

    def advice(self, found: Sizes) -> str:
        """What to do about a finding of such a sign and size."""
        return self.remedy

    def unit(self, template: str, context: ArmContext) -> str:
        """A unit with the joint's own units of torque and position."""
        return self.unit_at(template, context, self.joint)

    @staticmethod
    def unit_at(template: str, context: ArmContext, joint: int | None) -> str:
        """The same for any joint. `joint`: joint index, from 0; None for the whole arm."""
        kind = context.robot.joints[joint or 0].type
        return template.format(tau=_TORQUE[kind], q=_POSITION[kind])

    def quantities(self, context: ArmContext, coefficients: Array, shape: Array, covariance: Array) -> Quantities:
        """A finding's parameters: coefficients, (c,), then shape, (k,), with their `covariance`, (c + k, c + k)."""
        std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
        names = (*self.coefficients, *self.shapes)
        values = (*coefficients, *shape)
        return tuple(
            Quantity(each.name, float(value), float(error), self.unit(each.unit, context))
            for each, value, error in zip(names, values, std, strict=True)
            if isinstance(each, Coefficient) or each.reported
        )


def per_joint_columns(rows: Array) -> Array:
    """Columns of a single joint, `rows`, (g, c, N), in the form that `Effect.columns` returns, (g, c, 1, N)."""
    return rows[:, :, None, :]


def mesh(*axes: Array) -> Array:
    """All combinations of the shape parameters' values, (g, k). `*axes`: (g_i,), values of each shape parameter."""
    return np.stack([part.ravel() for part in np.meshgrid(*axes, indexing="ij")], axis=1)
