"""Keys of a scenario's entries: strict numbers and names beyond those of the robot file."""

from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator

from tauscope.robot.document_fields import Number, refusal
from tauscope.robot.messages import shown

LARGEST_EXPONENT = 10.0
"""Of a power law in speed or angle."""


def _not_negative(value: float) -> float:
    """Zero or more."""
    if value < 0.0:
        raise refusal(f"must be zero or more, but is {value:g}")
    return value


def _exponent(value: float) -> float:
    """An exponent that no speed makes overflow."""
    if not 0.0 < value <= LARGEST_EXPONENT:
        raise refusal(f"must be above 0 and at most {LARGEST_EXPONENT:g}, but is {value:g}")
    return value


def _whole(value: Any) -> int:
    """A joint's or link's number; names are replaced before."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise refusal(f"must be a number counted from 1 or a joint's name, but is {shown(value)}")
    return value


def _seed(value: Any) -> int:
    """A seed of a random number generator."""
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**63:
        raise refusal(f"must be a whole number of zero or more, but is {shown(value)}")
    return value


def _list(value: Any) -> Any:
    """A list, also where a single number is written."""
    if isinstance(value, list | tuple):
        if not value:
            raise refusal("must not be an empty list; write a number or a list of numbers")
        return list(value)
    return [value]


NotNegative = Annotated[Number, AfterValidator(_not_negative)]
Exponent = Annotated[Number, AfterValidator(_exponent)]
JointNumber = Annotated[int, BeforeValidator(_whole)]
Numbers = Annotated[list[Number], BeforeValidator(_list)]
NotNegativeNumbers = Annotated[list[NotNegative], BeforeValidator(_list)]
Seed = Annotated[int, BeforeValidator(_seed)]


def one_of(*words: str) -> Any:
    """Validator of a key that is one of a few words."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or value not in words:
            raise refusal(f"must be {' or '.join(words)}, but is {shown(value)}")
        return value

    return BeforeValidator(check)


def zero_vector() -> list[float]:
    """Three zeros."""
    return [0.0, 0.0, 0.0]


def single_zero() -> list[float]:
    """A zero for all."""
    return [0.0]
