"""Base of what requests and answers hold."""

import math
from typing import Annotated, Any

from pydantic import BeforeValidator, ConfigDict, Field

from tauscope.strict_model import StrictModel


class AnswerModel(StrictModel):
    """An answer; it may be made from an object with attributes of the same names."""

    model_config = ConfigDict(from_attributes=True)


class PageAnswer(AnswerModel):
    """A page of a list."""

    next: str | None = Field(default=None, description="to be given as `after` for the next page; null: it is the last")


def _no_nan(value: Any) -> Any:
    """JSON knows no NaN: what was not measured is null."""
    return None if isinstance(value, float) and math.isnan(value) else value


Measured = Annotated[float | None, BeforeValidator(_no_nan)]
"""A number, or null where there was nothing to measure."""
