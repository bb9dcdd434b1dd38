"""Fields of the robot file: strict numbers and names, each refusal worded for the user."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, BeforeValidator, model_validator
from pydantic_core import PydanticCustomError

from tauscope.robot.messages import nearest, shown
from tauscope.robot.robot import JointType
from tauscope.strict_model import StrictModel

LARGEST_NUMBER = 1e9
LONGEST_NAME = 200
DEEPEST_DRIVE = 16


def refusal(text: str, key: str | None = None) -> PydanticCustomError:
    """The error of a field, worded by us."""
    return PydanticCustomError("refused", "{text}", {"text": text, "key": key})


class Document(StrictModel):
    """A mapping of the robot file."""

    @model_validator(mode="before")
    @classmethod
    def _refuse_unknown_keys(cls, data: Any) -> Any:
        """Name the first unknown key and the nearest known one, before a missing key is complained of."""
        if isinstance(data, Mapping):
            for key in data:
                if key not in cls.model_fields:
                    name = key if isinstance(key, str) else repr(key)
                    hint = nearest(name, cls.model_fields)
                    raise refusal(f"unknown key {shown(key)}; {hint}", key if isinstance(key, str) else None)
        return data


def _number(value: Any) -> float:
    if isinstance(value, str):
        raise refusal(f"{shown(value)} is text; write a number without quotes and without a unit")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise refusal(f"must be a number, but is {shown(value)}")
    if isinstance(value, float) and not math.isfinite(value):
        raise refusal(f"must be a finite number, but is {value}")
    if abs(value) > LARGEST_NUMBER:
        raise refusal(f"{shown(value)} is beyond {LARGEST_NUMBER:g}; check the unit (SI: rad, m, s, kg, Nm)")
    return float(value)


def _require(is_right: Callable[[float], bool], words: str) -> AfterValidator:
    """Refuses numbers by words that may hold ``{0:g}``, the number."""

    def check(value: float) -> float:
        if not is_right(value):
            raise refusal(words.format(value))
        return value

    return AfterValidator(check)


def _name(value: Any) -> str:
    """A name that can stand in a message and in a file name's place."""
    if not isinstance(value, str):
        raise refusal(f"must be text, but is {shown(value)}; put it in quotes")
    if not value.strip():
        raise refusal("must not be empty")
    if len(value) > LONGEST_NAME or not value.isprintable():
        raise refusal(f"{shown(value)} must be printable text of at most {LONGEST_NAME} characters")
    return value


def choice(key: str, known: Iterable[str]) -> BeforeValidator:
    """Accepts one of several words, or nothing."""
    words = tuple(known)

    def check(value: Any) -> Any:
        if value is not None and (not isinstance(value, str) or value not in words):
            raise refusal(f"{shown(value)} is no {key} of an actuator; write one of {', '.join(words)}")
        return value

    return BeforeValidator(check)


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise refusal(f"must be text, but is {shown(value)}; put it in quotes")
    return value


def check_source(value: Any) -> Any:
    """A column by name or by number from 1, or a list of them."""
    entries = value if isinstance(value, list) else [value]
    for entry in entries:
        is_number = isinstance(entry, int) and not isinstance(entry, bool) and entry > 0
        if not (is_number or (isinstance(entry, str) and entry)):
            raise refusal(f"{shown(entry)} is no column; write its name, or its number from 1")
    if not entries:
        raise refusal("must not be empty")
    return value


def _sign(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or value not in (1, -1):
        raise refusal(f"must be 1 or -1, but is {shown(value)}")
    return int(value)


def _motion(value: Any) -> JointType:
    if not isinstance(value, str) or value not in set(JointType):
        raise refusal(f"{shown(value)} is not a joint type; write revolute or prismatic")
    return JointType(value)


def _range(value: list[float]) -> list[float]:
    if len(value) != 2:
        raise refusal(f"must be two numbers [lower, upper], but holds {len(value)}")
    lower, upper = value
    if lower > upper:
        raise refusal(f"lower bound {lower:g} is not below upper bound {upper:g}; swap them")
    if lower == upper:
        raise refusal(f"lower and upper bound are both {lower:g}; leave the limits out where they are not known")
    return value


def _vector(value: list[float]) -> list[float]:
    if len(value) != 3:
        raise refusal(f"must be three numbers [x, y, z], but holds {len(value)}")
    return value


def _rotation(value: list[list[float]]) -> list[list[float]]:
    if [len(row) for row in value] != [3, 3, 3]:
        raise refusal("must be three rows of three numbers")
    matrix = np.array(value)
    if not np.allclose(matrix @ matrix.T, np.eye(3), rtol=0.0, atol=1e-9):
        raise refusal("is not a rotation: its rows are not orthonormal")
    if np.linalg.det(matrix) < 0.0:
        raise refusal("is not a rotation: it mirrors")
    return value


def _plain(value: Any, depth: int = 0) -> Any:
    if depth > DEEPEST_DRIVE:
        raise refusal(f"is nested deeper than {DEEPEST_DRIVE} levels")
    if isinstance(value, float) and not math.isfinite(value):
        raise refusal(f"must hold finite numbers, but holds {value}")
    if value is None or isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, list | tuple):
        return [_plain(item, depth + 1) for item in value]
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return {key: _plain(item, depth + 1) for key, item in value.items()}
    raise refusal("must hold plain data only: text, numbers, lists, and mappings with text as keys")


def _plain_mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise refusal(f"must be a mapping, but is {shown(value)}")
    return _plain(value)


Number = Annotated[float, BeforeValidator(_number)]
_UNKNOWN = "leave it out where it is not known"
Positive = Annotated[Number, _require(lambda value: value > 0.0, f"must be above zero, but is {{0:g}}; {_UNKNOWN}")]
NotNegative = Annotated[
    Number, _require(lambda value: value >= 0.0, "must not be below zero, but is {0:g}; write its size")
]
Share = Annotated[
    Number, _require(lambda value: 0.0 < value <= 1.0, "must be a share above 0 and up to 1, but is {0:g}")
]
Angle = Annotated[Number, _require(lambda value: abs(value) < 6.3, "is {0:g} rad, beyond a turn; 90° are 1.5708")]
Nonzero = Annotated[Number, _require(bool, f"must not be zero; {_UNKNOWN}")]
Name = Annotated[str, BeforeValidator(_name)]
Text = Annotated[str, BeforeValidator(_text)]
Motion = Annotated[JointType, BeforeValidator(_motion)]
Sign = Annotated[int, BeforeValidator(_sign)]
Range = Annotated[list[Number], AfterValidator(_range)]
Vector = Annotated[list[Number], AfterValidator(_vector)]
Rotation = Annotated[list[list[Number]], AfterValidator(_rotation)]
PlainMapping = Annotated[dict[str, Any], BeforeValidator(_plain_mapping)]
