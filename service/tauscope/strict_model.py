"""Bases of everything that is read from or written to JSON."""

from pydantic import BaseModel, ConfigDict


class StrictModel(BaseModel):
    """No type is converted, no key is overlooked."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class ResultModel(StrictModel):
    """A result; a number that was not measured is null."""

    model_config = ConfigDict(ser_json_inf_nan="null")
